"""Antiparallel ideal thyristors that are both fired: nothing determines what goes round in them.

In fixed steps with a smooth law, Newton's method left what the laws leave open as it was: up to
7 A went round for ten milliseconds, which is enough to hold a thyristor on past its gate.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

#: the second thyristor carries the current when the first is fired, which takes over at its zero
DECK = """AC controller with a load of {resistance} Ohm and 20 mH, and a junction
Va a 0 SIN(0 -100 50 0 0 {phase})
Vg1 g1 b PULSE(0 5 11m 0 0 6m 1)
Vg2 g2 a PULSE(0 5 1m 0 0 25m 1)
D2 b a g2 scr
D1 a b g1 scr
L1 b c 20m
R1 c 0 {resistance}
R2 c d 1k
D3 d 0 junction
.model scr SCR(Vgt=1)
.model junction D(IS=1p)
.tran 50u 60m uic
.end
"""


@pytest.mark.parametrize(("resistance", "phase"), [(7, 27), (9.3, 0), (9.3, 27), (11, 0), (17, 27)])
def test_only_one_of_two_thyristors_conducts(resistance, phase):
    """Each row lies in a half wave: the current of the load is that of one thyristor."""
    deck = nsspice.read(DECK.format(resistance=resistance, phase=phase))
    steps, exact = (deck.run(method=method)[0] for method in ("moreau", "sdirk"))
    assert steps.certificate.passed
    forth, back = steps["i(d1)"], steps["i(d2)"]
    largest = np.abs(steps["i(l1)"]).max()
    # the rest is rounding
    assert np.minimum(forth, back).max() <= 1e-12 * largest
    # implicit steps of 50 us in 20 ms are of order one: half a step of the steepest slope, 5 A/ms
    same = np.interp(steps.time, exact.time, exact["i(d1)"])
    assert np.abs(forth - same).max() < 0.5 * 50e-6 * 100 / 20e-3
    # without a gate the last half wave ends, by both
    late = steps.time > 0.047
    assert np.abs(steps["i(l1)"][late]).max() <= 1e-12 * largest
