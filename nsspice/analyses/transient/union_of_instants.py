"""Points of several islands, each with its own instants, put side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..signals.curve import Floats
from ..signals.signal_function import Pieces


def align(parts: Sequence[Floats], curves: Sequence[Sequence[Pieces]] = ()) -> Floats:
    """Return the points of all parts on all their instants.

    Each part has the time first; an instant that appears twice is a jump, before and after.  Where
    a part has no point at an instant of another, it is what the engine has computed there, or else
    a line between its points; where it has one point at the jump of another, that point is given on
    both sides.

    Parameters
    ----------
    parts : sequence of ndarray, shape (k_i, 1 + c_i)
        At least one row each, times not falling.
    curves : sequence, optional
        Of each part: its signals as polynomials, as far as its engine has them.

    Returns
    -------
    ndarray, shape (k, 1 + sum c_i)

    Examples
    --------
    >>> a = np.array([[0.0, 1.0], [1.0, 2.0], [1.0, 5.0]])
    >>> b = np.array([[0.0, 0.0], [0.5, 3.0], [1.0, 6.0]])
    >>> align([a, b]).tolist()
    [[0.0, 1.0, 0.0], [0.5, 1.5, 3.0], [1.0, 2.0, 6.0], [1.0, 5.0, 6.0]]
    """
    if len(parts) == 1:
        return parts[0]
    instants = np.unique(np.concatenate([part[:, 0] for part in parts]))
    places = []
    repeats = np.ones(instants.size, dtype=np.int64)
    for part in parts:
        first = np.searchsorted(part[:, 0], instants, "left")
        count = np.searchsorted(part[:, 0], instants, "right") - first
        places.append((first, count))
        np.maximum(repeats, count, out=repeats)
    which = np.repeat(np.arange(instants.size), repeats)
    # number of the row among those of its instant
    turn = np.arange(which.size) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    columns = [instants[which]]
    for number, (part, (first, count)) in enumerate(zip(parts, places, strict=True)):
        here = first[which] + np.minimum(turn, np.maximum(count[which] - 1, 0))
        present = count[which] > 0
        last = part.shape[0] - 1
        block = part[np.minimum(here, last), 1:]
        if not present.all():
            gaps = np.flatnonzero(~present)
            right = np.minimum(here[gaps], last)
            left = np.maximum(here[gaps] - 1, 0)
            t, t0, t1 = instants[which[gaps]], part[left, 0], part[right, 0]
            width = np.where(t1 > t0, t1 - t0, 1.0)
            share = np.clip((t - t0) / width, 0.0, 1.0)[:, None]
            block[gaps] = part[left, 1:] * (1.0 - share) + part[right, 1:] * share
            for curve in curves[number] if curves else ():
                values = curve.at(t)
                known = ~np.isnan(values).all(axis=1)
                block[gaps[known]] = values[known]
        columns.append(block)
    return np.column_stack(columns)


class Merger:
    """Aligns points that arrive in pieces; hands on what no later piece can change.

    Parameters
    ----------
    widths : sequence of int
        Columns of each part, the time included.
    """

    def __init__(self, widths: Sequence[int]) -> None:
        self._waiting = [np.empty((0, width)) for width in widths]
        self._ended = [False] * len(widths)
        #: the last row of each part that was handed on, from which to interpolate
        self._before = [np.empty((0, width)) for width in widths]
        self._curves: list[list[Pieces]] = [[] for _ in widths]

    def add(self, part: int, rows: Floats, curves: Sequence[Pieces] = ()) -> None:
        """Take the next rows of a part, and its signals as polynomials up to there."""
        self._waiting[part] = np.concatenate([self._waiting[part], rows])
        if len(self._curves) > 1:
            self._curves[part] += curves

    def end(self, part: int) -> None:
        """Note that a part has no more rows."""
        self._ended[part] = True

    def reached(self, part: int) -> float:
        """Return the time up to which a part is known, infinite after its end."""
        if self._ended[part]:
            return float("inf")
        rows = self._waiting[part]
        return float(rows[-1, 0]) if rows.shape[0] else -float("inf")

    def take(self) -> Floats:
        """Return the aligned rows before the first instant that may still get more."""
        horizon = min(self.reached(k) for k in range(len(self._waiting)))
        width = 1 + sum(rows.shape[1] - 1 for rows in self._waiting)
        heads, known = [], []
        for k, rows in enumerate(self._waiting):
            cut = int(np.searchsorted(rows[:, 0], horizon, "left"))
            heads.append(rows[:cut])
            # one row more on both sides, so that values between can be interpolated
            known.append(np.concatenate([self._before[k], rows[: cut + 1]]))
            self._waiting[k] = rows[cut:]
            if cut:
                self._before[k] = rows[cut - 1 : cut].copy()
        if not any(head.shape[0] for head in heads) or not all(k.shape[0] for k in known):
            return np.empty((0, width))
        times = np.concatenate([head[:, 0] for head in heads])
        low, high = times.min(), times.max()
        block = align(known, self._curves)
        fresh: Floats = block[(block[:, 0] >= low) & (block[:, 0] <= high)]
        for curves in self._curves:
            curves[:] = [curve for curve in curves if curve.end[-1] > high]
        return fresh
