"""The power MOSFET VDMOS: ngspice's characteristics and edges, its charges, its cards."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.circuit import build
from nsspice.compare.ngspice import run as ngspice_run
from nsspice.devices.diodes.number_tape import NumberTape
from nsspice.devices.mosfets.vdmos_law import VdmosLaw, at_temperature
from nsspice.devices.stamper import Conditions
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text

CARDS = {
    "channel": "Vto={v} Kp=10",
    "all of it": "Vto={v} Kp=10 lambda=0.02 theta=0.03 mtriode=1.5 ksubthres=0.08 subshift=0.05 "
    "Rd=20m Rs=10m Rg=2 Rb=30m Rds=1meg Is=1p N=1.1 BV=9.3 IBV=1m NBV=1.5",
    "temperature": "Vto={v} Kp=10 tcvth=4m mu=-1.7 Rd=20m trd1=5m trd2=1u Rs=5m trs1=2m Is=1n "
    "ksubthres=0.2 tksubthres1=1m eg=1.0 xti=2 Rb=10m trb1=3m",
    "exponent of rd": "Vto={v} Kp=10 Rd=20m texp0=1.6",
}


def codes(text: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"title\n{text}\n"))
    return sorted(d.code for d in caught.value.diagnostics)


@pytest.mark.parametrize("sign", [1, -1], ids=["nchan", "pchan"])
@pytest.mark.parametrize("card", CARDS.values(), ids=CARDS)
def test_characteristics_are_those_of_ngspice(card: str, sign: int):
    """Over v_ds from a conducting body diode to breakdown, and v_gs; at 80 degrees Celsius.

    Two in parallel break down at 2 IBV, in ngspice 39 at IBV: there is one if there is a BV.
    """
    count = 1 if "BV" in card else 2
    kind = "nchan" if sign > 0 else "pchan"
    text = f"""t
M1 d g 0 MX m={count}
Vd d 0 0
Vg g 0 0
.model MX VDMOS({kind} {card.format(v=2 * sign)})
.temp 80
.dc Vd {-0.5 * sign} {9.5 * sign} {0.5 * sign} Vg {-sign} {8 * sign} {0.75 * sign}
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    other = ngspice_run(circuit, signals=["i(vd)"])
    mine, theirs = np.ravel(solution["i(vd)"]), np.ravel(other["i(vd)"])
    assert np.abs(mine).max() > 1.0
    assert np.abs(mine - theirs).max() <= 1e-6 * np.abs(theirs).max()


def test_edges_are_those_of_ngspice():
    """A p-channel switch with all charges, ohmic load; 1e-3 of the supply."""
    text = """t
V1 p 0 12
M1 a g p MX
R1 a 0 10
Vg g1 p PULSE(0 -10 50n 10n 10n 0.4u 1u)
Rg g1 g 5
.model MX VDMOS(pchan Vto=-3 Kp=20 Rg=2 Rd=30m Rs=5m Rb=10m Cgs=1n Cgdmax=1n Cgdmin=0.1n
+ a=0.4 Cjo=0.5n Vj=0.7 M=0.4 Is=1p TT=20n lambda=0.01)
.tran 2n 0.8u
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    other = ngspice_run(circuit, signals=["v(a)", "v(g)"], max_step=0.2e-9, vntol=1e-6)
    for name in ("v(a)", "v(g)"):
        theirs = np.interp(solution.time, other.time, other[name])
        assert np.abs(solution[name] - theirs).max() <= 1e-3 * 12.0


def law(vgd: float, **card: float) -> VdmosLaw[float]:
    p = at_temperature(card, True, Conditions(), None, 0.0)
    return VdmosLaw(NumberTape(), p, {"gs": 0.0, "gd": vgd, "ds": -vgd})


@pytest.mark.parametrize("vgd", [-20.0, -1.0, -1e-3, 1e-3, 0.5, 3.0, 20.0])
def test_gate_drain_charge_is_the_integral_of_its_capacitance(vgd: float):
    card = {"cgdmin": 1e-10, "cgdmax": 1e-9, "a": 0.7}
    s = 0.9e-9 / (1 + math.pi / 2)
    share = math.tanh(0.7 * vgd) if vgd > 0 else math.atan(0.7 * vgd)
    h = 1e-5
    charges = [law(vgd + d, **card).charges()["gate-drain charge"] for d in (-h, h)]
    assert None not in charges
    slope = (charges[1] - charges[0]) / (2 * h)  # type: ignore[operator]
    assert slope == pytest.approx(1e-9 - s + s * share, rel=1e-6)


def test_terminal_currents_add_up_and_the_body_diode_conducts():
    text = """t
