"""A field-oriented drive: currents in rotor coordinates by a Python controller at 10 kHz.

Six ideal transistors with diodes and dead times feed a synchronous machine at constant speed: its
phases are a resistance, an inductance and an induced voltage each.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice import Controller, Pwm

PERIOD, DC = 1e-4, 300.0
R, L, PSI, SPEED = 0.5, 5e-3, 0.2, 2.0 * math.pi * 50.0  # Ohm, H, V s, 1/s electrical
SHIFT = 2.0 * math.pi / 3.0


def leg(k: int) -> str:
    phase = -math.degrees(k * SHIFT)
    return f"""Vh{k} h{k} 0 0
Vl{k} l{k} 0 0
Sh{k} dc x{k} h{k} 0 ideal
Sl{k} x{k} 0 l{k} 0 ideal
Dh{k} x{k} dc
Dl{k} 0 x{k}
R{k} x{k} m{k} {R}
L{k} m{k} e{k} {L} ic=0
Ve{k} e{k} star SIN(0 {PSI * SPEED} 50 0 0 {phase + 90.0})
"""


DECK = "drive\nVdc dc 0 300\n" + "".join(map(leg, range(3))) + ".model ideal SW(VT=0.5)\n"


class FieldOriented:
    """PI controllers of both currents with decoupling; the voltages act in the next period."""

    def __init__(self, wanted: float) -> None:
        self.wanted = wanted
        # the zero of the controller is the pole of the machine; crossover at 500 Hz
        self.gain = 2.0 * math.pi * 500.0 * L
        self.d = self.q = 0.0

    def __call__(self, time: float, values: tuple[float, ...]) -> list[float]:
        angle = SPEED * time
        a, b = values
        alpha, beta = a, (a + 2.0 * b) / math.sqrt(3.0)
        c, s = math.cos(angle), math.sin(angle)
        d, q = c * alpha + s * beta, c * beta - s * alpha
        errors = -d, self.wanted - q
        self.d += self.gain * R / L * PERIOD * errors[0]
        self.q += self.gain * R / L * PERIOD * errors[1]
        u_d = self.gain * errors[0] + self.d - SPEED * L * q
        u_q = self.gain * errors[1] + self.q + SPEED * (L * d + PSI)
        angle += 1.5 * SPEED * PERIOD
        c, s = math.cos(angle), math.sin(angle)
        alpha, beta = c * u_d - s * u_q, s * u_d + c * u_q
        volts = alpha, -0.5 * alpha + 0.75**0.5 * beta, -0.5 * alpha - 0.75**0.5 * beta
        middle = 0.5 * (max(volts) + min(volts))  # space vectors: the zero vectors are equal
        return [min(max(0.5 + (v - middle) / DC, 0.0), 1.0) for v in volts]


@pytest.mark.parametrize("stop", [0.06, pytest.param(1.0, marks=pytest.mark.soak)])
def test_currents_and_power_of_a_drive(stop: float) -> None:
    legs = [Pwm(f"vh{k}", PERIOD, "updown", complement=f"vl{k}", dead_time=1e-6) for k in range(3)]
    controller = Controller(PERIOD, ["i(l0)", "i(l1)"], legs, FieldOriented(10.0), delay=PERIOD)
    solution = nsspice.tran(
        nsspice.read(DECK), stop, 5e-5, uic=True, controllers=[controller],
        signals=["i(l0)", "i(l1)", "i(l2)"],
    )  # fmt: skip
    assert solution.certificate.passed
    whole = (solution.time > stop - 0.02) & (np.arange(solution.time.size) % 2 == 0)
    angle = SPEED * solution.time[whole] - SHIFT * np.arange(3)[:, None]
    currents = np.array([solution[f"i(l{k})"][whole] for k in range(3)])
    q = -2.0 / 3.0 * (np.sin(angle) * currents).sum(axis=0)
    d = 2.0 / 3.0 * (np.cos(angle) * currents).sum(axis=0)
    # sampled in the middle of zero vectors; dead times of 1 us take 3 V and turn with the currents
    assert q.mean() == pytest.approx(10.0, abs=0.05)
    assert d.mean() == pytest.approx(0.0, abs=0.05)
    assert np.hypot(q - 10.0, d).max() < 0.5
