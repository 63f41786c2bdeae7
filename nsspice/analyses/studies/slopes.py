"""How measures depend on parameters and elements: extrapolated differences of runs.

Runs of the exact engine err by rounding alone, so that their measures are smooth functions of
every value in the deck (of a threshold, a forward drop or a delay as well) as long as the order of
switchings stays.  With :math:`D(h)` the central difference, Richardson's extrapolation

.. math::

    D(h) = m' + c_2 h^2 + c_4 h^4 + \\dots

of three steps leaves the sixth power, and the last two columns of its table bound the error.

References: C. J. F. Ridders, "Accurate computation of F'(x) and F'(x) F''(x)", Advances in
Engineering Software 4 (1982) 75, doi:10.1016/S0141-1195(82)80057-0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from ..results.sensitivity import Sensitivity
from ..signals.curve import Floats

#: of a value: what is left of the truncation is (1/128)^6, rounding of a run is enlarged 512 times
_STEP = 2.0**-7
_LEVELS = 3

#: Returns measures with another value of a parameter or element.
Measured = Callable[[str, float], Mapping[str, float]]


def slopes(
    measured: Measured, nominal: Mapping[str, float], name: str, value: float
) -> list[Sensitivity]:
    """Return the derivatives of measures by one parameter.

    Parameters
    ----------
    measured : callable
        Returns the measures for a name and a value.
    nominal : mapping of str to float
        Measures wanted, with the values that they have.
    name : str
    value : float
        Of the parameter, not zero.

    Examples
    --------
    >>> (s,) = slopes(lambda name, x: {"cube": x**3}, {"cube": 8.0}, "x", 2.0)
    >>> abs(s.derivative - 12.0) < 1e-10, s.error < 1e-8
    (True, True)
    """
    keys = list(nominal)
    middle = np.array([nominal[key] for key in keys])
    both: list[Floats] = []
    corners: list[Floats] = []
    for level in range(_LEVELS):
        h = abs(value) * _STEP * 0.5**level
        sides = [measured(name, value + side * h) for side in (1.0, -1.0)]
        ahead, behind = (np.array([m.get(key, np.nan) for key in keys]) for m in sides)
        both.append((ahead - behind) / (2.0 * h))
        corners.append((ahead + behind - 2.0 * middle) / (2.0 * h))
    slope, error = _extrapolated(both, (4.0, 16.0))
    # half of what the slopes on both sides differ by: odd powers, none of degree zero if smooth
    corner, _ = _extrapolated(corners, (2.0, 8.0))
    return [
        Sensitivity(key, name, value, nominal[key], *map(float, found))
        for key, *found in zip(keys, slope, np.maximum(error, np.abs(corner)), strict=True)
    ]


def _extrapolated(columns: list[Floats], powers: Sequence[float]) -> tuple[Floats, Floats]:
    """Return the limit of a sequence of halved steps, and its distance from the best before it."""
    error = np.zeros_like(columns[0])
    for power in powers:
        better = [fine + (fine - wide) / (power - 1.0) for wide, fine in pairwise(columns)]
        error = np.abs(better[-1] - columns[-1])
        columns = better
    return columns[0], error
