"""Transfer functions of z in a deck: an input, a source that holds the output, and a clock."""

from __future__ import annotations

import math

from ..deck import Element, Sampled, Source
from ..elements.template import Template
from ..expressions.expression import Expression
from ..expressions.node import Node
from ..findings import Unreadable
from .scope import Scope

#: what is above zero, or not below
_LEAST = {"period": math.ulp(0.0), "delay": 0.0, "offset": 0.0}


def sampled_parts(
    scope: Scope,
    item: Template,
    nodes: tuple[str, ...],
    drive: Node,
    coefficients: tuple[tuple[float, ...], tuple[float, ...]],
) -> tuple[list[Element], Sampled]:
    """Return the source with the name of the line and its input, and the function.

    Parameters
    ----------
    scope : Scope
    item : Template
    nodes : tuple of str
        Of the output, with their full names.
    drive : Node
        The input.
    coefficients : (tuple of float, tuple of float)
        Numerator and denominator from the highest power of z.

    Raises
    ------
    Unreadable
        For values that are not numbers, or impossible.
    """
    numbers: dict[str, float] = {}
    for key, text in item.params.items():
        value = scope.param(key, text).value
        if not isinstance(value, float):
            raise Unreadable("NS1010", f"{item.name}: {key} is not a number", text.span)
        if not _LEAST.get(key, -math.inf) <= value < math.inf:
            raise Unreadable("NS1025", f"{item.name}: {key} cannot be {value:g}", text.span)
        numbers[key] = value
    name, where = scope.prefix + item.name, item.span
    start = numbers.get("ic", 0.0)
    output = Element(
        name,
        "v" if item.letter == "e" else "i",
        nodes,
        where,
        source=Source(start, None, "", (), {}, where),
        node_spans=(where, where),
    )
    node = f"{name}#in"
    sensed = Element(
        f"{name}.in",
        "b",
        (node, "0"),
        where,
        value=Expression(drive, where),
        quantity="v",
        node_spans=(where, where),
    )
    clocked = Sampled(
        name,
        f"v({node})",
        *coefficients,
        numbers["period"],
        numbers.get("delay", 0.0),
        numbers.get("offset", 0.0),
        start,
        numbers.get("min", -math.inf),
        numbers.get("max", math.inf),
        where,
    )
    return [output, sensed], clocked
