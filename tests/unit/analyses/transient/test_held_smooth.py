"""``.ic`` without ``uic`` beside smooth laws: the nodes start where they are held."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice


def test_a_junction_capacitance_starts_at_the_held_voltage():
    circuit = nsspice.read(
        """junction charge, let go at 2 V
D1 0 a DC
R1 a 0 1k
.model DC D(IS=1e-18 CJO=1u VJ=1 M=0.5)
.ic v(a)=2
.tran 1u 0.5m 0 0.5u
"""
    )
    solution = nsspice.tran(circuit)
    v = solution["v(a)"]
    assert v[0] == pytest.approx(2.0, rel=1e-3)
    # 1 uF / sqrt(1 + v) v' = -v / R: the time is 1 ms times the integral of 1 / (v sqrt(1 + v))
    root = np.sqrt(1.0 + v)
    time = 1e-3 * (np.log((root + 1.0) / (root - 1.0)) - np.log((3**0.5 + 1) / (3**0.5 - 1)))
    assert time[-1] == pytest.approx(0.5e-3, rel=2e-3)


def test_a_diode_beside_a_held_capacitor():
    circuit = nsspice.read(
        """held capacitor and diode
R1 a 0 1k
C1 a 0 1u
D1 a b DX
R2 b 0 1k
.model DX D(IS=1e-14)
.ic v(a)=5
.tran 1u 10u
"""
    )
    solution = nsspice.tran(circuit)
    assert solution["v(a)"][0] == pytest.approx(5.0, rel=2e-3)
    drop = solution["v(a,b)"][0]
    current = solution["i(d1)"][0]
    assert current == pytest.approx(1e-14 * np.expm1(drop / 0.025864), rel=2e-2)
