"""Switches that turn together for ever, where one after the other comes to rest.

Two switches that hold each other open: with both open both are told to close, and the other way
round.  The static solution was refused (NS3007), and runs began with both closed.
"""

import numpy as np
import pytest

import nsspice

LATCH = """latch of two switches
V1 vp 0 5
R1 vp q1 1k
R2 vp q2 1k
S1 q1 0 q2 0 sw
S2 q2 0 q1 0 sw
{stores}
.model sw sw(vt=2.5)
{analysis}
"""
STORES = "C1 q1 0 1n\nC2 q2 0 1n"

# positive feedback through an amplifier: whatever it shows, a switch drives it away from there
OSCILLATOR = """class D amplifier
Vp vp 0 30
Vn 0 vn 30
S1 vp o q 0 sw
S2 o vn qn 0 sw
R1 o 0 8
G1 it 0 o 0 4u
C2 it 0 1n
Rit it 0 10meg
Eq q 0 VALUE={0.5+0.5*tanh(200*(v(it)+ 0.2*(v(qd)-0.5)))}
Rqd q qd 100
Cqd qd 0 100p
Eqn qn 0 VALUE={1-v(q)}
.model sw sw(vt=0.6 ron=100m roff=1meg)
.tran 0.5u 20u
"""


@pytest.mark.parametrize("stores", ["", STORES], ids=["nothing", "capacitors"])
def test_a_latch_has_a_static_solution(stores: str) -> None:
    point = nsspice.read(LATCH.format(stores=stores, analysis=".op")).run()[0]
    assert sorted([point["v(q1)"][0], point["v(q2)"][0]]) == pytest.approx([0.0, 5.0], abs=1e-12)


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_run_begins_there(method: str) -> None:
    run = nsspice.tran(
        nsspice.read(LATCH.format(stores=STORES, analysis=".tran 1u 20u")), method=method
    )
    assert run.certificate is not None
    assert run.certificate.passed
    assert not run.jumps
    for row in range(run["v(q1)"].size):
        pair = sorted([run["v(q1)"][row], run["v(q2)"][row]])
        assert pair == pytest.approx([0.0, 5.0], abs=1e-9)


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
def test_without_a_static_solution_the_first_row_obeys_the_switches(method: str) -> None:
    run = nsspice.tran(nsspice.read(OSCILLATOR), method=method)
    assert run.certificate is not None
    assert run.certificate.passed
    closed = np.abs(np.column_stack([run["i(s1)"], run["i(s2)"]])) > 1.0
    told = np.column_stack([run["v(q)"], run["v(qn)"]]) > 0.6
    assert np.array_equal(closed[0], told[0])
    # it regulates: the output goes to and fro
    assert {bool(o > 0) for o in run["v(o)"]} == {False, True}
