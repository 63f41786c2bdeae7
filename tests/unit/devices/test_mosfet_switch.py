"""MOSFETs that are switches: channel, body diodes, terminal currents, what their cards may say."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.circuit import build
from nsspice.compare.ngspice import run as ngspice_run
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text
from nsspice.problems.descriptor import Switch


def point(text: str, *signals: str) -> list[float]:
    (solution,) = nsspice.read(f"t\n{text}\n.save {' '.join(signals)}\n.op\n").run()
    return [float(solution[s][0]) for s in signals]


def codes(text: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"title\n{text}\n"))
    return sorted(d.code for d in caught.value.diagnostics)


def test_channel_and_body_diode_are_two_pairs():
    circuit = build(parse_text("t\nV1 d 0 1\nV2 g 0 1\nM1 d g 0 N\n.model N NMOS(ideal Vto=2)\n"))
    mna = circuit.islands[0].assemble()
    assert mna.pairs == ["m1", "m1.bd"]
    gate = mna.unknowns.index("v(g)")
    assert mna.system.switches == (Switch(0, ((gate, 1.0),), 2.0, 2.0),)
    assert mna.system.smooth is None


@pytest.mark.parametrize(
    ("gate", "drain", "current"),
    # the channel carries both directions, the diode (0.7 V, 10 mOhm) one; in parallel they share
    [
        (5.0, 1.0, 1.0 / 0.1),
        (0.0, 1.0, 0.0),
        (0.0, -1.0, -0.3 / 0.01),
        (5.0, -0.5, -0.5 / 0.1),
        (5.0, -1.0, -1.0 / 0.1 - 0.3 / 0.01),
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_current_of_each_state(gate: float, drain: float, current: float, sign: float):
    kind = "NMOS" if sign > 0 else "PMOS"
    text = f"""V1 d 0 {sign * drain}
V2 g 0 {sign * gate}
M1 d g 0 N m=2
.model N {kind}(ideal Vto={sign * 3} Ron=0.2 body=DB)
.model DB D(Vfwd=0.7 Ron=0.02)"""
    signals = "i(m1)", "i(m1.s)", "i(m1.g)", "p(m1)"
    found = point(text, *signals)
    expected = [sign * current, -sign * current, 0.0, drain * current]
    assert found == pytest.approx(expected, abs=1e-12)


def test_a_body_of_its_own_has_two_diodes():
    text = """V1 d 0 -1
V2 s 0 -2
V3 b 0 0
V4 g 0 -5
M1 d g s b N
.model N NMOS(Ron=1 Vto=2 body=DB)
.model DB D(Vfwd=0.5 Ron=1)"""
    found = point(text, "i(m1)", "i(m1.s)", "i(m1.b)", "p(m1)")
    assert found == pytest.approx([-0.5, -1.5, 2.0, 0.5 + 3.0], abs=1e-12)


def test_a_smooth_body_diode():
    text = """I1 0 s 1m
M1 0 g s N
V1 g 0 0
.model N NMOS(ideal Vto=2 body=DB)
.model DB D(IS=1f)"""
    (v,) = point(text, "v(s)")
    assert v == pytest.approx(8.617333262e-5 * 300.15 * np.log(1 + 1e12), rel=1e-9)


def test_hysteresis_and_threshold():
    text = """t
V1 d 0 1
R1 d a 1k
M1 a g 0 N
V2 g 0 PWL(0 0 1 10 2 0)
.model N NMOS(ideal Vto=5 Vh=2)
.save v(a)
.tran 10m 2
"""
    (solution,) = nsspice.read(text).run()
    times = [event.time for event in solution.events]
    assert times == pytest.approx([0.7, 1.7], abs=1e-12)


def test_agrees_with_ngspice():
    """The 10 mV are the drop of the sharp diode that ngspice has in place of an ideal one."""
    text = """t
