"""Sources that read the current of a capacitor or the voltage of an inductor store nothing.

The rate in their law was taken for a charge of its own, and the balance of energy failed by 40 %
in runs whose rows were right.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

DECK = """Rates of 1 uF and 10 mH control a source
V1 a 0 SIN(0 10 1k)
R1 a b 100
C1 b 0 1u
L1 b d 10m
R4 d 0 50
B1 o 0 V={expression}
R2 o 0 1k
{load}
.tran 10u 3m uic
"""
JUNCTION = "D1 b c junction\nR3 c 0 1k\n.model junction D(IS=1p)"
#: a switch puts 1 nF, charged to 5 V, across the capacitor
JUMP = """V2 e 0 5
R5 e f 1k
C2 f 0 1n IC=0
S1 f b g 0 sw
Vg g 0 PULSE(0 1 1m 0 0 1)
.model sw SW(VT=0.5)"""


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
@pytest.mark.parametrize("load", ["", JUNCTION, JUMP])
@pytest.mark.parametrize("expression", ["I(C1)*1k", "V(b,d)*2+I(C1)*300", "2*I(C1)-3*I(L1)"])
def test_a_source_that_reads_a_rate_stores_nothing(expression, load, method):
    """The energies are those of the elements: C and L store, the sources deliver the rest."""
    deck = DECK.format(expression=expression, load=load)
    run = nsspice.tran(nsspice.read(deck), method=method)
    assert run.certificate.passed
    stored = 0.5e-6 * run["v(b)"] ** 2 + 5e-3 * run["i(l1)"] ** 2
    if load == JUMP:
        stored += 0.5e-9 * run["v(f)"] ** 2
    # rows and sums have the rounding of the run alone
    change = stored[-1] - stored[0]
    assert abs(run.certificate.energy.stored - change) <= 1e-9 * np.max(stored)


def test_the_same_by_a_sensor():
    """A source of 0 V in series senses the same current, and both runs move the same energies."""
    deck = DECK.format(expression="I(C1)*1k", load="")
    sensed = deck.replace("C1 b 0 1u", "C1 b s 1u\nVs s 0 0").replace("I(C1)", "I(Vs)")
    runs = [nsspice.tran(nsspice.read(text), method="moreau") for text in (deck, sensed)]
    one, other = (run.certificate.energy for run in runs)
    for name in ("stored", "delivered", "dissipated", "scheme"):
        # both solve the same equations in each step, to rounding
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-9)
