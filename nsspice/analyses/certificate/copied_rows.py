"""What reaches the table is what was computed: sums over all rows, and some rows once more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ... import _core
from ...solvers.stepper import Stepper
from ..signals.curve import Floats
from .energy import worse
from .node_reach import NodeReach
from .written_rows import KNOWN, Violation


class CopiedRows:
    """Compares the rows of one island with what its stepper shows of them.

    The core adds up each column as rows leave the engine; the table must have the same sums.  What
    rows are made of is added up too: terms and states of the exact engine, unknowns of steps and
    powers of their polynomials; the sums that follow from these must be those of the rows.  The
    exact engine also computes a row of each mode and some others once more from its unknowns, not
    by the maps of its modes.

    Parameters
    ----------
    stepper : Stepper
    first : int
        The first of its columns among those that are recorded, the time being column 0.
    names : sequence of str
        Their signals: ``v(n)``, ``i(d)``.
    reach : NodeReach
        What rounding of currents makes of voltages, and the other way round.
    """

    def __init__(
        self, stepper: Stepper, first: int, names: Sequence[str], reach: NodeReach
    ) -> None:
        self._stepper = stepper
        self._columns = slice(first, first + len(names))
        self._currents = np.array([False, *(name[0] == "i" for name in names)])
        self._reach = reach
        self._ohms, self._siemens = reach.of_columns(names)
        width = self._currents.size
        self._sums = _core.ColumnSums(first, len(names))
        self._off, self._largest = np.zeros(width), np.zeros(width)
        self._waiting = np.empty((0, width))
        self._lost = False

    def take(self, block: Floats) -> None:
        """Take the next rows: time, then the columns of all islands."""
        self._sums.add(np.ascontiguousarray(block))
        found = self._stepper.take_references()
        if found.shape[0]:
            self._waiting = np.concatenate([self._waiting, found])
        if block.shape[0] and self._waiting.shape[0]:
            self._compare(block)

    def _compare(self, block: Floats) -> None:
        """Compare the rows that a block has, and keep those that come later."""
        times = block[:, 0]
        now = self._waiting[:, 0] <= times[-1]
        once, self._waiting = self._waiting[now], self._waiting[~now]
        at = np.minimum(np.searchsorted(times, once[:, 0]), times.size - 1)
        self._lost |= bool((times[at] != once[:, 0]).any())
        with np.errstate(invalid="ignore"):
            off = np.abs(block[at, self._columns] - once[:, 1:])
        if off.size:
            self._off[1:] = np.maximum(self._off[1:], off.max(axis=0))
            self._largest[1:] = np.maximum(self._largest[1:], np.abs(once[:, 1:]).max(axis=0))

    def worst(self) -> Violation:
        """Return the worst relative difference."""
        count, sums, sizes, made_of = self._stepper.written
        own, found, _ = self._sums.sums()
        if count != own or self._lost:
            return Violation(1.0, "what is written", 0.0)
        with np.errstate(invalid="ignore"):
            error = _largest(np.abs(np.array(found) - sums), np.array(sizes))
        mean = np.array(sizes) / max(count, 1)
        largest = np.maximum(self._largest, mean) if mean.size else self._largest
        volts, amperes = (
            np.max(largest[1:][kind], initial=0.0)
            for kind in (~self._currents[1:], self._currents[1:])
        )
        siemens = np.maximum(self._siemens, self._reach.conductance)
        rounding = np.zeros_like(self._off)
        rounding[1:] = KNOWN * np.where(
            self._currents[1:], amperes + siemens * volts, volts + self._ohms * amperes
        )
        if count:
            with np.errstate(invalid="ignore"):
                expected = np.array(made_of)
                apart = np.abs(np.array(sums[1:]) - expected)
                # each row may have a rounding of its own
                apart = np.maximum(apart - count * rounding[1:], 0.0)
                total = _largest(apart, np.maximum(np.array(sizes[1:]), np.abs(expected)))
            error = total if worse(total, error) else error
        beyond = np.where(self._off > rounding, self._off - rounding, 0.0)
        other = _largest(np.where(np.isfinite(self._off), beyond, self._off), largest)
        return Violation(other if worse(other, error) else error, "what is written", 0.0)


def _largest(off: Floats, sizes: Floats) -> float:
    """Return the largest part of what it is measured by; not a number is the worst."""
    if not off.size:
        return 0.0
    parts = np.divide(off, sizes, out=np.zeros_like(off), where=sizes != 0.0)
    return float(np.max(parts))
