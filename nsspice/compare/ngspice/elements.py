"""One function for each element letter: how it is written for ngspice."""

from __future__ import annotations

import itertools
import math
from typing import Any

from ...devices.device import Device
from ...devices.diodes.leg_device import LegDevice
from ...devices.expressions.behavioural import Reading, as_expression
from ...devices.passive.coupling import Coupling
from ...devices.passive.passive import Passive
from ...devices.sources.isource import CurrentSource
from ...devices.sources.vsource import VoltageSource
from ...devices.switches.thyristor import Thyristor
from ...element_kinds import KINDS
from ...lazy import resolve
from ...netlist.deck import Element
from ...netlist.expressions.expression import Expression
from .deck_writer import DeckWriter, untranslatable
from .diodes import write_branches, write_leg
from .expression import spice_expression
from .thyristors import write_thyristor
from .waveform import source_text


def write(writer: DeckWriter, element: Element, device: Device) -> None:
    """Write one element.

    Raises
    ------
    UsageError
        NS4014 if ngspice has nothing that could stand for it.
    """
    place = KINDS[element.letter].translation
    if not place:
        raise untranslatable(f"{element.name}: ngspice has no equivalent for it")
    resolve(place)(writer, element, device)


def is_voltage_source(element: Element, device: Device) -> bool:
    """Return whether an element becomes a voltage source, which measures its own current."""
    return isinstance(device, VoltageSource) or (
        element.letter in "rl" and isinstance(device, Passive) and device.value == 0.0
    )


def write_passive(writer: DeckWriter, element: Element, device: Device) -> None:
    """Write R, C or L."""
    if _is_law(element):
        write_behavioural(writer, element, device)
        return
    assert isinstance(device, Passive)
    letter, value = element.letter, device.at(writer.conditions)
    coefficients = ""
    rise = device.coefficients
    if writer.sweeps_temperature and rise:
        if rise.temp is not None or rise.tnom is not None:
            raise untranslatable(f"{element.name} has its own temperature in a .dc temp sweep")
        value = device.value
        coefficients = f"tc1={rise.tc1!r} tc2={rise.tc2!r} dtemp={rise.dtemp!r}"
        if rise.tce:
            coefficients += f" tce={rise.tce!r}"
    if value == 0.0 and letter in "rl":
        meter = writer.names.element("v", device.name)
        writer.add(meter, *(writer.node(n) for n in device.nodes), "DC 0")
        writer.substitute(device.name, "short", "voltage source of 0 V")
        return
    value = value * device.m if letter == "c" else value / device.m
    if math.isinf(value) or value == 0.0:
        return
    words: list[object] = [writer.names.element(letter, device.name)]
    words += [*writer.ends(device.name, device.nodes[:2]), value, coefficients]
    if device.ic is not None and letter in "cl":
        words.append(f"ic={device.ic!r}")
    writer.add(*words)


def write_coupling(writer: DeckWriter, element: Element, device: Coupling) -> None:
    """Write the coupling of each two inductors."""
    pairs = list(itertools.combinations(device.inductors, 2))
    for k, (one, two) in enumerate(pairs):
        name = device.name if len(pairs) == 1 else f"{device.name}_{k + 1}"
        coils = [writer.names.element("l", coil.name) for coil in (one, two)]
        writer.add(writer.names.element("k", name), *coils, device.coefficient)


def write_source(writer: DeckWriter, element: Element, device: Device) -> None:
    """Write V or I."""
    if not isinstance(device, VoltageSource | CurrentSource):
        write_behavioural(writer, element, device)
        return
    waveform, *end = device.waveforms(writer.conditions)
    if end:
        raise untranslatable(f"{device.name}: ngspice has no sine with a limited number of cycles")
    text, sharp = source_text(waveform, writer.stop, writer.edge)
    words: list[object] = [writer.names.element(device.letter, device.name)]
    if isinstance(device, VoltageSource):
        words += [writer.node(node) for node in device.nodes]
    else:
        words += writer.ends(device.name, device.nodes)
    if isinstance(device, CurrentSource) and device.m != 1.0:
        text += f" m={device.m!r}"
    writer.add(*words, text)
    if sharp:
        writer.substitute(device.name, "ideal edge", f"ramp of {writer.edge:g} s")


def _is_law(element: Element) -> bool:
    """Return whether an expression of signals is the value."""
    return isinstance(element.value, Expression) or element.quantity in ("v", "i")


