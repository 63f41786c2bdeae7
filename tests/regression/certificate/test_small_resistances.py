"""Currents of closed diodes that are differences of potentials over a small resistance.

A half-wave rectifier with a diode of 10 mOhm was refused, and 21 of 48 with other values: the
current of the source is that of the diode, ``(v(in) - v(b)) / Ron``, and where it begins and ends
it is rounding of 10 V over 10 mOhm, which was no term in the equation of the node.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsspice

RECTIFIER = """half-wave rectifier
V1 in 0 SIN(0 {volts} 50)
D1 in b di
R1 b 0 1k
C1 b 0 {farads}
.model di D(Ron={ron} {off})
.tran 0.2m 60m
.end
"""
VALUES = [
    *itertools.product(
        (1.0, 10.0, 325.0, 1e4), ("1u", "10m", "1"), ("", "Roff=1meg"), ("1u", "100u")
    )
]
OHMS = {"1u": 1e-6, "10m": 1e-2, "1": 1.0}
FARADS = {"1u": 1e-6, "100u": 1e-4}


@pytest.mark.parametrize(("volts", "ron", "off", "farads"), VALUES)
def test_half_wave_rectifiers_are_certified(volts, ron, off, farads):
    deck = RECTIFIER.format(volts=volts, ron=ron, off=off, farads=farads)
    solution = nsspice.tran(nsspice.read(deck))
    assert solution.certificate.passed


@pytest.mark.parametrize("farads", ["1u", "100u"])
def test_the_voltage_is_that_of_its_differential_equation(farads):
    deck = RECTIFIER.format(volts=10.0, ron="10m", off="Roff=1meg", farads=farads)
    solution = nsspice.tran(nsspice.read(deck))
    leak, slope = 1e-6, 1.0 / OHMS["10m"]

    def rate(t: float, v: np.ndarray) -> np.ndarray:
        across = 10.0 * np.sin(100.0 * np.pi * t) - v
        current = leak * across + slope * np.maximum(across, 0.0)
        return (current - v / 1e3) / FARADS[farads]

    reference = solve_ivp(
        rate, (0.0, 60e-3), [0.0], "Radau", solution.time, rtol=1e-9, atol=1e-11, max_step=1e-4
    )
    # the kink of the characteristic costs the reference some digits of its tolerance
    assert np.abs(solution["v(b)"] - reference.y[0]).max() <= 1e-6


def test_a_node_that_nothing_feeds_is_at_rest():
    """A resistor of 55 kOhm beside one of 41 Ohm, which only capacitors connect.

    The operating point was refused: the potential of the first was the difference of voltages of
    the capacitors, which the second knew to rounding of its own conductance, and 50 fV were left.
    """
    deck = """two resistors that capacitors connect
V1 n0 0 1
R1 n1 0 10.81
R2 n2 n1 54650
R3 n3 n0 41.17
C1 n3 n2 4.442e-10
R5 n0 0 30490
C3 n0 n2 2.374e-08
.op
.end
"""
    solution = nsspice.op(nsspice.read(deck))
    assert solution.certificate.passed
    # no current flows in r1, r2 and r3
    assert solution["v(n2)"][0] == 0.0
    assert solution["v(n1)"][0] == 0.0
    assert solution["v(n3)"][0] == pytest.approx(1.0, rel=1e-15)
