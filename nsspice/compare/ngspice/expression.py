"""Expressions as ngspice's B sources read them."""

from __future__ import annotations

import math
from collections.abc import Callable

from ...errors import Diagnostic, UsageError
from ...netlist.expressions.node import Node

#: functions of the same name and meaning
_SAME = frozenset(
    [
        *("abs", "acos", "acosh", "asin", "asinh", "atan", "atanh", "ceil", "cos", "cosh"),
        *("exp", "floor", "ln", "log10", "nint", "sgn", "sin", "sinh", "sqrt", "tan", "tanh"),
        *("u", "u2", "uramp"),
    ]
)
_INFIX = {
    "add": "+",
    "mul": "*",
    "lt": "<",
    "le": "<=",
    "gt": ">",
    "ge": ">=",
    "eq": "==",
    "ne": "!=",
    "and": "&&",
    "or": "||",
}


def spice_expression(node: Node, signal: Callable[[str], str]) -> str:
    """Return an expression in ngspice's spelling.

    Parameters
    ----------
    node : Node
    signal : callable
        From a canonical name, ``v(a)``, ``v(a,b)``, ``i(v1)``, ``time``, ``temper`` or ``i``, to
        what ngspice calls it.

    Raises
    ------
    UsageError
        NS4014 for a function that ngspice has not.

    Examples
    --------
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> tree = Expression.parse("2*v(a)**3 - hypot(v(b), 1)").node
    >>> spice_expression(tree, str)
    '((2.0*pwr(v(a),3.0))-((sqrt((v(b))*(v(b))+(1.0)*(1.0)))))'
    """

    def text(item: Node) -> str:
        op = item.op
        if op == "num":
            return _number(float(item.value))
        if op in ("var", "name"):
            return signal(str(item.value))
        if op == "add":
            return "(" + _joined(item, text, "neg", "+", "-") + ")"
        if op == "mul":
            return "(" + _joined(item, text, "inv", "*", "/") + ")"
        args = [text(arg) for arg in item.args]
        if op == "neg":
            return f"(-({args[0]}))"
        if op == "inv":
            return f"(1/({args[0]}))"
        if op == "pow":
            return _power(item, args)
        if op == "not":
            return f"(({args[0]}) == 0 ? 1 : 0)"
        if op == "if":
            return f"(({args[0]}) != 0 ? ({args[1]}) : ({args[2]}))"
        if op in _INFIX:
            sign = f" {_INFIX[op]} "
            if op in ("and", "or"):
                args = [f"(({arg}) != 0)" for arg in args]
            return f"(({sign.join(args)}) ? 1 : 0)"
        return _call(item, args)

    return text(node)


def _number(value: float) -> str:
    if not math.isfinite(value):
        raise UsageError(
            Diagnostic("NS4014", f"ngspice has no number for {value:g} in an expression")
        )
    return repr(value) if value >= 0.0 else f"({value!r})"


def _joined(item: Node, text: Callable[[Node], str], inverse: str, sign: str, other: str) -> str:
    """Return a sum or a product with true differences or quotients."""
    out = text(item.args[0])
    for arg in item.args[1:]:
        out += f"{other}({text(arg.args[0])})" if arg.op == inverse else sign + text(arg)
    return out


def _power(item: Node, args: list[str]) -> str:
    """Return a power of real numbers; ngspice's own takes the magnitude of the base."""
    exponent = item.args[1]
    if exponent.op == "num" and float(exponent.value) % 2.0 == 1.0:
        return f"pwr({args[0]},{args[1]})"
    return f"pow({args[0]},{args[1]})"


def _call(item: Node, args: list[str]) -> str:
    """Return a function call, built from others where ngspice lacks it."""
    name, x = str(item.value), args[0]
    if name in _SAME:
        return f"{name}({x})"
    if name in ("pow", "pwr"):
        return _power(item, args) if name == "pow" else f"pwr({x},{args[1]})"
    if name in ("min", "max"):
        out = x
        for arg in args[1:]:
            out = f"{name}({out},{arg})"
        return out
    if name == "limit":
        low, high = f"min({args[1]},{args[2]})", f"max({args[1]},{args[2]})"
        return f"min(max({x},{low}),{high})"
    if name == "square":
        return f"(({x})*({x}))"
    if name == "hypot":
        return f"(sqrt(({x})*({x})+({args[1]})*({args[1]})))"
    if name == "int":
        return f"(sgn({x})*floor(abs({x})))"
    if name == "pwl":
        points = [float(arg.value) for arg in item.args[1:] if arg.op == "num"]
        if len(points) == len(args) - 1 and all(
            a < b for a, b in zip(points[::2], points[2::2], strict=False)
        ):
            # beyond the ends ngspice continues with the last slope
            inside = f"min(max({x},{_number(points[0])}),{_number(points[-2])})"
            return f"pwl({inside},{','.join(repr(p) for p in points)})"
    raise UsageError(
        Diagnostic(
            "NS4014",
            f"ngspice has no function {name} in the form used here",
            hint="compare a deck without it, or use a reference CSV file",
        )
    )
