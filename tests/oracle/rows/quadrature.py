"""Capacitors and inductors between rows: the change of a charge is the integral of the current.

The integral is known from the rows to some order only.  By the trapezoidal rule and two parabolas,
through the row before and the row after the interval, it gets three values; a change outside of
their range by more than that range is a violation.  Where the rows around an interval do not lie on
a smooth curve (what is faster than they are), the integral may be anything between the extremes of
the current nearby.  Fixed steps have their own sum: the current at the end of a step times its
length.
"""

from __future__ import annotations

import numpy as np

from .storage import Store
from .written import Bools, Floats, Rows, Violation

#: a curve is smooth where second differences are below this share of the first ones
SMOOTH = 0.3
#: intervals differ in length at most by this factor where nothing happens between them
EVEN = 8.0
#: rows on either side among which extremes are sought where it is not
NEARBY = 8


def between_rows(store: Store, rows: Rows, stepped: bool) -> list[Violation]:
    """Return by which share of its range a charge or flux misses its integral."""
    if rows.time.size < 4:
        return []
    law = "charge" if store.element.letter == "c" else "flux"
    change, rate = np.diff(store.content), store.rate
    integrals, smooth = _integrals(rate, rows)
    nearest = np.fmin.reduce(np.abs(integrals - change))
    spread = np.fmax.reduce(integrals) - np.fmin.reduce(integrals)
    spread = np.where(smooth, spread, np.maximum(spread, np.diff(rows.time) * _swing(rate)))
    error = np.maximum(nearest - spread, 0.0) / store.scale
    if stepped:
        # other islands' steps are rows too, at which values are interpolated
        steps = np.abs(change - np.diff(rows.time) * rate[1:]) / store.scale
        error = np.minimum(error, steps)
    # at the rows that end intervals; a jump takes no time
    at_rows = np.concatenate([[0.0], np.where(rows.moves, error, 0.0)])
    return rows.worst(law, store.element.name, at_rows)


def _integrals(rate: Floats, rows: Rows) -> tuple[Floats, Bools]:
    """Return three values of each interval's integral, nan where rows of a jump are in the way, and
    whether the rows around it lie on a smooth curve."""
    h, moves = np.diff(rows.time), rows.moves
    trapezoid = 0.5 * h * (rate[:-1] + rate[1:])
    before, after = np.full_like(h, np.nan), np.full_like(h, np.nan)
    smooth = np.zeros(h.size, bool)
    slope = np.divide(np.diff(rate), h, out=np.zeros_like(h), where=moves)
    usable = moves[:-1] & moves[1:]
    # three times the second difference over the lengths of both intervals
    bend = np.where(usable, np.diff(slope) / np.where(usable, h[:-1] + h[1:], 1.0), np.nan)
    before[1:] = trapezoid[1:] - bend * h[1:] ** 3 / 6
    after[:-1] = trapezoid[:-1] - bend * h[:-1] ** 3 / 6
    longest, shortest = np.maximum(h[:-1], h[1:]), np.minimum(h[:-1], h[1:])
    steepest = np.maximum(np.abs(slope[:-1]), np.abs(slope[1:]))
    # a short interval is beside an event, after which something fast may begin
    even = usable & (longest <= EVEN * shortest)
    fair = even & (np.abs(bend) * longest <= SMOOTH * steepest)
    smooth[1:-1] = fair[:-1] & fair[1:]
    return np.vstack([trapezoid, before, after]), smooth


def _swing(rate: Floats) -> Floats:
    """Return the difference of extremes of the rows near each interval, and of zero."""
    padded = np.pad(rate, (NEARBY, NEARBY), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEARBY + 2)
    top = np.maximum(windows.max(axis=1), 0.0)
    return np.asarray(top - np.minimum(windows.min(axis=1), 0.0))
