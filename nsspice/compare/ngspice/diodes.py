"""Diodes, Ebers-Moll transistors and ideal switches; set-valued laws as sharp smooth ones."""

from __future__ import annotations

from ...devices.diodes.broken_junction import BrokenJunction
from ...devices.diodes.diode_branch import CurveBody, JunctionBody, Leg
from ...devices.diodes.leg_device import LegDevice
from ...devices.switches.switch import CurrentSwitch, SwitchLaw, VoltageSwitch
from ...netlist.deck import Element
from .deck_writer import DeckWriter, untranslatable
from .expression import spice_expression


def write_branches(writer: DeckWriter, diode: LegDevice) -> None:
    """Write a diode of any law."""
    a, b = writer.ends(diode.name, diode.nodes)
    write_leg(writer, diode.name, diode.leg, a, b, getattr(diode, "ic", None))


def write_leg(
    writer: DeckWriter, name: str, leg: Leg, a: str, b: str, ic: float | None = None
) -> None:
    """Write a diode law between two spelled nodes; its current is measured if it has a drop.

    Parameters
    ----------
    writer : DeckWriter
    name : str
        Of the diode, or of one diode of a transistor.
    leg : Leg
    a, b : str
    ic : float, optional
        Initial voltage [V].
    """
    if leg.drop is not None:
        inner = writer.names.inner(f"{name}_drop")
        own = f"i({writer.meter(name)})"
        if leg.parallel != 1.0:
            own = f"({own}/{leg.parallel!r})"
        text = spice_expression(leg.drop.node, lambda signal: writer.signal(signal, own))
        writer.add(writer.names.element("b", f"{name}_drop"), a, inner, f"V={text}")
        a = inner
    body = leg.body.origin if isinstance(leg.body, BrokenJunction) else leg.body
    if isinstance(body, JunctionBody):
        _junction(writer, name, body, a, b, ic)
    elif not isinstance(body, CurveBody):
        raise untranslatable(f"{name}: ngspice has no equivalent for its law")
    elif writer.options.junction == "sidiode":
        _piecewise(writer, name, body, a, b)
    else:
        _sharp_junctions(writer, name, body, a, b)


def _junction(
    writer: DeckWriter, name: str, body: JunctionBody, a: str, b: str, ic: float | None
) -> None:
    """Write a smooth junction, which ngspice has."""
    words = " ".join(f"{key}={value!r}" for key, value in body.law.given if key != "t_abs")
    model = writer.model(("d", body.law), "junction", f"d({words})")
    line: list[object] = [writer.names.element("d", name), a, b, model]
    # m= and not an area: ngspice 39 leaves IBV as it is, and writes beyond its memory for "2.0"
    count = body.parallel if body.parallel != 1.0 else None
    temp = body.law.t_abs if body.temp is None else body.temp
    given = ("m", count), ("ic", ic), ("temp", temp), ("dtemp", body.dtemp or None)
    for key, value in given:
        if value is not None:
            line.append(f"{key}={value!r}")
    writer.add(*line)


def law_name(body: CurveBody) -> str:
    """Return what kind of set-valued diode a law is."""
    given = [effect for effect in body.effects if effect.value is not None]
    if not given:
        return "ideal diode"
    return "diode with " + " ".join(f"{e.parameter}={e.value:g}" for e in given)


def _piecewise(writer: DeckWriter, name: str, body: CurveBody, a: str, b: str) -> None:
    """Write XSPICE's diode, whose pieces are those of the law with resistances at the ends."""
    least, most = writer.options.resistances
    conductance = max(body.parts.conductance, 1.0 / most)
    words = {"ron": 0.0, "roff": 1.0 / conductance}
    for pair in body.parts.pairs:
        # the pair and the conductance conduct side by side
        slope = (
            max(1.0 / (1.0 / pair.resistance + conductance), least) if pair.resistance else least
        )
        if pair.forward:
            words["ron"] = slope
            if pair.offset:
                words["vfwd"] = pair.offset
        else:
            words |= {"vrev": pair.offset, "rrev": slope}
    if not words["ron"]:
        raise untranslatable(
            f"{name}: ngspice has no diode that never conducts in forward direction"
        )
    exact = " ".join(f"{key}={value!r}" for key, value in words.items())
    short = " ".join(f"{key}={value:g}" for key, value in words.items())
    model = writer.model(exact, "sidiode", f"sidiode({exact})")
    writer.add(writer.names.element("a", name), a, b, model)
    writer.substitute(name, law_name(body), f"sidiode({short})")


def _sharp_junctions(writer: DeckWriter, name: str, body: CurveBody, a: str, b: str) -> None:
    """Write an exponential junction with series voltage and resistance for every pair."""
    options, parts = writer.options, body.parts
    n = float(options.junction)
    if parts.conductance:
        writer.add(writer.names.element("r", f"{name}_off"), a, b, 1.0 / parts.conductance)
    for pair in parts.pairs:
        suffix = "" if pair.forward else "_rev"
        first, last = (a, b) if pair.forward else (b, a)
        if pair.offset:
            inner = writer.names.inner(f"{name}{suffix}_v")
            source = writer.names.element("v", f"{name}{suffix}_vfwd")
            writer.add(source, first, inner, "DC", pair.offset)
            first = inner
        resistance = f" rs={pair.resistance!r}" if pair.resistance else ""
        card = f"d(is={options.saturation!r} n={n!r}{resistance})"
        model = writer.model(card, "junction", card)
        writer.add(writer.names.element("d", name + suffix), first, last, model)
    used = f"junction D(is={options.saturation:g} n={n:g})"
    law = law_name(body)
    if law != "ideal diode":
        used += " with a source and resistances for its breakpoints and slopes"
    writer.substitute(name, law, used)


def write_switch(
    writer: DeckWriter, element: Element, switch: VoltageSwitch | CurrentSwitch
) -> None:
    """Write a switch; an ideal one gets a tiny and a huge resistance."""
    law = switch.law
    voltage = isinstance(switch, VoltageSwitch)
    a, b = writer.ends(switch.name, switch.nodes)
    model = switch_model(writer, switch.name, law, switch.m, "v" if voltage else "i")
    if voltage:
        where = [writer.node(node) for node in switch.controls[:2]]
        if law.inverted:  # closed below: the control is turned round
            where.reverse()
    else:
        if law.inverted:
            raise untranslatable(
                f"ngspice has no switch that closes below a current: {switch.name}"
            )
        where = [writer.meter(switch.controls[0])]
    words = [writer.names.element("s" if voltage else "w", switch.name), a, b, *where, model]
    if switch.starts_on:
        words.append("on")
    writer.add(*words)


def switch_model(writer: DeckWriter, name: str, law: SwitchLaw, m: float, letter: str) -> str:
    """Return the model card of a switch by voltage (``v``) or by current (``i``)."""
    least, most = writer.options.resistances
    ron, roff = (min(max(r, least), most) / m for r in (law.ron, law.roff))
    low, high = law.off_below, law.on_above
    if law.inverted:
        low, high = -high, -low
    middle, width = (low + high) / 2.0, (high - low) / 2.0
    kind = "sw" if letter == "v" else "csw"
    body = f"{kind}({letter}t={middle!r} {letter}h={width!r} ron={ron!r} roff={roff!r})"
    if law.ron < least or law.roff > most:
        writer.substitute(name, "ideal switch", f"{kind} with ron={ron:g} roff={roff:g}")
    return writer.model((law, m, letter), "switch", body)
