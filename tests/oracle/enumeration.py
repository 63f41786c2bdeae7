"""Generalized equations with signs, mode by mode: every sign pattern, plain Newton in numpy.

``p in g(z) + prod Sgn_{low_i, high_i}(z_i)``: in a mode each component is negative, zero or
positive, which leaves smooth equations for those that are not zero; a solution counts if its signs
and the multipliers of the zeros agree with the mode.  Slow, and with no idea in common with the
program's way.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Function = Callable[[Floats], Floats]


def solutions(
    g: Function,
    jacobian: Function,
    p: Floats,
    signs: list[tuple[float, float]],
    starts: list[Floats],
) -> list[Floats]:
    """Return all solutions found, each once.

    Parameters
    ----------
    g, jacobian : callable
        (n,) to (n,) and (n, n).
    p : ndarray, shape (n,)
    signs : list of (float, float)
        ``low, high`` of each component.
    starts : list of ndarray
        Points from which Newton's method starts in each mode.
    """
    n = p.size
    found: list[Floats] = []
    for mode in itertools.product((-1, 0, 1), repeat=n):
        free = [i for i in range(n) if mode[i]]
        value = np.array(
            [signs[i][1] if mode[i] > 0 else signs[i][0] if mode[i] < 0 else 0.0 for i in range(n)]
        )
        for start in starts:
            z = np.where(np.array(mode) == 0, 0.0, start)
            z = _newton(g, jacobian, p - value, z, free)
            if z is None:
                continue
            rest = p - g(z)
            scale = 1e-9 * (1.0 + np.abs(p).max())
            fits = all(
                signs[i][0] - scale <= rest[i] <= signs[i][1] + scale
                if mode[i] == 0
                else mode[i] * z[i] >= 0.0
                for i in range(n)
            )
            if fits and not any(np.abs(z - other).max() < 1e-9 for other in found):
                found.append(z)
    return found


def _newton(
    g: Function, jacobian: Function, p: Floats, z: Floats, free: list[int]
) -> Floats | None:
    if not free:
        return z
    z = z.copy()
    for _ in range(60):
        step = np.linalg.solve(jacobian(z)[np.ix_(free, free)], (p - g(z))[free])
        z[free] += step
        if np.abs(step).max() <= 1e-15 * (1.0 + np.abs(z).max()):
            return z
    small = np.abs((p - g(z))[free]).max() < 1e-12 * (1.0 + np.abs(p).max())
    return z if small else None