I1 0 d -2
Vg g 0 0
M1 d g 0 MX
.model MX VDMOS(Vto=3 Kp=20 Rd=10m Rs=10m Rg=1 Rb=20m Is=1p Cgs=1n)
.save i(m1) i(m1.s) i(m1.g) v(d)
.op
"""
    (solution,) = nsspice.read(text).run()
    d, s, g, v = (float(solution[n][0]) for n in ("i(m1)", "i(m1.s)", "i(m1.g)", "v(d)"))
    assert d == pytest.approx(-2.0, rel=1e-12)
    assert d + s + g == pytest.approx(0.0, abs=1e-12)
    vt = 8.617333262e-5 * 300.15
    assert -v == pytest.approx(vt * math.log1p(2e12) + 2 * 0.02, rel=1e-6)


def test_small_signals_of_the_gate():
    """The gate's input is Rg in series with Cgs and Cgd (1 + gain) at low gain: no load here."""
    text = """t
Vd d 0 10
Vg g 0 DC 0 AC 1
M1 d g 0 MX
.model MX VDMOS(Vto=3 Kp=20 Rg=10 Cgs=1n Cgdmin=0.1n Cgdmax=0.1n)
.ac lin 1 1meg 1meg
"""
    (solution,) = nsspice.read(text).run()
    c, w = 1.1e-9, 2e6 * math.pi
    assert -solution["i(vg)"][0] == pytest.approx(1 / (10 + 1 / (1j * w * c)), rel=1e-6)


def test_initial_charges():
    text = """t
M1 d g 0 MX ic=5,2
Rg g 0 1k
Rd d 0 1meg
.model MX VDMOS(Vto=3 Kp=20 Cgs=1n Cgdmax=1n Cgdmin=0.2n Cjo=1n)
.save v(g) v(d)
.tran 1p 10p uic
"""
    (solution,) = nsspice.read(text).run()
    assert solution["v(g)"][0] == pytest.approx(2.0, abs=1e-9)
    assert solution["v(d)"][0] == pytest.approx(5.0, abs=1e-9)


@pytest.mark.parametrize(
    ("line", "card", "code"),
    [
        ("M1 d g 0 N", "VDMOS(Vto=1 Kp=-1)", "NS2005"),
        ("M1 d g 0 N", "VDMOS(Vto=1 Kp=1 ksubthres=0)", "NS2005"),
        ("M1 d g 0 N", "VDMOS(Vto=1 Kp=1 Cgdmin=2n Cgdmax=1n)", "NS2005"),
        ("M1 d g 0 N", "VDMOS(Vto=1 Kp=1 Rq=1)", "NS2008"),
        ("M1 d g 0 N", "VDMOS(Vto=1 Kp=1 gamma=1)", "NS2003"),
        ("M1 d g 0 N m=0", "VDMOS(Vto=1 Kp=1)", "NS2005"),
        ("M1 d g 0 tj tc N thermal", "VDMOS(Vto=1 Kp=1)", "NS1009"),
        ("M1 d g 0 N thermal", "VDMOS(Vto=1 Kp=1)", "NS2008"),
    ],
)
def test_wrong_cards(line: str, card: str, code: str):
    assert code in codes(f"Vd d 0 1\nVg g 0 1\n{line}\n.model N {card}")


def test_what_a_card_leaves_out_is_said():
    circuit = nsspice.read(
        "t\nV1 d 0 1\nM1 d d 0 b X\nRb b 0 1\n.model X VDMOS(Ron=1m mfg=me)\n.op\n"
    )
    told = {w.code: w.message for w in circuit.warnings}
    assert "Vto = 0 and Kp = 1" in told["NS2058"]
    assert any("fourth node" in w.message for w in circuit.warnings)
