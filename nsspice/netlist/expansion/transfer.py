"""Rational transfer functions as state space: ``LAPLACE {input} = {H(s)}``.

With ``s = w p`` and H(p) = (b0 + ... + bn p^n)/(a0 + ... + an p^n) the states x1 ... xn of the
controllable form are voltages of capacitors 1/w:

    x1' = w x2, ..., xn' = w (u - a0 x1 - ... - a(n-1) xn)
    y = b0 x1 + ... + b(n-1) xn + bn xn'/w

with an = 1; ``w`` makes |a0| 1 as well, so that rates between 1e-6 and 1e9 1/s make no large
ratios.
Numerator and denominator are polynomials as lists, the constant first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...errors import Span
from ..deck import Element
from ..expressions.expression import Expression
from ..expressions.node import Node, add, mul, num, var
from ..findings import Unreadable

Polynomial = list[float]
#: of a denominator; rounding of the coefficients of more decides about the poles
MAX_ORDER = 16


class NoRational(Exception):
    """A function of s that is not a quotient of polynomials; the text is why."""


def rational(tree: Node, name: str = "s") -> tuple[Polynomial, Polynomial]:
    """Return numerator and denominator of an expression of a variable.

    Raises
    ------
    NoRational
        For functions of it, and for powers of it that are not whole.

    Examples
    --------
    >>> from nsspice.netlist.expressions.node import inv
    >>> rational(inv(add((num(1.0), mul((num(3.0), var("s")))))))  # 1/(1 + 3 s)
    ([1.0], [1.0, 3.0])
    """
    op, args = tree.op, tree.args
    if op == "num":
        return [float(tree.value)], [1.0]
    if op in ("var", "name"):
        if tree.value == name:
            return [0.0, 1.0], [1.0]
        raise NoRational(f"{tree.value} is not a constant")
    if op == "add":
        top, bottom = rational(args[0], name)
        for arg in args[1:]:
            more, below = rational(arg, name)
            if below == bottom:
                top = _sum(top, more)
            else:
                top, bottom = (
                    _sum(_product(top, below), _product(more, bottom)),
                    _product(bottom, below),
                )
        return top, bottom
    if op == "mul":
        top, bottom = [1.0], [1.0]
        for arg in args:
            more, below = rational(arg, name)
            top, bottom = _product(top, more), _product(bottom, below)
        return top, bottom
    if op == "neg":
        top, bottom = rational(args[0], name)
        return [-c for c in top], bottom
    if op == "inv":
        top, bottom = rational(args[0], name)
        return bottom, top
    if op == "pow" and args[1].op == "num" and float(args[1].value).is_integer():
        exponent = int(float(args[1].value))
        if abs(exponent) > MAX_ORDER:
            raise NoRational(f"a power of {exponent} is higher than {MAX_ORDER}")
        base = rational(args[0], name)
        top, bottom = base if exponent >= 0 else base[::-1]
        result: tuple[Polynomial, Polynomial] = [1.0], [1.0]
        for _ in range(abs(exponent)):
            result = _product(result[0], top), _product(result[1], bottom)
        return result
    called = str(tree.value).lstrip("?") if op == "call" else op
    raise NoRational(f"{called} of {name} is not a quotient of polynomials")


def _sum(a: Polynomial, b: Polynomial) -> Polynomial:
    longer, shorter = (a, b) if len(a) >= len(b) else (b, a)
    return [c + (shorter[k] if k < len(shorter) else 0.0) for k, c in enumerate(longer)]


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    result = [0.0] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for k, y in enumerate(b):
            result[i + k] += x * y
    return result


def _trimmed(p: Polynomial) -> Polynomial:
    while len(p) > 1 and p[-1] == 0.0:
        p = p[:-1]
    return p


def taken_apart(
    element: Element, drive: Node, top: Sequence[float], bottom: Sequence[float], span: Span
) -> list[Element]:
    """Return the elements of a transfer function, the one with its name first.

    Parameters
    ----------
    element : Element
        E or G without a value: its output.
    drive : Node
        Its input.
    top, bottom : sequence of float
        Numerator and denominator, the constant first.
    span : Span
        Place of the function.

    Raises
    ------
    Unreadable
        If it is improper, of too high an order, or has no denominator.
    """
    b, a = _trimmed(list(top)), _trimmed(list(bottom))
    while len(a) > 1 and a[0] == 0.0 and b[0] == 0.0 and len(b) > 1:  # a common factor s
        a, b = a[1:], b[1:]
    order = len(a) - 1
    if not all(map(math.isfinite, (*a, *b))) or a[-1] == 0.0:
        message = f"{element.name}: the transfer function has no finite values"
        raise Unreadable("NS1024", message, span)
    if len(b) > len(a):
        message = f"{element.name}: the numerator of H(s) has a higher power than its denominator"
        hint = "add a pole far above all frequencies of interest: 1/(1 + s/w)"
        raise Unreadable("NS1025", message, span, hint)
    if order > MAX_ORDER:
        message = f"{element.name}: a denominator of order {order} is higher than {MAX_ORDER}"
        raise Unreadable("NS1023", message, span, "write it as a chain of two sources")
    rate = _rate(a)
    unit = a[-1] * rate**order  # common factors of both are of no meaning
    a = [c * rate**k / unit for k, c in enumerate(a)]
    b = [c * rate**k / unit for k, c in enumerate(b)] + [0.0] * (len(a) - len(b))
    states = [f"{element.name}#x{k + 1}" for k in range(order)]
    last = b[-1]
    rows = [(b[k] - last * a[k], states[k]) for k in range(order)]
    output = _combination(rows, last, drive)
    quantity = "v" if element.letter == "e" else "i"
    made = [_with(element, element.name, element.letter, element.nodes, output, quantity)]
    for k, state in enumerate(states):
        if k + 1 < order:
            flow = var(f"v({states[k + 1]})")
        else:
            rows = [(-a[i], states[i]) for i in range(order)]
            flow = _combination(rows, 1.0, drive)
        name = f"{element.name}.x{k + 1}"
        made.append(_with(element, f"{name}.c", "c", (state, "0"), 1.0 / rate, ""))
        made.append(_with(element, f"{name}.b", "b", ("0", state), flow, "i"))
    return made


def sampled_coefficients(
    name: str, top: Sequence[float], bottom: Sequence[float], span: Span
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the coefficients of a function of z from its highest power, the denominator's is 1.

    Raises
    ------
    Unreadable
        If it looks ahead, is of too high an order, or has no denominator.
    """
    b, a = _trimmed(list(top)), _trimmed(list(bottom))
    while len(a) > 1 and a[0] == 0.0 and b[0] == 0.0 and len(b) > 1:  # a common factor z
        a, b = a[1:], b[1:]
    if not all(map(math.isfinite, (*a, *b))) or a[-1] == 0.0:
        raise Unreadable("NS1024", f"{name}: the transfer function has no finite values", span)
    if len(b) > len(a):
        message = f"{name}: the numerator of H(z) has a higher power than its denominator"
        raise Unreadable("NS1025", message, span, "it would look ahead: divide by a power of z")
    if len(a) - 1 > MAX_ORDER:
        message = f"{name}: a denominator of order {len(a) - 1} is higher than {MAX_ORDER}"
        raise Unreadable("NS1023", message, span, "write it as a chain of two sources")
    b += [0.0] * (len(a) - len(b))
    return tuple(c / a[-1] for c in reversed(b)), tuple(c / a[-1] for c in reversed(a))


def _rate(a: Polynomial) -> float:
    """Return the unit of rates [1/s]: the first and the last coefficient become equal."""
    first = next(k for k, c in enumerate(a) if c != 0.0)
    span = len(a) - 1 - first
    return abs(a[first] / a[-1]) ** (1.0 / span) if span else 1.0


def _combination(rows: Sequence[tuple[float, str]], gain: float, drive: Node) -> Node:
    """Return a sum of states and of the input."""
    terms = [mul((num(c), var(f"v({state})"))) for c, state in rows if c != 0.0]
    if gain != 0.0:
        terms.append(mul((num(gain), drive)))
    return add(terms) if terms else num(0.0)


def _with(
    element: Element,
    name: str,
    letter: str,
    nodes: tuple[str, ...],
    law: Node | float,
    quantity: str,
) -> Element:
    """Return a part of an element."""
    value = Expression(law, element.span) if isinstance(law, Node) else law
    spans = (element.span,) * len(nodes)
    return Element(
        name, letter, nodes, element.span, value=value, quantity=quantity, node_spans=spans
    )
