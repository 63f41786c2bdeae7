"""Piecewise-linear expressions of one signal as broken lines: places, and the law between them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from ...netlist.expressions.node import Node
from ..behaviour import linear_form
from .comparators import Comparator
from .piecewise import Inner, piecewise

#: a value at a crossing is a quotient of two differences of sums of rounded terms
ROUNDING = 8.0 * 2.0**-53

#: ``c + s x``
Affine = tuple[float, float]


class BrokenLine(NamedTuple):
    """A function of x that is affine between some places; it may jump there.

    Parameters
    ----------
    places : tuple of float
        In rising order.
    laws : tuple of (float, float)
        Constant and slope before, between and after the places.
    """

    places: tuple[float, ...]
    laws: tuple[Affine, ...]

    @property
    def slopes(self) -> tuple[float, ...]:
        """Return the slopes of the pieces."""
        return tuple(slope for _, slope in self.laws)

    @property
    def continuous(self) -> bool:
        """Return whether it has no jumps, rounding aside.

        Each law is a sum of as many terms as there are kinks, as large as the steepest slope makes
        them.
        """
        steepest = max(abs(s) for _, s in self.laws)
        known = ROUNDING * len(self.laws)
        return all(
            abs(c1 - c2 + (s1 - s2) * x) <= known * (abs(c1) + abs(c2) + steepest * abs(x))
            for x, ((c1, s1), (c2, s2)) in zip(self.places, pairwise(self.laws), strict=True)
        )


def broken_line(node: Node, signals: Mapping[str, float]) -> BrokenLine | None:
    """Return a piecewise-linear expression of one variable x as a broken line.

    Parameters
    ----------
    node : Node
    signals : mapping of str to float
        Signals that are multiples of x: ``{"v(a,b)": 1.0, "v(b,a)": -1.0}``.

    Returns
    -------
    BrokenLine or None
        None if it is not such an expression, or reads other signals.

    Examples
    --------
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> broken_line(Expression.parse("3*v(a) - 2*max(v(a) - 2, 0)").node, {"v(a)": 1.0})
    BrokenLine(places=(2.0,), laws=((0.0, 3.0), (4.0, 1.0)))
    >>> broken_line(Expression.parse("v(a) > 1 ? 5 : 3").node, {"v(a)": 1.0}).laws
    ((3.0, 0.0), (5.0, 0.0))
    """
    found = piecewise(node, "x")
    if found is None:
        return None
    tree, inner = found
    known = {signal: BrokenLine((), ((0.0, factor),)) for signal, factor in signals.items()}
    try:
        for part in inner:
            known[part.signal] = _inner(part, known)
        return _sum(tree, known)
    except KeyError:  # another signal
        return None


def _inner(part: Inner, known: Mapping[str, BrokenLine]) -> BrokenLine:
    if isinstance(part, Comparator):
        control = _sum(part.control, known)
        low, high = _sum(part.low, known), _sum(part.high, known)
        return _chosen(control, low, high)
    line = _sum(part.base, known)
    for limit, sign in ((part.floor, 1.0), (part.ceiling, -1.0)):
        if limit is not None:
            bound = _sum(limit, known)
            gap = _combined([(sign, bound), (-sign, line)])
            line = _chosen(gap, line, bound)
    return line


def _sum(node: Node, known: Mapping[str, BrokenLine]) -> BrokenLine:
    form = linear_form(node)
    if form is None:
        raise KeyError
    constant = BrokenLine((), ((form[0], 0.0),))
    return _combined([(1.0, constant), *((f, known[name]) for name, f in form[1].items())])


def _combined(terms: Sequence[tuple[float, BrokenLine]]) -> BrokenLine:
    """Return a weighted sum."""

    def law(x: float) -> Affine:
        parts = [(factor, _at(line, x)) for factor, line in terms]
        return sum(f * c for f, (c, _) in parts), sum(f * s for f, (_, s) in parts)

    return _built({p for _, line in terms for p in line.places}, law)


def _chosen(control: BrokenLine, low: BrokenLine, high: BrokenLine) -> BrokenLine:
    """Return one line where another one is positive, and a third elsewhere."""
    places = {p for line in (control, low, high) for p in line.places}
    ends = (-math.inf, *control.places, math.inf)
    for (begin, end), (c, s) in zip(pairwise(ends), control.laws, strict=True):
        if s and begin < (zero := -c / s) < end:
            places.add(zero)

    def law(x: float) -> Affine:
        c, s = _at(control, x)
        return _at(high if c + s * x > 0.0 else low, x)

    return _built(places, law)


def _at(line: BrokenLine, x: float) -> Affine:
    """Return the law between two places."""
    return line.laws[sum(x > place for place in line.places)]


def _built(candidates: set[float], law: Callable[[float], Affine]) -> BrokenLine:
    """Return the line with a law between candidates for its places, without those that are none."""
    places: list[float] = []
    for place in sorted(candidates):
        # the same place computed in two ways
        if not places or place - places[-1] > ROUNDING * max(abs(place), abs(places[-1])):
            places.append(place)
    laws = [law(x) for x in _between(places)]
    kept = [k for k, (one, two) in enumerate(pairwise(laws)) if one != two]
    return BrokenLine(tuple(places[k] for k in kept), (laws[0], *(laws[k + 1] for k in kept)))


def _between(places: Sequence[float]) -> list[float]:
    """Return a point before, between and after some places."""
    if not places:
        return [0.0]
    first, last = places[0], places[-1]
    inside = [a + 0.5 * (b - a) for a, b in pairwise(places)]
    return [first - abs(first) - 1.0, *inside, last + abs(last) + 1.0]
