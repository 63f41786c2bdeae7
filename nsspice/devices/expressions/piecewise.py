r"""Piecewise-linear expressions as complementarity pairs: limiters, tables, choices between laws.

``limit(v(x), 0, 1)`` is linear on either side of its kinks.  Written on a tape it is a smooth law
to the solver, and a closed loop that holds one takes steps.  Here it becomes a *limiter*: a node
inside the element, whose voltage y follows a linear combination and is kept between two others,

.. math::

    y = b(z) + \lambda_1 - \lambda_2, \qquad
    0 \le \lambda_1 \perp y - f(z) \ge 0, \qquad 0 \le \lambda_2 \perp c(z) - y \ge 0,

so that ``max(a, b)`` is ``b`` with the floor ``a``, ``min`` the same with a ceiling, ``limit`` has
both.  In each mode y is one of the combinations as it is: nothing cancels, however far the
input has gone.  A choice between laws, ``if(v(c) > 0, v(a), v(b))``, is a comparator whose node has
the voltage of one law or the other; so is the product of a signal with what is 0 or 1.

A choice that is continuous, ``if(v(a) > 0, v(a), 0)``, is the maximum or minimum that it describes:
it stays well-posed in a loop without storage.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import ONE, ZERO, Node, TooLarge, add, mul, neg, num, var
from ..behaviour import linear_form
from .comparators import Comparator, Reader, difference

#: constant and factors of signals
Form = tuple[float, dict[str, float]]

#: most nodes of one expression: a table of a hundred points costs less on a tape
_MOST = 40
#: largest tree of which it is looked at what keeps it from being piecewise linear
_LOOKED = 2000


class Limiter(NamedTuple):
    """A node inside an element that follows an expression between two others.

    Parameters
    ----------
    signal : str
        ``v(node)``.
    base : Node
        What it is as long as no limit is met.
    floor, ceiling : Node or None
        What it is at least and at most.
    """

    signal: str
    base: Node
    floor: Node | None
    ceiling: Node | None


Inner = Comparator | Limiter


def value_of(node: Inner, signals: Mapping[str, float]) -> float:
    """Return the voltage of a node inside an element for given signals.

    Examples
    --------
    >>> value_of(Limiter("v(b1#1)", var("v(a)"), ZERO, ONE), {"v(a)": 3.0})
    1.0
    """

    def of(part: Node) -> float:
        return float(Expression(part).evaluate(signals))

    if isinstance(node, Comparator):
        control = of(node.control)
        return of(node.high if control > 0.0 or (control == 0.0 and node.closed) else node.low)
    value = of(node.base)
    value = value if node.floor is None else max(value, of(node.floor))
    return value if node.ceiling is None else min(value, of(node.ceiling))


def piecewise(node: Node, name: str) -> tuple[Node, list[Inner]] | None:
    """Return a piecewise-linear expression as a linear one of nodes inside its element, and these.

    Parameters
    ----------
    node : Node
    name : str
        Of the element; the nodes are ``name#1``, ``name#2`` ...

    Returns
    -------
    (Node, list of Comparator or Limiter) or None
        None if the expression is not piecewise linear, or of too many pieces.

    Examples
    --------
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> from nsspice.netlist.expressions.node import show
    >>> tree, (limiter,) = piecewise(Expression.parse("2*limit(v(a), 0, 1)").node, "b1")
    >>> show(tree), show(limiter.base), show(limiter.floor), show(limiter.ceiling)
    ('2*v(b1#1)', 'v(a)', '0', '1')
    >>> piecewise(Expression.parse("max(v(a)*v(b), 0)").node, "b1") is None
    True
    """
    reader = _PiecewiseReader(name)
    try:
        tree = reader.replace(node)
    except (_Nonlinear, TooLarge):
        return None
    return (tree, reader.inner) if linear_form(tree, timed=True) is not None else None


def obstacle(node: Node) -> Node:
    """Return the first part of an expression that is not piecewise linear though its parts are.

    Examples
    --------
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> from nsspice.netlist.expressions.node import show
    >>> show(obstacle(Expression.parse("limit(v(a), 0, 1) + 2*exp(v(b))").node))
    'exp(v(b))'
    """
    if node.op == "call" and node.value in ("asin", "acos") and node.args[0].op == "call":
        return node  # a triangle of what its sine is of
    for part in node.args:
        if part.op != "inv" and part.size <= _LOOKED and piecewise(part, "x") is None:
            return obstacle(part)
    return node


def slope(form: Form, inner: Sequence[Inner], signal: str) -> tuple[float, float]:
    """Return bounds of the slope of a piecewise-linear law in one signal: least and largest.

    Comparators, which jump, have no bounds.

    Parameters
    ----------
    form : tuple
        Constant and factors of signals and inner nodes.
    inner : sequence of Comparator or Limiter
    signal : str

    Examples
    --------
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> tree, inner = piecewise(Expression.parse("i + max(2*i, 0)").node, "r1")
    >>> slope(linear_form(tree), inner, "i")
    (1.0, 3.0)
    """
    known = {signal: (1.0, 1.0)}

    def of(factors: dict[str, float]) -> tuple[float, float]:
        low = high = 0.0
        for name, factor in factors.items():
            ends = [factor * end for end in known.get(name, (0.0, 0.0))]
            low, high = low + min(ends), high + max(ends)
        return low, high

    for node in inner:
        if isinstance(node, Comparator):
            known[node.signal] = (-float("inf"), float("inf"))
            continue
        pieces = [p for p in (node.base, node.floor, node.ceiling) if p is not None]
        forms = [linear_form(p, timed=True) for p in pieces]
        bounds = [of(f[1]) for f in forms if f is not None]
        known[node.signal] = min(b[0] for b in bounds), max(b[1] for b in bounds)
    return of(form[1])


class _Nonlinear(Exception):
    """A part that is not piecewise linear."""


class _PiecewiseReader(Reader):
    """Walks one tree and makes nodes of its kinks, too."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._made: dict[tuple[object, ...], Node] = {}

    @property
    def inner(self) -> list[Inner]:
        """The nodes in their order."""
        return self.found

    @property
    def _states(self) -> set[str]:
        """Signals that are 0 or 1."""
        return {c.signal for c in self.found if isinstance(c, Comparator) and c.binary}

    def _replace(self, node: Node) -> Node:
        if node.op == "if":
            return self._choice(*node.args)
        if node.op == "mul":
            return self._factors([self.replace(arg) for arg in node.args])
        if node.op == "call" and linear_form(node, timed=True) is None:
            return self._function(str(node.value), node.args)
        new = super()._replace(node)
        if linear_form(new, timed=True) is None:
            raise _Nonlinear
        return new

    def _function(self, name: str, args: tuple[Node, ...]) -> Node:
        """Return a function with kinks or jumps."""
        if name in ("u", "buf", "inv"):
            return super()._replace(Node("call", args, name))
        values = [self.replace(arg) for arg in args]
        x = values[0]
        if name == "abs":
            return self._limited(neg(x), x, None)
        if name == "uramp":
            return self._limited(x, ZERO, None)
        if name == "u2":
            return self._limited(x, ZERO, ONE)
        if name == "sgn":
            return difference(self._above(x, ZERO), self._above(ZERO, x))
        if name in ("min", "max"):
            total = x
            for value in values[1:]:
                sides = (value, None) if name == "max" else (None, value)
                total = self._limited(total, *sides)
            return total
        if name == "limit":
            one, other = values[1:]
            low, high = self._limited(one, None, other), self._limited(one, other, None)
            if low.op == high.op == "num":
                return self._limited(x, low, high)
            # limits that move are two kinks one after the other, whose matrix is triangular
            return self._limited(self._limited(x, low, None), None, high)
        points = [float(p.value) for p in values[1:] if p.op == "num"]
        if len(points) < len(values) - 1:
            raise _Nonlinear
        if name == "pwl":
            return self._table(x, points)
        if name == "steps":
            return self._staircase(x, points)
        raise _Nonlinear

    def _limited(self, base: Node, floor: Node | None, ceiling: Node | None) -> Node:
        """Return what follows one combination between two others, a number where all are."""
        forms = [_form(base), *(None if n is None else _form(n) for n in (floor, ceiling))]
        if all(form is None or not form[1] for form in forms):
            value = forms[0][0] if forms[0] is not None else 0.0
            value = value if forms[1] is None else max(value, forms[1][0])
            return num(value if forms[2] is None else min(value, forms[2][0]))
        key = tuple(None if f is None else (f[0], frozenset(f[1].items())) for f in forms)
        found = self._made.get(key)
        if found is None:
            signal = self._new_signal()
            self.found.append(Limiter(signal, base, floor, ceiling))
            found = self._made[key] = var(signal)
        return found

    def _new_signal(self) -> str:
        if len(self.found) >= _MOST:
            raise _Nonlinear
        return super()._new_signal()

    def _above(self, left: Node, right: Node) -> Node:
        """Return a signal that is 1 where one side is larger."""
        return self._truth(Node("gt", (left, right)))

    def _table(self, x: Node, points: Sequence[float]) -> Node:
        """Return a broken line, constant beyond its ends; where it jumps the lower point counts."""
        places, values = points[::2], points[1::2]
        if len(places) == 1:
            return num(values[0])
        if any(b < a for a, b in pairwise(places)):
            raise _Nonlinear
        inside = self._limited(x, num(places[0]), num(places[-1]))
        terms, last = [num(values[0])], 0.0
        for (x0, x1), (y0, y1) in zip(pairwise(places), pairwise(values), strict=True):
            if x1 == x0:
                terms.append(mul([num(y1 - y0), self._above(x, num(x0))]))
                continue
            rise = (y1 - y0) / (x1 - x0)
            if rise != last:
                # the first point is where the line begins, at which `inside` stops; from a point
                # on, so that steep pieces are exactly zero before and leave small values alone
                beyond = difference(inside, num(x0))
                if x0 > places[0]:
                    beyond = self._limited(beyond, ZERO, None)
                terms.append(mul([num(rise - last), beyond]))
            last = rise
        return add(terms)

    def _staircase(self, x: Node, points: Sequence[float]) -> Node:
        """Return values between limits: ``limit, value, limit, value ... limit``, zero outside."""
        limits, heights = points[::2], [0.0, *points[1::2], 0.0]
        if any(b <= a for a, b in pairwise(limits)) or len(heights) != len(limits) + 1:
            raise _Nonlinear
        return add(
            mul([num(after - before), self._above(x, num(limit))])
            for limit, (before, after) in zip(limits, pairwise(heights), strict=True)
        )

    def _choice(self, condition: Node, then: Node, other: Node) -> Node:
        """Return one of two laws."""
        then, other = self.replace(then), self.replace(other)
        gap = _form(difference(then, other))
        truth = self._decided(condition)
        if isinstance(truth, Comparator):
            control = _form(truth.control)
            ratio = _ratio(gap, control)
            if ratio:  # both laws meet where the condition changes
                return self._limited(other, *((then, None) if ratio > 0.0 else (None, then)))
        elif truth.op == "num":
            return then if truth.value else other
        if set(gap[1]) <= self._states:
            terms = self._product(self._shown(truth), difference(then, other))
            if terms is not None:
                return add([other, *terms])
        return self._selected(truth, then, other)

    def _decided(self, condition: Node) -> Comparator | Node:
        """Return a comparison that is not a node yet, or a combination of nodes that is 1 or 0."""
        plain = self.compared(condition)
        if plain is not None:
            return plain
        if condition.op == "num" or self.is_condition(condition):
            return self._truth(condition)
        return self._truth(Node("ne", (condition, ZERO)))

    def _shown(self, truth: Comparator | Node) -> Node:
        """Return a combination of nodes that is 1 or 0."""
        return self._add(truth) if isinstance(truth, Comparator) else truth

    def _add(self, comparator: Comparator) -> Node:
        key = _key(comparator)
        found = self._made.get(key)
        if found is None:
            signal = self._new_signal()
            self.found.append(comparator._replace(signal=signal))
            found = self._made[key] = var(signal)
        return found

    def _selected(self, truth: Comparator | Node, then: Node, other: Node) -> Node:
        """Return a node with one of two voltages."""
        if not isinstance(truth, Comparator):
            known = {c.signal: c for c in self.found if isinstance(c, Comparator)}
            own = known.get(str(truth.value)) if truth.op == "var" else None
            half = add([truth, num(-0.5)])
            truth = Comparator("", half, False) if own is None else own._replace(written=None)
        return self._add(truth._replace(high=then, low=other))

    def _factors(self, factors: Sequence[Node]) -> Node:
        """Return a product in which no two signals meet."""
        total: Node = ONE
        for factor in factors:
            total = self._times(total, factor)
        return total

    def _times(self, one: Node, two: Node) -> Node:
        if two.op == "inv":
            divisor = _form(two.args[0])
            if divisor[1] or divisor[0] == 0.0:
                raise _Nonlinear
            return mul([one, two])
        a, b = _form(one), _form(two)
        if not (a[1] and b[1]):
            return mul([one, two])
        states = self._states
        if not set(a[1]) <= states:
            one, two, a, b = two, one, b, a
        if not set(a[1]) <= states:
            raise _Nonlinear
        if set(b[1]) <= states and (terms := self._product(one, two)) is not None:
            return add(terms)
        # each state times the signal is a node of its own
        terms = [mul([num(a[0]), two])]
        terms += [mul([num(f), self._selected(var(c), two, ZERO)]) for c, f in a[1].items()]
        return add(terms)


def _form(node: Node) -> Form:
    form = linear_form(node, timed=True)
    if form is None:
        raise _Nonlinear
    return form


def _key(comparator: Comparator) -> tuple[object, ...]:
    parts = (comparator.control, comparator.low, comparator.high)
    forms = (_form(part) for part in parts)
    return comparator.closed, *((f[0], frozenset(f[1].items())) for f in forms)


def _ratio(one: Form, other: Form) -> float:
    """Return by which factor one combination is another, 0 if it is none."""
    first = next((name for name, value in other[1].items() if value), None)
    if first is None or first not in one[1]:
        return 0.0
    factor = one[1][first] / other[1][first]
    names = set(one[1]) | set(other[1])
    same = all(one[1].get(n, 0.0) == factor * other[1].get(n, 0.0) for n in names)
    return factor if same and one[0] == factor * other[0] else 0.0
