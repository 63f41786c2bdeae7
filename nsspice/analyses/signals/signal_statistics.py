"""Integrals, extremes, crossings and slopes of signals, from polynomials instead of rows.

Integrals are those of Gauss with twelve points, exact for products of two of the polynomials; where
an expression bends more, or has a kink, pieces are halved until both halves agree with the whole.
Extremes are zeros of derivatives, and crossings are found by the method of Illinois.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from .signal_function import Pieces, Trace, basis, places, slopes

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Edge = Literal["rise", "fall", "cross"]

_EPS = float(np.finfo(np.float64).eps)
_LEGENDRE, _WEIGHTS = np.polynomial.legendre.leggauss(12)
#: the points of Gauss as parts of a cell, and their weights
GAUSS_POINTS, GAUSS_WEIGHTS = 0.5 + 0.5 * _LEGENDRE, 0.5 * _WEIGHTS
#: the points of Gauss in a cell, and its ends
_NODES = np.concatenate([GAUSS_POINTS, [0.0, 1.0]])
#: what the values at the points of Gauss say about the ends
_TO_ENDS = np.polynomial.legendre.legvander(np.array([-1.0, 1.0]), 11) @ np.linalg.inv(
    np.polynomial.legendre.legvander(_LEGENDRE, 11)
)
#: halves that differ from the whole by less than this part of the integral of the absolute value
#: are as good as rounding lets them be
_AGREE = 16.0 * _EPS
#: an interval is halved so often: a jump is located to rounding of an instant
_HALVINGS = 52
#: part of a cell to which an extreme is located: its value is off by the square of that
_SETTLED = 1e-13
#: points at which a piece is looked at for extremes and crossings: three for each degree of freedom
_LOOKS = places(34)
#: points of the polynomial around an extreme
_AROUND = 12
#: between two looks a curve with a kink rises by no more than this part of its swing in the piece
_RISE = 0.25
#: steps of the method of Illinois: halving alone would take 52
_STEPS = 60
#: so many cells, on average, have to be the same part of their pieces to be evaluated together
_ALIKE = 8
#: cells at a time: 34 points of each
_BLOCK = 1 << 14


@dataclass(frozen=True, slots=True)
class Cells:
    """Parts of pieces: of the pieces ``index`` from ``low`` to ``high``, each shape (k,)."""

    index: Indices
    low: Floats
    high: Floats

    @classmethod
    def of(cls, pieces: Pieces, start: float, stop: float) -> Cells:
        """Return the cells that make up a window."""
        end = pieces.end
        inside = (end > start) & (pieces.begin < stop)
        index = np.flatnonzero(inside)
        begin, length = pieces.begin[index], pieces.length[index]
        with np.errstate(divide="ignore", invalid="ignore"):
            low = np.where(begin < start, (start - begin) / length, 0.0)
            high = np.where(end[index] > stop, (stop - begin) / length, 1.0)
        return cls(index, low, high)

    def at(self, part: Floats) -> Floats:
        """Return the parts of pieces at parts ``part``, shape (p,) or (k, p), of the cells."""
        return self.low[:, np.newaxis] + (self.high - self.low)[:, np.newaxis] * part

    def chosen(self, which: Indices | npt.NDArray[np.bool_]) -> Cells:
        """Return some of the cells."""
        return Cells(self.index[which], self.low[which], self.high[which])

    def halves(self) -> Cells:
        """Return the first halves, then the second ones."""
        middle = 0.5 * (self.low + self.high)
        return Cells(
            np.tile(self.index, 2),
            np.concatenate([self.low, middle]),
            np.concatenate([middle, self.high]),
        )

    def values(self, trace: Trace, part: Floats) -> Floats:
        """Return the expression at parts ``part``, shape (p,) or (k, p), of the cells."""
        if part.ndim > 1:
            return trace.at(self.index, self.at(part))
        if (self.low == self.low[:1]).all() and (self.high == self.high[:1]).all():
            return trace.at(self.index, self.low[:1] + (self.high[:1] - self.low[:1]) * part)
        # halves of whole pieces have their factors in common
        ends, kind = np.unique(self.low + 1j * self.high, return_inverse=True)
        if ends.size * _ALIKE > self.index.size:
            return trace.at(self.index, self.at(part))
        found = np.empty((self.index.size, part.size))
        for k, end in enumerate(ends):
            cells = kind == k
            at = end.real + (end.imag - end.real) * part
            found[cells] = trace.at(self.index[cells], at)
        return found

    def abscissa(self, trace: Trace, part: Floats) -> Floats:
        """Return the abscissae at one part of each cell, shape (k,)."""
        pieces = trace.motion.pieces
        at = self.low + (self.high - self.low) * part
        return np.asarray(pieces.begin[self.index] + at * pieces.length[self.index])


@np.errstate(all="ignore")  # a result that is not a number is reported as such
def integral(trace: Trace, start: float, stop: float, *, square: bool = False) -> float:
    """Return the integral of an expression, or of its square, over a window."""
    cells = Cells.of(trace.motion.pieces, start, stop)
    parts: list[Floats] = []
    todo, sizes, _ = _quadrature(trace, cells, square)
    size = float(sizes.sum())
    for _ in range(0 if trace.linear else _HALVINGS):
        if not cells.index.size:
            break
        halves = cells.halves()
        found, sizes, bends = _quadrature(trace, halves, square)
        k = cells.index.size
        both = found[:k] + found[k:]
        # a kink near an end of a cell lies beyond all points of Gauss, but the end shows it
        off = np.maximum(np.abs(both - todo), np.maximum(bends[:k], bends[k:])) > _AGREE * size
        parts.append(both[~off])
        split = np.tile(off, 2)
        cells, todo = halves.chosen(split), found[split]
    parts.append(todo)
    return float(np.concatenate(parts).sum())


def _quadrature(trace: Trace, cells: Cells, square: bool) -> tuple[Floats, Floats, Floats]:
    """Return the integrals over cells, of the absolute values, and of what is off at the ends."""
    found, sizes, off = np.zeros((3, cells.index.size))
    for first in range(0, cells.index.size, _BLOCK):
        block = slice(first, first + _BLOCK)
        part = Cells(cells.index[block], cells.low[block], cells.high[block])
        values = part.values(trace, _NODES)
        values = values * values if square else values
        width = (part.high - part.low) * trace.motion.pieces.length[part.index]
        values, ends = values[:, :-2], values[:, -2:]
        found[block] = values @ GAUSS_WEIGHTS * width
        sizes[block] = np.abs(values) @ GAUSS_WEIGHTS * width
        off[block] = np.abs(values @ _TO_ENDS.T - ends).max(axis=1) * width
    return found, sizes, off


def mean(trace: Trace, start: float, stop: float, *, square: bool = False) -> float:
    """Return the mean of an expression, or of its square; at a single point the value."""
    if stop > start:
        return integral(trace, start, stop, square=square) / (stop - start)
    found = value(trace, start)
    return found * found if square else found


def value(trace: Trace, x: float, *, left: bool = False) -> float:
    """Return an expression at an abscissa; of a jump the value after it, or before (``left``)."""
    index, part = _place(trace, x, left)
    return float(trace.at(np.array([index]), np.array([part]))[0, 0])


def values(trace: Trace, x: Floats, *, left: bool = False) -> Floats:
    """Return an expression at abscissae, shape (k,); of jumps the values after (before) them."""
    pieces = trace.motion.pieces
    index = np.searchsorted(pieces.end, x, "left" if left else "right")
    index = np.minimum(index, pieces.begin.size - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.nan_to_num((x - pieces.begin[index]) / pieces.length[index])
    return trace.at(index, np.clip(part, 0.0, 1.0)[:, np.newaxis])[:, 0]


def _place(trace: Trace, x: float, left: bool) -> tuple[int, float]:
    pieces = trace.motion.pieces
    index = int(np.searchsorted(pieces.end, x, "left" if left else "right"))
    index = min(index, pieces.begin.size - 1)
    length = float(pieces.length[index])
    part = (x - float(pieces.begin[index])) / length if length else 0.0
    return index, min(max(part, 0.0), 1.0)


def slope(trace: Trace, x: float) -> float:
    """Return the derivative of an expression; where it has two, their mean."""
    pieces = trace.motion.pieces
    found = []
    for left in (True, False):
        index, part = _place(trace, x, left)
        if not pieces.length[index]:
            continue
        # a kink elsewhere in the piece is not seen
        low, high = max(0.0, part - 0.005), min(1.0, part + 0.005)
        cell = Cells(np.array([index]), np.array([low]), np.array([high]))
        values = cell.values(trace, places(_AROUND))[0]
        width = (high - low) * float(pieces.length[index])
        at = np.array([(part - low) / (high - low)])
        found.append(float((basis(_AROUND, at) @ slopes(_AROUND) @ values)[0]) / width)
    return float(np.mean(found)) if found else float("nan")


def extreme(trace: Trace, start: float, stop: float, *, least: bool = False) -> tuple[float, float]:
    """Return the largest (``least``: smallest) value in a window, and where it is first reached."""
    return extremes(trace, start, stop, (-1.0 if least else 1.0,))[0]


def extremes(
    trace: Trace, start: float, stop: float, signs: Sequence[float] = (1.0, -1.0)
) -> list[tuple[float, float]]:
    """Return the largest value in a window (of a sign -1 the smallest), and where it is first."""
    if not stop > start:
        return [(value(trace, start), start)] * len(signs)
    cells = Cells.of(trace.motion.pieces, start, stop)
    many, k = np.array(signs), cells.index.size
    tops, swings = np.empty((2, many.size, k))
    where = np.empty((many.size, k), dtype=np.intp)
    for first in range(0, k, _BLOCK):
        block = slice(first, first + _BLOCK)
        part = Cells(cells.index[block], cells.low[block], cells.high[block])
        seen = part.values(trace, _LOOKS)
        swings[:, block] = seen.max(axis=1) - seen.min(axis=1)
        for row, sign in enumerate(signs):
            where[row, block] = (sign * seen).argmax(axis=1)
            tops[row, block] = (sign * seen).max(axis=1)
    best = np.fmax.reduce(tops, axis=1)
    # nothing but pieces that may rise above the best point seen is looked at closer
    rows, near = np.nonzero(tops + _RISE * swings >= best[:, np.newaxis])
    chosen, look = cells.chosen(near), where[rows, near]
    low, high = _LOOKS[np.maximum(look - 1, 0)], _LOOKS[np.minimum(look + 1, _LOOKS.size - 1)]
    around = Cells(
        chosen.index, *(chosen.low + (chosen.high - chosen.low) * p for p in (low, high))
    )
    closer, at = _top(trace, around, many[rows])
    seen_at, top_at = chosen.abscissa(trace, _LOOKS[look]), around.abscissa(trace, at)
    found = []
    for one, sign in enumerate(signs):
        if np.isnan(best[one]):
            found.append((float("nan"), float("nan")))
            continue
        mine = rows == one
        values = np.concatenate([tops[one, near[mine]], closer[mine]])
        places_ = np.concatenate([seen_at[mine], top_at[mine]])
        top = float(np.fmax.reduce(values))
        first_ = float(places_[values >= top - 2.0 * _EPS * abs(top)].min())
        found.append((sign * top, first_))
    return found


def _top(trace: Trace, cells: Cells, signs: Floats) -> tuple[Floats, Floats]:
    """Return the largest value in each cell and the part of the cell where it is.

    Of cells with a sign -1 they are those of the expression times -1.  In so short a cell the
    expression has one extreme, where the derivative of a polynomial through some of its points is
    zero, or a kink, to which the best point is as near as halving comes.
    """
    sign = signs[:, np.newaxis]
    values = sign * cells.values(trace, places(_AROUND))
    rates = values @ slopes(_AROUND).T
    # where it rises and then falls
    turns = (rates[:, :-1] > 0.0) & (rates[:, 1:] <= 0.0)
    k = turns.argmax(axis=1)
    low = np.where(turns.any(axis=1), places(_AROUND)[k], places(_AROUND)[values.argmax(axis=1)])
    high = np.where(turns.any(axis=1), places(_AROUND)[k + 1], low)
    at = _summit(rates, low, high)
    found = (sign * cells.values(trace, at[:, np.newaxis]))[:, 0]
    if trace.linear:
        return found, at  # a piece is smooth, and so is a sum of signals in it
    # a kink: halving by values
    left, right = np.zeros(at.size), np.ones(at.size)
    for _ in range(_HALVINGS):
        thirds = np.stack([left + (right - left) / 3.0, right - (right - left) / 3.0], axis=1)
        pair = sign * cells.values(trace, thirds)
        rising = pair[:, 0] < pair[:, 1]
        left, right = (
            np.where(rising, thirds[:, 0], left),
            np.where(rising, right, thirds[:, 1]),
        )
        if np.all(right - left < 1e-12):
            break
    kink = 0.5 * (left + right)
    of_kink = (sign * cells.values(trace, kink[:, np.newaxis]))[:, 0]
    higher = of_kink > found + 4.0 * _EPS * np.abs(found)
    return np.where(higher, of_kink, found), np.where(higher, kink, at)


def _summit(rates: Floats, low: Floats, high: Floats) -> Floats:
    """Return where polynomials fall through zero, by Newton's method between two bounds."""
    curves = rates @ slopes(_AROUND).T
    at = 0.5 * (low + high)
    for _ in range(_HALVINGS):
        factors = basis(_AROUND, at)
        rate = np.einsum("kn,kn->k", factors, rates)
        curve = np.einsum("kn,kn->k", factors, curves)
        low, high = np.where(rate > 0.0, at, low), np.where(rate > 0.0, high, at)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = at - rate / curve
        inside = (step > low) & (step < high)
        found = np.where(inside, step, 0.5 * (low + high))
        done = np.all(np.abs(found - at) <= _SETTLED)
        at = found
        if done:
            break
    return at


