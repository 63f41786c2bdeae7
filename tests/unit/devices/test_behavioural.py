"""Laws given by expressions: stamps by hand, solutions against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle.newton import Static
from oracle.tapes import run

import nsspice
from nsspice.circuit import MnaSystem, ProblemClass, build
from nsspice.circuit.dlcp import dlcp_form
from nsspice.circuit.explain import explain
from nsspice.errors import NetlistError, RegularityError, TopologyError
from nsspice.netlist import parse_text


def assembled(text: str, **conditions: object) -> MnaSystem:
    circuit = build(parse_text(f"title\n{text}\n"))
    assert len(circuit.islands) == 1
    return circuit.islands[0].assemble(**conditions)


def solved(text: str, *signals: str, t: float = 0.0, **conditions: object) -> list[float]:
    """Return signals of the only solution; all sources are constants."""
    mna = assembled(text, **conditions)
    static = Static(mna.system)
    u = [w.values[0] for w in mna.system.waveforms]
    found = list(static.solutions(u, t))
    assert len(found) == 1
    return [static.output(mna.functional(s), found[0], u) for s in signals]


def codes(text: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"title\n{text}\n"))
    return [d.code for d in caught.value.diagnostics]


def test_a_nonlinear_resistor_has_its_current_as_unknown():
    mna = assembled("V1 a 0 2\nR1 a 0 V={asinh(i)}")
    assert mna.unknowns == ["v(a)", "i(v1)", "i(r1)"]
    smooth = mna.system.smooth
    assert smooth is not None
    assert smooth.F.dense().ravel().tolist() == [0.0, 0.0, 1.0]
    assert smooth.Q.data.size == 0
    value, slope = run(smooth.tape, [0.0, 0.0, 3.0])
    assert value[0] == math.asinh(3.0)
    assert slope[0].tolist() == [0.0, 0.0, 1 / math.hypot(1, 3.0)]


def test_a_nonlinear_resistor_solves_its_law():
    assert solved("V1 a 0 2\nR1 a 0 V={asinh(i)}", "i(r1)", "i(v1)") == pytest.approx(
        [math.sinh(2.0), -math.sinh(2.0)]
    )
    # three in parallel share the current
    assert solved("I1 0 a 3\nR1 a 0 V={i^3} m=3", "v(a)") == pytest.approx([1.0])
    assert solved("V1 a 0 2\nR1 a 0 R={1+v(a)*v(a)}", "i(r1)") == pytest.approx([2 / 5])


def test_linear_expressions_cost_nothing():
    text = "V1 a 0 2\nR1 a b V={3*i + 1}\nR2 b c 2\nB1 c 0 V={v(a)/4 - 2*i(V1)}"
    circuit = build(parse_text(f"t\n{text}\n"))
    assert circuit.islands[0].problem_class is ProblemClass.LINEAR_ALGEBRAIC
    assert circuit.islands[0].assemble().system.smooth is None
    # 2 = 3i + 1 + 2i + 0.5 + 2i
    assert solved(text, "i(r1)", "v(c)") == pytest.approx([0.5 / 7, 0.5 + 1 / 7])


def test_linear_current_sources_and_who_reads_them():
    text = "V1 a 0 3\nB1 0 b I={2*v(a) + 1} m=2\nR1 b 0 1\nB2 c 0 V={i(B1)}\nR2 c 0 1"
    # a current source's current flows from the first node through it: into b
    assert solved(text, "v(b)", "i(b1)", "v(c)") == pytest.approx([14.0, 14.0, 14.0])
    assert "i(b1)" in assembled(text).unknowns
    alone = "V1 a 0 3\nB1 0 b I={2*v(a) + 1}\nR1 b 0 1"
    assert "i(b1)" not in assembled(alone).unknowns
    assert solved(alone, "i(b1)") == pytest.approx([7.0])


def test_smooth_current_sources_and_who_reads_them():
    text = "V1 a 0 3\nB1 0 b I={v(a)^2}\nR1 b 0 1"
    assert solved(text, "v(b)", "i(b1)") == pytest.approx([9.0, 9.0])
    sensed = text + "\nF1 0 c B1 2\nR2 c 0 1\nB2 d 0 V={i(B1)*i(F1)}\nR3 d 0 1"
    assert solved(sensed, "v(c)", "v(d)") == pytest.approx([18.0, 162.0])


def test_currents_of_diodes_capacitors_and_sources_are_read():
    text = "I1 0 a 2\nD1 a 0\nR1 a 0 1\nB1 b 0 V={i(D1)^2}\nR2 b 0 1"
    assert solved(text, "v(b)") == pytest.approx([4.0])
    assert "i(d1)" in assembled(text).unknowns  # a multiplier is not read by tapes
    mna = assembled("I1 0 a 2\nC1 a 0 3\nB1 b 0 V={i(C1)^2 + i(I1)}\nR2 b 0 1")
    # C y' - i = 0, y - v(a) = 0: what is stored keeps a symmetric form
    row, y = mna.unknowns.index("i(c1)"), mna.unknowns.index("v(c1#c)")
    E, G = mna.system.E.dense(), mna.system.G.dense()
    assert E[y, y] == 3.0
    assert np.count_nonzero(E) == 1
    assert G[y, row] == -1.0
    assert [G[row, y], G[row, mna.unknowns.index("v(a)")]] == [1.0, -1.0]


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("E1 b 0 VALUE={v(a)^2}", 9.0),
        ("E1 b 0 VOL='v(a)*v(a,c)'", 3.0),
        ("E1 b 0 POLY(1) a 0 1 2 3", 1 + 6 + 27),
        ("E1 b 0 POLY(2) a 0 c 0 0 1 1 0 1", 3 + 2 + 6),
        ("E1 b 0 TABLE {v(a)} = (0,0) (2,4) (4,5)", 4.5),
        ("H1 b 0 POLY(1) V1 0 0 1", (3 - 2) ** 2),
        ("B1 b 0 V=temper*v(a)", 81.0),
    ],
)
def test_voltage_forms(line: str, value: float):
    text = f"V1 a 0 3\nV2 c 0 2\nR1 a c 1\nR2 b 0 1\n{line}"
    assert solved(text, "v(b)") == pytest.approx([value])


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("G1 0 b VALUE={v(a)^2}", 9.0),
        ("G1 0 b CUR='2^v(a)' m=2", 16.0),
        ("F1 0 b POLY(1) V1 2 0 1", 3.0),
        ("G1 0 b TABLE {v(a)*v(c)} = (0,1) (12,7)", 4.0),
    ],
)
def test_current_forms(line: str, value: float):
    text = f"V1 a 0 3\nV2 c 0 2\nR1 a c 1\nR2 b 0 1\n{line}"
    assert solved(text, "v(b)") == pytest.approx([value])


def test_time_runs_in_transients_and_stands_at_dc():
    text = "B1 a 0 V={2 + time*time/3}\nR1 a 0 1"
    assert solved(text, "v(a)", t=3.0) == pytest.approx([5.0])
    assert solved(text, "v(a)", t=3.0, analysis="dc") == pytest.approx([2.0])


@pytest.mark.parametrize(
    ("law", "value"),
    [
        ("2 + time", lambda t: 2.0 + t),
        ("4*sin(3*time + 1) - 1", lambda t: 4.0 * math.sin(3.0 * t + 1.0) - 1.0),
        ("cos(1 - 2*time)/2 + sin(5*time)", lambda t: math.cos(1 - 2 * t) / 2 + math.sin(5 * t)),
        ("sin(-time)*3", lambda t: -3.0 * math.sin(t)),
        ("v(c)*0.5 + cos(time)", lambda t: 0.5 + math.cos(t)),
    ],
)
def test_straight_lines_and_sines_of_the_time_are_sources(law, value):
    """Without a smooth law the circuit is one for the exact engine."""
    text = f"VC c 0 1\nB1 a 0 V={{{law}}}\nR1 a b 1\nC1 b 0 1\n"
    run = nsspice.read(f"laws of the time\n{text}.op\n.tran 0.1 5\n").run()
    assert run[0]["v(a)"] == pytest.approx([value(0.0)], abs=1e-14)
    assert "modewise" in {island.method for island in run[1].islands}
    assert run[1]["v(a)"] == pytest.approx([value(t) for t in run[1].time], abs=1e-13)


def test_products_of_sines_are_smooth_laws():
    for law in ("sin(time)*cos(time)", "sin(time*time)", "sin(v(a))"):
        assert assembled(f"B1 b 0 I={{{law}}}\nR1 a b 1\nC1 a 0 1").system.smooth is not None
    assert assembled("B1 b 0 I={sin(0*time + 1)}\nR1 b 0 1").system.smooth is None


def test_temper_follows_the_temperature():
    assert solved("B1 a 0 V={temper}\nR1 a 0 1", "v(a)", temperature=50.0) == [50.0]


@pytest.mark.parametrize(
    ("line", "signal", "value"),
    [
        # ngspice 39 prints 4.22 and 4.292 for the B sources, and the same growth for the first R
        ("B1 0 b I={v(a)^2} tc1=1m tc2=2u\nRb b 0 1", "v(b)", 4 * (1 + 0.05 + 0.005)),
        ("B1 b 0 V={v(a)^2} tc1=1m temp=100\nRb b 0 1", "v(b)", 4 * (1 + 0.073)),
        ("B1 0 b I={2*v(a)} tc1=1m\nRb b 0 1", "i(b1)", 4 * (1 + 0.05)),
        ("R1 a 0 R={1k*(1+v(a))} tc1=1m tc2=2u", "i(r1)", 2 / 3e3 / (1 + 0.05 + 0.005)),
        ("R1 a 0 R={1k*(1+v(a))} tc1=1m dtemp=10 m=2", "i(r1)", 4 / 3e3 / (1 + 0.06)),
        ("R1 a 0 V={2*i} tc=1m,2u temp=127", "i(r1)", 1 / (1 + 0.1 + 0.02)),
        ("R1 a 0 rm R={1k*(1+v(a))}\n.model rm r(tc1=1m tnom=57)", "i(r1)", 2 / 3e3 / 1.02),
    ],
)
def test_temperature_coefficients(line: str, signal: str, value: float):
    found = solved(f"V1 a 0 2\n{line}", signal, temperature=77.0)
    assert found == pytest.approx([value], rel=1e-12)


def test_a_temperature_that_nothing_follows_is_named():
    text = "V1 a 0 1\nR1 a 0 R={1k*(1+v(a))} temp=50\nR2 a 0 1 dtemp=3\nB1 0 a I={v(a)} temp=9"
    circuit = build(parse_text(f"t\n{text}\n"))
    named = [w.message.split(" has no effect")[0] for w in circuit.warnings]
    assert named == ["temp of r1", "dtemp of r2", "temp of b1"]


def test_wrong_references_and_parameters():
    base = "V1 a 0 1\nR1 a 0 1\n"
    assert codes(base + "B1 b 0 V={v(zz)}\nR2 b 0 1") == ["NS1071"]
    assert codes(base + "B1 b 0 V={i(R9)}\nR2 b 0 1") == ["NS1070"]
    assert codes(base + "L1 a 0 1\nL2 a 0 1\nK1 L1 L2 .5\nB1 b 0 V={i(K1)}\nR2 b 0 1") == ["NS2006"]
    assert codes(base + "R3 a 0 V={i^3} m=0") == ["NS2005"]
    # sensed by sources only: nothing drives the node
    with pytest.raises(TopologyError, match="senses the voltage of node x"):
        build(parse_text(f"t\n{base}E1 b 0 x 0 1\nB1 c 0 V={{v(x)^2}}\nR2 b 0 1\nR3 c 0 1\n"))


def test_explain_shows_class_and_expressions():
    circuit = build(parse_text("t\nV1 a 0 1\nR1 a b V={asinh(i)}\nB1 b 0 V={v(a)^2}\n"))
    text = explain(circuit).text()
    assert "GE, generalized equation" in text
    assert "r1 and b1 are smooth and nonlinear" in text
    assert "voltage {asinh(i)}" in text
    assert "behavioural source b1: voltage {v(a)^2}" in text
    assert "smooth nonlinear law" in explain(circuit, matrices=True).text()
    mna = circuit.islands[0].assemble()
    with pytest.raises(RegularityError) as caught:
        dlcp_form(mna)
    assert caught.value.code == "NS2063"


def test_islands_join_what_expressions_read():
    text = "V1 a 0 1\nR1 a 0 1\nB1 b 0 V={v(a)^2}\nR2 b 0 1\nB2 c 0 I={i(R2)^2}\nR3 c 0 1\n"
    assert len(build(parse_text(f"t\n{text}")).islands) == 1
    assert np.isfinite(build(parse_text(f"t\n{text}")).islands[0].assemble().system.n)
