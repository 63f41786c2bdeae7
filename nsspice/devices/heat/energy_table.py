"""Energies of a switching, by current, blocking voltage and junction temperature.

A data sheet gives them on a grid; between its points they are linear in each quantity, and so they
are beyond its ends, down to zero.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from ...netlist.deck import Grid, Param
from ...netlist.findings import Findings

_AXES = ("i", "v", "t")
_HINT = "write table(i=0 10 20 v=0 600 t=25 125 e=...): for each t, for each v, one energy per i"


@dataclass(frozen=True, slots=True)
class EnergyTable:
    """A grid of energies.

    Parameters
    ----------
    axes : tuple of tuple of float
        Currents [A], voltages [V] and temperatures [C], each rising; one value where the energy
        does not depend on it.
    energies : tuple of float
        [J], the current running fastest, then the voltage.
    """

    axes: tuple[tuple[float, ...], ...]
    energies: tuple[float, ...]

    def energy(self, current: float, voltage: float, temperature: float) -> float:
        """Return the energy [J] at a current [A], voltage [V] and temperature [C].

        Examples
        --------
        >>> table = EnergyTable(((0.0, 10.0), (0.0, 600.0), (25.0,)), (0.0, 0.0, 0.0, 1e-3))
        >>> table.energy(5.0, 300.0, 125.0)
        0.00025
        """
        values: Sequence[float] = self.energies
        for axis, at in zip(self.axes, (current, voltage, temperature), strict=True):
            if len(axis) == 1:
                continue
            k = min(max(bisect_right(axis, at) - 1, 0), len(axis) - 2)
            share = (at - axis[k]) / (axis[k + 1] - axis[k])
            count = len(axis)
            values = [
                (1.0 - share) * values[j + k] + share * values[j + k + 1]
                for j in range(0, len(values), count)
            ]
        return max(values[0], 0.0)

    def covers(self, current: float, voltage: float, temperature: float) -> bool:
        """Return whether a point lies inside the grid, up to rounding."""
        asked = zip(self.axes, (current, voltage, temperature), strict=True)
        return all(
            len(axis) == 1 or axis[0] - 1e-9 * axis[-1] <= at <= axis[-1] * (1.0 + 1e-9)
            for axis, at in asked
        )


def energy_table(param: Param, owner: str, findings: Findings | None = None) -> EnergyTable | None:
    """Return the table of a parameter, or None after reporting what is wrong with it.

    Parameters
    ----------
    param : Param
        A number stands for the same energy everywhere.
    owner : str
        ``model m``, for messages.
    findings : Findings, optional
    """
    value = param.value
    if isinstance(value, int | float):
        value = Grid({"e": (float(value),)})
    wrong = f"{param.name} of {owner} is not a table of energies"
    if isinstance(value, Grid):
        lists = value.lists
        unknown = [name for name in lists if name not in (*_AXES, "e")]
        axes = tuple(lists.get(name, (math.nan,)) for name in _AXES)
        count = math.prod(map(len, axes))
        energies = lists.get("e", ())
        if unknown:
            wrong = f"{param.name} of {owner} has no axis {unknown[0]}"
        elif any(b <= a for axis in axes for a, b in pairwise(axis)):
            wrong = f"the values of an axis of {param.name} of {owner} must increase"
        elif any(axis[0] < 0.0 for axis in axes[:2]):
            wrong = f"{param.name} of {owner}: currents and voltages must be 0 or more"
        elif len(energies) != count:
            wrong = f"{param.name} of {owner} has {len(energies)} energies e for {count} points"
        elif not all(0.0 <= e < math.inf for e in energies):
            wrong = f"{param.name} of {owner}: energies must not be negative"
        else:
            return EnergyTable(axes, energies)
    if findings is not None:
        findings.error("NS2005", wrong, param.span, _HINT)
    return None
