"""Topology checks, before any numerics: what no choice of element values could repair.

Errors: no ground, sensed nodes that nothing drives, loops of voltage sources that do not add up to
zero, cut-sets of current sources with a net current; the last two also with inductors as shorts and
capacitors open where the deck asks for a DC solution.  Everything that ideal elements make legal is
accepted: loops of capacitors, cut-sets of inductors, floating parts, parallel and series diodes,
redundant but consistent sources.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..devices.device import Device
from ..devices.sources.isource import CurrentSource
from ..devices.sources.vsource import VoltageSource
from ..devices.sources.waveform import initial_value
from ..devices.stamper import Conditions
from ..errors import Diagnostic, TopologyError, suggest
from ..netlist.deck import DcCard, Deck, OpCard, TranCard
from ..netlist.findings import Findings
from ..problems.descriptor import Waveform
from .cutsets import check_cutsets
from .loops import Graph, check_loops
from .union_find import UnionFind


@dataclass(frozen=True, slots=True)
class Mode:
    """A situation in which the sources must fit together.

    Parameters
    ----------
    dc : bool
        Inductors are shorts and capacitors are open.
    what : str
        For messages: ``at DC`` or an empty string.
    waveforms : dict of str to tuple of Waveform or None
        What each independent source does, as a sum; None for a swept one.
    """

    dc: bool
    what: str
    waveforms: dict[str, tuple[Waveform | None, ...]]


def check_topology(
    devices: Sequence[Device], deck: Deck, defaults: Conditions, findings: Findings
) -> None:
    """Check the graph of a circuit.

    Parameters
    ----------
    devices : sequence of Device
    deck : Deck
        Its analyses say whether a DC solution is needed.
    defaults : Conditions
    findings : Findings
        Takes the warnings.

    Raises
    ------
    TopologyError
        With all errors.
    """
    graph = [(device, device.edges()) for device in devices]
    errors: list[Diagnostic] = []
    conflicts: list[frozenset[str]] = []
    elements: dict[str, None] = {}
    errors += _check_ground(devices)
    errors += _check_sensed(devices)
    _warn_dangling(devices, findings)
    _warn_shorted(devices, findings)
    if not errors:  # without ground every part floats: that says nothing new
        _warn_floating(graph, findings)
    for mode in modes(devices, deck, defaults):
        for diagnostic, names in (*check_loops(graph, mode), *check_cutsets(graph, mode)):
            if not any(known <= frozenset(names) for known in conflicts):
                conflicts.append(frozenset(names))
                elements.update(dict.fromkeys(names))
                errors.append(diagnostic)
    if errors:
        raise TopologyError(errors, list(elements))


def modes(devices: Sequence[Device], deck: Deck, defaults: Conditions) -> list[Mode]:
    """Return the situations that the deck's analyses lead through."""
    sources = [d for d in devices if isinstance(d, VoltageSource | CurrentSource)]
    result: list[Mode] = []
    transients = [a for a in deck.analyses if isinstance(a, TranCard)]
    steady = [a for a in deck.analyses if isinstance(a, OpCard | DcCard)]
    if transients or not deck.analyses:
        result.append(Mode(False, "", {d.name: d.waveforms(defaults) for d in sources}))
    if any(not card.uic for card in transients):
        start: dict[str, tuple[Waveform | None, ...]] = {
            d.name: tuple(Waveform("dc", (initial_value(w),)) for w in d.waveforms(defaults))
            for d in sources
        }
        result.append(Mode(True, "at DC (the start of .tran)", start))
    if steady:
        swept = {s.name for a in steady if isinstance(a, DcCard) for s in a.sweeps}
        constant = Conditions(
            defaults.temperature, {}, "dc", defaults.tstep, defaults.tstop, defaults.nominal
        )
        values: dict[str, tuple[Waveform | None, ...]] = {
            d.name: (None,) if d.name in swept else d.waveforms(constant) for d in sources
        }
        result.append(Mode(True, "at DC", values))
    return result


