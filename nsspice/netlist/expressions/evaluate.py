"""Values of expression trees, on floats and elementwise on numpy arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ..text.numbers import Traced, as_float
from .function_values import SCALAR, array_functions, divide, real_power
from .node import Node, num

_COMPARE: dict[str, Callable[[float, float], bool]] = {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
}


def scalar(node: Node, values: Mapping[str, float]) -> float:
    """Return the value of a tree for float signals.

    Only the chosen branch of a conditional is looked at; ``&&`` and ``||`` stop as soon as the
    result is known.

    Raises
    ------
    KeyError
        If a signal has no value.
    """
    op = node.op
    if op == "num":
        return node.value  # type: ignore[return-value]
    if op == "var" or op == "name":
        return as_float(values[node.value])  # type: ignore[index]
    args = node.args
    total = scalar(args[0], values)
    if op == "add":
        for arg in args[1:]:
            if arg.op == "neg":
                total -= scalar(arg.args[0], values)
            else:
                total += scalar(arg, values)
        return total
    if op == "mul":
        for arg in args[1:]:
            if arg.op == "inv":
                total = divide(total, scalar(arg.args[0], values))
            else:
                total *= scalar(arg, values)
        return total
    if op == "neg":
        return -total
    if op == "pow":
        exponent = scalar(args[1], values)
        if isinstance(total, Traced) or isinstance(exponent, Traced):
            return as_float(total**exponent)
        return real_power(total, exponent)
    if op == "call":
        rest = []
        for arg in args[1:]:
            rest.append(scalar(arg, values))
        for known in (total, *rest):
            if isinstance(known, Traced):
                return known.applied(str(node.value), (total, *rest))
        return SCALAR[node.value](total, *rest)  # type: ignore[index]
    if op == "if":
        return scalar(args[1 if total != 0.0 else 2], values)
    return _logic(node, total, values)


def _logic(node: Node, total: float, values: Mapping[str, float]) -> float:
    """Return comparisons, logic and the reciprocal."""
    op = node.op
    args = node.args
    if op in _COMPARE:
        return float(_COMPARE[op](total, scalar(args[1], values)))
    if op == "not":
        return float(total == 0.0)
    if op == "inv":
        return divide(1.0, total)
    stop = op == "or"  # an or is known with the first true term, an and with the first false one
    for arg in args[1:]:
        if (total != 0.0) is stop:
            break
        total = scalar(arg, values)
    return float(total != 0.0)


def array(node: Node, values: Mapping[str, Any]) -> Any:
    """Return the value of a tree elementwise; all branches are computed, none warns."""
    import numpy as np

    with np.errstate(all="ignore"):
        return _array(node, values, np, array_functions())


def _array(node: Node, values: Mapping[str, Any], np: Any, functions: Mapping[str, Any]) -> Any:
    op = node.op
    if op == "num":
        return np.float64(node.value)
    if op in ("var", "name"):
        return np.asarray(values[str(node.value)], dtype=float)
    args: list[Any] = []
    for arg in node.args:
        signed = (op == "add" and arg.op == "neg") or (op == "mul" and arg.op == "inv")
        args.append(_array(arg.args[0] if signed and args else arg, values, np, functions))
    total = args[0]
    if op == "add":
        for arg, term in zip(node.args[1:], args[1:], strict=True):
            total = total - term if arg.op == "neg" else total + term
        return total
    if op == "mul":
        for arg, factor in zip(node.args[1:], args[1:], strict=True):
            total = total / factor if arg.op == "inv" else total * factor
        return total
    if op == "neg":
        return -total
    if op == "inv":
        return 1.0 / total
    if op == "pow":
        return np.power(total, args[1])
    if op == "call":
        return functions[str(node.value)](*args)
    if op == "if":
        return np.where(total != 0.0, args[1], args[2])
    if op == "not":
        return np.where(total == 0.0, 1.0, 0.0)
    if op in _COMPARE:
        return np.where(_COMPARE[op](total, args[1]), 1.0, 0.0)
    truth = total != 0.0
    for term in args[1:]:
        truth = (truth | (term != 0.0)) if op == "or" else (truth & (term != 0.0))
    return np.where(truth, 1.0, 0.0)


def fold(node: Node) -> Node:
    """Return a constant in place of a node whose arguments are all constants.

    A value that is not finite stays an expression: it has no text that reads back.  A reciprocal
    alone is left to its product, so that a/b is rounded once.
    """
    if not node.args or node.op == "inv":
        return node
    for arg in node.args:
        if arg.op != "num" and not (arg.op == "inv" and arg.args[0].op == "num"):
            return node
    value = scalar(node, {})
    return num(value) if math.isfinite(value) else node


def rebuild(
    node: Node,
    leaf: Callable[[Node], Node],
    function: Callable[[str, list[Node]], Node] | None = None,
) -> Node:
    """Return a tree with its names and signals replaced, constant parts folded.

    Parameters
    ----------
    node : Node
        The tree.
    leaf : callable
        Gives the new node for a name or a signal.
    function : callable, optional
        Gives the node for a call that has not been looked up, by name and arguments.

    Raises
    ------
    TooLarge
        If the new tree is too deep or too large.
    """
    known: dict[int, Node] = {}

    def walk(old: Node) -> Node:
        if old.op in ("name", "var"):
            return leaf(old)
        if not old.args and old.op != "call":
            return old
        done = known.get(id(old))
        if done is not None:
            return done
        new = []
        for arg in old.args:
            new.append(walk(arg))
        if old.op == "call" and str(old.value)[0] == "?":
            if function is None:
                result = Node(old.op, tuple(new), old.value)
            else:
                result = fold(function(str(old.value)[1:], new))
        elif all(a is b for a, b in zip(new, old.args, strict=True)):
            result = old
        else:
            result = fold(Node(old.op, tuple(new), old.value))
        known[id(old)] = result
        return result

    return walk(node)
