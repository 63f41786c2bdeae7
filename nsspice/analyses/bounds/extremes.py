"""Extremes of a signal over the period, proved to be those for all parameters of a box."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...problems.descriptor import Functional
from ...problems.taylor import Models, Unbounded
from .flow import Piece
from .orbit import NotProved, Orbit
from .signs import bernstein, deepest, halves, slope, smallest

#: points of a piece at which the middle of the box is looked at
_POINTS = np.linspace(0.0, 1.0, 65)
#: pieces are halved so often where curvature decides
_LEVELS = 4
#: a jump that is rounding, as a part of the value
_CONTINUOUS = 1e-12


@dataclass(frozen=True, slots=True)
class Extreme:
    """Where a signal is largest (or smallest).

    Parameters
    ----------
    segment, piece : int
    at : Models, shape ()
        Place in the piece, from 0 to 1.
    row : Models, shape (w,)
        The signal there, as a row on w.
    change : Models, shape (w,)
        Of w since the beginning of the period.
    spare : float
        What the signal may exceed its value there by.
    """

    segment: int
    piece: int
    at: Models
    row: Models
    change: Models
    spare: float
    stationary: bool

    @property
    def inside(self) -> bool:
        """Whether it is inside of a piece, where the signal is smooth."""
        return bool(self.at.coefficients[1:].any() or 0.0 < float(self.at.middle) < 1.0)


class Extremes:
    """Largest and smallest values of a signal along an orbit.

    Parameters
    ----------
    orbit : Orbit
    output : Functional
    """

    def __init__(self, orbit: Orbit, output: Functional) -> None:
        self._orbit = orbit
        self._rows = [segment.mode.row(output) for segment in orbit.segments]
        #: change of w up to each piece
        self._before: list[list[Models]] = []
        total = Models.constant(orbit.home, np.zeros(orbit.scale.size))
        for pieces in orbit.run.pieces:
            self._before.append([])
            for piece in pieces:
                self._before[-1].append(total)
                total = total + _sum(piece, None)

    def extreme(self, sign: int) -> Extreme:
        """Return the place of the largest value of ``sign`` times the signal.

        Where another place has a larger one for some parameters, ``spare`` says by how much.
        """
        found = self._candidate(sign)
        spare = found.spare
        for k, pieces in enumerate(self._orbit.run.pieces):
            for j, piece in enumerate(pieces):
                spare = max(spare, self._prove(found, k, j, piece, sign))
        return replace(found, spare=spare)

    def difference(self, one: Extreme, other: Extreme) -> Models:
        """Return the difference of the values at two places, shape ()."""
        rows = one.row - other.row
        start = self._orbit.run.starts[0][:, 0] + other.change
        total = _dot(one.row, one.change - other.change)
        if not rows.nothing.all():
            total = total + _dot(rows, start)
        total = total.copy()
        total.remainder = total.remainder + one.spare + other.spare
        return total

    def value(self, one: Extreme) -> Models:
        """Return the value at a place, shape ()."""
        total = _dot(one.row, self._orbit.run.starts[0][:, 0] + one.change)
        total.remainder = total.remainder + one.spare
        return total

    def _candidate(self, sign: int) -> Extreme:
        """Return where the middle of the box has its extreme."""
        best, place = -np.inf, (0, 0, 0)
        for k, pieces in enumerate(self._orbit.run.pieces):
            middles = self._rows[k].middle
            for j, piece in enumerate(pieces):
                powers = piece.terms.middle[:-1] @ middles
                values = sign * np.polynomial.polynomial.polyval(_POINTS, powers)
                i = int(np.argmax(values))
                if values[i] > best:
                    best, place = float(values[i]), (k, j, i)
        k, j, i = place
        piece, row = self._orbit.run.pieces[k][j], self._rows[k]
        home = self._orbit.home
        spare = 0.0
        rates = slope(piece.along(row))
        at = Models.constant(home, _POINTS[i])
        stationary = False
        ends = 0.0 if i == 0 else 1.0 if i == _POINTS.size - 1 else None
        middle = sign * rates.middle
        if ends is not None:
            # an extreme next to the end, between two points
            rate = float(np.polynomial.polynomial.polyval(ends, middle))
            inside = rate > 0.0 if ends == 0.0 else rate < 0.0
            ends = None if inside else ends
        if ends is None:
            try:
                at, spare = self._stationary(rates, float(_POINTS[i]))
                stationary = True
            except (NotProved, Unbounded):
                pass  # it moves out of the piece: what exceeds the value here is spare
        change = self._before[k][j] + _sum(piece, at)
        return Extreme(k, j, at, row, change, spare, stationary)

    def _stationary(self, rates: Models, guess: float) -> tuple[Models, float]:
        """Return where a rate vanishes, and how far a value there may be from the extreme."""
        home = rates.home
        at = Models.constant(home, guess)
        curves = slope(rates)
        for _ in range(3 + home.degree):
            step = _horner(rates, at) / _horner(curves, at)
            at = Models(home, at.coefficients - step.coefficients, np.zeros(()))
        # |rate| <= e at the place, |curvature| >= m: the extreme is within e / m, e^2 / 2m higher
        error = float(_horner(rates, at).bound())
        whole = bernstein(curves)
        least = max(smallest(whole), smallest(-whole))
        if least <= 0.0:
            near = _horner(curves, at).range()
            least = 0.5 * max(float(near[0]), -float(near[1]))
            if least <= 0.0:
                raise NotProved("the curvature at an extreme")
            # the curvature keeps half of its size as far as the root may be
            reach = error / least
            most = float(bernstein(slope(curves)).bound().max()) if curves.shape[0] > 1 else 0.0
            if reach * most > least:
                raise NotProved("the curvature at an extreme")
        place = at.range()
        reach = error / least
        if float(place[0]) - reach <= 0.0 or float(place[1]) + reach >= 1.0:
            raise NotProved("an extreme may move to another segment")
        return at, error * error / (2.0 * least) * (1.0 + 1e-9)

    def _prove(self, found: Extreme, k: int, j: int, piece: Piece, sign: int) -> float:
        """Return by how much the signal on a piece may exceed the extreme."""
        powers = piece.along(self._rows[k])
        margin = -powers
        margin[0] = self._gap(found, k, self._before[k][j])
        margin.remainder[0] += piece.left(self._rows[k])
        margin = margin * float(sign)
        if (k, j) == (found.segment, found.piece) and found.inside:
            return self._above(bernstein(margin), bernstein(slope(slope(margin))), found)
        jumps = [self._jump(found, k, j), self._jump(found, k, j + 1)]
        starts, ends = (jump is not None for jump in jumps)
        # where a signal is continuous its rows differ by rounding
        return deepest(margin, starts=starts, ends=ends) + max(jump or 0.0 for jump in jumps)

    def _gap(self, found: Extreme, k: int, change: Models) -> Models:
        """Return how far the extreme is from the signal of a segment after a change of w.

        By changes: both have the same beginning.
        """
        row = self._rows[k]
        rest = found.row - row
        gap = _dot(found.row, found.change) - _dot(row, change)
        if not rest.nothing.all():
            gap = gap + _dot(rest, self._orbit.run.starts[0][:, 0])
        return gap

    def _jump(self, found: Extreme, k: int, j: int) -> float | None:
        """Return how far the signal jumps to an extreme at a boundary of pieces.

        None if the extreme is not there, or the signal is not continuous.
        """
        if found.inside:
            return None
        pieces = self._orbit.run.pieces
        count = len(pieces)

        def place(k: int, j: int) -> tuple[int, int]:
            return ((k + 1) % count, 0) if j == len(pieces[k]) else (k, j)

        at_end = float(found.at.middle) == 1.0
        if place(k, j) != place(found.segment, found.piece + at_end):
            return None
        rest = found.row - self._rows[k]
        if rest.nothing.all():
            return 0.0
        start = self._orbit.run.starts[0][:, 0] + found.change
        jump = float(_dot(rest, start).bound())
        size = float(_dot(found.row, start).bound())
        return jump if jump <= _CONTINUOUS * size else None

    def _above(self, margin: Models, curvature: Models, found: Extreme) -> float:
        """Return by how much a signal with an extreme inside a piece exceeds it on the piece."""
        margins, curves = [margin], [curvature]
        for _ in range(_LEVELS):
            margins = [part for m in margins for part in halves(m)]
            curves = [part for c in curves for part in halves(c)]
        convex = [smallest(c) > 0.0 for c in curves]
        count = len(margins)
        low, high = (float(end) for end in found.at.range())
        first, last = int(low * count), min(int(high * count), count - 1)
        above = 0.0
        for i, part in enumerate(margins):
            # one valley around the extreme: there the margin is least
            if not found.stationary or not all(convex[min(i, first) : max(i, last) + 1]):
                above = max(above, -smallest(part))
        return above


def _horner(powers: Models, at: Models) -> Models:
    total = powers[-1]
    for k in range(powers.shape[0] - 2, -1, -1):
        total = total * at + powers[k]
    return total


def _sum(piece: Piece, at: Models | None) -> Models:
    """Return the change of w from the beginning of a piece to a place, or its end."""
    terms = piece.terms
    count = terms.shape[0] - 1
    total = terms[count - 1]
    for k in range(count - 2, 0, -1):
        total = (total if at is None else total * at[None]) + terms[k]
    if at is not None:
        total = total * at[None]
    total = total.copy()
    total.remainder = total.remainder + terms[count].bound()
    return total


def _dot(row: Models, column: Models) -> Models:
    return (row[None, :] @ column[:, None])[0, 0]
