"""Thyristors as a B source for the falling curve, with sharp diodes for its set-valued parts."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...devices.diodes.characteristic import Decomposition, PairLaw
from ...devices.diodes.diode_branch import CurveBody, Leg
from ...devices.switches.latching_thyristor import LatchingThyristor
from ...devices.switches.thyristor import Thyristor
from .deck_writer import DeckWriter, untranslatable
from .diodes import write_leg
from .expression import spice_expression


def write_thyristor(writer: DeckWriter, thyristor: Thyristor) -> None:
    """Write forward branch, reverse breakdown and gate."""
    name, card, m = thyristor.name, thyristor.card, thyristor.parallel
    if isinstance(thyristor, LatchingThyristor):
        raise untranslatable(
            f"{name}: ngspice has no ideal thyristor",
            "also give vbo and ih: ngspice can express a falling characteristic",
        )
    anode, cathode, *rest = writer.ends(name, thyristor.nodes, "akg")
    inner = writer.names.inner(f"{name}_drop")
    forward = writer.metered_node(f"{name}.fwd", anode)
    gate = ""
    if rest:
        gate_node = writer.metered_node(f"{name}.gate", rest[0])
        trigger = PairLaw(True, card.get("vgt", 0.0), card.get("rg", 0.0) / m)
        _diode(writer, f"{name}.gate", trigger, gate_node, cathode)
        gate = f"(i({writer.meter(f'{name}.gate')})/{m!r})"
    own = f"(i({writer.meter(f'{name}.fwd')})/{m!r})"
    text = _curve(writer, thyristor, own) if thyristor.curve else _thyristor(card, own, gate)
    writer.add(writer.names.element("b", f"{name}_drop"), forward, inner, f"V={text}")
    _diode(writer, f"{name}.fwd", PairLaw(True, 0.0, 0.0), inner, cathode)
    if "vrev" in card:
        slope = card.get("rrev", card.get("ron", 0.0)) / m
        _diode(writer, f"{name}.rev", PairLaw(True, card["vrev"], slope), cathode, anode)
    writer.substitute(name, "thyristor", "B source in series with a diode")


def _diode(writer: DeckWriter, name: str, pair: PairLaw, a: str, b: str) -> None:
    write_leg(writer, name, Leg(CurveBody(Decomposition(0.0, (pair,)), ())), a, b)


def _curve(writer: DeckWriter, thyristor: Thyristor, own: str) -> str:
    """Return the given curve, straight below zero and above its end."""
    assert thyristor.curve is not None
    node = thyristor.curve.node
    slope, end = thyristor.card.get("ron", 0.0), thyristor.card.get("alpha", math.inf)

    def at(current: str) -> str:
        return spice_expression(node, lambda signal: writer.signal(signal, current))

    total = at(own)
    if math.isfinite(end):
        total = f"({own} > {end!r} ? ({at(repr(end))}+{slope!r}*({own}-{end!r})) : ({total}))"
    return f"({own} < 0 ? ({at('0.0')}+{slope!r}*{own}) : ({total}))"


def _thyristor(card: Mapping[str, float], own: str, gate: str) -> str:
    """Return the curve of breakover and holding."""
    holding = card.get("vh", 0.0)
    left = f"max(0,1-max({own},0)/{card['ih']!r})"
    fall = f"{card['vbo'] - holding!r}*{left}*{left}"
    if gate:
        fall += f"*max(0,1-{gate}/{card['igt']!r})"
    return f"({holding!r}+{card.get('ron', 0.0)!r}*{own}+{fall})"
