"""Periodic steady states with digital controllers, against matrix exponentials and long runs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

import nsspice
from nsspice import Adc, Controller, Pwm
from nsspice.errors import NumericalError, UsageError

BUCK = """buck converter with a digital controller
Vin in 0 24
Vg g 0 0
S1 in sw g 0 ideal
D1 0 sw
L1 sw out 100u
C1 out 0 100u
R1 out 0 5
.model ideal SW(VT=0.5)
"""
PERIOD, TARGET = 10e-6, 12.0
A = np.array([[0.0, -1.0 / 100e-6], [1.0 / 100e-6, -1.0 / (5.0 * 100e-6)]])


class PI:
    """An integral and proportional law whose state can be set."""

    def __init__(self, kp: float = 0.01, ki: float = 0.002) -> None:
        self.kp, self.ki, self.sum = kp, ki, 0.3

    @property
    def state(self) -> list[float]:
        return [self.sum]

    @state.setter
    def state(self, values: list[float]) -> None:
        (self.sum,) = values

    def __call__(self, time, values):
        error = TARGET - values[0]
        self.sum += self.ki * error
        return min(max(self.sum + self.kp * error, 0.0), 0.95)


def steps_of(duty: float) -> tuple[np.ndarray, np.ndarray]:
    """State a period later as ``M x + b`` if the switch is on for a part of it at its start."""
    whole = np.zeros((3, 3))
    whole[:2, :2] = A
    on = whole.copy()
    on[0, 2] = 24.0 / 100e-6
    both = expm(whole * (1.0 - duty) * PERIOD) @ expm(on * duty * PERIOD)
    return both[:2, :2], both[:2, 2]


def orbit_on_paper(late: bool, law: PI) -> tuple[float, np.ndarray, np.ndarray]:
    """Duty, state at the sample, and multipliers: there the sample is the target."""
    low, high = 0.1, 0.9
    for _ in range(100):
        duty = 0.5 * (low + high)
        M, b = steps_of(duty)
        x = np.linalg.solve(np.eye(2) - M, b)
        low, high = (duty, high) if x[1] < TARGET else (low, duty)
    M, _ = steps_of(duty)
    # the duty moves the edge at duty T: a jump of the rate by 24 V / L there
    rest = expm(A * (1.0 - duty) * PERIOD) @ np.array([24.0 / 100e-6, 0.0]) * PERIOD
    # x, sum, duty that waits: s' = s + ki (target - v), d' = s' + kp (target - v)
    s_v, d_v = -law.ki, -law.ki - law.kp
    if late:
        Phi = np.zeros((4, 4))
        Phi[:2, :2], Phi[:2, 3] = M, rest
        Phi[2, 1], Phi[2, 2] = s_v, 1.0
        Phi[3, 1], Phi[3, 2] = d_v, 1.0
    else:
        Phi = np.zeros((3, 3))
        Phi[:2, :2], Phi[:2, 2] = M, rest
        Phi[:2, 1] += rest * d_v
        Phi[2, 1], Phi[2, 2] = s_v, 1.0
    return duty, x, np.linalg.eigvals(Phi)


HIGH, LOW = (0.01, 0.002), (0.0002, 0.0001)


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("gains", [HIGH, LOW])
def test_a_buck_is_on_its_orbit(late: bool, gains: tuple[float, float]) -> None:
    circuit, law = nsspice.read(BUCK), PI(*gains)
    controller = Controller(
        PERIOD, ["v(out)"], [Pwm("vg", PERIOD)], law, delay=PERIOD if late else 0.0
    )
    solution = nsspice.pss(circuit, controllers=[controller], extra=["i(l1)"])
    duty, x, multipliers = orbit_on_paper(late, PI(*gains))
    assert solution.periodic.period == PERIOD
    # a period closes to 1e-12, and the slowest multiplier enlarges that by 1/(1 - 0.98)
    assert solution["v(out)"][[0, -1]] == pytest.approx([TARGET, TARGET], abs=1e-9)
    assert solution["i(l1)"][0] == pytest.approx(x[0], abs=1e-9)
    assert law.sum == pytest.approx(duty, abs=1e-10)
    assert solution.certificate.passed
    found = np.sort_complex(np.array(solution.periodic.multipliers))
    wanted = np.sort_complex(multipliers[np.abs(multipliers) > solution.periodic.tolerance])
    # differences know them to the square root of what closes
    assert found == pytest.approx(wanted, abs=solution.periodic.tolerance)
    # too much gain: the orbit is there, though no run would stay on it
    fast = np.abs(multipliers).max() > 1.0
    assert solution.periodic.verdict == ("unstable: Neimark-Sacker" if fast else "stable")
    assert fast == (gains is HIGH)


def test_periods_of_two_rates_have_a_common_one() -> None:
    deck = "two rates\nVa a 0 0\nR1 a b 1k\nC1 b 0 1u\nV2 c 0 SIN(0 1 500)\nR2 c 0 1\n"
    controllers = [
        Controller(1.5e-3, ["v(c)"], [], lambda t, v: None),
        Controller(1e-3, [], ["va"], Toggle()),
    ]
    solution = nsspice.pss(nsspice.read(deck), controllers=controllers)
    assert solution.periodic.period == pytest.approx(6e-3)
    # a square wave of 2 ms behind 1 ms: the ends are +-tanh(T/(4 tau)) with T = 2 ms
    level = math.tanh(0.5)
    assert np.abs(solution["v(b)"]).max() == pytest.approx(level, abs=1e-10)


class Toggle:
    """Turns at each call."""

    def __init__(self) -> None:
        self.state = [1.0]

    def __call__(self, time, values):
        self.state = [-self.state[0]]
        return self.state[0]


def test_steps_find_the_orbit_too() -> None:
    smooth = BUCK.replace("D1 0 sw", "D1 0 sw junction").replace(
        ".model ideal", ".model junction D(IS=1n RS=1m)\n.model ideal"
    )
    law = PI()
    controller = Controller(PERIOD, ["v(out)"], [Pwm("vg", PERIOD)], law)
    solution = nsspice.pss(nsspice.read(smooth), controllers=[controller])
    assert solution.islands[0].method == "sdirk"
    assert solution["v(out)"][0] == pytest.approx(TARGET, abs=1e-4)
    # the drop of the junction raises the duty
    assert orbit_on_paper(False, law)[0] + 0.005 < law.sum < orbit_on_paper(False, law)[0] + 0.02


def test_a_quantised_law_without_an_orbit_is_named() -> None:
    controller = Controller(
        PERIOD,
        [Adc("v(out)", bits=4, high=24.0)],
        [Pwm("vg", PERIOD, ticks=7)],
        PI(ki=0.05),
    )
    with pytest.raises(NumericalError) as error:
        nsspice.pss(nsspice.read(BUCK), controllers=[controller])
    assert error.value.code == "NS3062"


def test_a_period_that_is_no_multiple_is_refused() -> None:
    controller = Controller(PERIOD, ["v(out)"], [Pwm("vg", PERIOD)], PI())
    with pytest.raises(UsageError):
        nsspice.pss(nsspice.read(BUCK), 1.5 * PERIOD, controllers=[controller])
    with pytest.raises(UsageError):
        nsspice.pss(nsspice.read(BUCK), trigger="v(out)", controllers=[controller])
