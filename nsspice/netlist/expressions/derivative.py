"""Exact symbolic derivatives of expression trees.

At a corner or a jump (``abs``, ``u``, ``min``, ``if``) the derivative is that of the piece which
the function itself takes there; a jump contributes nothing.
"""

from __future__ import annotations

from collections.abc import Callable

from .node import (
    ONE,
    ZERO,
    Node,
    add,
    call,
    choose,
    div,
    inv,
    is_num,
    mul,
    neg,
    num,
    power,
    sub,
)

TWO = num(2.0)

#: derivative of a function of one argument
_OUTER: dict[str, Callable[[Node], Node]] = {
    "abs": lambda x: call("sgn", x),
    "acos": lambda x: neg(inv(call("sqrt", sub(ONE, mul((x, x)))))),
    "acosh": lambda x: inv(mul((call("sqrt", sub(x, ONE)), call("sqrt", add((x, ONE)))))),
    "asin": lambda x: inv(call("sqrt", sub(ONE, mul((x, x))))),
    "asinh": lambda x: inv(call("hypot", ONE, x)),
    "atan": lambda x: inv(add((ONE, mul((x, x))))),
    "atanh": lambda x: inv(sub(ONE, mul((x, x)))),
    "cos": lambda x: neg(call("sin", x)),
    "cosh": lambda x: call("sinh", x),
    "exp": lambda x: call("exp", x),
    "ln": lambda x: inv(x),
    "log10": lambda x: inv(mul((num(2.302585092994046), x))),
    "sin": lambda x: call("cos", x),
    "sinh": lambda x: call("cosh", x),
    "sqrt": lambda x: inv(mul((TWO, call("sqrt", x)))),
    "square": lambda x: mul((TWO, x)),
    "tan": lambda x: add((ONE, power(call("tan", x), TWO))),
    "tanh": lambda x: sub(ONE, power(call("tanh", x), TWO)),
    "u2": lambda x: choose(_both(_gt(x, ZERO), _gt(ONE, x)), ONE, ZERO),
    "uramp": lambda x: call("u", x),
}
#: constant between their jumps
_FLAT = {"buf", "ceil", "floor", "int", "inv", "nint", "sgn", "steps", "u"}


def _gt(left: Node, right: Node) -> Node:
    return Node("gt", (left, right))


def _both(left: Node, right: Node) -> Node:
    return Node("and", (left, right))


def derivative(node: Node, variable: str) -> Node:
    """Return the derivative of a tree with respect to one signal.

    Parameters
    ----------
    node : Node
        The expression.
    variable : str
        Canonical name such as ``v(a)``.  A difference ``v(a,b)`` is a variable of its own.
    """
    return _derive(node, variable, {})


def _derive(node: Node, variable: str, known: dict[int, Node]) -> Node:
    """Return the derivative; shared subtrees are differentiated once."""
    if node.op in ("num", "name"):
        return ZERO
    if node.op == "var":
        return ONE if node.value == variable else ZERO
    found = known.get(id(node))
    if found is None:
        found = known[id(node)] = _rule(node, variable, known)
    return found


def _rule(node: Node, variable: str, known: dict[int, Node]) -> Node:
    """Apply the rule of one operation."""
    op, args = node.op, node.args
    if op == "if":
        return choose(args[0], _derive(args[1], variable, known), _derive(args[2], variable, known))
    inner = []
    for arg in args:
        inner.append(_derive(arg, variable, known))
    if all(is_num(d, 0.0) for d in inner):
        return ZERO
    if op == "add":
        return add(inner)
    if op == "neg":
        return neg(inner[0])
    if op == "inv":
        return neg(div(inner[0], mul((args[0], args[0]))))
    if op == "mul":
        return _product(args, inner)
    if op == "pow":
        return _power(node, args, inner)
    if op == "call":
        return _call(node, args, inner)
    return ZERO  # comparisons and logic are constant between their jumps


def _product(args: tuple[Node, ...], inner: list[Node]) -> Node:
    """Sum over the factors, each replaced by its derivative once."""
    terms = []
    for index, slope in enumerate(inner):
        if not is_num(slope, 0.0):
            rest = args[:index] + args[index + 1 :]
            terms.append(mul((slope, *rest)))
    return add(terms)


