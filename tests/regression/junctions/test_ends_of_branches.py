"""DC sweeps where the branch of solutions ends: the sweep goes on with what `.op` finds there.

Up to then it stays on its branch.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.regulator import REGULATOR

import nsspice

FOLLOWER = """an amplifier drives a transistor
V1 s 0 1
E1 o 0 VALUE={12*tanh(1e6/12*(v(s)-v(e)))}
Q1 c o e qn
Re e 0 100
Vc cc 0 10
Rc cc c 200
.model qn NPN(IS=1e-14 BF=100)
"""


@pytest.mark.parametrize("step", [0.25, 0.5, 1.0])
def test_a_sweep_goes_on_behind_the_end_of_its_branch(step: float) -> None:
    """Whatever the step: some were lucky, most ended with NS3004 where the reference starts."""
    circuit = nsspice.read(REGULATOR)
    values = np.arange(0.0, 8.0 + step, step)
    sweep = nsspice.dc(circuit, "vin", values)
    assert sweep.certificate.passed
    for k in np.flatnonzero(np.isin(values, [5.0, 6.0, 8.0])):
        point = nsspice.op(circuit, values={"vin": values[k]})
        assert sweep["v(out)"][k] == pytest.approx(point["v(out)"][0], abs=1e-6)


def test_a_guess_that_leads_nowhere_does_not_count() -> None:
    point = nsspice.op(nsspice.read(f"{FOLLOWER}.nodeset v(e)=-20\n"))
    assert point["v(e)"][0] == pytest.approx(1.0, abs=1e-5)


def test_a_sweep_stays_on_its_branch() -> None:
    """A trigger: up it changes at +1 V, down at -1 V, whatever a start from nothing would find."""
    circuit = nsspice.read(
        "trigger\nV1 a 0 0\nE1 o 0 VALUE={10*tanh(100*(v(p)-v(a)))}\nR1 o p 9k\nR2 p 0 1k\n"
    )
    up = np.linspace(-2.0, 2.0, 41)
    run = nsspice.dc(circuit, "v1", [*up, *up[::-1]])
    there, back = run["v(o)"][:41], run["v(o)"][41:][::-1]
    assert (there[up < 0.85] > 9.0).all()
    assert (there[up > 1.05] < -9.0).all()
    assert (back[up > -0.85] < -9.0).all()
    assert (back[up < -1.05] > 9.0).all()


def test_a_node_that_nothing_holds_beside_what_decays() -> None:
    """Its 50 V of the beginning made every stage of a decayed current look impulsive: no end."""
    text = """a coil on a resistor, and a diode that leads nowhere
L1 0 n3 1 IC=-5
R4 n3 0 10
D2 n2 n3
.tran 0.1 10 uic
"""
    run = nsspice.tran(nsspice.read(text), method="sdirk")
    assert run.certificate.passed
    assert run.islands[0].stats["steps"] < 200
    exact = -5.0 * np.exp(-10.0 * run.time)
    assert np.abs(run["i(l1)"] - exact).max() < 5.0 * 1e-5
