"""The two-terminal elements behind the storage and conductance matrices of a system.

An assembled matrix holds sums of elements: in 1 F + 1 pF only four digits of the 1 pF are left.
Methods that need all digits, or that count loops and cut-sets instead of looking at values, take
the elements themselves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from .csc import Csc
    from .descriptor import DescriptorSystem

#: unknown, unknown (-1 for ground), capacitance [F] or conductance [S]
TwoTerminal = tuple[int, int, float]


class Elements(NamedTuple):
    """Capacitors and resistors (as conductances) between unknowns.

    Parameters
    ----------
    capacitors, conductors : list of (int, int, float)
        Two unknowns, -1 for ground, and the capacitance [F] or conductance [S] between their nodes.
    before : list of int, optional
        For each unknown that is a voltage the unknown of the node against which it is counted, -1
        for ground (and for currents); ground for all by default.
    """

    capacitors: list[TwoTerminal]
    conductors: list[TwoTerminal]
    before: list[int] | None = None

    def beside_currents(self, count: int) -> Elements:
        """Return them with so many unknowns more that are currents."""
        before = None if self.before is None else [*self.before, *[-1] * count]
        return self._replace(before=before)


def elements_of(system: DescriptorSystem) -> Elements:
    """Return the elements of a system, from its matrices where they were not kept.

    Parameters
    ----------
    system : DescriptorSystem

    Returns
    -------
    Elements
        Without those whose value is rounding in a sum of the matrix.

    Examples
    --------
    >>> from nsspice.problems import Csc, DescriptorSystem
    >>> E = Csc.from_triplets((2, 2), [0, 0, 1, 1], [0, 1, 0, 1], [3.0, -1.0, -1.0, 1.0])
    >>> none = Csc.zeros
    >>> system = DescriptorSystem(E, none((2, 2)), none((2, 0)), none((0, 2)), none((0, 0)),
    ...     np.zeros(0), none((2, 0)), row_kind=np.zeros(2, np.uint8))
    >>> elements_of(system).capacitors
    [(0, 1, 1.0), (0, -1, 2.0)]
    """
    if system.elements is not None:
        return system.elements
    return Elements(_network(system.E, system.row_kind), _network(system.G, system.row_kind))


def _network(
    matrix: Csc, row_kind: np.ndarray[tuple[int], np.dtype[np.uint8]]
) -> list[TwoTerminal]:
    """Read a matrix of current rows as a network of two-terminal elements."""
    entries: dict[tuple[int, int], float] = {}
    for row, col, value in zip(matrix.indices, matrix.columns, matrix.data, strict=True):
        if row_kind[row] == 0 and row_kind[col] == 0:
            entries[int(row), int(col)] = float(value)
    found: list[TwoTerminal] = []
    grounded: dict[int, float] = {}
    size: dict[int, float] = {}
    for (row, col), value in entries.items():
        if row == col:
            grounded[row] = grounded.get(row, 0.0) + value
            size[row] = size.get(row, 0.0) + abs(value)
        elif value < 0.0 and entries.get((col, row)) == value:
            if row < col:
                found.append((row, col, -value))
            grounded[row] = grounded.get(row, 0.0) + value
            size[row] = size.get(row, 0.0) + abs(value)
    for row, value in grounded.items():
        if value > 1e-14 * size[row]:
            found.append((row, -1, value))
    return found
