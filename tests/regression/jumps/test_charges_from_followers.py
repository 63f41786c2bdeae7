"""Capacitors that jump to the voltage of a controlled source, which gives the energy for it."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

HOLD = """sample and hold with an ideal switch
V1 a 0 SIN(0 5 1k)
E1 b 0 a 0 {gain}
Vc c 0 PULSE(0 1 10u 0 0 1u 50u)
S1 b h c 0 sw
C1 h 0 1n
.model sw SW(VT=0.5)
.tran 1u 500u
"""
RAISED = """a capacitor that a step raises through a diode
V1 a 0 PULSE(0 5 10u 0 0 1 2)
E1 b 0 a 0 3
D1 b h
C1 h 0 1n
.tran 1u 20u
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
@pytest.mark.parametrize("gain", [1.0, -2.0, 0.5])
def test_a_sample_is_held(method: str, gain: float) -> None:
    found = nsspice.tran(nsspice.read(HOLD.replace("{gain}", str(gain))), method=method)
    assert found.certificate is not None
    assert found.certificate.passed
    # half a period after the pulse the value of its end is still there
    ends = 11e-6 + 50e-6 * np.arange(9)
    held = np.interp(ends + 25e-6, found.axis, found["v(h)"])
    assert held == pytest.approx(5.0 * gain * np.sin(2e3 * np.pi * ends), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_diode_lets_a_step_through(method: str) -> None:
    found = nsspice.tran(nsspice.read(RAISED), method=method)
    assert found.certificate is not None
    assert found.certificate.passed
    (jump,) = found.jumps
    # 15 nC at 15 V, of which the capacitor keeps a half
    (charge,) = (i.value for i in jump.impulses if i.element == "d1")
    assert charge == pytest.approx(15e-9, rel=1e-6)
    assert jump.after - jump.before == pytest.approx(0.5 * 15e-9 * 15.0, rel=1e-6)