V1 p 0 10
M1 p g a N
M2 a g 0 P
R1 a 0 10
V2 g a PULSE(-10 10 1u 0 0 4u 10u)
.model N NMOS(ideal Vto=3 Ron=0.1)
.model P PMOS(ideal Vto=-3 Ron=0.1)
.tran 0.1u 10u
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    other = ngspice_run(circuit, signals=["v(a)"])
    rows = np.linspace(0.05e-6, 9.95e-6, 100)  # between the edges
    mine = np.interp(rows, solution.time, solution["v(a)"])
    theirs = np.interp(rows, other.time, other["v(a)"])
    assert np.abs(mine - theirs).max() <= 1e-2


@pytest.mark.parametrize(
    ("line", "card", "code"),
    [
        ("M1 d g 0 N", "NMOS(ideal Ron=-1)", "NS2005"),
        ("M1 d g 0 N", "NMOS(ideal Ron=2 Roff=1)", "NS2005"),
        ("M1 d g 0 N", "NMOS(ideal Vh=-1)", "NS2005"),
        ("M1 d g 0 N", "NMOS(ideal Kp=1)", "NS2003"),
        ("M1 d g 0 N m=0", "NMOS(ideal)", "NS2005"),
        ("M1 d g 0 N", "NPN", "NS2002"),
        ("M1 d g 0 N", "NMOS(LEVEL=54)", "NS2008"),
        ("M1 d g 0 N thermal", "NMOS(ideal)", "NS2008"),
        ("M1 d g 0 N", "NMOS(ideal body=N)", "NS2002"),
    ],
)
def test_wrong_cards(line: str, card: str, code: str):
    assert code in codes(f"V1 d 0 1\nV2 g 0 1\n{line}\n.model N {card}")


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("gate", "collector", "current"),
    [(5.0, 3.0, 2.0 / 0.1), (5.0, 0.9, 0.0), (0.0, 3.0, 0.0), (5.0, -1.0, -0.3 / 0.02)],
)
def test_an_igbt_conducts_one_way(sign: float, gate: float, collector: float, current: float):
    kind = "NIGBT" if sign > 0 else "PIGBT"
    text = f"""V1 c 0 {sign * collector}
V2 g 0 {sign * gate}
Z1 c g 0 IG m=2
.model IG {kind}(ideal Vto={sign * 3} Vce0=1 Ron=0.2 body=DB)
.model DB D(Vfwd=0.7 Ron=0.04)"""
    found = point(text, "i(z1)", "i(z1.e)", "i(z1.g)", "p(z1)")
    expected = [sign * current, -sign * current, 0.0, collector * current]
    assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("card", "code"),
    [
        ("NIGBT(AGD=1u)", "NS2008"),
        ("NIGBT(ideal Vce0=-1)", "NS2005"),
        ("NIGBT(ideal Kp=1)", "NS2003"),
        ("NMF", "NS2002"),
    ],
)
def test_wrong_igbt_cards(card: str, code: str):
    assert code in codes(f"V1 c 0 1\nV2 g 0 1\nZ1 c g 0 IG\n.model IG {card}")


def test_an_igbt_agrees_with_ngspice():
    text = """t
V1 p 0 10
Z1 p g a IG
R1 a 0 10
V2 g a PULSE(0 10 1u 0 0 4u 10u)
.model IG NIGBT(ideal Vto=3 Ron=0.1 Vce0=1)
.tran 0.1u 10u
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    other = ngspice_run(circuit, signals=["v(a)"])
    rows = np.array([0.5e-6, 2.5e-6, 4.5e-6, 7.5e-6])  # on and off, between the edges
    mine = np.interp(rows, solution.time, solution["v(a)"])
    theirs = np.interp(rows, other.time, other["v(a)"])
    assert np.abs(mine - theirs).max() <= 1e-2


def test_unknown_body_model():
    with pytest.raises(NetlistError) as caught:
        parse_text("t\nV1 d 0 1\nM1 d g 0 N\n.model N NMOS(ideal body=DX)\n.op\n")
    assert [d.code for d in caught.value.diagnostics] == ["NS1060"]
