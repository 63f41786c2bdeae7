"""Mode by mode, currents in large resistances keep their digits beside diodes of milliohms."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

#: a capacitor discharges through kilohms and a diode, beside a branch of 196 Ohm
CHAIN = """chain
V1 n0 0 SIN(1 5 1785.3)
Rs n0 n1 28.9
C3 n3 n1 1.95u
R4 n4 n3 3.57k
R6 n6 n4 4.01k
D0 n1 n6 DR
D1 n3 n2 DR
R2 n2 0 167
.model DR D(Ron=10m Roff=1meg)
.tran 2.8u 1.4m
"""
#: a capacitor that a closed diode has charged leaks through the open one
LEAK = """leak
V1 a 0 PULSE(0 5 0 0 0 1 2)
Rs a b 4
D0 b c DR
C0 c 0 64u
.model DR D(Ron=10m Roff=1meg)
.tran 10m 2 uic
"""


def test_one_current_flows_through_a_chain() -> None:
    run = nsspice.tran(nsspice.read(CHAIN), method="modewise")
    assert run.certificate.laws < 1e-11
    diode, chain = run["i(d0)"], (run["v(n4)"] - run["v(n3)"]) / 3570.0
    # voltages of some volts are known to some units of 1e-16: 1e-15 V across 3.57 kOhm
    assert np.abs(diode - chain).max() <= 1e-12 * np.abs(diode).max()


def test_what_leaks_through_an_open_diode() -> None:
    run = nsspice.tran(nsspice.read(LEAK), method="modewise")
    late = run.time > 1.01
    start = run["v(c)"][late][0]
    # Ron > 0 in series with Rs; open, the resistance is that of Roff
    decay = np.exp(-(run.time[late] - run.time[late][0]) / (64e-6 * (1e6 + 4.0)))
    assert run["v(c)"][late] == pytest.approx(start * decay, rel=1e-12)