def write_behavioural(writer: DeckWriter, element: Element, device: Device) -> None:
    """Write R, E, F, G, H and B with an expression of signals as a B source."""
    value = as_expression(element)
    if element.quantity == "flux" or (element.letter == "l" and not element.quantity):
        raise untranslatable(f"{element.name}: ngspice cannot have {value.text} as its value")
    parallel = float(getattr(device, "m", 1.0))
    a, b = writer.ends(element.name, element.nodes)
    own = f"i({writer.meter(element.name)})"
    if parallel != 1.0:  # a law is that of one of several equal elements
        own = f"({own}/{parallel!r})"
    text = spice_expression(value.node, lambda name: writer.signal(name, own))
    if isinstance(device, Reading) and device.coefficients:
        rise = device.coefficients
        if writer.sweeps_temperature:
            raise untranslatable(f"{element.name} has tc1= in a .dc temp sweep")
        text = f"({text})*{rise.factor(writer.conditions)!r}"
    quantity = element.quantity
    if element.letter == "r" and not quantity:
        quantity, text = "i", f"v({a},{b})/({text})"
    if parallel != 1.0 and quantity != "v":
        text = f"({text})*{parallel!r}"
    if element.letter == "c":
        key = quantity or "c"
        writer.add(writer.names.element("c", element.name), a, b, f"{key}='{text}'")
        return
    name = writer.names.element("b", element.name)
    writer.add(name, a, b, f"{quantity.upper()}={text}")
    if element.letter != "b":
        writer.substitute(element.name, f"nonlinear {element.letter.upper()}", "B source")


def write_controlled(writer: DeckWriter, element: Element, device: Device) -> None:
    """Write E, F, G or H."""
    if _is_law(element):
        write_behavioural(writer, element, device)
        return
    if not isinstance(element.value, int | float):
        raise untranslatable(f"{element.name} has no constant gain")
    gain = float(element.value)
    if element.letter in "fg" and "m" in element.params:
        gain *= float(element.params["m"].value)  # type: ignore[arg-type]
    if element.letter in "eg":
        controls = [writer.node(node) for node in element.controls]
    else:
        controls = [writer.meter(element.controls[0])]
    name = writer.names.element(element.letter, element.name)
    writer.add(name, *writer.ends(element.name, element.nodes), *controls, gain)


def write_diode(writer: DeckWriter, element: Element, device: Device) -> None:
    """Write D, a diode or a thyristor."""
    if isinstance(device, Thyristor):
        write_thyristor(writer, device)
    else:
        assert isinstance(device, LegDevice)
        write_branches(writer, device)


def write_transistor(writer: DeckWriter, element: Element, device: Device) -> None:
    """Write a transistor: SPICE's own, or two diodes and the currents that they carry along."""
    legs = getattr(device, "legs", None)
    count = 4 if "s" in device.terminals else 3
    nodes = writer.ends(element.name, element.nodes[:count], "cbes")
    if legs is not None:
        _ebers_moll(writer, device, nodes)
        return
    assert element.model is not None
    words: list[object] = [writer.names.element("q", element.name), *nodes]
    words.append(writer.verbatim(element.model))
    parallel = getattr(device, "parallel", 1.0)
    if parallel != 1.0:  # m= and not area=, which leaves the reverse currents of ngspice 39 alone
        words.append(f"m={parallel!r}")
    for key in ("temp", "dtemp"):
        param = element.params.get(key)
        if key == "temp" and param is None:
            param = element.model.params.get("t_abs")
        if param is not None and isinstance(param.value, int | float):
            words.append(f"{key}={float(param.value)!r}")
    writer.add(*words)


def _ebers_moll(writer: DeckWriter, device: Any, nodes: list[str]) -> None:
    """Write an Ebers-Moll transistor with diodes of any law."""
    collector, base, emitter = nodes
    meters = []
    for key, node, leg in zip(("de", "dc"), (emitter, collector), device.legs, strict=True):
        name = f"{device.name}.{key}"
        a, b = (base, node) if device.npn else (node, base)
        write_leg(writer, name, leg, writer.metered_node(name, a), b)
        meters.append(writer.meter(name))
    shares = ((collector, meters[0], device.alphan), (emitter, meters[1], device.alphai))
    for node, meter, share in shares:
        if share:
            a, b = (node, base) if device.npn else (base, node)
            name = writer.names.element("f", f"{device.name}_{meter}")
            writer.add(name, a, b, meter, share)
    kind = "NPN" if device.npn else "PNP"
    writer.substitute(device.name, f"Ebers-Moll {kind}", "two diodes and two F sources")
