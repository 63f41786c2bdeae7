"""The charge of a capacitance that depends on its own voltage: integrals of expression trees.

Known are sums and multiples of powers, exponentials, circular and hyperbolic functions, ``ln`` and
tables, each of a linear function of the variable, and products of polynomials.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

from ...netlist.expressions.node import ONE, Node, add, call, div, mul, neg, num, power, sub
from ..behaviour import linear_form

#: largest degree of a product of polynomials
_DEGREE = 20
_Polynomial = list[float]

#: integral of a function of x
_INTEGRALS: dict[str, Callable[[Node], Node]] = {
    "exp": lambda x: call("exp", x),
    "sin": lambda x: neg(call("cos", x)),
    "cos": lambda x: call("sin", x),
    "sinh": lambda x: call("cosh", x),
    "cosh": lambda x: call("sinh", x),
    # ln cosh x, without overflow
    "tanh": lambda x: add(
        (call("abs", x), call("ln", add((ONE, call("exp", mul((num(-2.0), call("abs", x))))))))
    ),
    "atan": lambda x: sub(
        mul((x, call("atan", x))), mul((num(0.5), call("ln", add((ONE, mul((x, x)))))))
    ),
    "ln": lambda x: sub(mul((x, call("ln", x))), x),
    "sqrt": lambda x: _power(x, 0.5),
    "abs": lambda x: mul((num(0.5), x, call("abs", x))),
    "u": lambda x: call("uramp", x),
    "uramp": lambda x: mul((num(0.5), call("square", call("uramp", x)))),
}


def antiderivative(node: Node, variable: Node) -> Node | None:
    """Return a tree whose derivative is the given one, None if it is not known.

    Parameters
    ----------
    node : Node
        Reads one signal, or none.
    variable : Node
        That signal.

    Examples
    --------
    >>> from nsspice.netlist.expressions.node import show, var
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> show(antiderivative(Expression.parse("exp(2*v(a))").node, var("v(a)")))
    'exp(v(a)*2)*0.5'
    """
    op, args = node.op, node.args
    if op == "add":
        parts = [antiderivative(arg, variable) for arg in args]
        return None if None in parts else add([part for part in parts if part is not None])
    if op == "neg":
        inner = antiderivative(args[0], variable)
        return None if inner is None else neg(inner)
    if op == "if":
        return _choice(node, variable)
    polynomial = _polynomial(node)
    if polynomial is not None:
        return add(
            mul((num(c / k), _raised(variable, k))) for k, c in enumerate(polynomial, start=1)
        )
    if op == "mul":
        varying = [arg for arg in args if not _constant(arg)]
        inner = antiderivative(varying[0], variable) if len(varying) == 1 else None
        factors = [arg for arg in args if _constant(arg)]
        return None if inner is None else mul([*factors, inner])
    return _of_linear(node, variable)


def _choice(node: Node, variable: Node) -> Node | None:
    """Return the integral of a choice at a threshold c of the variable.

    It is the integral on the side on which x = 0 lies, and beyond the threshold that of the
    difference, of the distance from it: nothing cancels near zero.
    """
    condition, then, other = node.args
    if condition.op not in ("gt", "ge", "lt", "le"):
        return None
    form = linear_form(sub(*condition.args))
    if form is None or len(form[1]) != 1:
        return None
    (factor,) = form[1].values()
    if factor == 0.0:
        return None
    threshold = -form[0] / factor
    rising = (condition.op in ("gt", "ge")) == (factor > 0.0)
    above, below = (then, other) if rising else (other, then)
    near, far, sign = (below, above, 1.0) if threshold >= 0.0 else (above, below, -1.0)
    inner, jump = antiderivative(near, variable), linear_form(sub(far, near))
    if inner is None or jump is None or len(jump[1]) > 1:
        return None
    rate = next(iter(jump[1].values()), 0.0)
    beyond = call("uramp", mul((num(sign), sub(variable, num(threshold)))))
    first = mul((num(sign * (jump[0] + rate * threshold)), beyond))
    return add((inner, first, mul((num(0.5 * rate), call("square", beyond)))))


def _of_linear(node: Node, variable: Node) -> Node | None:
    """Return the integral of a power or a function of a linear argument."""
    exponent, base, function = 1.0, node, ""
    while base.op in ("inv", "pow") and (base.op == "inv" or base.args[1].op == "num"):
        exponent *= -1.0 if base.op == "inv" else float(base.args[1].value)
        base = base.args[0]
    if base.op == "call" and base.value == "sqrt" and exponent != 1.0:
        exponent, base = exponent / 2.0, base.args[0]
    if base.op == "call":
        if exponent != 1.0:
            return None
        function, inner = str(base.value), base.args[0]
    else:
        inner = base
    form = linear_form(inner)
    if form is None or len(form[1]) != 1:
        return None
    argument = add((mul((variable, num(next(iter(form[1].values()))))), num(form[0])))
    slope = num(1.0 / next(iter(form[1].values())))
    if not function:
        return mul((_power(argument, exponent), slope))
    if function == "pwl":
        table = _table(mul((variable, num(next(iter(form[1].values()))))), form[0], base.args[1:])
        return None if table is None else mul((table, slope))
    return mul((_INTEGRALS[function](argument), slope)) if function in _INTEGRALS else None


def _power(x: Node, exponent: float) -> Node:
    """Return the integral of a power of x."""
    if exponent == -1.0:
        return call("ln", call("abs", x))
    return div(power(x, num(exponent + 1.0)), num(exponent + 1.0))


def _table(x: Node, shift: float, points: tuple[Node, ...]) -> Node | None:
    """Return the integral of a table of ``x + shift``, zero at x = 0 without cancellation there.

    That is half of each change of slope times a squared ramp away from x = 0.
    """
    if any(p.op != "num" for p in points):
        return None
    at, values = ([float(p.value) for p in points[k::2]] for k in (0, 1))
    slopes = [0.0]
    for (x0, x1), (y0, y1) in zip(pairwise(at), pairwise(values), strict=True):
        if x1 == x0:
            return None
        slopes.append((y1 - y0) / (x1 - x0))
    slopes.append(0.0)
    here = next((k for k, place in enumerate(at) if place > shift), len(at))
    nearest = max(here - 1, 0)
    start = values[nearest] + slopes[here] * (shift - at[nearest])
    terms = [mul((num(start), x)), mul((num(0.5 * slopes[here]), call("square", x)))]
    for place, (before, after) in zip(at, pairwise(slopes), strict=True):
        away = 1.0 if place > shift else -1.0
        ramp = call("uramp", mul((num(away), sub(x, num(place - shift)))))
        terms.append(mul((num(0.5 * away * (after - before)), call("square", ramp))))
    return add(terms)


def _raised(variable: Node, exponent: int) -> Node:
    return variable if exponent == 1 else mul([variable] * exponent)


def _constant(node: Node) -> bool:
    form = linear_form(node)
    return form is not None and not form[1]


def _polynomial(node: Node) -> _Polynomial | None:
    """Return the coefficients of a polynomial of the one signal, None if it is not a polynomial."""
    form = linear_form(node)
    if form is not None:
        return [form[0], *form[1].values()]
    if node.op == "add":
        parts = [_polynomial(arg) for arg in node.args]
        total: _Polynomial = []
        for part in parts:
            if part is None:
                return None
            size = max(len(total), len(part))
            total = [
                (total[k] if k < len(total) else 0.0) + (part[k] if k < len(part) else 0.0)
                for k in range(size)
            ]
        return total
    if node.op == "neg":
        inner = _polynomial(node.args[0])
        return None if inner is None else [-c for c in inner]
    factors: list[Node] = []
    if node.op == "mul":
        factors = list(node.args)
    elif node.op == "call" and node.value == "square":
        factors = [node.args[0]] * 2
    elif node.op == "pow" and node.args[1].op == "num":
        exponent = float(node.args[1].value)
        if exponent in range(1, _DEGREE + 1):
            factors = [node.args[0]] * int(exponent)
    return _product(factors)


def _product(factors: list[Node]) -> _Polynomial | None:
    """Return the coefficients of a product of polynomials."""
    if not factors:
        return None
    total = [1.0]
    for factor in factors:
        part = _polynomial(factor)
        if part is None or len(total) + len(part) > _DEGREE + 2:
            return None
        longer = [0.0] * (len(total) + len(part) - 1)
        for i, a in enumerate(total):
            for j, b in enumerate(part):
                longer[i + j] += a * b
        total = longer
    return total if all(map(math.isfinite, total)) else None
