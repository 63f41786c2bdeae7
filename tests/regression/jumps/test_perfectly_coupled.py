"""Perfectly coupled windings between capacitors whose charges conflict with the ratio of turns."""

from __future__ import annotations

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
