"""Ideal thyristors: what fires them, what they cost, what their cards may say."""

from __future__ import annotations

import numpy as np
import pytest
from oracle.node_voltages import in_node_voltages

import nsspice
from nsspice.circuit import MnaSystem, build
from nsspice.circuit.explain import explain
from nsspice.compare.ngspice.translate import translate
from nsspice.errors import NetlistError, UsageError
from nsspice.netlist import parse_text
from nsspice.problems.descriptor import Switch


def assembled(text: str) -> MnaSystem:
    circuit = build(parse_text(f"title\n{text}\n"))
    return in_node_voltages(circuit.islands[0].assemble())


def solved(circuit: nsspice.Circuit) -> nsspice.Solution:
    (solution,) = nsspice.run(circuit)
    return solution


def codes(text: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"title\n{text}\n"))
    return sorted(d.code for d in caught.value.diagnostics)


def test_a_sensed_gate_is_the_control_of_one_pair():
    mna = assembled("V1 a 0 1\nR1 a b 1\nD1 b 0 g m1\nV2 g 0 0\n.model m1 SCR(Vgt=2 Vh=1 Ron=3)")
    assert mna.pairs == ["d1.fwd"]
    assert mna.system.smooth is None
    assert mna.system.q.tolist() == [1.0]
    assert mna.system.D.dense().tolist() == [[3.0]]
    gate = mna.unknowns.index("v(g)")
    assert mna.system.switches == (Switch(0, ((gate, 1.0),), 2.0, 2.0, latching=True),)


def test_breakover_lowers_the_threshold():
    mna = assembled("V1 a 0 1\nR1 a b 1\nD1 b 0 g m1\nV2 g 0 0\n.model m1 SCR(Vgt=2 Vbo=100)")
    (switch,) = mna.system.switches
    assert sorted(switch.control) == sorted(
        [(mna.unknowns.index("v(g)"), 1.0), (mna.unknowns.index("v(b)"), 0.02)]
    )


def gated(model: str, gate: str, source: str = "100") -> nsspice.Solution:
    text = f"t\nV1 a 0 {source}\nR1 a b 10\nD1 b 0 g m1\n{gate}\n.model m1 SCR({model})\n"
    return solved(nsspice.read(text + ".op\n"))


@pytest.mark.parametrize(
    ("model", "gate", "current"),
    [
        ("Vgt=1 Vh=1", "V2 g 0 5", 9.9),
        ("Vgt=1 Vh=1", "V2 g 0 1", 0.0),
        ("Vgt=1 Vh=1 Vbo=90", "V2 g 0 0", 9.9),
        ("Vgt=1 Vh=1 Vbo=120", "V2 g 0 0", 0.0),
        ("Vgt=1 Vh=1 Vbo=120", "V2 g 0 0.2", 9.9),
        ("Igt=10m Vh=1 Ron=10", "I2 0 g 11m", 99 / 20),
        ("Igt=10m Vh=1 Ron=10", "I2 0 g 9m", 0.0),
    ],
)
def test_the_operating_point(model: str, gate: str, current: float):
    assert gated(model, gate)["i(d1)"][-1] == pytest.approx(current, rel=1e-12)


def test_it_blocks_in_reverse_and_breaks_down():
    fired = "V2 g 0 5"
    assert gated("Vgt=1", fired, "-100")["i(d1)"][-1] == 0.0
    assert gated("Vgt=1 Vrev=60", fired, "-100")["i(d1)"][-1] == pytest.approx(-4.0)


def test_without_a_gate_the_breakover_fires():
    text = """t
V1 a 0 PWL(0 0 1m 100 2m 0)
R1 a b 10
D1 b 0 m1
.model m1 SCR(Vbo=50)
.tran 0.1m 2m
"""
    run = solved(nsspice.read(text))
    i = np.where((run.time > 0.5e-3) & (run.time < 2e-3), run["v(a)"] / 10, 0.0)
    away = np.abs(run.time - 0.5e-3) > 1e-9
    assert run["i(d1)"][away] == pytest.approx(i[away], abs=1e-12)


def test_currents_and_power_of_the_gate():
    run = gated("Igt=10m Vgt=0.7 Rg=20 Vh=1", "I2 0 g 50m")
    assert run["i(d1)"][-1] == pytest.approx(9.9)
    text = "t\nV1 a 0 100\nR1 a b 10\nD1 b 0 g m1\nI2 0 g 50m\n.model m1 SCR(Igt=10m Vgt=0.7 Rg=20)"
    shown = solved(nsspice.read(text + "\n.save i(d1.g) i(d1.k) p(d1)\n.op\n"))
    assert shown["i(d1.g)"][-1] == pytest.approx(50e-3)
    assert shown["i(d1.k)"][-1] == pytest.approx(-10.05)
    assert shown["p(d1)"][-1] == pytest.approx(50e-3 * 1.7)


def test_parallel_thyristors_share_current_and_gate_current():
    text = (
        "t\nV1 a 0 100\nR1 a b 10\nD1 b 0 g m1 m=2\nI2 0 g {}\n.model m1 SCR(Igt=10m Ron=2)\n.op\n"
    )
    assert solved(nsspice.read(text.format("21m")))["i(d1)"][-1] == pytest.approx(100 / 11)
    assert solved(nsspice.read(text.format("19m")))["i(d1)"][-1] == 0.0


def test_what_the_card_may_say():
    base = "V1 a 0 1\nR1 a b 1\nD1 b 0 {}\n.model m1 {}"
    assert codes(base.format("m1", "scr(vh=1)")) == ["NS2005"]
    assert codes(base.format("a m1", "scr(vh=1)")) == ["NS2005"]
    assert codes(base.format("a m1", "scr(igt=0)")) == ["NS2005"]
    assert codes(base.format("a m1", "scr(vgt=1 vbo=5 vh=9)")) == ["NS2005"]
    assert codes(base.format("a m1", "scr(vgt=1 alpha=2)")) == ["NS2005"]
    deck = parse_text("t\n" + base.format("a m1", "scr(vgt=1 vh=2)") + "\n")
    shown = explain(build(deck)).text()
    for part in ("DLCP" if "DLCP" in shown else "LCP", "gate voltage (vgt=1 V)", "stays on while"):
        assert part in shown


def test_ngspice_has_none():
    circuit = nsspice.read("t\nV1 a 0 1\nR1 a b 1\nD1 b 0 a m1\n.model m1 scr(vgt=1)\n.op\n")
    with pytest.raises(UsageError, match="d1: ngspice has no ideal thyristor"):
        translate(circuit, circuit.deck.analyses[0])
