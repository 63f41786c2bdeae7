"""SPICE's MOSFET of LEVEL=1: ngspice's characteristics and edges, conserved charges, its cards."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.circuit import build
from nsspice.compare.ngspice import run as ngspice_run
from nsspice.devices.diodes.number_tape import NumberTape
from nsspice.devices.mosfets.level1_law import Level1Law
from nsspice.devices.mosfets.level1_thermal import at_temperature
from nsspice.devices.stamper import Conditions
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text

CARDS = {
    "channel": "VTO={v} KP=50u",
    "body and length": "VTO={v} KP=50u LAMBDA=0.02 GAMMA=0.4 PHI=0.65 LD=0.1u",
    "resistances": "VTO={v} KP=50u LAMBDA=0.02 GAMMA=0.4 RD=100 RSH=50",
    "process": "TOX=50n NSUB=1e16 NSS=1e10 TPG=1 UO=550",
    "process, gate like body": "TOX=50n NSUB=1e16 TPG=-1 JS=1e-4",
    "process, aluminium": "TOX=50n NSUB=1e16 TPG=0",
}
SIZE = {"w": 1e-5, "l": 1e-6, "ad": 0.0, "as": 0.0, "pd": 0.0, "ps": 0.0, "nrd": 1.0, "nrs": 1.0}


def codes(text: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"title\n{text}\n"))
    return sorted(d.code for d in caught.value.diagnostics)


def point(text: str, *signals: str) -> list[float]:
    (solution,) = nsspice.read(f"t\n{text}\n.save {' '.join(signals)}\n.op\n").run()
    return [float(solution[s][0]) for s in signals]


@pytest.mark.parametrize("sign", [1, -1], ids=["nmos", "pmos"])
@pytest.mark.parametrize("card", CARDS.values(), ids=CARDS)
def test_characteristics_are_those_of_ngspice(card: str, sign: int):
    """Over the plane of v_ds of both signs and v_gs; the body blocks in all points."""
    kind = "NMOS" if sign > 0 else "PMOS"
    text = f"""t
M1 d g 0 b MX W=20u L=2u AD=100p AS=100p NRD=2 NRS=1 m=2
Vd d 0 0
Vg g 0 0
Vb b 0 {-3 * sign}
.model MX {kind}(LEVEL=1 {card.format(v=0.8 * sign)})
.temp 60
.dc Vd {-2.9 * sign} {5.1 * sign} {0.5 * sign} Vg {-sign} {5 * sign} {0.75 * sign}
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    other = ngspice_run(circuit, signals=["i(vd)"])
    mine, theirs = np.ravel(solution["i(vd)"]), np.ravel(other["i(vd)"])
    assert np.abs(mine).max() > 1e-3
    assert np.abs(mine - theirs).max() <= 1e-6 * np.abs(theirs).max()


@pytest.mark.parametrize("temperature", [27, 100])
@pytest.mark.parametrize("sign", [1, -1], ids=["nmos", "pmos"])
def test_forward_body_junctions_are_those_of_ngspice(sign: int, temperature: int, monkeypatch):
    """With the constants of 2014, which ngspice 39 has: k/q is 3.4e-7 less than that of the SI.

    A junction at 0.9 V multiplies that by v q/kT, 35 at 27 degrees: 1.2e-5 of its current.
    """
    kind = "NMOS" if sign > 0 else "PMOS"
    text = f"""t
M1 d g 0 0 MX W=10u L=1u
Vd d 0 0
Vg g 0 {2 * sign}
.model MX {kind}(LEVEL=1 VTO={sign} KP=1m LAMBDA=0.02 GAMMA=0.5 IS=1e-14)
.temp {temperature}
.dc Vd {-0.9 * sign} {sign} {0.1 * sign}
"""

    def worst() -> float:
        circuit = nsspice.read(text)
        mine = np.ravel(circuit.run()[0]["i(vd)"])
        theirs = np.ravel(ngspice_run(circuit, signals=["i(vd)"])["i(vd)"])
        return float(np.abs(mine - theirs).max() / np.abs(theirs).max())

    assert 1e-6 < worst() < 2e-5
    monkeypatch.setattr("nsspice.devices.temperature.BOLTZMANN", 1.38064852e-23)
    monkeypatch.setattr("nsspice.devices.temperature.CHARGE", 1.6021766208e-19)
    assert worst() < 1e-8


