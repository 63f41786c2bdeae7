"""MOSFETs and IGBTs: SPICE's own as they are, those that are switches as a switch and diodes."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...devices.diodes.diode_branch import Leg
from ...devices.mosfets.level1 import Level1
from ...devices.mosfets.mosfet_switch import MosfetSwitch
from ...devices.mosfets.smooth_mosfet import SmoothMosfet
from ...devices.mosfets.vdmos import Vdmos
from ...devices.switches.switch import SwitchLaw
from ...devices.transistors.igbt import Igbt
from ...devices.transistors.jfet import Jfet
from ...netlist.deck import Element
from .deck_writer import DeckWriter, untranslatable
from .diodes import switch_model, write_leg

#: words of a VDMOS card that are not parameters of ngspice's
_NOT_WRITTEN = ("nchan", "pchan", "switch", "t_abs")


def write_mosfet(writer: DeckWriter, element: Element, device: object) -> None:
    """Write a MOSFET of any kind."""
    if isinstance(device, MosfetSwitch):
        _switch(writer, device)
    elif isinstance(device, Level1):
        assert element.model is not None
        nodes = writer.ends(device.name, (*device.corners, device.body), "dgsb")
        model = writer.verbatim(element.model)
        sizes = {k: v for k, v in device.size.items() if v}
        _line(writer, device, nodes, model, sizes)
    elif isinstance(device, Vdmos):
        assert element.model is not None
        nodes = writer.ends(device.name, device.corners, "dgs")
        card = {"vto": 0.0, "kp": 1.0, **device.card}  # without them those of an IRF540 are taken
        words = (f"{k}={v!r}" for k, v in card.items() if k not in _NOT_WRITTEN)
        body = f"vdmos({'nchan' if device.n else 'pchan'} {' '.join(words)})"
        _line(writer, device, nodes, writer.model(("card", id(element.model)), "power", body), {})
    else:
        raise untranslatable(f"{element.name}: ngspice has no equivalent for it")


def write_jfet(writer: DeckWriter, element: Element, device: Jfet) -> None:
    """Write a JFET, which ngspice has."""
    assert element.model is not None
    nodes = writer.ends(device.name, device.corners, "dgs")
    _line(writer, device, nodes, writer.verbatim(element.model), {})


def _line(
    writer: DeckWriter,
    device: SmoothMosfet,
    nodes: list[str],
    model: str,
    more: Mapping[str, float],
) -> None:
    """Write the line of a smooth MOSFET."""
    given = dict(more)
    if device.parallel != 1.0:
        given["m"] = device.parallel
    if device.temp is not None:
        given["temp"] = device.temp
    elif device.dtemp:
        given["dtemp"] = device.dtemp
    words = (f"{key}={value!r}" for key, value in given.items())
    writer.add(writer.names.element(device.letter, device.name), *nodes, model, *words)


def _switch(writer: DeckWriter, device: MosfetSwitch) -> None:
    """Write a switch between drain and source, and the body diodes."""
    name = device.name
    g, s = device.controls if device.n else device.controls[::-1]
    d, source = (writer.node(node) for node in device.ends)
    if name in writer.metered:
        d = writer.metered_node(name, d)
    model = switch_model(writer, name, device.law, device.parallel, "v")
    writer.add(writer.names.element("s", name), d, source, writer.node(g), writer.node(s), model)
    body = writer.node(device.body)
    for terminal, leg in device.legs.items():
        node = d if terminal == "d" else source
        a, k = (body, node) if device.n else (node, body)
        write_leg(writer, f"{name}.b{terminal}", leg, a, k)
    writer.substitute(name, "switching MOSFET", "switch with a body diode")


def write_igbt(writer: DeckWriter, element: Element, device: Igbt) -> None:
    """Write a diode with the drop, a switch behind it, and the antiparallel diode."""
    name = device.name
    (c,) = writer.ends(name, device.ends[:1])
    e = writer.node(device.ends[1])
    inner = writer.names.inner(f"{name}_channel")
    first, last = (c, inner) if device.n else (inner, c)
    write_leg(writer, f"{name}.drop", Leg(device.drop), first, last)
    threshold = device.given.get("vto", 0.0) * (1.0 if device.n else -1.0)
    width = device.given.get("vh", 0.0)
    law = SwitchLaw(0.0, math.inf, threshold + width, threshold - width, False, ())
    model = switch_model(writer, name, law, 1.0, "v")
    g, s = device.controls if device.n else device.controls[::-1]
    writer.add(writer.names.element("s", name), inner, e, writer.node(g), writer.node(s), model)
    if device.leg is not None:
        a, k = (e, c) if device.n else (c, e)
        write_leg(writer, f"{name}.diode", device.leg, a, k)
    writer.substitute(name, "switching IGBT", "diode and switch in series")