def _power(node: Node, args: tuple[Node, ...], inner: list[Node]) -> Node:
    """Return d(a^b) = b a^(b-1) da + a^b ln(a) db."""
    base, exponent = args
    terms = []
    if not is_num(inner[0], 0.0):
        lowered = num(float(exponent.value) - 1.0) if exponent.op == "num" else sub(exponent, ONE)
        terms.append(mul((exponent, power(base, lowered), inner[0])))
    if not is_num(inner[1], 0.0):
        terms.append(mul((node, call("ln", base), inner[1])))
    return add(terms)


def _call(node: Node, args: tuple[Node, ...], inner: list[Node]) -> Node:
    """Apply the chain rule to a function."""
    function = str(node.value)
    if function in _FLAT:
        return ZERO
    if function in _OUTER:
        return mul((_OUTER[function](args[0]), inner[0]))
    if function in ("min", "max"):
        slope, best = inner[0], args[0]
        for arg, d in zip(args[1:], inner[1:], strict=True):
            ahead = _gt(arg, best) if function == "max" else _gt(best, arg)
            slope = choose(ahead, d, slope)
            best = call(function, best, arg)
        return slope
    if function == "limit":
        x, a, b = args
        low, high = call("min", a, b), call("max", a, b)
        d_low = _call(low, (a, b), [inner[1], inner[2]])
        d_high = _call(high, (a, b), [inner[1], inner[2]])
        return choose(_gt(low, x), d_low, choose(_gt(x, high), d_high, inner[0]))
    if function == "atan2":
        y, x = args
        top = sub(mul((x, inner[0])), mul((y, inner[1])))
        return div(top, add((mul((x, x)), mul((y, y)))))
    if function == "hypot":
        x, y = args
        return div(add((mul((x, inner[0])), mul((y, inner[1])))), node)
    if function == "pwr":
        return _signed_power(node, args, inner)
    assert function == "pwl"
    return _broken_line(args, inner)


def _signed_power(node: Node, args: tuple[Node, ...], inner: list[Node]) -> Node:
    """Return d(sgn(a)|a|^b) = b |a|^(b-1) da + sgn(a)|a|^b ln|a| db."""
    base, exponent = args
    size = call("abs", base)
    terms = []
    if not is_num(inner[0], 0.0):
        terms.append(mul((exponent, power(size, sub(exponent, ONE)), inner[0])))
    if not is_num(inner[1], 0.0):
        terms.append(mul((node, call("ln", size), inner[1])))
    return add(terms)


def _broken_line(args: tuple[Node, ...], inner: list[Node]) -> Node:
    """Return the slope of the segment; points that vary themselves carry their own slopes."""
    x, points = args[0], args[1:]
    slopes: list[Node] = []
    for k in range(0, len(points) - 3, 2):
        x0, y0, x1, y1 = points[k : k + 4]
        if all(p.op == "num" for p in (x0, y0, x1, y1)):
            run = float(x1.value) - float(x0.value)
            rise = float(y1.value) - float(y0.value)
            slopes += [x0, num(rise / run if run > 0.0 else 0.0)]
        else:
            slopes += [x0, div(sub(y1, y0), sub(x1, x0))]
    if not slopes:
        return inner[2]
    terms = []
    if not is_num(inner[0], 0.0):
        terms.append(mul((call("steps", x, *slopes, points[-2]), inner[0])))
    if any(not is_num(d, 0.0) for d in inner[1:]):
        terms.append(_moving_points(x, points, inner[1:]))
    return add(terms)


def _moving_points(x: Node, points: tuple[Node, ...], inner: list[Node]) -> Node:
    """Return the part of a table's slope that comes from its points."""
    result = inner[-1]
    for k in range(len(points) - 4, -1, -2):
        x0, y0, x1, y1 = points[k : k + 4]
        dx0, dy0, dx1, dy1 = inner[k : k + 4]
        share = div(sub(x, x0), sub(x1, x0))
        slope = div(sub(y1, y0), sub(x1, x0))
        drift = sub(
            mul((share, sub(dy1, dy0))), mul((slope, add((dx0, mul((share, sub(dx1, dx0)))))))
        )
        result = choose(_gt(x, x1), result, add((dy0, drift)))
    return choose(_gt(x, points[0]), result, inner[1])