def test_edges_are_those_of_ngspice():
    """Overlap and junction charges in an inverter; its currents are those of fine steps."""
    text = """t
Vdd vdd 0 5
Vin in 0 PULSE(0 5 0.2n 0.2n 0.2n 1n 3n)
M1 a in vdd vdd P W=20u L=1u AD=40p AS=40p PD=24u PS=24u
M2 a in 0 0 N W=10u L=1u AD=20p AS=20p PD=14u PS=14u
C1 a 0 20f
.model N NMOS(VTO=0.8 KP=60u LAMBDA=0.02 GAMMA=0.5 CGSO=0.3n CGDO=0.3n CGBO=0.4n CJ=0.3m
+ CJSW=0.3n MJSW=0.33 RD=20 RS=20)
.model P PMOS(VTO=-0.9 KP=25u LAMBDA=0.03 GAMMA=0.6 CGSO=0.3n CGDO=0.3n CGBO=0.4n CBD=20f
+ CBS=20f PB=0.9 MJ=0.4 RD=20 RS=20)
.tran 10p 2.5n
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    other = ngspice_run(circuit, signals=["v(a)"], max_step=1e-12, abstol=1e-13, vntol=1e-8)
    theirs = np.interp(solution.time, other.time, other["v(a)"])
    assert np.abs(solution["v(a)"] - theirs).max() <= 1e-3 * 5.0


def channel(overdrive: float, drain: float, **card: float) -> Level1Law[float]:
    given = {"vto": 0.8, "kp": 6e-5, "phi": 0.7, "tox": 2e-8, **card}
    p = at_temperature(given, SIZE, True, Conditions(), None, 0.0)
    vgs = 0.8 + overdrive
    v = {"gs": vgs, "gd": vgs - drain, "ds": drain, "bs": 0.0, "bd": -drain, "gb": vgs}
    return Level1Law(NumberTape(), p, v)


@pytest.mark.parametrize("drain", [-3.0, -0.5, 0.1, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("overdrive", [0.2, 1.0, 3.0])
def test_the_gate_has_meyers_charge(overdrive: float, drain: float):
    """Derivatives of its charge by v_gs and v_gd are Meyer's capacitances above the threshold."""
    h = 1e-6
    u, w = max(overdrive, 0.0), max(overdrive - drain, 0.0)
    if min(overdrive, overdrive - drain) > 0.0:
        meyer = [1.0 - w**2 / (u + w) ** 2, 1.0 - u**2 / (u + w) ** 2]
    else:
        meyer = [float(u > w), float(w > u)]

    def charge(du: float, dw: float) -> float:
        found = channel(overdrive + du, drain + du - dw).charges(apart=True)
        gs, gd = found["gate-source charge"], found["gate-drain charge"]
        assert gs is not None
        assert gd is not None
        return gs + gd

    oxide = channel(overdrive, drain).p["oxide"]
    by_source = (charge(h, 0.0) - charge(-h, 0.0)) / (2 * h)
    by_drain = (charge(0.0, h) - charge(0.0, -h)) / (2 * h)
    expected = [2.0 / 3.0 * oxide * share for share in meyer]
    assert [by_source, by_drain] == pytest.approx(expected, abs=1e-6 * oxide)


def test_source_and_drain_may_be_exchanged():
    here, there = channel(1.3, 0.7), channel(0.6, -0.7)
    assert here.channel() == pytest.approx(-there.channel(), rel=1e-14)
    one, two = here.charges(apart=True), there.charges(apart=True)
    assert one["gate-source charge"] == pytest.approx(two["gate-drain charge"], rel=1e-14)
    assert one["gate-drain charge"] == pytest.approx(two["gate-source charge"], rel=1e-14)


def test_no_charge_is_lost_in_a_cycle():
    """The charge into the gate of a pass transistor comes back, of which ngspice 39 loses 49 fC.

    The tolerance is that of the quadrature of its surges, 1 % of the charge of the oxide at 5 V.
    """
    text = """t
Vg g 0 PULSE(0 5 1n 1n 1n 4n 10n)
Vd d 0 PULSE(0 3 3n 1n 1n 4n 10n)
M1 d g s 0 N W=10u L=1u
C1 s 0 50f
.model N NMOS(VTO=0.8 KP=60u TOX=20n IS=0)
.measure tran q INTEG i(Vg) FROM=90n TO=100n
.tran 0.1n 100n
"""
    (solution,) = nsspice.read(text).run()
    oxide = channel(1.0, 1.0).p["oxide"]
    assert abs(solution.measures["q"]) <= 1e-2 * oxide * 5.0


def test_small_signals():
    """Gain -gm/(g + gds) with gm = beta u (1 + lambda v), gds = lambda beta u^2 / 2."""
    text = """t
Vdd vdd 0 5
Vg g 0 DC 1.5 AC 1
M1 d g 0 0 N W=10u L=1u
R1 vdd d 10k
.model N NMOS(VTO=0.8 KP=60u LAMBDA=0.02)
.ac lin 1 1k 1k
"""
    (solution,) = nsspice.read(text).run()
    beta, u = 6e-4, 0.7
    half = 0.5 * beta * u * u
    v = (5.0 - 1e4 * half) / (1.0 + 1e4 * half * 0.02)
    gain = -beta * u * (1.0 + 0.02 * v) / (1e-4 + half * 0.02)
    assert solution["v(d)"][0].real == pytest.approx(gain, rel=1e-7)


def test_terminal_currents_add_up():
    text = """Vd d 0 2
Vg g 0 3
Vb b 0 -1
Rs s 0 100
M1 d g s b N W=10u L=1u
.model N NMOS(VTO=0.8 KP=60u GAMMA=0.4 RD=50)"""
    parts = point(text, "i(m1)", "i(m1.g)", "i(m1.s)", "i(m1.b)", "v(s)")
    assert parts[0] > 1e-4
    assert sum(parts[:4]) == pytest.approx(0.0, abs=1e-15)
    assert -parts[2] == pytest.approx(parts[4] / 100, rel=1e-9)


