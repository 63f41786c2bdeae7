"""Which voltages are independent of each other: the question that every normal tree answers.

A voltage is a linear form of the node potentials.  Plain branches are differences of two
potentials, for which disjoint sets answer at once; perfect transformers relate voltages with
factors, which needs elimination.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from .union_find import UnionFind

Form = Mapping[int, float]


class Basis(Protocol):
    """A growing set of independent forms."""

    def add(self, form: Form) -> bool:
        """Add a form; return False if it depends on those that are there."""
        ...


class GraphBasis:
    """Independent voltages of plain branches.

    Parameters
    ----------
    nodes : int
        Number of nodes without ground.

    Examples
    --------
    >>> basis = GraphBasis(2)
    >>> basis.add({0: 1.0}), basis.add({0: 1.0, 1: -1.0}), basis.add({1: 1.0})
    (True, True, False)
    """

    def __init__(self, nodes: int) -> None:
        self._sets = UnionFind(nodes + 1)

    def add(self, form: Form) -> bool:
        """Add a difference of two potentials, or one potential against ground."""
        ends = [node + 1 for node in form]
        if not ends:
            return False
        return self._sets.union(ends[0], ends[1] if len(ends) > 1 else 0)


class LinearBasis:
    """Independent voltages in general, by elimination.

    Examples
    --------
    The second winding of a 1:2 transformer has a voltage of its own only once:

    >>> basis = LinearBasis()
    >>> basis.add({1: 1.0, 0: -2.0}), basis.add({0: 1.0}), basis.add({1: 1.0})
    (True, True, False)
    """

    #: entries below this fraction of a form's largest one count as rounding errors
    TINY = 1e-9

    def __init__(self) -> None:
        self._rows: dict[int, dict[int, float]] = {}

    def add(self, form: Form) -> bool:
        """Add any form; return False if it depends on those that are there."""
        row = dict(form)
        largest = max(map(abs, row.values()), default=0.0)
        pending = [node for node in row if node in self._rows]
        # a pivot row holds no earlier pivots, so that this ends after at most one visit to each
        while pending:
            pivot = pending.pop()
            factor = row.get(pivot, 0.0)
            if factor == 0.0:
                continue
            for node, value in self._rows[pivot].items():
                row[node] = row.get(node, 0.0) - factor * value
                if node != pivot and node in self._rows:
                    pending.append(node)
            row[pivot] = 0.0
        row = {node: value for node, value in row.items() if abs(value) > self.TINY * largest}
        if not row:
            return False
        pivot = max(row, key=lambda node: (abs(row[node]), -node))
        self._rows[pivot] = {node: value / row[pivot] for node, value in row.items()}
        return True
