"""What the A lines of a deck have in common: nodes with states or values, meters of the netlist."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from ...errors import Span, suggest
from ..deck import Element, Param, Source
from ..elements.template import CodeTemplate
from ..findings import Findings, Unreadable
from .scope import Scope

#: the value at an operating point of what a code model integrates
_START = re.compile(r"\.ic v\((\w+)\)=(.+)")
#: a voltage that is the sum of what is attached to a node: letter, node, gain, and its own nodes
_ATTACHED = re.compile(r"\.attached (\w) (\w+) (\S+) (\w+) (\w+)")


class _Meter(NamedTuple):
    """A source whose value is a sum over elements of the deck."""

    name: str
    letter: str
    node: str
    gain: float
    nodes: tuple[str, str]
    span: Span


class Coded:
    """The code models of a deck.

    Parameters
    ----------
    findings : Findings
    initial : dict of str to Param
        Voltages at the operating point, which code models add to.
    """

    def __init__(self, findings: Findings, initial: dict[str, Param]) -> None:
        #: names of all elements of code models
        self.names: set[str] = set()
        self._digital: dict[str, Span] = {}
        self._clean: set[str] = set()
        self._real: dict[str, Span] = {}
        self._meters: list[_Meter] = []
        self._findings = findings
        self._initial = initial

    def look_over(self, scope: Scope, items: Sequence[object]) -> None:
        """Note which nodes of a scope are driven by logic, with 0 V or 1 V."""
        for item in items:
            if isinstance(item, CodeTemplate) and not item.own:
                from ..code_models.catalogue import driven_ports

                model = scope.model(item.model)
                if model is not None:
                    self._clean.update(map(scope.node, driven_ports(item, model)))

    def lines(
        self, item: CodeTemplate, scope: Scope, inner: Scope, given: dict[str, float]
    ) -> list[str]:
        """Return the lines of an element; what they say of the deck as a whole is kept.

        Parameters
        ----------
        item : CodeTemplate
            With the names that its nodes have inside.
        scope, inner : Scope
            Around the line, and inside of its subcircuit.
        given : dict of str to float
            Parameters of the line.
        """
        texts = _own_lines(item, given) if item.own else self._written(scope, item, inner, given)
        left = []
        for text in texts:
            if start := _START.fullmatch(text):
                node = inner.node(start[1])
                self._initial[node] = Param(node, float(start[2]), item.span)
            elif found := _ATTACHED.fullmatch(text):
                letter, node, gain, *nodes = found.groups()
                plus, minus = (inner.node(name) for name in nodes)
                name = f"{inner.prefix}meter"
                meter = _Meter(
                    name, letter, inner.node(node), float(gain), (plus, minus), item.span
                )
                self._meters.append(meter)
            elif text[0] == "*":  # what the deck's author has to know
                self._findings.warning("NS1101", f"{item.name}: {text[2:]}", item.span)
            else:
                left.append(text)
        return left

    def _written(
        self, scope: Scope, item: CodeTemplate, inner: Scope, given: dict[str, float]
    ) -> list[str]:
        model = scope.model(item.model)
        if model is None:
            hint = suggest(item.model, scope.known("models")) or f"add .model {item.model} ..."
            message = f"{item.name}: there is no model {item.model}"
            raise Unreadable("NS1060", message, item.model_span, hint, item.model)
        from ..code_models.catalogue import digital_ports, real_ports, written

        clean = frozenset(name for name in item.nodes if inner.node(name) in self._clean)
        texts = written(item, model, clean, given)
        for found, kept in ((digital_ports, self._digital), (real_ports, self._real)):
            names = found(item, model) - {"0", "null"}
            kept.update({inner.node(name): item.span for name in names})
        return texts

    def finish(self, elements: list[Element]) -> None:
        """Add what depends on the whole deck, and warn about digital nodes seen by others.

        They have 0 and 1 V; one that nothing drives is 0.  The value of a real node is what all
        that drives it adds up to: a current into 1 Ohm.
        """
        for meter in self._meters:
            source = Source(_attached(elements, meter), None, "", (), {}, meter.span)
            spans = (meter.span,) * 2
            elements.append(
                Element(meter.name, "v", meter.nodes, meter.span, source=source, node_spans=spans)
            )
            self.names.add(meter.name)
        touched = {node for element in elements for node in element.nodes}
        for node, where in {**self._digital, **self._real}.items():
            if node in self._real or node not in touched:
                low = Element(f"{node}#low", "r", (node, "0"), where, value=1.0)
                elements.append(low)
                self.names.add(low.name)
            if node not in touched:
                message = f"nothing drives the digital node {node}: it is 0"
                self._findings.warning("NS1097", message, where)
        mixed = {
            node: self._digital[node]
            for element in elements
            if element.name not in self.names
            for node in element.nodes
            if node in self._digital
        }
        if mixed:
            shown = ", ".join(list(mixed)[:6]) + ", ..." * (len(mixed) > 6)
            message = f"digital nodes have 0 V and 1 V, also where other elements see them: {shown}"
            hint = "put an adc_bridge or dac_bridge with their levels between"
            self._findings.warning("NS1097", message, next(iter(mixed.values())), hint)


def _attached(elements: list[Element], meter: _Meter) -> float:
    """Return the capacitance of all capacitors at a node, or the inductance of its inductors.

    Like XSPICE it looks through voltage sources of 0 V, once, and joins inductors in parallel.
    """
    nodes = {meter.node}
    for element in elements:
        source = element.source
        constant = element.letter == "v" and source is not None and source.kind == ""
        if constant and source is not None and source.dc == 0.0 and meter.node in element.nodes:
            nodes |= set(element.nodes)
    nodes.discard("0")
    values = [
        e.value
        for e in elements
        if e.letter == meter.letter and isinstance(e.value, float) and nodes & set(e.nodes)
    ]
    if meter.letter == "c":
        return meter.gain * sum(values)
    return meter.gain / sum(1.0 / value for value in values) if values else 0.0


def _own_lines(item: CodeTemplate, given: dict[str, float]) -> list[str]:
    """Return the lines of a transmission line or of one of LTspice's A devices."""
    from ..elements.transmission import MODEL, written_line

    if item.model == MODEL:
        return written_line(item, given)
    from ..code_models.a_devices import written

    return written(item, given)