def _check_ground(devices: Sequence[Device]) -> list[Diagnostic]:
    """Return an error if no element is connected to ground."""
    if any("0" in d.nodes for d in devices):
        return []
    return [
        Diagnostic(
            "NS2020",
            "no element is connected to ground (node 0)",
            devices[0].span if devices else None,
            "call one node 0 or gnd: all voltages refer to it",
        )
    ]


def _check_sensed(devices: Sequence[Device]) -> list[Diagnostic]:
    """Return an error for each node that is sensed but not connected."""
    driven = {node for d in devices for node in d.nodes}
    driven.add("0")
    errors: list[Diagnostic] = []
    reported: set[str] = set()
    for device in devices:
        for node in device.control_nodes:
            if node not in driven and node not in reported:
                reported.add(node)
                errors.append(
                    Diagnostic(
                        "NS2025",
                        f"{device.name} senses the voltage of node {node}, to which no element is "
                        "connected",
                        device.control_span(node),
                        suggest(node, sorted(driven)) or f"connect something to {node}",
                    )
                )
    return errors


def _warn_dangling(devices: Sequence[Device], findings: Findings) -> None:
    """Warn about nodes with one connection: often a misspelt name."""
    first: dict[str, tuple[Device, int]] = {}
    degree: dict[str, int] = {}
    for device in devices:
        for k, node in enumerate(device.nodes):
            degree[node] = degree.get(node, 0) + 1
            first.setdefault(node, (device, k))
    sensed = {node for d in devices for node in d.control_nodes}
    # what a function of z samples is sensed by its clock
    sensed |= {node for node in degree if node.endswith("#in")} | {"0"}
    lonely = [n for n, count in degree.items() if count == 1 and n not in sensed]
    names = list(degree)
    for k, node in enumerate(lonely):
        device, place = first[node]
        spans = device.node_spans
        span = spans[place] if place < len(spans) else device.span
        # comparing names costs time in proportion to their number: not for thousands of nodes
        hint = suggest(node, names, cutoff=0.75) if k < 20 and len(names) < 5000 else ""
        findings.warning(
            "NS2050",
            f"only {device.name} is connected to node {node}: it carries no current",
            span,
            hint,
        )


def _warn_shorted(devices: Sequence[Device], findings: Findings) -> None:
    """Warn about elements with both ends on one node."""
    for device in devices:
        if device.nodes and device.ends[0] == device.ends[1]:
            findings.warning(
                "NS2057", f"both ends of {device.name} are on node {device.ends[0]}", device.span
            )


def _warn_floating(graph: Graph, findings: Findings) -> None:
    """Warn about parts without any path to ground."""
    number: dict[str, int] = {"0": 0}
    owner: dict[str, Device] = {}
    joins: list[tuple[int, int]] = []
    for device, edges in graph:
        for node in device.nodes:
            number.setdefault(node, len(number))
            owner.setdefault(node, device)
        for edge in edges:
            if edge.kind not in ("I", "G"):
                joins.append((number[edge.a], number[edge.b]))
    sets = UnionFind(len(number))
    for a, b in joins:
        sets.union(a, b)
    parts: dict[int, list[str]] = {}
    for node, k in number.items():
        root = sets.find(k)
        if root != 0:
            parts.setdefault(root, []).append(node)
    for nodes in parts.values():
        listed = ", ".join(nodes[:6]) + (f" and {len(nodes) - 6} more" if len(nodes) > 6 else "")
        plural = "s" if len(nodes) > 1 else ""
        findings.warning(
            "NS2051",
            f"node{plural} {listed} ha{'ve' if plural else 's'} no path to ground: nothing fixes "
            f"the potential, so its average is set to 0 V",
            owner[nodes[0]].span,
            "connect one node of this part to ground if its potential matters",
        )
