"""Thyristors: the characteristic of appendix B, example 4.3, and gate control."""

from __future__ import annotations

import numpy as np
import pytest
from oracle.newton import Static

from nsspice.circuit import MnaSystem, build
from nsspice.circuit.explain import explain
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text

#: phi(0) = 2, phi'(0) = 3, falling between 0.447 and 1.267, phi(2) = 4, phi'(2) = 6
CURVE = "V={2 + 3*i - 4.5*i^2 + 1.75*i^3} alpha=2 Ron=8 Vrev=1"
GATED = "scr(vbo=100 vh=1 ih=0.1 ron=0.5 igt=10m vgt=0.7 rg=20 vrev=200)"


def assembled(text: str) -> MnaSystem:
    circuit = build(parse_text(f"title\n{text}\n"))
    assert len(circuit.islands) == 1
    return circuit.islands[0].assemble()


def codes(text: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"title\n{text}\n"))
    return sorted(d.code for d in caught.value.diagnostics)


def phi(z: float) -> float:
    return 2 + 3 * z - 4.5 * z**2 + 1.75 * z**3


@pytest.mark.parametrize("z", [-3.0, -0.1, 0.2, 0.8, 1.9, 2.5, 40.0])
def test_every_piece_of_the_characteristic(z: float):
    v = phi(z) if 0 < z <= 2 else (8 * (z - 2) + 4 if z > 2 else 8 * z - 1)
    mna = assembled(f"I1 0 a {z!r}\nD1 a 0 scr\n.model scr SCR({CURVE})")
    static = Static(mna.system)
    guess = np.full(static.n + static.m, z)
    (x,) = static.solutions([z], guesses=[guess])
    assert x[0] == pytest.approx(v, rel=1e-12)
    assert static.output(mna.functional("i(d1)"), x, [z]) == pytest.approx(z, rel=1e-12)


def test_no_current_between_breakdown_and_breakover():
    text = "V1 a 0 {0!r}\nR1 a b 1\nD1 b 0 scr\n.model scr SCR({1})"
    for v in (-0.99, 0.0, 1.99):
        mna = assembled(text.format(v, CURVE))
        static = Static(mna.system)
        (x,) = static.solutions([w.values[0] for w in mna.system.waveforms])
        assert mna.voltage("b", x) == pytest.approx(v, abs=1e-12)


def test_parallel_thyristors_share_the_current():
    mna = assembled(f"I1 0 a 5\nD1 a 0 scr m=2\n.model scr SCR({CURVE})")
    static = Static(mna.system)
    (x,) = static.solutions([5.0], guesses=[np.full(static.n + static.m, 5.0)])
    assert x[0] == pytest.approx(4 + 8 * 0.5)


def on_and_off(gate: float) -> list[float]:
    """Return the anode currents of all solutions with 50 V over 100 Ohm."""
    text = f"V1 a 0 50\nR1 a b 100\nD1 b 0 g m1\nI1 0 g {gate!r}\n.model m1 {GATED}"
    mna = assembled(text)
    static = Static(mna.system)
    u = [w.values[0] for w in mna.system.waveforms]
    guesses = [np.zeros(static.n + static.m), np.full(static.n + static.m, 0.5)]
    found = static.solutions(u, guesses=guesses)
    return sorted({round(static.output(mna.functional("i(d1)"), x, u), 9) for x in found})


def test_the_gate_triggers():
    conducting = round((50 - 1) / 100.5, 9)
    # blocked and conducting are both solutions until the gate takes the first one away; the third
    # one lies on the falling branch between them
    assert on_and_off(0.0)[0] == 0.0
    assert on_and_off(0.0)[-1] == conducting
    assert on_and_off(10e-3) == [conducting]


def test_the_gate_is_a_diode_to_the_cathode():
    mna = assembled(f"V1 a 0 50\nR1 a b 100\nD1 b 0 g m1\nI1 0 g 5m\n.model m1 {GATED}")
    assert mna.pairs == ["d1.fwd", "d1.rev", "d1.gate"]
    static = Static(mna.system)
    u = [w.values[0] for w in mna.system.waveforms]
    x = next(iter(static.solutions(u)))
    assert x[mna.unknowns.index("v(g)")] == pytest.approx(0.7 + 5e-3 * 20)
    assert static.output(mna.functional("i(d1.g)"), x, u) == pytest.approx(5e-3)
    assert static.output(mna.functional("i(d1.k)"), x, u) == pytest.approx(-5e-3)


def test_explain_and_wrong_models():
    circuit = build(
        parse_text(f"t\nV1 a 0 1\nR1 a b 1\nD1 b 0 g m1\nR2 g 0 1\n.model m1 {GATED}\n")
    )
    shown = explain(circuit).text()
    for part in ("breakover (vbo=100 V)", "holding current (ih=0.1 A)", "gate trigger current"):
        assert part in shown
    assert "thyristor d1" in shown
    base = "V1 a 0 1\nR1 a b 1\nD1 b 0 {}\n.model m1 {}"
    assert codes(base.format("m1", "scr(ih=1)")) == ["NS2005"]
    assert codes(base.format("a m1", "scr(vbo=5 ih=1)")) == ["NS2005"]
    assert codes(base.format("m1", "scr(vbo=5 ih=1 vh=9)")) == ["NS2005"]
    assert codes(base.format("m1", "scr(vbo=5 ih=1 V={i})")) == ["NS2005", "NS2005"]
    assert codes(base.format("a m1", "d(ideal)")) == ["NS2002"]
    assert codes(base.format("m1", "scr(vbo=5 ih=1 zz=3)")) == ["NS2003"]
