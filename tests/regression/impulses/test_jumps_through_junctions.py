"""Charge that passes a junction without series resistance in no time.

An ideal switch puts volts across a junction: its current is beyond any size, and what it lets pass
in the shortest step is a jump.  The balance of charge lacked it (by all of it), and the state right
after the jump, the limit of several steps, missed Kirchhoff's law: exit code 3 for right rows.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

UNIT = 1.380649e-23 * 300.15 / 1.602176634e-19
SOURCE, SATURATION, CAPACITANCE, CLOSES = 10.0, 1e-14, 1e-6, 0.5e-9
CHARGED = f"""An ideal switch charges a capacitor through a junction
V1 in 0 {SOURCE}
S1 in a g 0 sw
VG g 0 PULSE(0 1 0 1n 1n 40u 100u)
D1 a out d
C1 out 0 {CAPACITANCE}
.model sw SW(VT=0.5)
.model d D(IS={SATURATION})
.tran 1u 30u
"""
RINGING = CHARGED.replace("C1 out 0 1e-06", "C1 out 0 1u\nL1 out o2 10u\nC2 o2 0 1u\nR1 o2 0 100")
PULLED = CHARGED.replace("D1 a", "C0 a b 1u\nRb b 0 1k\nD2 0 b d\nD1 b") + "R1 out 0 100\n"
RELTOL = 1e-5


def charged(t: np.ndarray) -> np.ndarray:
    """C v' = IS exp((V - v) / Vt): the logarithm of a line."""
    slope = SATURATION / (CAPACITANCE * UNIT) * np.exp(SOURCE / UNIT)
    return UNIT * np.log1p(slope * np.maximum(t - CLOSES, 0.0))


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
@pytest.mark.parametrize("deck", [CHARGED, RINGING, PULLED], ids=["alone", "ringing", "pulled"])
def test_the_charge_is_accounted_for(deck: str, method: str) -> None:
    run = nsspice.tran(nsspice.read(deck), method=method)
    assert run.certificate.passed
    first = run.jumps[0]
    (charge,) = (abs(i.value) for i in first.impulses if i.element == "s1")
    moved = max(abs(s.after - s.before) for s in first.stores if s.unit == "A s")
    assert charge == pytest.approx(moved, rel=1e-6)


def test_what_follows_is_the_closed_form() -> None:
    run = nsspice.tran(nsspice.read(CHARGED), method="sdirk", reltol=RELTOL)
    assert np.abs(run["v(out)"] - charged(run.time)).max() <= RELTOL * SOURCE
