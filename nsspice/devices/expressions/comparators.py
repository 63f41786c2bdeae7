r"""Comparisons of signals in expressions, as switches: where a law jumps, the instant is an event.

``if(v(ref) > v(saw), 5, 0)`` is not a smooth function, and a solver that meets it as a number finds
the jump only by accident.  Here a comparison whose truth is all that counts becomes a *comparator*:
an ideal switch between 1 V and a node with a resistor to ground, closed while it is true,

.. math::

    c = 1 \text{ V if closed, } 0 \text{ if open}, \qquad
    \texttt{if}(a > b,\, x,\, y) = y + (x - y)\, c \quad (x, y \text{ constant}),

so that its instants are located like those of any switch, and exactly where all else is linear.
What follows from several comparisons (``&&``, ``||``) is one more comparator, of their sum.

Where the two sides stay equal, a comparison has the value that is written: ``v(g) > 0`` is false at
0 V, ``v(g) >= 0`` is true, and with both of them ``==`` and ``u`` (one half at 0) have theirs.

A choice between laws, ``if(v(a) > 0, v(a), 0)``, stays what it is here: ``piecewise`` reads it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import ONE, ZERO, Node, TooLarge, add, mul, neg, num, var
from ...netlist.text.numbers import as_float
from ..behaviour import linear_form

#: comparisons by what they are true of: the sign of ``left - right``, and truth at equality
_COMPARED = {"gt": (1.0, False), "ge": (1.0, True), "lt": (-1.0, False), "le": (-1.0, True)}
#: steps by where they jump, and whether down
_STEPS = {"buf": (0.5, False), "inv": (0.5, True)}
#: most comparators for one product of others: nested choices would double them with each level
_MOST = 8


class Comparator(NamedTuple):
    """A switch that an expression asks for.

    Parameters
    ----------
    signal : str
        ``v(node)``: 1 while the control is positive, else 0, if nothing else is said.
    control : Node
        Of the signals of the deck and of comparators before this one.
    closed : bool
        Whether it is closed where the control stays at zero.
    written : Node or None
        The comparison of the deck that it stands for; None for what follows from several.
    low, high : Node
        What the signal is otherwise, and what it is while the control is positive.
    """

    signal: str
    control: Node
    closed: bool
    written: Node | None = None
    low: Node = ZERO
    high: Node = ONE

    @property
    def binary(self) -> bool:
        """Whether the signal is 0 or 1."""
        return self.low is ZERO and self.high is ONE


def split(node: Node, name: str) -> tuple[Node, list[Comparator]]:
    """Return an expression without its comparisons, and the comparators that it reads instead.

    Parameters
    ----------
    node : Node
    name : str
        Of the element; its comparators are the nodes ``name#1``, ``name#2`` ...

    Examples
    --------
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> from nsspice.netlist.expressions.node import show
    >>> pwm = Expression.parse("if(v(ref) > v(saw), 12, -12)")
    >>> tree, (comparator,) = split(pwm.node, "b1")
    >>> show(tree), comparator.signal, show(comparator.control)
    ('-12 + 24*v(b1#1)', 'v(b1#1)', 'v(ref) - v(saw)')
    >>> show(split(Expression.parse("v(a)*(v(b) > 1)").node, "b1")[0])
    'v(a)*v(b1#1)'
    >>> split(Expression.parse("if(v(a) > 0, v(a), 0)").node, "b1")[1]
    []
    """
    if not Expression(node).jumps():
        return node, []
    reader = Reader(name)
    try:
        return reader.replace(node), [c for c in reader.found if isinstance(c, Comparator)]
    except TooLarge:
        return node, []  # deep already: evaluated as it is


class Reader:
    """Walks one tree and collects its comparators."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.found: list[Any] = []
        self._known: dict[int, tuple[Node, Node]] = {}
        self._truths: dict[int, tuple[Node, Node]] = {}
        self._pairs: dict[frozenset[str], str] = {}

    def replace(self, node: Node) -> Node:
        """Return a tree with its jumping parts replaced."""
        return _once(self._known, node, self._replace)

    def _replace(self, node: Node) -> Node:
        if not _reads(node):
            return node
        if _is_condition(node, plain=False):
            return self._step(node) if node.value == "u" else self._truth(node)
        if node.op == "if":
            condition, *chosen = node.args
            then, other = map(self.replace, chosen)
            steady = all(_steady(branch, self.name) for branch in (then, other))
            if not steady or not _is_condition(condition, plain=True):
                return Node("if", (condition, then, other))
            truth = self._truth(condition)
            terms = self._product(truth, difference(then, other))
            if terms is not None:
                return add([other, *terms])
            # no longer linear, but constant between events all the same
            return add([mul([truth, then]), mul([difference(ONE, truth), other])])
        args = tuple(map(self.replace, node.args))
        if all(new is old for new, old in zip(args, node.args, strict=True)):
            return node
        if node.op == "add":
            return add(args)
        if node.op == "mul":
            return mul(args)
        return Node(node.op, args, node.value)

    def _truth(self, node: Node) -> Node:
        """Return a tree that is 1 where a condition is true and 0 where it is false."""
        return _once(self._truths, node, self._new_truth)

    def _new_truth(self, node: Node) -> Node:
        op, args = node.op, node.args
        if op == "num":
            return num(float(node.value != 0.0))
        if (compared := self.compared(node)) is not None:
            return self._switch(compared.control, compared.closed, node)
        if op in ("eq", "ne"):
            # at least one of both is true
            both = [self._truth(Node(one, args)) for one in ("le", "ge")]
            return add([*both, num(-1.0)] if op == "eq" else [num(2.0), *map(neg, both)])
        if op == "not":
            return difference(ONE, self._truth(args[0]))
        if op in ("and", "or"):
            least = len(args) - 0.5 if op == "and" else 0.5
            return self._switch(add([*map(self._truth, args), num(-least)]), False)
        if node.value == "u":
            return self._truth(Node("ge", (args[0], num(0.0))))  # what is not zero is true
        limit, falls = _STEPS[str(node.value)]
        truth = self._truth(Node("gt", (args[0], num(limit))))
        return difference(ONE, truth) if falls else truth

    def compared(self, node: Node) -> Comparator | None:
        """Return the comparator of a comparison, which has no node yet."""
        if node.op not in _COMPARED:
            return None
        sign, closed = _COMPARED[node.op]
        left, right = map(self.replace, node.args)
        control = difference(left, right) if sign > 0.0 else difference(right, left)
        return Comparator("", control, closed, node)

    def is_condition(self, node: Node) -> bool:
        """Return whether a tree is nothing but truth."""
        return _is_condition(node, plain=False)

    def _step(self, node: Node) -> Node:
        """Return the unit step, which is one half at zero."""
        sides = (self._truth(Node(op, (node.args[0], num(0.0)))) for op in ("gt", "ge"))
        return mul([num(0.5), add(list(sides))])

    def _product(self, one: Node, two: Node) -> list[Node] | None:
        """Return the terms of a product of what is 0 or 1; None if they are many."""
        first, second = linear_form(one), linear_form(two)
        if first is None or second is None or len(first[1]) * len(second[1]) > _MOST:
            return None
        total = {"": first[0] * second[0]}
        for constant, (_, factors) in ((first[0], second), (second[0], first)):
            for name, factor in factors.items():
                total[name] = total.get(name, 0.0) + constant * factor
        for a, f in first[1].items():
            for b, g in second[1].items():
                both = a if a == b else self._both(a, b)
                total[both] = total.get(both, 0.0) + f * g
        return [mul([num(f), var(name)]) if name else num(f) for name, f in total.items() if f]

    def _both(self, a: str, b: str) -> str:
        """Return the signal that is 1 where two are."""
        known = self._pairs.get(frozenset((a, b)))
        if known is None:
            node = self._switch(add([var(a), var(b), num(-1.5)]), False)
            known = self._pairs[frozenset((a, b))] = str(node.value)
        return known

    def _switch(self, control: Node, closed: bool, written: Node | None = None) -> Node:
        """Return the signal of a new comparator."""
        signal = self._new_signal()
        self.found.append(Comparator(signal, control, closed, written))
        return var(signal)

    def _new_signal(self) -> str:
        return f"v({self.name}#{len(self.found) + 1})"


