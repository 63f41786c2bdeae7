"""What expressions remember: ``ddt(x)``, ``idt(x, start)``, ``sdt(x)``, ``delay(x, time)``.

The derivative is the current of 1 F across a source of the value; the integral is the voltage of 1
F that is charged with the value, and begins with its start value.  A delay is a source that the run
sets, see ``nsspice/analyses/transient/delays.py``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from ..deck import Delay, Element, Param
from ..elements.template import Formula
from ..expressions.evaluate import rebuild
from ..expressions.expression import Expression
from ..expressions.node import Node, neg, num, var
from ..findings import Unreadable
from .scope import Scope

#: smallest and largest number of arguments
_NAMES = {"ddt": (1, 1), "idt": (1, 2), "sdt": (1, 1), "delay": (2, 3), "absdelay": (2, 3)}


def has_memory(node: Node) -> bool:
    """Return whether an expression that has not been bound calls one of the functions."""
    if node.op == "call" and str(node.value).lstrip("?") in _NAMES:
        return True
    return any(has_memory(arg) for arg in node.args)


class Memory(NamedTuple):
    """What an expression remembers.

    Parameters
    ----------
    elements : list of Element
    initial : dict of str to Param
        Voltages by node at the operating point.
    delays : list of Delay
    """

    elements: list[Element]
    initial: dict[str, Param]
    delays: list[Delay]


def without_memory(name: str, formula: Formula, scope: Scope) -> tuple[Formula, Memory]:
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
    (Formula, Memory)

    Raises
    ------
    Unreadable
        For a wrong number of arguments, or a start value that is not a number.
    """
    made: list[Element] = []
    initial: dict[str, Param] = {}
    delays: list[Delay] = []
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

    def delayed(label: str, node: str, value: Node, args: list[Node]) -> Node:
        time = bind(args[1])
        # the third argument of PSpice's and Verilog-A's is a bound that nothing needs
        if time.op != "num" or not 0.0 < float(time.value) < math.inf:
            message = "the time of a delay must be a number above zero"
            raise Unreadable("NS1025", message, where)
        made.append(part(f"{label}.b", (node, "0"), value, "v"))
        output, sensed = scope.node(f"{node}#late"), scope.node(node)
        element = Element(
            f"{scope.prefix}{name}.{label}",
            "e",
            (output, "0"),
            where,
            (sensed, "0"),
            1.0,
            params={"delay": Param("delay", float(time.value), where)},
            node_spans=(where,) * 4,
        )
        made.append(element)
        delays.append(Delay(element.name, f"v({sensed})", float(time.value), where))
        return var(f"v({node}#late)")

    def function(called: str, args: list[Node]) -> Node:
        if called not in _NAMES:
            return Node("call", tuple(args), f"?{called}")
        least, most = _NAMES[called]
        if not least <= len(args) <= most:
            counts = " or ".join(map(str, dict.fromkeys((least, most))))
            message = f"{called} takes {counts} argument{'s' * (most > 1)}"
            raise Unreadable("NS1022", message, where)
        label = f"{called}{len(made) // 2 + 1}"
        node = f"{name}#{label}"
        value = bind(args[0])
        if called == "ddt":
            made.append(part(f"{label}.b", (node, "0"), value, "v"))
            made.append(part(f"{label}.c", (node, "0"), 1.0, ""))
            return neg(var(f"i({name}.{label}.b)"))
        if called in ("delay", "absdelay"):
            return delayed(label, node, value, args)
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
    memory = Memory(made, initial, delays)
    return Formula(tree, formula.line, formula.start, formula.end, made=True), memory
