"""Steady states of a buck converter whose junction diode and comparator close a loop."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

CLOSED_BUCK = """closed-loop buck converter, proportional control
Vin in 0 24
S1 in sw g 0 SW
D1 0 sw DS
Rsn sw sn 22
Csn sn 0 1n
L1 sw out 47u Rser=20m
C1 out 0 100u Rser=10m
R1 out 0 {load}
Vref ref 0 5
R2 out fb 10k
R3 fb 0 10k
Eerr e 0 VALUE={{(V(ref)/2-V(fb))*5}}
Rc e c 1k
Cc c 0 100n
Vsaw saw 0 PULSE(0 1 0 9.8u 0.1u 0.1u 10u)
Bg g 0 V=if(v(c)>v(saw),1,0)
.model SW SW(Ron=20m Vt=0.5)
.model DS D(IS=1e-8 N=1.05 RS=10m CJO=300p)
.end
"""


@pytest.mark.parametrize("load", ["2.5", "100"])
def test_few_steps_lead_to_the_orbit(load: str) -> None:
    """From rest the output overshoots, and the comparator does not act for many periods."""
    orbit = nsspice.pss(nsspice.read(CLOSED_BUCK.format(load=load)), period=1e-5, row_step=5e-9)
    assert orbit.certificate.passed
    assert orbit.periodic.steps <= 10  # 32 and 96 by differences along few directions
    # over a period a capacitor keeps its charge: what enters the filter leaves through the load
    entering, leaving = orbit.average("i(l1)"), orbit.average("v(out)") / float(load)
    divider = orbit.average("v(out)") / 20e3
    # rows and steps are known to 1e-5 of the largest current
    assert abs(entering - leaving - divider) < 1e-4 * np.abs(orbit["i(l1)"]).max()
    assert 4.8 < orbit.average("v(out)") < 5.0