def _once(known: dict[int, tuple[Node, Node]], node: Node, make: Callable[[Node], Node]) -> Node:
    """Return what is made of a node, which shared ones stand for once."""
    found = known.get(id(node))
    if found is None:
        found = known[id(node)] = (node, make(node))  # the node lives on, and with it its number
    return found[1]


def _is_condition(node: Node, plain: bool) -> bool:
    """Return whether a tree is nothing but truth: comparisons and what follows from them.

    ``plain``: numbers are conditions, too, true if not zero.
    """
    if node.op in ("and", "or", "not"):
        return all(_is_condition(arg, plain=True) for arg in node.args)
    if node.op == "call":
        return node.value in _STEPS or node.value == "u"
    return node.op in (*_COMPARED, "eq", "ne") or (plain and node.op == "num")


def difference(left: Node, right: Node) -> Node:
    """Return ``left - right``, a number if both are numbers."""
    if left.op == right.op == "num":
        return num(as_float(left.value) - as_float(right.value))
    return add([left, neg(right)])


def _reads(node: Node) -> bool:
    """Return whether a tree holds a signal."""
    return node.op == "var" or any(map(_reads, node.args))


def _steady(node: Node, name: str) -> bool:
    """Return whether a tree reads nothing but comparators of the element."""
    if node.op == "var":
        return str(node.value).startswith(f"v({name}#")
    return all(_steady(arg, name) for arg in node.args)
