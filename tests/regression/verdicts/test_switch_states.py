"""States of switches that nothing but the switches decide: every combination, by hand.

The sources of the numbers are voltage dividers of the resistances that each state leaves.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import nsspice
from nsspice.circuit.explain import explain
from nsspice.circuit.regularity import dc_uniqueness

LATCH = """SR latch: what one switch pulls down keeps the other one open
V1 p 0 1
R1 p a 1k
R2 p b 1k
S1 a 0 b 0 SW
S2 b 0 a 0 SW
.model SW SW(vt=0.5 vh=0 ron=1 roff=1meg)
{more}.op
"""
#: a divider of 1 kOhm and a switch that is closed, open
LOW, HIGH = 1.0 / 1001.0, 1e6 / 1001e3
SCHMITT = """a comparator between {low} and {high} that {verb} what it sees
V1 in 0 {volts}
R1 in x 1k
R2 o x 1k
B1 o 0 V={{if(v(x)>0,{high},{low})}}
{more}.op
"""
HELD = """a switch inside its band
V1 c 0 {volts}
Vp p 0 1
R1 p a 1k
S1 a 0 c 0 SW
.model SW SW(vt=0.5 vh=0.2 ron=1 roff=1meg)
.op
"""


def judged(deck):
    """Return the operating point, the verdict on it, and what was proved for all sources."""
    circuit = nsspice.read(deck)
    proof = dc_uniqueness(circuit.islands[0].assemble(analysis="dc"))
    (solution,) = circuit.run()
    return solution, solution.islands[0].regularity, proof


def test_a_latch_has_two_operating_points():
    solution, verdict, proof = judged(LATCH.format(more=""))
    assert not proof.unique
    assert proof.elements == ("s1", "s2")
    assert verdict.kind == "several"
    assert "all of them" in verdict.reason
    found = sorted((s["v(a)"], s["v(b)"]) for s in verdict.solutions)
    assert np.allclose(found, [(LOW, HIGH), (HIGH, LOW)], rtol=1e-12)
    assert [w.code for w in solution.warnings] == ["NS3005"]


@pytest.mark.parametrize(("a", "b"), [(1, 0), (0, 1)])
def test_a_nodeset_chooses_the_state(a, b):
    """As the warning says."""
    solution, _, _ = judged(LATCH.format(more=f".nodeset v(a)={a} v(b)={b}\n"))
    assert solution["v(a)"][0] == pytest.approx(HIGH if a else LOW, rel=1e-12)


@pytest.mark.parametrize("volts", [0.2, -0.2, 0.9, 1.5, -1.5])
def test_positive_feedback(volts):
    """v(x) = (volts + v(o))/2 with v(o) = 1 or -1: both while |volts| < 1, else one."""
    deck = SCHMITT.format(volts=volts, low=-1, high=1, verb="adds to", more="")
    solution, verdict, proof = judged(deck)
    assert not proof.unique
    states = [o for o in (-1.0, 1.0) if (o > 0.0) == ((volts + o) / 2.0 > 0.0)]
    assert verdict.kind == ("several" if len(states) == 2 else "unique"), str(verdict)
    if len(states) == 2:
        assert np.allclose(sorted(s["v(o)"] for s in verdict.solutions), states, rtol=1e-14)
    else:
        assert solution["v(o)"][0] == pytest.approx(states[0], rel=1e-14)
    chosen = judged(SCHMITT.format(volts=volts, low=-1, high=1, verb="adds to",
                                   more=".nodeset v(x)=1 v(o)=1\n"))[0]  # fmt: skip
    assert chosen["v(o)"][0] == pytest.approx(max(states), rel=1e-14)


def test_negative_feedback_has_no_state_and_is_promised_none():
    """v(o) = -1 makes v(x) < 0, which asks for +1; `explain` promised one solution."""
    deck = SCHMITT.format(volts=0.2, low=1, high=-1, verb="takes from", more="")
    circuit = nsspice.read(deck)
    explained = explain(circuit)
    assert "not proved" in str(explained.islands[0].uniqueness)
    with pytest.raises(nsspice.errors.NumericalError, match="NS3007"):
        circuit.run()
    # beyond the swing of the output there is one: v(x) > 0 whatever it does
    solution, verdict, _ = judged(deck.replace("V1 in 0 0.2", "V1 in 0 1.2"))
    assert verdict.kind == "unique"
    assert solution["v(o)"][0] == pytest.approx(-1.0, rel=1e-14)


@pytest.mark.parametrize(("volts", "states"), [(0.5, 2), (0.2, 1), (0.8, 1)])
def test_hysteresis_inside_its_band_and_outside(volts, states):
    """0.3 V and 0.7 V are the thresholds."""
    solution, verdict, proof = judged(HELD.format(volts=volts))
    assert not proof.unique
    assert verdict.kind == ("several" if states == 2 else "unique"), str(verdict)
    if states == 1:
        assert solution["v(a)"][0] == pytest.approx(LOW if volts > 0.7 else HIGH, rel=1e-12)


def test_steps_with_a_comparator_are_not_promised():
    """x' = sgn(x) at 0 has three trajectories: up, down, and staying for a while."""
    deck = "growth\nC1 x 0 1 IC=0\nB1 0 x I={if(v(x)>0,1,-1)}\n.tran 10m 1 uic\n"
    steps, _ = explain(nsspice.read(deck)).islands[0].trajectory
    assert steps.holds is None
    assert "own control" in steps.reason


