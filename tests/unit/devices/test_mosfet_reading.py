"""Smooth MOSFETs read as switches: threshold, on-resistance, body diode, drive of the gate."""

from __future__ import annotations

import math

import pytest

import nsspice
from nsspice.circuit import build
from nsspice.circuit.gate_drives import gate_drives
from nsspice.devices.mosfets.mosfet_switch import MosfetSwitch
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text
from nsspice.screening.candidates import candidates
from nsspice.screening.edits import without
from nsspice.screening.result import EffectRow, EffectsReport

POWER = ".model X VDMOS(Vto=2 Kp=20 mtriode=1.5 theta=0.02 Rd=10m Rs=5m Rg=1 Rb=20m Is=1p N=1.1"
POWER += " Cgs=1n Cjo=1n BV=60)"
SWITCH = ".options mosfet=switch\n"


def drives(text: str) -> dict[str, float]:
    return gate_drives(parse_text(f"t\n{text}\nRl d 0 1\n{POWER}\n.model P PMOS\n").elements)


@pytest.mark.parametrize(
    ("text", "drive"),
    [
        ("V1 g 0 PULSE(0 8 0 1n 1n 1u 2u)\nM1 d g 0 X", 8.0),
        ("V1 a s PULSE(-5 15 0 1n 1n 1u 2u)\nR1 a g 5\nRd g s 10k\nM1 d g s X\nRs s 0 1", 15.0),
        ("V1 a 0 PWL(0 0 1u 9 2u 0)\nL1 a g 5n\nM1 d g 0 X", 9.0),
        ("V1 a 0 SIN(2 5 1k)\nE1 g s a 0 2\nM1 d g s X\nRs s 0 1", 14.0),
        ("V1 g 0 PULSE(0 5 0 1n 1n 1u 2u)\nV2 s 0 5\nM1 d g s P", 5.0),
        ("V1 g s -12\nV2 s 0 24\nM1 d g s P", 12.0),
    ],
)
def test_the_drive_is_that_of_the_sources(text: str, drive: float):
    assert drives(text) == {"m1": pytest.approx(drive)}


def test_a_gate_without_sources_has_no_known_drive():
    assert drives("M1 d g 0 X\nC1 g 0 1n\nRg g 0 1k") == {}


def device(text: str) -> MosfetSwitch:
    circuit = build(parse_text(f"t\n{text}\n"))
    found = next(d for d in circuit.devices if d.name == "m1")
    assert isinstance(found, MosfetSwitch)
    return found


@pytest.mark.parametrize("sign", [1, -1])
def test_on_resistance_is_that_of_the_smooth_transistor(sign: int):
    kind = "nchan" if sign > 0 else "pchan"
    card = POWER.replace("VDMOS(Vto=2", f"VDMOS({kind} Vto={2 * sign}")
    text = f"Vg g 0 {8 * sign}\nM1 d g 0 X m=2\nI1 0 d {1e-3 * sign}\n{card}\n"
    (smooth,) = nsspice.read(f"t\n{text}.save v(d)\n.op\n").run()
    (switch,) = nsspice.read(f"t\n{text}{SWITCH}.save v(d)\n.op\n").run()
    assert switch["v(d)"][0] == pytest.approx(smooth["v(d)"][0], rel=1e-4)


def test_the_body_diode_is_that_of_the_card():
    text = f"Vg g 0 8\nM1 d g 0 X\nRd d 0 1\n{POWER}\n{SWITCH}"
    made = device(text)
    (fwd, rev) = made.legs["d"].body.parts.pairs
    current = 0.1 / made.law.ron
    vt = 8.617333262e-5 * 300.15
    assert fwd.offset == pytest.approx(1.1 * vt * math.log1p(current / 1e-12), rel=1e-9)
    assert fwd.resistance == 0.02
    assert rev.offset == 60.0


def test_what_is_left_out_is_said_once():
    text = f"t\nVg g 0 8\nM1 d g 0 X\nM2 d g 0 X\nRd d 0 1\n{POWER}\n{SWITCH}.op\n"
    (told,) = [w.message for w in nsspice.read(text).warnings if w.code == "NS2059"]
    assert told.startswith("m1 and 1 more read as a switch")
    assert "at 8 V of the gate" in told
    assert "omitted: rg, cgs, cjo" in told


