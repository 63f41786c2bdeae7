"""Perfectly coupled windings between capacitors whose charges conflict with the ratio of turns."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

DECK = """two capacitors, one transformer
C1 a 0 1u IC=10
C2 b 0 1u IC=3
L1 a 0 1m IC=0
L2 b 0 4m IC=0
K1 L1 L2 1
R1 b 0 1k
.tran 1u 20u uic
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_charges_pass_the_windings_and_fluxes_stay(method: str) -> None:
    """Steps showed 13.7 A and 23 A for 2.56 mA, certified.

    v(b) = 2 v(a), and what leaves C1 enters C2 by halves: q1 + 2 q2 = 16 uC = 5 C v(a).  No flux
    was there, i1 = -2 i2, and the rates keep the ratio of voltages: -i2 - v(b) / R = -2 i1.
    """
    run = nsspice.tran(nsspice.read(DECK), method=method)
    assert run.certificate.passed
    assert run["v(a)"][0] == pytest.approx(3.2, rel=1e-14)
    assert run["v(b)"][0] == pytest.approx(6.4, rel=1e-14)
    assert run["i(l1)"][0] == pytest.approx(2.0 * 6.4 / (5.0 * 1e3), rel=1e-12)
    assert run["i(l2)"][0] == pytest.approx(-6.4 / (5.0 * 1e3), rel=1e-12)
    (jump,) = run.jumps
    assert jump.lost == pytest.approx(54.5e-6 - 25.6e-6, rel=1e-12)


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
@pytest.mark.parametrize(("turns", "second"), [(2.0, 1e-6), (0.1, 47e-6), (13.0, 3e-9)])
def test_a_switch_joins_capacitors_through_a_transformer(
    method: str, turns: float, second: float
) -> None:
    """Nothing else flows after the switch has closed: a row by ``sdirk`` had 1.3 MA, exit 3.

    C1 (10 V - v) = n C2 n v, and both ring with the primary from there: v cos(w t).
    """
    deck = f"""a jump during a run
V1 g 0 PULSE(0 1 1m 0 0 1 2)
C1 a 0 4u IC=10
S1 a b g 0 SHORT
L1 b 0 1m IC=0
L2 c 0 {1e-3 * turns**2!r} IC=0
K1 L1 L2 1
C2 c 0 {second!r}
.model SHORT SW(VT=0.5)
.tran 1u 1.1m uic
"""
    run = nsspice.tran(nsspice.read(deck), method=method)
    assert run.certificate.passed
    whole = 4e-6 + turns**2 * second
    begun = 10.0 * 4e-6 / whole
    (jump,) = run.jumps
    assert jump.lost == pytest.approx(0.5 * 10.0 * 4e-6 * (10.0 - begun), rel=1e-11)
    after = run.axis > 1e-3
    assert after.sum() == 100
    ringing = begun * np.cos((run.axis[after] - 1e-3) / np.sqrt(1e-3 * whole))
    # steps of fixed length err by w^2 h t / 2 in the phase and as much in size: w^2 < 1/(1 mH 4 uF)
    allowed = {"modewise": 1e-9, "sdirk": 1e-5, "moreau": 2 * 0.5 * 2.5e8 * 1e-6 * 1e-4}[method]
    assert np.max(np.abs(run["v(a)"][after] - ringing)) <= allowed * begun
