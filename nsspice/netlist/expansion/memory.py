"""Derivatives and integrals in expressions, ``ddt(x)``, ``idt(x, start)``, ``sdt(x)``, as storage.

The derivative is the current of 1 F across a source of the value; the integral is the voltage of 1
F that is charged with the value, and begins with its start value.
"""

from __future__ import annotations

from dataclasses import replace

from ..deck import Element, Param
from ..elements.template import Formula
from ..expressions.evaluate import rebuild
from ..expressions.expression import Expression
from ..expressions.node import Node, neg, num, var
from ..findings import Unreadable
from .scope import Scope

_NAMES = ("ddt", "idt", "sdt")


def has_memory(node: Node) -> bool:
    """Return whether an expression that has not been bound calls one of the functions."""
    if node.op == "call" and str(node.value).lstrip("?") in _NAMES:
        return True
    return any(has_memory(arg) for arg in node.args)


def without_memory(
    name: str, formula: Formula, scope: Scope
) -> tuple[Formula, list[Element], dict[str, Param]]:
    """Return an expression with currents and voltages of its storage, and that storage.

    Parameters
    ----------
    name : str
        Local name of the element of the expression.
    formula : Formula
    scope : Scope
        Where its names are looked up.

    Returns
    -------
    tuple
        The expression; elements; initial voltages by node, which hold at the operating point.

    Raises
    ------
    Unreadable
        For a wrong number of arguments, or a start value that is no number.
    """
    made: list[Element] = []
    initial: dict[str, Param] = {}
    where = formula.span

    def bind(node: Node) -> Node:
        return scope.bind(replace(formula, node=node))

    def part(own: str, nodes: tuple[str, str], law: Node | float, of: str) -> Element:
        value = Expression(law, where) if isinstance(law, Node) else law
        full = tuple(scope.node(node) for node in nodes)
        letter = "b" if isinstance(law, Node) else "c"
        label = f"{scope.prefix}{name}.{own}"
        return Element(
            label, letter, full, where, value=value, quantity=of, node_spans=(where, where)
        )

    def function(called: str, args: list[Node]) -> Node:
        if called not in _NAMES:
            return Node("call", tuple(args), f"?{called}")
        if not 1 <= len(args) <= (2 if called == "idt" else 1):
            message = f"{called} takes {'1 or 2 arguments' if called == 'idt' else '1 argument'}"
            raise Unreadable("NS1022", message, where)
        label = f"{called}{len(made) // 2 + 1}"
        node = f"{name}#{label}"
        value = bind(args[0])
        if called == "ddt":
            made.append(part(f"{label}.b", (node, "0"), value, "v"))
            made.append(part(f"{label}.c", (node, "0"), 1.0, ""))
            return neg(var(f"i({name}.{label}.b)"))
        start = bind(args[1]) if len(args) > 1 else num(0.0)
        if start.op != "num":
            message = "the start value of idt must be a number"
            raise Unreadable("NS1025", message, where)
        made.append(part(f"{label}.b", ("0", node), value, "i"))
        made.append(part(f"{label}.c", (node, "0"), 1.0, ""))
        made[-1].params["ic"] = Param("ic", float(start.value), where)
        full = scope.node(node)
        initial[full] = Param(full, float(start.value), where)
        return var(f"v({node})")

    tree = rebuild(formula.node, lambda leaf: leaf, function)
    return Formula(tree, formula.line, formula.start, formula.end, made=True), made, initial
