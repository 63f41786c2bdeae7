"""One line for each element, in the form that the manual shows first."""

from __future__ import annotations

import math
from collections.abc import Container

from ...errors import Span
from ...netlist.elements.template import (
    CodeTemplate,
    Formula,
    InstanceTemplate,
    Port,
    SourceTemplate,
    Template,
    Value,
)
from ...netlist.elements.transmission import MODEL as LINE
from . import words
from .words import value


def element_line(item: Template | InstanceTemplate | CodeTemplate, idle: Container[Span]) -> str:
    """Return the line of an element.

    Parameters
    ----------
    item : Template, InstanceTemplate or CodeTemplate
    idle : container of Span
        Places of parameters without an effect, which are left out.
    """
    name = item.name[0].upper() + item.name[1:]
    if isinstance(item, InstanceTemplate):
        parts = [*item.nodes, item.subcircuit]
    elif isinstance(item, CodeTemplate):
        parts = _code_model(item)
    else:
        parts = [*item.nodes, *_content(item), *item.flags]
    return " ".join([name, *parts, *words.items(item.params, idle)])


def _content(item: Template) -> list[str]:
    """Return what is between nodes and parameters."""
    if item.source is not None:
        return _source(item.source)
    if item.transfer is not None:
        assert item.value is not None
        kind = "ZTRANS" if item.sampled else "LAPLACE"
        return [kind, _braced(item.value), "=", words.formula(item.transfer.node)]
    if item.quantity:
        assert item.value is not None
        return [_law(item, item.value)]
    model = [item.model] if item.model else []
    gain = [] if item.value is None else [value(item.value)]
    return [*item.controls, *gain, *model]


def _law(item: Template, given: Value) -> str:
    """Return the law of an element whose value depends on signals."""
    if item.letter == "i":  # a current that follows the voltage across it, point by point
        assert isinstance(given, Formula)
        points = given.node.args[1:]
        texts = [
            words.number(float(p.value)) if p.op == "num" else words.formula(p) for p in points
        ]
        return f"TBL({' '.join(texts)})"
    key = "VALUE" if item.letter in "efgh" else item.quantity.capitalize()
    return f"{key}={_braced(given)}"


def _braced(given: Value) -> str:
    """Return an expression in braces, also if it is a number."""
    return words.formula(given.node) if isinstance(given, Formula) else f"{{{value(given)}}}"


def _source(source: SourceTemplate) -> list[str]:
    """Return the value of an independent source."""
    parts = []
    if source.dc is not None:
        parts += ["DC", value(source.dc)] if source.kind or source.ac else [value(source.dc)]
    if source.ac is not None:
        phase = [] if source.ac[1] == 0.0 else [value(source.ac[1])]
        parts += ["AC", value(source.ac[0]), *phase]
    if source.kind:
        content = _points(source) if source.kind == "pwl" else list(map(value, source.values))
        parts.append(f"{source.kind.upper()}({' '.join(content)})")
    return parts + [f"{key}={value(given)}" for key, given in source.options.items()]


def _points(source: SourceTemplate) -> list[str]:
    """Return the arguments of a PWL with its relative times and repeated parts."""
    relative = set(source.relative)
    texts = ["+" * (k in relative) + value(given) for k, given in enumerate(source.values)]
    for part in reversed(source.repeats):
        turns = ["FOREVER"] if part.count == math.inf else ["FOR", value(part.count)]
        inner = f"({' '.join(texts[part.first : part.last])})"
        texts[part.first : part.last] = ["REPEAT", *turns, inner, "ENDREPEAT"]
    return texts


def _code_model(item: CodeTemplate) -> list[str]:
    """Return ports and model of an A line, or the nodes of a line."""
    if item.own:
        nodes = [node for vector in item.ports for port in vector for node in _ends(item, port)]
        return nodes if item.model == LINE else [*nodes, item.model]
    if item.name[0] == "p":
        return [n for v in item.ports for n in (*(p.plus for p in v), v[0].minus)] + [item.model]
    if item.name[0] != "a":  # a line with losses
        ends = [node for (port,) in item.ports for node in (port.plus, port.minus)]
        return [*(ends if item.name[0] != "u" else ends[::2]), item.model]
    vectors = []
    for vector in item.ports:
        ports = [_port(port) for port in vector]
        vectors.append(ports[0] if len(ports) == 1 else f"[{' '.join(ports)}]")
    return [*vectors, item.model]


def _ends(item: CodeTemplate, port: Port) -> tuple[str, ...]:
    return (port.plus, port.minus) if item.model == LINE else (port.plus,)


def _port(port: Port) -> str:
    """Return a port: its type, whether it is inverted, its nodes."""
    kind = f"%{port.kind}" if port.kind else ""
    differential = port.minus != "0" or (port.kind.endswith("d") and port.kind != "d")
    nodes = f"({port.plus} {port.minus})" if differential else port.plus
    return " ".join(filter(None, [kind, "~" * port.inverted + nodes]))
