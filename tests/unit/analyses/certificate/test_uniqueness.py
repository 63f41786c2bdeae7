"""Active circuits: several solutions are told, and steps that go past a growing mode."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate.regularity import Judge

LATCH = """two inverting stages with gain 5, clamped to 0..5 V, {0} and {1} at the start
Vcc p 0 DC 5
E1 x1 0 2 0 -5
Vo1 y1 x1 DC 15
R1 y1 1 1k
D1 1 p
D2 0 1
C1 1 0 1n IC={0}
E2 x2 0 1 0 -5
Vo2 y2 x2 DC 15
R2 y2 2 1k
D3 2 p
D4 0 2
C2 2 0 1n IC={1}
"""


def codes(sol):
    return {w.code for w in sol.warnings}


class Points:
    """Recorded points of one node, 1 A through two diodes: how they share it is free."""

    def __init__(self, count: int, lam: tuple[float, float]) -> None:
        self.z, self.lam, self.roles = np.zeros((count, 1)), np.tile(lam, (count, 1)), None

    def __len__(self) -> int:
        return len(self.z)


def test_points_that_are_not_recorded_count_as_the_core_counted_them():
    circuit = nsspice.read("share\nI1 0 a 1\nD1 a 0\nD2 a 0\n.op\n")
    mna = circuit.islands[0].assemble(analysis="dc")
    judge = Judge(mna, mna.system)
    both = Points(2, (0.5, 0.5))
    assert judge.undetermined(both, 2) == 2
    assert judge.undetermined(both, 1) == 1
    assert judge.undetermined(both, 5) == 5  # three were not recorded
    assert judge.undetermined(both, 0) == 0
    # one diode alone: its current is that of the source
    alone = nsspice.read("alone\nI1 0 a 1\nD1 a 0\n.op\n").islands[0].assemble(analysis="dc")
    one = Points(2, (1.0, 0.0))
    one.lam = one.lam[:, :1]
    assert Judge(alone, alone.system).undetermined(one, 5) == 0


def test_a_latch_keeps_its_state_and_short_steps_are_unique():
    for first, second in ((5, 0), (0, 5)):
        sol = nsspice.tran(
            nsspice.read(LATCH.format(first, second)), 2e-5, 1e-7, step=1e-7, uic=True
        )
        assert sol["v(1)"][-1] == pytest.approx(first, abs=1e-9)
        # two rest states, yet from any state one way on: h times the growth rate is below 1
        assert sol.certificate.uniqueness == "unique"
        assert not codes(sol)


def test_a_latch_without_storage_has_several_solutions():
    deck = "\n".join(line for line in LATCH.splitlines() if line[0] != "C")
    sol = nsspice.tran(nsspice.read(deck + "\n.nodeset v(1)=6\n"), 1e-6, 1e-7)
    assert sol["v(1)"][-1] == pytest.approx(5.0)
    assert sol.certificate.uniqueness == "several"
    assert codes(sol) == {"NS3050"}


def test_a_step_past_the_growing_mode_is_warned_about():
    """From (2.6, 2.4) the difference grows with (5 - 1)/1us: h = 1 us goes past it, 0.1 us not."""
    circuit = nsspice.read(LATCH.format(2.6, 2.4))
    good = nsspice.tran(circuit, 2e-5, 1e-7, step=1e-7, uic=True)
    assert not codes(good)
    assert good["v(1)"][-1] == pytest.approx(5.0)
    bad = nsspice.tran(circuit, 2e-5, 1e-6, step=1e-6, uic=True)
    assert codes(bad) == {"NS3050", "NS3051"}
    assert "4e+06 1/s" in next(w.message for w in bad.warnings if w.code == "NS3051")


def test_feedback_that_opposes_is_unique():
    deck = """comparator in negative feedback
V1 ref 0 SIN(0 1 10)
E1 e 0 ref x 1000
R1 e s 1
D1 s 0 SIGN
G1 0 x s 0 1m
C1 x 0 1u IC=0
.model SIGN D(Vfwd=1 Vrev=1)
"""
    sol = nsspice.tran(nsspice.read(deck), 1e-3, 1e-5, uic=True)
    assert sol.certificate.uniqueness == "unique"
    assert not codes(sol)


def test_passive_circuits_are_not_suspected():
    deck = "bridge\nV1 a b SIN(0 10 50)\nD1 a p\nD2 b p\nD3 0 a\nD4 0 b\nR1 p 0 1k\n"
    sol = nsspice.tran(nsspice.read(deck), 0.02, 1e-4)
    assert sol.certificate.several == ()


@pytest.mark.parametrize(
    ("law", "x", "value"), [("asin(v(x))", 1.0, np.pi / 2), ("acos(v(x))", -1.0, np.pi)]
)
def test_points_with_infinite_slopes_are_no_further_solutions(law, x, value):
    """The sources determine v(x), and it determines v(a); others were told of (0 V, 1.24338 V)."""
    circuit = nsspice.read(f"t\nVx x 0 {x}\nRx x 0 1\nB1 a 0 V={law}\nR1 a 0 1\n.op\n")
    solution = nsspice.op(circuit)
    assert abs(solution["v(a)"][0] - value) < 1e-12
    assert not [w for w in solution.warnings if w.code == "NS3005"]


def test_a_point_without_slopes_is_judged():
    """atan2(0, 0): the singular values of a matrix without numbers were a traceback."""
    text = "t\nVx x 0 0\nRx x 0 1\nB1 a 0 V=atan2(v(x),v(x))\nR1 a 0 1\n.op\n"
    solution = nsspice.op(nsspice.read(text))
    assert solution["v(a)"][0] == 0.0
    assert solution.summary()


def test_a_law_without_a_limit_is_named():
    """Around the origin atan2 takes every value: rounding errors were told as solutions."""
    text = "t\nVx x 0 0\nB1 a 0 V=atan2(v(x),v(x))\nR1 a 0 1k\n.op\n"
    solution = nsspice.op(nsspice.read(text))
    assert solution["v(a)"][0] == 0.0
    assert not codes(solution)
    verdict = solution.islands[0].regularity
    assert (verdict.kind, verdict.elements) == ("not known", ("b1",))
    assert "slope" in verdict.reason