@pytest.mark.parametrize("level", [1, 2, 3])
def test_cards_of_other_levels_that_say_vto_and_kp(level: int):
    text = f"""Vg g 0 5
M1 d g 0 0 N W=20u L=2u
Rd d 0 1
.model N NMOS(LEVEL={level} switch VTO=0.7 KP=50u THETA=0.1 VMAX=1e5)"""
    made = device(text)
    # of LEVEL=3 the mobility in the field of the gate, too
    field = 1.43 if level == 3 else 1.0
    assert made.law.ron == pytest.approx(field / (50e-6 * 10 * 4.3), rel=1e-5)
    assert made.law.on_above == pytest.approx(0.7)


def test_an_inverter_of_switches():
    text = f"""t
Vdd vdd 0 5
Vin in 0 PULSE(0 5 1n 0.1n 0.1n 5n 10n)
M1 a in vdd vdd P W=20u L=1u
M2 a in 0 0 N W=10u L=1u
C1 a 0 1p
.model N NMOS(VTO=0.8 KP=60u)
.model P PMOS(VTO=-0.9 KP=25u)
{SWITCH}.measure tran low FIND v(a) AT=5n
.measure tran high FIND v(a) AT=0.9n
.tran 0.1n 10n
"""
    (solution,) = nsspice.read(text).run()
    assert [i.method for i in solution.islands] == ["modewise"]
    assert solution.measures["high"] == pytest.approx(5.0, abs=1e-9)
    # the NMOS discharges it over 1/(beta u) = 397 Ohm from when its gate passes the threshold
    assert 0.0 <= solution.measures["low"] <= 5.0 * math.exp(-9.0)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (f"Vg g 0 1\nM1 d g 0 X\nRd d 0 1\n{POWER}\n{SWITCH}", "NS2005"),
        (f"Vg g 0 8\nM1 d g 0 X\nRd d 0 1\n{POWER}\n.options mosfet=ideal\n", "NS1010"),
        ("Vg g 0 8\nM1 d g 0 0 X\nRd d 0 1\n.model X NMOS(LEVEL=54 switch)\n", "NS2008"),
    ],
)
def test_what_cannot_be_read(text: str, code: str):
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"t\n{text}"))
    assert code in [d.code for d in caught.value.diagnostics]


def test_the_drive_may_be_said():
    made = device(f"M1 d g 0 X\nRg g 0 1\nRd d 0 1\n{POWER}\n.options mosfet=switch vgson=12\n")
    g = 20 * 1.5 * 10 / (1 + 0.02 * 12)
    assert made.law.ron == pytest.approx(0.015 + 1 / g, rel=1e-6)


def test_effects_try_the_switch():
    text = f"buck\nVg g 0 8\nM1 d g 0 X\nR1 d 0 1\n{POWER}\n.tran 1u 2u\n"
    deck = parse_text(text)
    (edit,) = [e for e in candidates(build(deck)) if e.kind == "switch"]
    made = build(without(deck, [edit])).devices[1]
    assert isinstance(made, MosfetSwitch)
    row = EffectRow(edit, 1e-4, "m", 9.0, 9.0, "drop")
    cheap = EffectsReport("buck", 1e-3, [row]).deck(text, deck)
    again = build(parse_text(cheap)).devices[1]
    assert isinstance(again, MosfetSwitch)
    assert again.law == made.law


DRIVEN = """a gate behind a resistor
Vd d 0 10
Vg s 0 PULSE(0 10 0 1n 1n 5u 10u)
Rg s g 100
Rd d x 1k
M1 x g 0 X
.model X VDMOS(Vto=3 Kp=10 {cgs})
.options {option}
.tran 1n 1u
.measure tran delay WHEN v(x)=5 fall=1
"""


@pytest.mark.parametrize("charged", [True, False])
def test_instants_that_depend_on_the_gate_charge_are_said_to(charged: bool):
    """1 nF behind 100 Ohm comes to 3 V of 10 V in 100 ns ln(10/7), and to zero delay without."""
    text = DRIVEN.replace("{cgs}", "Cgs=1n" if charged else "")
    delays, told = [], []
    for option in ("mosfet=model", "mosfet=switch"):
        circuit = nsspice.read(text.replace("{option}", option))
        delays.append(circuit.run()[0].measures["delay"])
        words = " ".join(w.message for w in circuit.warnings)
        told.append("without gate charge it switches as soon as" in words)
    lag = 100e-9 * math.log(10.0 / 7.0) if charged else 0.0
    # 5 mA of the load need 32 mV over the threshold; the edge takes 1 ns
    assert delays[0] == pytest.approx(lag, abs=1.5e-9)
    assert delays[1] == pytest.approx(0.3e-9, rel=1e-6)  # 3 V of the edge
    assert told == [False, charged]