def crossings(trace: Trace, level: float, edge: Edge, start: float, stop: float) -> Floats:
    """Return the abscissae in a window where an expression passes a level, in order.

    A rise goes from below to at or above the level, a fall from above to at or below it.
    """
    cells = Cells.of(trace.motion.pieces, start, stop)
    found: list[Floats] = []
    before = np.nan
    largest = 0.0
    for first in range(0, cells.index.size, _BLOCK):
        block = slice(first, first + _BLOCK)
        part = Cells(cells.index[block], cells.low[block], cells.high[block])
        values = part.values(trace, _LOOKS)
        largest = max(largest, float(np.fmax.reduce(np.abs(values), axis=None)))
        seen = _cleared(values - level, level, largest)
        found.append(_inside(trace, part, seen, level, edge))
        ends = np.append(before, seen[:-1, -1]), seen[:, 0]
        jumped = _passed(*ends, edge)
        found.append(part.abscissa(trace, np.zeros(part.index.size))[jumped])
        before = seen[-1, -1]
    return np.unique(np.concatenate(found)) if found else np.zeros(0)


def _cleared(apart: Floats, level: float, largest: float) -> Floats:
    """Return distances from a level without those that are rounding: what rests there is on it."""
    return np.where(np.abs(apart) <= 8.0 * _EPS * max(abs(level), largest), 0.0, apart)


