"""Expression trees: one kind of node, made only through functions that fold and bound them.

Sums and products are n-ary, so that a long ``a+b+c+...`` is one node and not a deep chain; a
difference is a sum with ``neg`` terms, a quotient a product with ``inv`` factors (evaluated as true
subtraction and division).  Depth and size are known for every node and bounded, which bounds the
recursion of everything that walks a tree.

======== =========================== ==================================================
op       args                        meaning
======== =========================== ==================================================
num      --                          the number ``value``
name     --                          an identifier not looked up yet
var      --                          a signal: ``v(a)``, ``i(v1)``, ``time``, ``temper``, ``i``
add mul  two or more                 sum, product from left to right
neg inv  one                         ``-a``, ``1/a``
pow      base, exponent              power of real numbers
lt le gt ge eq ne                    comparisons, 1.0 or 0.0
and or   two or more                 logic; not zero is true
not      one                         logic
if       condition, then, else       only the chosen branch counts
call     arguments                   function ``value`` of ``functions.py``
======== =========================== ==================================================
"""

from __future__ import annotations

from collections.abc import Iterable

from ..text.numbers import Traced, as_float, format_number

#: parts of complex signals: decibels, magnitude, phase, real and imaginary part
COMPLEX_FORMS = frozenset(kind + part for kind in "vi" for part in ("db", "m", "p", "r", "i"))
#: deeper trees are refused when read
MAX_DEPTH = 100
#: derivatives are deeper than what they are made of; walking a tree takes two frames a level
MAX_DERIVED_DEPTH = 250
#: an expression with more nodes is a mistake or an attack (functions that call functions)
MAX_SIZE = 200_000


class TooLarge(Exception):
    """An expression beyond MAX_DEPTH or MAX_SIZE."""


class Node:
    """One node of an expression tree; immutable and shared freely."""

    __slots__ = ("args", "depth", "op", "size", "value")

    def __init__(self, op: str, args: tuple[Node, ...] = (), value: float | str = 0.0) -> None:
        self.op = op
        self.args = args
        self.value = value
        depth: int = 0
        size: int = 1
        for arg in args:
            size += arg.size
            if arg.depth > depth:
                depth = arg.depth
        self.depth: int = depth + 1
        self.size: int = size
        if size > MAX_SIZE or depth >= MAX_DERIVED_DEPTH:
            raise TooLarge

    def __repr__(self) -> str:
        return f"Node({show(self)!r})"


ZERO = Node("num", (), 0.0)
ONE = Node("num", (), 1.0)


def num(value: float) -> Node:
    """Return a constant."""
    return Node("num", (), as_float(value))


def name(identifier: str) -> Node:
    """Return an identifier that the scope still has to explain."""
    return Node("name", (), identifier)


def var(identifier: str) -> Node:
    """Return a signal by its canonical name."""
    return Node("var", (), identifier)


def is_num(node: Node, value: float) -> bool:
    """Return whether a node is this constant."""
    return node.op == "num" and not isinstance(node.value, Traced) and node.value == value


def add(terms: Iterable[Node]) -> Node:
    """Return a sum: nested first sums are joined, zeros are left out."""
    flat: list[Node] = []
    for term in terms:
        if term.op == "add" and not flat:
            flat.extend(term.args)
        elif not is_num(term, 0.0):
            flat.append(term)
    if not flat:
        return ZERO
    return flat[0] if len(flat) == 1 else Node("add", tuple(flat))


def mul(factors: Iterable[Node]) -> Node:
    """Return a product: nested first products are joined, ones left out, a zero is zero."""
    flat: list[Node] = []
    for factor in factors:
        if factor.op == "mul" and not flat:
            flat.extend(factor.args)
        elif is_num(factor, 0.0):
            return ZERO
        elif not is_num(factor, 1.0):
            flat.append(factor)
    if not flat:
        return ONE
    return flat[0] if len(flat) == 1 else Node("mul", tuple(flat))


def neg(node: Node) -> Node:
    """Return the negative."""
    if node.op == "num":
        assert isinstance(node.value, float)
        return num(-node.value)
    return node.args[0] if node.op == "neg" else Node("neg", (node,))


def inv(node: Node) -> Node:
    """Return the reciprocal."""
    return Node("inv", (node,))


def sub(left: Node, right: Node) -> Node:
    """Return a difference."""
    return add((left, neg(right)))


def div(left: Node, right: Node) -> Node:
    """Return a quotient."""
    if is_num(left, 0.0) and not is_num(right, 0.0):
        return ZERO
    return left if is_num(right, 1.0) else Node("mul", (left, inv(right)))


def power(base: Node, exponent: Node) -> Node:
    """Return a power."""
    if is_num(exponent, 1.0):
        return base
    return ONE if is_num(exponent, 0.0) else Node("pow", (base, exponent))


def call(function: str, *args: Node) -> Node:
    """Return a function call; the caller has checked the number of arguments."""
    return Node("call", args, function)


def choose(condition: Node, then: Node, other: Node) -> Node:
    """Return a conditional; equal constant branches need no condition."""
    if then.op == "num" and is_num(other, as_float(then.value)):
        return then
    if condition.op == "num":
        return then if condition.value != 0.0 else other
    return Node("if", (condition, then, other))


_INFIX = {
    "add": (" + ", 5),
    "mul": ("*", 6),
    "pow": ("**", 8),
    "lt": (" < ", 4),
    "le": (" <= ", 4),
    "gt": (" > ", 4),
    "ge": (" >= ", 4),
    "eq": (" == ", 3),
    "ne": (" != ", 3),
    "and": (" && ", 2),
    "or": (" || ", 1),
}


def show(node: Node) -> str:
    """Return a tree as text that parses back to the same values."""
    return _show(node)[0]


def _show(node: Node) -> tuple[str, int]:
    """Return text and precedence (0 ternary ... 9 atom)."""
    op = node.op
    if op == "num":
        assert isinstance(node.value, float)
        text = format_number(node.value)
        return (text, 9) if node.value >= 0 and text[0] != "-" else (text, 7)
    if op in ("name", "var"):
        return str(node.value), 9
    if op == "call":
        words = []
        for arg in node.args:
            words.append(_show(arg)[0])
        return f"{node.value}({', '.join(words)})", 9
    if op == "if":
        condition, then = _within(node.args[0], 1), _within(node.args[1], 1)
        return f"{condition} ? {then} : {_within(node.args[2], 1)}", 0
    if op == "neg":
        return f"-{_within(node.args[0], 7)}", 7
    if op == "inv":
        return f"1/{_within(node.args[0], 7)}", 6
    if op == "not":
        return f"!{_within(node.args[0], 7)}", 7
    sign, rank = _INFIX[op]
    text = _within(node.args[0], rank + 1 if op == "pow" or rank in (3, 4) else rank)
    for arg in node.args[1:]:
        if op == "add" and arg.op == "neg":
            text += f" - {_within(arg.args[0], 6)}"
        elif op == "add" and arg.op == "num" and as_float(arg.value) < 0.0:
            text += f" - {format_number(-as_float(arg.value))}"
        elif op == "mul" and arg.op == "inv":
            text += f"/{_within(arg.args[0], 7)}"
        else:
            text += sign + _within(arg, 8 if op == "pow" else rank + 1)
    return text, rank


def _within(node: Node, rank: int) -> str:
    text, own = _show(node)
    return f"({text})" if own < rank else text
