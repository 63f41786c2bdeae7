r"""Broken lines through the origin for rising curves, as far apart from them as a tolerance allows.

A line that runs through points below a convex curve, and comes as far above it between them, is
half as far from it as its chords are.  With N pieces for a difference of :math:`\epsilon` times a
scale I

.. math::

    N \approx \frac{1}{4 \sqrt\epsilon} \int \sqrt{f''(v) / I}\, dv,

so that the difference is of second order in 1/N.  Where the curve is above its scale, a difference
relative to the curve itself is allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

#: a line of more knots is not made
MOST = 200
#: halvings of an interval in which a number is searched for, of the length of a piece
_HALVINGS, _OF_PIECE = 40, 12
#: steps of the golden-section search, and its ratio
_LOOKS, _RATIO = 16, 0.5 * (math.sqrt(5.0) - 1.0)
#: points of a piece at which the difference is measured
_POINTS = 16

Law = Callable[[float], float]
Point = tuple[float, float]


class Knot(NamedTuple):
    """Where a line changes its slope: ``slope`` is added beyond the voltage ``place``.

    At an ``end`` the curve is no longer followed: beyond, differences are not bounded.
    """

    place: float
    slope: float
    end: bool = False


class BrokenCurve(NamedTuple):
    """A broken line through the origin.

    Parameters
    ----------
    slope : float
        At the origin.
    forward, reverse : tuple of Knot
        Away from the origin; a slope is added to the value in its own direction.
    error : float
        Largest difference from the curve, relative to the larger of the scale and the curve.
    """

    slope: float
    forward: tuple[Knot, ...]
    reverse: tuple[Knot, ...]
    error: float

    def at(self, v: float) -> float:
        """Return the value at a voltage.

        Examples
        --------
        >>> BrokenCurve(1.0, (Knot(1.0, 2.0),), (Knot(-1.0, -0.5),), 0.0).at(2.0)
        4.0
        """
        ahead = sum(k.slope * max(v - k.place, 0.0) for k in self.forward)
        behind = sum(k.slope * max(k.place - v, 0.0) for k in self.reverse)
        return self.slope * v + ahead - behind


class Curve(NamedTuple):
    """One branch of a rising curve from the origin, seen behind a series resistance.

    Parameters
    ----------
    value : callable
        Of a voltage, without the resistance.
    bend : float
        1 for a convex curve, -1 for a concave one.
    scale, tolerance : float
        A difference of ``tolerance max(scale, value)`` is allowed.
    resistance : float
        [Ohm]
    """

    value: Law
    bend: float
    scale: float
    tolerance: float
    resistance: float = 0.0

    def behind(self, x: float) -> Point:
        """Return the point as far on the hollow side of the curve as is allowed."""
        value = self.value(x)
        allowed = self.tolerance * max(self.scale, abs(value))
        return x + self.resistance * value, value - self.bend * allowed

    def excess(self, begin: Point, slope: float, x: float) -> float:
        """Return how far a line is on the other side, in units of what is allowed."""
        value = self.value(x)
        line = begin[1] + slope * (x + self.resistance * value - begin[0])
        return self.bend * (line - value) / (self.tolerance * max(self.scale, abs(value)))

    def knots(self, slope: float, stop: float, ends: bool) -> tuple[list[Knot], float]:
        """Return the knots of a line with a slope at the origin, and its largest error.

        Parameters
        ----------
        slope : float
        stop : float
            Voltage up to which the curve is followed, the series resistance left out.
        ends : bool
            Whether the line turns to the tangent there, so that it can be seen when it is left.

        Raises
        ------
        ValueError
            If there are more than ``MOST``.
        """
        begin, x = (0.0, 0.0), 0.0
        places: list[Point] = []
        slopes = [slope]
        # the first piece ends where the curve leaves it
        end = last_good(lambda x: self.excess((0.0, 0.0), slope, x) >= -1.0, 0.0, stop)
        error = self._measured(begin, slope, 0.0, end)
        length = end
        while end < stop:
            x, begin = end, self.behind(end)
            places.append(begin)
            if self.resistance:
                final = (1.0 - self.tolerance) / self.resistance
                if self._largest(begin, final, x, stop) <= 1.0:
                    slopes.append(final)
                    error = max(error, self._measured(begin, final, x, stop))
                    break
            end = self._piece(begin, x, length, stop)
            if end <= x or len(places) > MOST:
                raise ValueError("too many pieces")
            length = end - x
            slopes.append(self._chord(begin, end))
            error = max(error, self._measured(begin, slopes[-1], x, end))
        if ends and end >= stop:
            step = 1e-6 * stop
            places.append(self.behind(stop))
            slopes.append((self.value(stop) - self.value(stop - step)) / step)
        own = [s / (1.0 - self.resistance * s) for s in slopes]
        at = (t - self.resistance * c for t, c in places)
        knots = [Knot(v, b - a) for v, a, b in zip(at, own, own[1:], strict=False)]
        if ends and end >= stop:
            knots[-1] = knots[-1]._replace(end=True)
        return knots, error

    def _chord(self, begin: Point, end: float) -> float:
        t, c = self.behind(end)
        return (c - begin[1]) / (t - begin[0])

    def _piece(self, begin: Point, x: float, length: float, stop: float) -> float:
        """Return the end of the longest piece, of which some are as long as the one before."""

        def good(end: float) -> bool:
            return self._largest(begin, self._chord(begin, end), x, end) <= 1.0

        while x + length < stop and good(x + length):
            length *= 2.0
        while not good(min(x + length, stop)) and length > 0.0:
            length *= 0.5
        if x + length >= stop:
            return stop
        return last_good(good, x + length, min(x + 2.0 * length, stop), _OF_PIECE)

    def _largest(self, begin: Point, slope: float, low: float, high: float) -> float:
        """Return the largest excess on a piece, which has one maximum: golden-section search."""
        a, b = high - _RATIO * (high - low), low + _RATIO * (high - low)
        fa, fb = self.excess(begin, slope, a), self.excess(begin, slope, b)
        for _ in range(_LOOKS):
            if fa > fb:
                high, b, fb = b, a, fa
                a = high - _RATIO * (high - low)
                fa = self.excess(begin, slope, a)
            else:
                low, a, fa = a, b, fb
                b = low + _RATIO * (high - low)
                fb = self.excess(begin, slope, b)
        return max(fa, fb)

    def _measured(self, begin: Point, slope: float, low: float, high: float) -> float:
        points = (low + (high - low) * k / _POINTS for k in range(_POINTS + 1))
        found = max(abs(self.excess(begin, slope, x)) for x in points)
        return self.tolerance * max(found, self._largest(begin, slope, low, high))

    def first_slope(self, stop: float) -> float:
        """Return the slope at the origin that gives a concave curve the longest first piece."""
        most = self.value(1e-6 * stop) / (1e-6 * stop)

        def good(share: float) -> bool:
            return self._largest((0.0, 0.0), (1.0 - share) * most, 0.0, stop) <= 1.0

        return (1.0 - last_good(good, 0.0, 1.0)) * most


def last_good(
    good: Callable[[float], bool], low: float, high: float, halvings: int = _HALVINGS
) -> float:
    """Return the largest number up to ``high`` for which a condition holds that holds at ``low``.

    Examples
    --------
    >>> round(last_good(lambda x: x * x <= 2.0, 0.0, 4.0), 9)
    1.414213562
    """
    if good(high):
        return high
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if good(middle) else (low, middle)
    return low