def _passed(before: Floats, after: Floats, edge: Edge) -> npt.NDArray[np.bool_]:
    rising = (before < 0.0) & (after >= 0.0)
    falling = (before > 0.0) & (after <= 0.0)
    return {"rise": rising, "fall": falling, "cross": rising | falling}[edge]


def _inside(trace: Trace, cells: Cells, seen: Floats, level: float, edge: Edge) -> Floats:
    """Return the crossings inside cells, of which the distances from the level have been seen."""
    looks = np.broadcast_to(_LOOKS, seen.shape)
    # a curve that turns between two looks may pass the level there and come back
    a, b, c = seen[:, :-2], seen[:, 1:-1], seen[:, 2:]
    turning = (a * b > 0.0) & (b * c > 0.0)
    turning &= (
        (np.abs(b) < np.abs(a)) & (np.abs(b) <= np.abs(c)) & (np.abs(b) <= np.abs(a - b + c - b))
    )
    row, k = np.nonzero(turning)
    if row.size:
        around = cells.chosen(row)
        ends = [around.low + (around.high - around.low) * _LOOKS[k + e] for e in (0, 2)]
        _, at = _top(trace, Cells(around.index, *ends), -np.sign(b[row, k]))
        place = _LOOKS[k] + (_LOOKS[k + 2] - _LOOKS[k]) * at
        there = around.values(trace, place[:, np.newaxis])[:, 0] - level
        beyond = there * b[row, k] < 0.0
        row, k, place, there = row[beyond], k[beyond], place[beyond], there[beyond]
    left, right = looks[:, :-1], looks[:, 1:]
    i, j = np.nonzero(_passed(seen[:, :-1], seen[:, 1:], edge))
    brackets = [(i, left[i, j], right[i, j], seen[i, j], seen[i, j + 1])]
    if row.size:
        for near, far in ((k, None), (None, k + 2)):
            x0, s0 = (place, there) if near is None else (_LOOKS[near], seen[row, near])
            x1, s1 = (place, there) if far is None else (_LOOKS[far], seen[row, far])
            ok = _passed(s0, s1, edge)
            brackets.append((row[ok], x0[ok], x1[ok], s0[ok], s1[ok]))
    rows, x0, x1, s0, s1 = (np.concatenate(column) for column in zip(*brackets, strict=True))
    chosen = cells.chosen(rows)
    return chosen.abscissa(trace, _root(trace, chosen, level, x0, x1, s0, s1))


