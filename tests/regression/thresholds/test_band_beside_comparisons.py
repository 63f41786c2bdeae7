"""A switch with hysteresis keeps its state while comparisons in its control come to rest."""

from __future__ import annotations

import pytest

import nsspice

#: at 3 ns the inner comparison turns, and then its product with the outer one: between both the
#: control would be -2 V, but at no time it is outside of the band from -0.5 to 0.5 V and below
DECK = """nested conditions
V1 a 0 PULSE(0 1 2n 0 0 50n 100n)
V2 d 0 PULSE(1 0 3n 0 0 10n 20n)
B1 c 0 V={if(v(a) > 0.5, 0, if(v(d) > 0.5, 1, -1))}
V3 q1 0 1
S1 q1 q c 0 m
R1 q 0 1
.model m SW(VT=0 VH=0.5)
.tran 1n 6n uic
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_values_that_are_never_taken_turn_no_switch(method: str) -> None:
    run = nsspice.tran(nsspice.read(DECK), method=method)
    assert run.certificate.passed
    assert run["v(c)"].min() >= -1e-12
    assert run["v(q)"] == pytest.approx(1.0, abs=1e-9)
    assert not [event for event in run.events if event.element == "s1"]