def test_a_closed_switch_beside_a_diode_shares_its_current():
    """The matrix of the pair was 4e-20, which is zero."""
    deck = """an ideal diode beside an ideal switch
V1 a 0 5
Vc c 0 1
R1 a b 1k
D1 b 0 DI
S1 b 0 c 0 SW
C1 b 0 1u
L1 a x 1m
R2 x b 10
.model DI D(ideal)
.model SW SW(vt=0.5 vh=0 ron=0)
.tran 1u 1m
"""
    steps, _ = explain(nsspice.read(deck)).islands[0].trajectory
    assert "one only" not in steps.reason
    apart = deck.replace("D1 b 0 DI", "D1 b y DI\nR3 y 0 1")
    steps, _ = explain(nsspice.read(apart)).islands[0].trajectory
    assert "one only" in steps.reason


@pytest.mark.parametrize("seed", range(8))
def test_random_switches_against_all_states(seed):
    """Three switches that pull three nodes down, controlled by random sums of these nodes."""
    random = np.random.default_rng(seed)
    for _ in range(4):
        weights = random.integers(-1, 2, (3, 3))
        lines = ["switches", "V1 p 0 1"]
        for k in range(3):
            lines += [f"R{k} p n{k} 1k", f"S{k} n{k} 0 c{k} 0 SW"]
            total = "+".join(f"({w})*v(n{j})" for j, w in enumerate(weights[k]))
            lines += [f"B{k} c{k} 0 V={{{total}}}"]
        deck = "\n".join([*lines, ".model SW SW(vt=0.35 vh=0 ron=1 roff=1meg)", ".op", ""])
        truth = []
        for states in itertools.product((False, True), repeat=3):
            v = np.where(states, LOW, HIGH)
            if all((weights @ v > 0.35) == np.array(states)):
                truth.append(v)
        circuit = nsspice.read(deck)
        try:
            (solution,) = circuit.run()
        except nsspice.errors.NumericalError:
            # the search for a state is no enumeration; where it finds none nothing is promised
            assert not dc_uniqueness(circuit.islands[0].assemble(analysis="dc")).unique or not truth
            continue
        verdict = solution.islands[0].regularity
        assert truth
        if verdict.kind == "unique":
            assert len(truth) == 1, deck
        if verdict.kind == "several":
            found = {tuple(round(s[f"v(n{k})"], 6) for k in range(3)) for s in verdict.solutions}
            assert found == {tuple(v.round(6).tolist()) for v in truth}, deck


PARALLEL = """ideal elements in parallel
V1 a 0 5
Vc c 0 1
R1 a b 1k
D1 b 0 DI
{beside}
C1 b 0 1u
.model DI D(ideal)
.model DJ D(IS=1e-14)
.model SW SW(vt=0.5 vh=0 ron=0)
.tran 10u 1m
"""


@pytest.mark.parametrize("method", ["auto", "sdirk"])
@pytest.mark.parametrize(
    ("beside", "unique"),
    [
        ("S1 b 0 c 0 SW", False),  # 5 mA in any shares
        ("S1 0 b c 0 SW", False),
        ("D2 b 0 DI", False),
        ("D2 b 0 DI\nD3 b 0 DJ", False),
        ("D2 0 b DI", False),  # a current around both changes nothing
        ("D2 y b DI\nR2 y 0 1", True),
        ("D3 b 0 DJ", True),
    ],
)
def test_a_run_with_a_free_current_is_not_called_unique(method, beside, unique):
    """The certificate says what one law of the loop says: any current may flow around it."""
    solution = nsspice.tran(nsspice.read(PARALLEL.format(beside=beside)), method=method)
    assert (solution.certificate.uniqueness == "unique") is unique


def test_a_ring_of_one_inverter_has_no_operating_point():
    """v(o) > 1/2 asks for 0 and v(o) <= 1/2 for 1: no state is one, and none is promised."""
    circuit = nsspice.read("ring\nB1 o 0 V={if(v(o)>0.5,0,1)}\nR1 o 0 1\n.op\n")
    proof = dc_uniqueness(circuit.islands[0].assemble(analysis="dc"))
    assert not proof.unique
    assert proof.elements == ("b1",)
    with pytest.raises(nsspice.errors.NumericalError, match="NS3007"):
        circuit.run()


INDEX_THREE = """a differentiator behind a differentiator
V1 a 0 SIN(0 1 100)
C1 a 0 1u
F1 0 b V1 1
C2 b2 0 1
Vs b b2 0
RB b 0 1meg
L1 c 0 1m
F2 0 c Vs 1
.tran 0.1m 20m
"""


@pytest.mark.parametrize("method", ["auto", "sdirk"])
def test_a_second_derivative_of_a_source_is_refused(method):
    """v(c) = L C v1'': of index 3, which no engine with an estimate of its errors certifies."""
    with pytest.raises((nsspice.errors.NumericalError, nsspice.errors.CertificateError)):
        nsspice.tran(nsspice.read(INDEX_THREE), method=method)