def _root(
    trace: Trace, cells: Cells, level: float, x0: Floats, x1: Floats, s0: Floats, s1: Floats
) -> Floats:
    """Return the part of each cell, between x0 and x1, where the distance from a level is zero."""
    x0, x1, s0, s1 = x0.copy(), x1.copy(), s0.copy(), s1.copy()
    side = np.zeros(x0.size)
    for step in range(_STEPS):
        open_ = (s1 != 0.0) & (s0 != 0.0) & (x1 - x0 > _EPS * np.maximum(x1, 1e-3))
        if not open_.any():
            break
        k = np.flatnonzero(open_)
        a, b, fa, fb = x0[k], x1[k], s0[k], s1[k]
        x = b - fb * ((b - a) / (fb - fa))
        x = np.where((x > a) & (x < b) & (step % 4 != 3), x, 0.5 * (a + b))
        f = cells.chosen(k).values(trace, x[:, np.newaxis])[:, 0] - level
        same = f * fb > 0.0
        # the end that stays twice counts for half, so that both ends move
        x1[k], s1[k] = np.where(same, x, b), np.where(same, f, fb)
        x0[k], s0[k] = np.where(same, a, x), np.where(same, fa, f)
        s0[k] = np.where(same & (side[k] > 0.0), 0.5 * s0[k], s0[k])
        s1[k] = np.where(~same & (side[k] < 0.0), 0.5 * s1[k], s1[k])
        side[k] = np.where(same, 1.0, -1.0)
    return np.where(
        s1 == 0.0, x1, np.where(s0 == 0.0, x0, np.where(np.abs(s0) < np.abs(s1), x0, x1))
    )
