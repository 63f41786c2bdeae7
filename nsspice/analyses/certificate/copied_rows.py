"""What reaches the table is what was computed: sums over all rows, and some rows once more."""

from __future__ import annotations

import numpy as np

from ...solvers.stepper import Stepper
from ..signals.curve import Floats
from .energy import worse
from .written_rows import KNOWN, Violation

#: rows have one of so many weights in the sums, as in the core
_WEIGHTS = 8


class CopiedRows:
    """Compares the rows of one island with what its stepper shows of them.

    The core adds up each column as rows leave the engine; the table must have the same sums.  The
    exact engine computes some rows once more from its unknowns, not by the maps of its modes.

    Parameters
    ----------
    stepper : Stepper
    first : int
        The first of its columns among those that are recorded, the time being column 0.
    currents : sequence of bool
        Which of them are currents.
    """

    def __init__(self, stepper: Stepper, first: int, currents: list[bool]) -> None:
        self._stepper = stepper
        self._columns = slice(first, first + len(currents))
        self._currents = np.array([False, *currents], dtype=bool)
        width = self._currents.size
        self._count, self._sums = 0, np.zeros(width)
        self._off, self._largest = np.zeros(width), np.zeros(width)
        self._waiting = np.empty((0, width))
        self._time, self._lost = 0.0, False

    def take(self, block: Floats) -> None:
        """Take the next rows: time, then the columns of all islands."""
        rows = block.shape[0]
        weights = 1.0 + (self._count + np.arange(rows)) % _WEIGHTS / _WEIGHTS
        self._count += rows
        self._sums[0] += weights @ block[:, 0]
        self._sums[1:] += weights @ block[:, self._columns]
        found = self._stepper.take_references()
        if found.shape[0]:
            self._waiting = np.concatenate([self._waiting, found])
        if rows and self._waiting.shape[0]:
            self._compare(block)

    def _compare(self, block: Floats) -> None:
        """Compare the rows that a block has, and keep those that come later."""
        times = block[:, 0]
        now = self._waiting[:, 0] <= times[-1]
        once, self._waiting = self._waiting[now], self._waiting[~now]
        at = np.minimum(np.searchsorted(times, once[:, 0]), times.size - 1)
        self._lost |= bool((times[at] != once[:, 0]).any())
        off = np.abs(block[at, self._columns] - once[:, 1:])
        if off.size:
            self._off[1:] = np.maximum(self._off[1:], off.max(axis=0))
            self._largest[1:] = np.maximum(self._largest[1:], np.abs(once[:, 1:]).max(axis=0))

    def worst(self) -> Violation:
        """Return the worst relative difference."""
        count, sums, sizes = self._stepper.written
        if count != self._count or self._lost:
            return Violation(1.0, "what is written", 0.0)
        error = _largest(np.abs(self._sums[: len(sums)] - sums), np.array(sizes))
        rounding = np.zeros_like(self._off)
        for kind in (self._currents, ~self._currents):
            rounding[kind] = KNOWN * np.max(self._largest[kind], initial=0.0)
        beyond = np.where(self._off > rounding, self._off - rounding, 0.0)
        other = _largest(np.where(np.isfinite(self._off), beyond, self._off), self._largest)
        return Violation(other if worse(other, error) else error, "what is written", 0.0)


def _largest(off: Floats, sizes: Floats) -> float:
    """Return the largest part of what it is measured by; not a number is the worst."""
    if not off.size:
        return 0.0
    parts = np.divide(off, sizes, out=np.zeros_like(off), where=sizes != 0.0)
    return float(np.max(parts))
