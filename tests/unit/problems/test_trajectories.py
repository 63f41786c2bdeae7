"""Verdicts on the trajectories of circuits: at most one, and a solution of each step."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.problems.theorems import each_step, one_trajectory

DECKS = {
    # resistor before the diode: every step has one solution
    "half wave with capacitor": (
        "V1 a 0 SIN(0 10 50)\nR1 a b 1\nD1 b c\nC1 c 0 1u IC=0\nR2 c 0 1k\n",
        (True, True),
    ),
    # a source across an ideal diode: contradicted where it is positive
    "source across a diode": ("V1 a 0 SIN(0 10 50)\nD1 a 0\nC1 a b 1u\nR1 b 0 1\n", (None, True)),
    # a Zener pair behind an inductor takes any current
    "inductor and Zener": (
        "V1 a 0 SIN(0 10 50)\nL1 a b 1m IC=0\nD1 b 0 z\n.model z D(Vfwd=0.7 Vrev=5.1)\n",
        (True, True),
    ),
    # gain in a loop: each step is solved, as the capacitor holds the input; the path is not proved
    "amplifier in feedback": (
        "V1 a 0 1\nR1 a b 1\nE1 c 0 b 0 -5\nD1 c d\nR2 d b 1\nC1 b 0 1u IC=0\n",
        (True, None),
    ),
    # a smooth junction is monotone
    "exponential diode": (
        "V1 a 0 SIN(0 10 50)\nR1 a b 1\nD1 b c d\n.model d D(IS=1e-12)\nC1 c 0 1u\nR2 c 0 1k\n",
        (None, True),
    ),
    # a falling resistance is not
    "tunnel diode": (
        "V1 a 0 1\nR1 a b 1\nB1 b 0 I={v(b)**3-2*v(b)}\nL1 b c 1u\nR2 c 0 1\nD1 c 0\n",
        (None, None),
    ),
}


@pytest.mark.parametrize("name", DECKS)
def test_trajectories_of_circuits(name):
    deck, known = DECKS[name]
    system = nsspice.read(f"{name}\n{deck}").islands[0].assemble().system
    found = each_step(system), one_trajectory(system)
    assert tuple(v.holds for v in found) == known, [str(v) for v in found]


def test_explain_tells_them(capsys):
    from nsspice.circuit.explain import explain

    deck, _ = DECKS["inductor and Zener"]
    found = explain(nsspice.read(f"zener\n{deck}")).islands[0]
    assert [v.holds for v in found.trajectory] == [True, True]
    assert "one trajectory at most" in found.text()
    assert found.to_dict()["trajectory"][1]["verdict"] == "holds"
