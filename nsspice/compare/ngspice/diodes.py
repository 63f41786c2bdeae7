"""Set-valued diodes and ideal switches as sharp smooth ones."""

from __future__ import annotations

import math

from ...devices import CurrentSwitch, Diode, DiodeLaw, VoltageSwitch
from .deck_writer import DeckWriter, untranslatable


def write_diode(writer: DeckWriter, diode: Diode) -> None:
    """Write a set-valued diode as a ``sidiode``, or as sharp junctions."""
    a, b = writer.ends(diode.name, diode.nodes)
    if writer.options.junction == "sidiode":
        _piecewise(writer, diode, a, b)
    else:
        _junctions(writer, diode, a, b)


def law_name(law: DiodeLaw) -> str:
    """Return what kind of set-valued diode a law is.

    Examples
    --------
    >>> law_name(DiodeLaw()), law_name(DiodeLaw(vfwd=0.7, ron=0.1))
    ('ideal diode', 'diode with vfwd=0.7 ron=0.1')
    """
    given = {
        key: getattr(law, key)
        for key in ("vfwd", "ron", "roff", "vrev", "rrev")
        if getattr(law, key) is not None
    }
    if not given:
        return "ideal diode"
    return "diode with " + " ".join(f"{key}={value:g}" for key, value in given.items())


def _piecewise(writer: DeckWriter, diode: Diode, a: str, b: str) -> None:
    """Write XSPICE's diode, whose pieces are those of the law with resistances at the ends."""
    law, m = diode.law, diode.parallel
    least, most = writer.options.resistances
    ron = max(law.ron or 0.0, least)
    roff = min(math.inf if law.roff is None else law.roff, most)
    words = [f"ron={ron / m!r}", f"roff={roff / m!r}"]
    if law.vfwd:
        words.append(f"vfwd={law.vfwd!r}")
    if law.vrev is not None:
        rrev = max(ron if law.rrev is None else law.rrev, least)
        words += [f"vrev={law.vrev!r}", f"rrev={rrev / m!r}"]
    body = f"sidiode({' '.join(words)})"
    model = writer.model((law, m), "sidiode", body)
    writer.add(writer.names.element("a", diode.name), a, b, model)
    writer.substitute(diode.name, law_name(law), _short(body))


def _short(body: str) -> str:
    """Return a model body for people: digits that nobody reads left out."""
    words = []
    for word in body.split():
        key, equals, value = word.partition("=")
        number, bracket = value.rstrip(")"), ")" * value.endswith(")")
        words.append(f"{key}={float(number):g}{bracket}" if equals and "(" not in number else word)
    return " ".join(words)


def _junctions(writer: DeckWriter, diode: Diode, a: str, b: str) -> None:
    """Write an exponential junction with series voltage and resistance for every pair."""
    options, parts = writer.options, diode.parts
    n = float(options.junction)
    if parts.conductance:
        writer.add(writer.names.element("r", f"{diode.name}_off"), a, b, 1.0 / parts.conductance)
    for pair in parts.pairs:
        suffix = "" if pair.forward else "_rev"
        first, last = (a, b) if pair.forward else (b, a)
        if pair.offset:
            inner = writer.names.inner(f"{diode.name}{suffix}_v")
            source = writer.names.element("v", f"{diode.name}{suffix}_drop")
            writer.add(source, first, inner, "DC", pair.offset)
            first = inner
        resistance = f" rs={pair.resistance!r}" if pair.resistance else ""
        body = f"d(is={options.saturation!r} n={n!r}{resistance})"
        model = writer.model(("junction", pair.resistance), "junction", body)
        name = diode.name + suffix
        writer.add(writer.names.element("d", name), first, last, model)
    used = f"junction D(is={options.saturation:g} n={n:g})"
    if diode.law != DiodeLaw():
        used += " with a source and resistances for its corners and slopes"
    writer.substitute(diode.name, law_name(diode.law), used)


def write_switch(writer: DeckWriter, switch: VoltageSwitch | CurrentSwitch) -> None:
    """Write a switch; an ideal one gets a tiny and a huge resistance."""
    law, m = switch.law, switch.m
    least, most = writer.options.resistances
    ron, roff = (min(max(r, least), most) / m for r in (law.ron, law.roff))
    low, high = law.off_below, law.on_above
    voltage = isinstance(switch, VoltageSwitch)
    letter = "v" if voltage else "i"
    a, b = writer.ends(switch.name, switch.nodes)
    if law.inverted:  # closed below: the control is turned round
        low, high = -high, -low
    middle, width = (low + high) / 2.0, (high - low) / 2.0
    body = (
        f"{'sw' if voltage else 'csw'}({letter}t={middle!r} {letter}h={width!r} "
        f"ron={ron!r} roff={roff!r})"
    )
    model = writer.model((law, m, letter), "switch", body)
    if voltage:
        control = [writer.node(node) for node in switch.controls[:2]]
        if law.inverted:
            control.reverse()
        where = control
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
    if law.ron < least or law.roff > most:
        writer.substitute(
            switch.name, "ideal switch", f"{body.partition('(')[0]} with ron={ron:g} roff={roff:g}"
        )
