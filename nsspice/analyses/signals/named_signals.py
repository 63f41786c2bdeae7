"""The signals that expressions of a deck name, at recorded points."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from ...devices.stamper import Layout
from ...problems.csc import Floats
from ...problems.descriptor import Functional


def combination(output: Functional, time: Floats, z: Floats, lam: Floats, u: Floats) -> Floats:
    """Return a combination of unknowns, multipliers and sources at points (..., n)."""
    total = np.zeros_like(time)
    for terms, values in ((output.z, z), (output.lam, lam), (output.u, u)):
        for column, factor in terms:
            total = total + factor * values[..., column]
    return total


class NamedSignals:
    """Values of signals by name.

    Parameters
    ----------
    layout : Layout
    frozen : float or None
        The time that expressions see [s], if it is fixed.
    """

    def __init__(self, layout: Layout, frozen: float | None) -> None:
        self._layout, self._frozen = layout, frozen

    def at(
        self,
        names: Iterable[str],
        currents: Mapping[str, Functional],
        points: tuple[Floats, Floats, Floats, Floats],
    ) -> dict[str, Floats]:
        """Return voltages, currents, time and temperature, each of the shape of the time.

        Parameters
        ----------
        names : iterable of str
        currents : mapping of str to Functional
            Those among the names.
        points : tuple of ndarray
            Time, unknowns, multipliers and sources.
        """
        time = points[0]
        found: dict[str, Floats] = {}
        for name in names:
            if name == "time":
                found[name] = time if self._frozen is None else np.full_like(time, self._frozen)
            elif name == "temper":
                found[name] = np.full_like(time, self._layout.conditions.temperature)
            elif name[0] == "v":
                a, b = (*name[2:-1].split(","), "0")[:2]
                found[name] = combination(Functional(z=self._layout.voltage(a, b)), *points)
            else:
                found[name] = combination(currents[name], *points)
        return found
