"""From a deck to a circuit: laws, references, checks, islands; all errors at once."""

from __future__ import annotations

from collections.abc import Sequence

from ..devices import law_of
from ..devices.device import Context, Device
from ..devices.stamper import Conditions
from ..errors import NetlistError
from ..netlist.deck import Deck, TranCard
from ..netlist.findings import Findings
from . import islands as _islands
from .circuit import Circuit, Island
from .gate_drives import gate_drives
from .kink_form import written
from .line_settings import line_settings, refuse_others
from .name_resolution import resolve
from .problem_class import classify
from .topology import check_topology


def build(deck: Deck) -> Circuit:
    """Return the circuit of a deck.

    Parameters
    ----------
    deck : Deck

    Raises
    ------
    NetlistError
        With every wrong element, model, parameter and reference of the deck.
    TopologyError
        If the graph admits no solution: no ground, contradicting sources.
    """
    findings = Findings()
    devices = read_devices(deck, findings)
    resolve(devices, [element.name for element in deck.elements], findings)
    if findings.errors:
        raise NetlistError(findings.errors)
    defaults = default_conditions(deck)
    check_topology(devices, deck, defaults, findings)
    circuit = circuit_of(deck, devices, defaults)
    circuit.warnings = [*deck.warnings, *findings.warnings]
    return circuit


def completed(error: NetlistError) -> NetlistError:
    """Return the error of a deck with what is wrong with the values of its readable lines, too.

    What lines say together, references and topology, is left until all of them can be read.
    """
    deck = error.partial
    if not isinstance(deck, Deck) or not deck.elements:
        return error
    findings = Findings()
    read_devices(deck, findings)
    return NetlistError([*error.diagnostics, *findings.errors])


def read_devices(deck: Deck, findings: Findings) -> list[Device]:
    """Return the devices of all good element lines; report the others."""
    context = Context(findings)
    for key in ("w", "l", "ad", "as"):
        given = deck.options.get(f"def{key}")
        if given is not None and isinstance(given.value, int | float):
            context.sizes[key] = float(given.value)
    _read_switches(deck, context, findings)
    context.lines, context.conditions = line_settings(deck, findings), default_conditions(deck)
    devices: list[Device] = []
    seen: dict[str, int] = {}
    for element in deck.elements:
        if element.name in seen:
            findings.error(
                "NS2007",
                f"{element.name} is defined twice; first on line {seen[element.name]}",
                element.span,
                "rename one of them",
            )
            continue
        seen[element.name] = element.span.line
        device = law_of(element.letter).read(element, context)
        if device is not None:
            devices.append(device)
    if context.lines is not None:
        refuse_others(devices, findings)
    context.tell()
    if not deck.elements:
        findings.error("NS2013", f"{deck.file} has no elements", None, "add elements to the deck")
    return devices


def _read_switches(deck: Deck, context: Context, findings: Findings) -> None:
    """Set whether ``.options mosfet=switch`` makes MOSFETs switches, and their drive levels."""
    asked = deck.options.get("mosfet")
    if asked is not None and asked.value not in ("switch", "model"):
        message = f"option mosfet cannot be {asked.value!r}"
        findings.error("NS1010", message, asked.span, "write mosfet=switch, or remove it")
    context.mosfet_switch = asked is not None and asked.value == "switch"
    mosfets = [e for e in deck.elements if e.letter == "m"]
    if mosfets and (
        context.mosfet_switch or any(e.model and "switch" in e.model.params for e in mosfets)
    ):
        level = deck.options.get("vgson")
        if level is not None and isinstance(level.value, int | float):
            context.drives = {e.name: float(level.value) for e in mosfets}
        else:
            context.drives = gate_drives(deck.elements)


def default_conditions(deck: Deck) -> Conditions:
    """Return the temperature and the times of the deck's first ``.tran`` card."""
    card = next((a for a in deck.analyses if isinstance(a, TranCard)), None)
    nominal = deck.options.get("tnom")
    value = nominal.value if nominal is not None else 27.0
    return Conditions(
        temperature=deck.temperature,
        tstep=card.tstep if card else None,
        tstop=card.tstop if card else None,
        nominal=float(value) if isinstance(value, int | float) else 27.0,
    )


def nodes_of(devices: Sequence[Device]) -> list[str]:
    """Return all nodes but ground in order of appearance."""
    nodes: dict[str, None] = {}
    for device in devices:
        for node in (*device.nodes, *device.control_nodes):
            nodes[node] = None
    nodes.pop("0", None)
    return list(nodes)


def circuit_of(deck: Deck, devices: list[Device], defaults: Conditions | None = None) -> Circuit:
    """Split devices that passed all checks into islands and classify each."""
    defaults = defaults or default_conditions(deck)
    groups = [written(g, nodes_of(g), defaults) for g in _islands.split(devices)]
    chosen = {device.name: device for group in groups for device in group}
    devices = [chosen[device.name] for device in devices]
    islands = [Island(g, nodes_of(g), *classify(g), defaults) for g in groups]
    node_home = {node: k for k, island in enumerate(islands) for node in island.nodes}
    home = {d.name: k for k, island in enumerate(islands) for d in island.devices}
    return Circuit(
        deck,
        devices,
        islands,
        [],
        {node: node_home[node] for node in nodes_of(devices)},
        {device.name: home[device.name] for device in devices},
    )
