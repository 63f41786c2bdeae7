"""Waveforms at the output rows as graphs: where one jumps, both sides belong to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...analyses.solution.solution import Floats, Solution

#: instants that differ by less than this share are the same up to rounding
_SAME = 1e-12
#: what varies less than this share of its size is constant up to rounding
_CONSTANT = 1e-12


@dataclass(frozen=True, slots=True)
class Graph:
    """Signals at the output rows, as the values between which each lies there.

    A quantity that jumps at the instant of a row has both sides of the jump and all that lies
    between them there: one program shows the side before the jump, another that after it, and both
    are right.

    Parameters
    ----------
    low, high : ndarray, shape (rows, signals)
        Least and largest value; they differ at jumps alone.

    Examples
    --------
    >>> graph = Graph(np.array([[0.0], [0.0]]), np.array([[0.0], [2.0]]))
    >>> graph.gap(Graph.of_table(np.array([[0.5], [2.5]]))).tolist()
    [[0.5], [0.5]]
    """

    low: Floats
    high: Floats

    @classmethod
    def of_table(cls, table: Floats) -> Graph:
        """Return the graph of signals of which one side is known, shape (rows, signals)."""
        return cls(table, table)

    @classmethod
    def of(cls, solution: Solution, signals: list[str]) -> Graph:
        """Return the graph of some signals of a solution."""
        low = np.column_stack([solution[name] for name in signals])
        fine = solution.with_jumps()
        if fine is solution:
            return cls(low, low)
        high = low.copy()
        every = np.column_stack([fine[name] for name in signals])
        before = np.flatnonzero(np.diff(fine.axis) == 0.0)
        instants = fine.axis[before]
        rows = np.searchsorted(solution.axis, instants * (1.0 - _SAME))
        near = solution.axis[np.minimum(rows, solution.axis.size - 1)]
        on_row = np.abs(near - instants) <= _SAME * instants
        for side in before[on_row], before[on_row] + 1:
            np.minimum.at(low, rows[on_row], every[side])
            np.maximum.at(high, rows[on_row], every[side])
        return cls(low, high)

    @property
    def span(self) -> Floats:
        """Range of each signal, its magnitude if it is constant, shape (signals,)."""
        low, high = self.low.min(axis=0), self.high.max(axis=0)
        size = np.maximum(np.abs(low), np.abs(high))
        span = np.where(high - low > _CONSTANT * size, high - low, size)
        out: Floats = np.where(span > 0.0, span, 1.0)
        return out

    def gap(self, other: Graph) -> Floats:
        """Return how far two graphs lie apart at each row, shape (rows, signals)."""
        out: Floats = np.maximum(0.0, np.maximum(other.low - self.high, self.low - other.high))
        return np.where(np.isfinite(other.low + other.high), out, np.inf)

    def shares(self, other: Graph) -> Floats:
        """Return the same as shares of the span of each signal of this graph."""
        out: Floats = self.gap(other) / self.span
        return out