def test_currents_of_a_tied_body_are_those_of_the_source():
    text = """I1 0 s 1
Vd d 0 0
Vg g 0 0
M1 d g s s N W=10m L=1u
.model N NMOS(VTO=1 KP=100u RD=10m RS=20m IS=1p RDS=1k TT=1n)"""
    d, s, g = point(text, "i(m1)", "i(m1.s)", "i(m1.g)")
    assert s == pytest.approx(1.0, rel=1e-9)
    assert d + s + g == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("level", [2, 3])
def test_cards_whose_other_effects_are_zero_are_square_laws(level: int):
    """The power MOSFETs of PSpice's libraries."""
    text = f"""t
M1 d g 0 0 MX
Vd d 0 0
Vg g 0 0
.model MX NMOS(LEVEL={level} GAMMA=0 DELTA=0 ETA=0 THETA=0 KAPPA=0 VMAX=0 XJ=0 TOX=100n UO=600
+ PHI=.6 RS=1.624m KP=20.53u W=.3 L=2u VTO=2.831 RD=1.031m CBD=3.229n PB=.8 CGSO=9n IS=194E-18)
.dc Vd -0.5 10 1 Vg 0 10 2
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    theirs = np.ravel(ngspice_run(circuit, signals=["i(vd)"])["i(vd)"])
    assert np.abs(np.ravel(solution["i(vd)"]) - theirs).max() <= 1e-6 * np.abs(theirs).max()


def test_gate_resistance_and_transit_time():
    """At the gate Rg in series with the overlap; beside the junction's conductance TT times it."""
    text = """t
Vg g 0 DC 0 AC 1
Vb b 0 DC 0.6 AC 1
M1 0 g 0 b N W=1m L=1u
.model N NMOS(VTO=1 CGSO=1n CGDO=1n RG=1k IS=1f TT=1u)
.ac lin 1 1meg 1meg
"""
    (solution,) = nsspice.read(text).run()
    w = 2e6 * math.pi
    assert -solution["i(vg)"][0] == pytest.approx(1 / (1e3 + 1 / (1j * w * 2e-12)), rel=1e-6)
    vt = 8.617333262e-5 * 300.15
    g = 2 * 1e-15 / vt * math.exp(0.6 / vt)
    assert -solution["i(vb)"][0] == pytest.approx(g * (1 + 1j * w * 1e-6), rel=1e-6)


def test_initial_voltages_and_default_sizes():
    text = """t
M1 d g 0 0 N ic=2,3
C1 d 0 1p ic=2
Vg g 0 3
.options defw=20u defl=4u
.model N NMOS(VTO=1 KP=100u CGDO=1n)
.save v(d) i(m1)
.tran 1p 10p uic
"""
    (solution,) = nsspice.read(text).run()
    assert solution["v(d)"][0] == pytest.approx(2.0, abs=1e-9)
    beta = 1e-4 * 20 / 4
    # the current of the channel and that of the overlap, which the falling drain discharges
    channel_current = beta * (2 * 2 - 2)
    slope = channel_current / (1e-12 + 1e-9 * 20e-6)
    assert solution["i(m1)"][0] == pytest.approx(channel_current - 1e-9 * 20e-6 * slope, rel=1e-3)


@pytest.mark.parametrize(
    ("line", "card", "code"),
    [
        ("M1 d g 0 0 N", "NMOS(KP=-1)", "NS2005"),
        ("M1 d g 0 0 N", "NMOS(PHI=0)", "NS2005"),
        ("M1 d g 0 0 N", "NMOS(FC=1)", "NS2005"),
        ("M1 d g 0 0 N", "NMOS(TOX=20n NSUB=1)", "NS2005"),
        ("M1 d g 0 0 N", "NMOS(TPG=2)", "NS2005"),
        ("M1 d g 0 0 N", "NMOS(VTOO=1)", "NS2003"),
        ("M1 d g 0 0 N", "NMOS(RB=1)", "NS2008"),
        ("M1 d g 0 0 N W=0", "NMOS", "NS2005"),
        ("M1 d g 0 0 N L=1u", "NMOS(LD=1u)", "NS2005"),
        ("M1 d g 0 0 N m=-1", "NMOS", "NS2005"),
        ("M1 d g 0 0 N", "NMOS(LEVEL=2 VMAX=1e5)", "NS2008"),
    ],
)
def test_wrong_cards(line: str, card: str, code: str):
    assert code in codes(f"Vd d 0 1\nVg g 0 1\n{line}\n.model N {card}")


def test_temperature_follows_the_threshold():
    card = {"vto": 0.8, "kp": 6e-5}
    cold, hot = (
        at_temperature(card, SIZE, True, Conditions(temperature=t), None, 0.0) for t in (27, 127)
    )
    assert hot["beta"] / cold["beta"] == pytest.approx((400.15 / 300.15) ** -1.5, rel=1e-12)
    assert hot["vbi"] < cold["vbi"] == 0.8
    assert math.isclose(cold["isd"], 1e-14)
