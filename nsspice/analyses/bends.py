"""Points between rows where an expression bends though its signals are lines.

Between two rows signals are the lines that join them, and the engines keep points where they are
not.  A product of two lines is a parabola all the same: the loss of a switch whose voltage rises
while its current falls is nothing at both rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ..netlist.expression import Expression
from .curve import Floats
from .solution import Solution

Indices = npt.NDArray[np.intp]

#: places of the points that are tested; a period that divides the piece does not hide from them
_PLACES = (0.31, 0.66)
#: so far off the line is on it, relative to the values there, as for the signals themselves ...
_FLAT = 1e-4
#: ... and to the largest value, where rounding and exact zeros begin
_TRACE = 1e-9
#: a piece is cut into three so often at most: a jump is then located to 2e-6 of the rows
_DEPTH = 12
#: points put in at most
_MOST = 1 << 22


def with_bends(
    solution: Solution,
    expressions: Sequence[Expression],
    constants: Mapping[str, float],
    start: float | None = None,
    stop: float | None = None,
) -> Solution:
    """Return the signals at so many instants that lines between them follow expressions, too.

    Parameters
    ----------
    solution : Solution
    expressions : sequence of Expression
    constants : mapping of str to float
        Values of names that are no signals.
    start, stop : float, optional
        Nothing is looked for outside of these.

    Raises
    ------
    KeyError
        If there is no such signal.

    Examples
    --------
    >>> from nsspice.netlist.expression import Expression
    >>> two = Solution("tran", "ramp", "time", np.array([0.0, 1.0]), {"v(a)": np.array([0.0, 1.0])})
    >>> fine = with_bends(two, [Expression.parse("v(a)*v(a)")], {})
    >>> bool(fine.axis.size > 10), bool(np.all(fine["v(a)"] == fine.axis))
    (True, True)
    """
    names = sorted({n for e in expressions for n in e.variables()} - set(constants))
    x, signals = solution.axis, np.array([solution[n] for n in names])
    if x.size < 2 or not names:
        return solution

    def between(values: Floats, row: Indices, part: Floats) -> Floats:
        return (1.0 - part) * values[..., row] + part * values[..., row + 1]

    def evaluate(row: Indices, part: Floats) -> Floats:
        known = {**constants, **dict(zip(names, between(signals, row, part), strict=True))}
        return np.array([np.broadcast_to(e.evaluate(known), row.shape) for e in expressions])

    low, high = np.minimum(x[:-1], x[1:]), np.maximum(x[:-1], x[1:])
    inside = (high > low) & (high > (-np.inf if start is None else start))
    row = np.flatnonzero(inside & (low < (np.inf if stop is None else stop)))
    left, right = np.zeros(row.size), np.ones(row.size)
    largest = np.zeros((len(expressions), 1))
    rows = [np.arange(x.size - 1), np.array([x.size - 2])]
    parts, count = [np.zeros(x.size - 1), np.ones(1)], 0
    with np.errstate(all="ignore"):
        for _ in range(_DEPTH):
            if not row.size or count > _MOST:
                break
            cuts = [left + place * (right - left) for place in _PLACES]
            values = [evaluate(row, part) for part in (left, *cuts, right)]
            local = np.maximum.reduce(np.abs(values))
            largest = np.fmax(largest, np.fmax.reduce(local, axis=1, keepdims=True))
            allowed = _FLAT * local + _TRACE * largest
            line = values[-1] - values[0]
            off = np.zeros(row.size, dtype=bool)
            for v, place in zip(values[1:-1], _PLACES, strict=True):
                off |= np.any(np.abs(v - values[0] - place * line) > allowed, axis=0)
            row, left, right = row[off], left[off], right[off]
            first, second = (cut[off] for cut in cuts)
            rows += [row, row]
            parts += [first, second]
            count += 2 * row.size
            row = np.tile(row, 3)
            left, right = (
                np.concatenate([left, first, second]),
                np.concatenate([first, second, right]),
            )
    if not count:
        return solution
    row, part = np.concatenate(rows), np.concatenate(parts)
    order = np.lexsort((part, row))
    row, part = row[order], part[order]
    columns = dict(zip(names, between(signals, row, part), strict=True))
    return replace(solution, axis=between(x, row, part), signals=columns, fine=None)
