"""Switches that sources decide about have their state before anything is solved for."""

from __future__ import annotations

import pytest

import nsspice

#: the only way of the current is a switch that is closed while its gate is low
DECK = """a current through a switch that is closed at rest
Vg g 0 {gate}
I1 0 n 0.7
L1 n x 10u IC=0
R1 n m 50
S1 m o 0 g closed
R2 o 0 320
.model closed SW(VT=-0.5)
{card}
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
@pytest.mark.parametrize("gate", ["0", "PULSE(0 1 17u 0 0 3u 6u)"])
def test_a_switch_closed_at_rest_carries_a_current_from_the_start(gate: str, method: str) -> None:
    deck = DECK.format(gate=gate, card=".tran 0.5u 5u uic")
    run = nsspice.tran(nsspice.read(deck), method=method)
    # all of the current, since the coil leads nowhere
    assert run["v(n)"][0] == pytest.approx(0.7 * 370.0, rel=1e-9)
    assert run["i(l1)"][0] == pytest.approx(0.0, abs=1e-9)


def test_so_it_does_at_an_operating_point() -> None:
    deck = DECK.format(gate="0", card=".op")
    run = nsspice.read(deck).run()[0]
    assert float(run["v(n)"][0]) == pytest.approx(0.7 * 370.0, rel=1e-9)


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_edges_at_the_start_open_one_switch_and_close_another(method: str) -> None:
    """Both change with their gate: neither a short circuit nor a gap lies between."""
    deck = """a current that changes its way at t = 0
Vg g 0 PULSE(0 1 0 0 0 5u 20u)
I1 0 n 1
S1 n a 0 g closed
S2 n b g 0 open
R1 a 0 10
R2 b 0 20
C1 b 0 1u
.model closed SW(VT=-0.5)
.model open SW(VT=0.5)
.tran 1u 4u
"""
    run = nsspice.tran(nsspice.read(deck), method=method)
    assert run.jumps == []
    assert run["v(n)"][0] == pytest.approx(0.0, abs=1e-5)  # C1 is empty; steps have a length
    assert run["v(a)"][0] == pytest.approx(0.0, abs=1e-9)
