"""Voltages of a tree beside junctions, among its lightest branches: the results are the same."""

from __future__ import annotations

import numpy as np

import nsspice

#: leakage alone holds the output; inner nodes hang from the anodes, charges from both
BRIDGE = """bridge behind two inductors
Va a 0 SIN(0 325 50)
Vb b 0 SIN(0 325 50 0 0 -120)
La a a1 2m
Lb b b1 2m
D0 a1 p d
D1 n a1 d
D2 b1 p d
D3 n b1 d
C1 p n 470u IC=350
R1 p n 100
.model d D(IS=1e-9 CJO=100p RS=20m)
.tran 5u 2m uic
"""


def test_a_floating_bridge() -> None:
    run, fine = (nsspice.tran(nsspice.read(BRIDGE), reltol=reltol) for reltol in (1e-5, 1e-7))
    assert run.certificate.passed
    assert fine.certificate.passed
    bus, other = (found["v(p)"] - found["v(n)"] for found in (run, fine))
    # errors of steps add up, so far to ten times the tolerance
    assert np.abs(bus - other).max() < 1e-4 * 375.0
    assert np.abs(run["i(la)"] + run["i(lb)"]).max() < 1e-9
