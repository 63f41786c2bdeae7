"""Observed orders: first for theta = 1, second for theta = 0.5 before the first switching.

States are compared in the sup norm, multipliers in the mean (they are off by O(1) in the step that
contains a switching, whatever its length).
"""

from __future__ import annotations

import numpy as np
import pytest
from oracle.core import transient
from oracle.orders import mean, observed, sup
from oracle.thesis_decks import (
    ALL,
    BRIDGE,
    FRICTION_FREE,
    FRICTION_LOADED,
    RIGID,
    SPRING,
    ZENER,
    Example,
)


def errors(example: Example, h: float, stop: float, theta: float) -> dict[str, float]:
    """Return the sup error of every state and the mean error of every multiplier."""
    signals = [*example.states, *example.multipliers]
    run = transient(example.deck, h, int(stop / h), signals, theta)
    exact = example.exact.at(run.t)
    out = {}
    for kinds, norm in ((example.states, sup), (example.multipliers, mean)):
        for name, (ours, factor) in kinds.items():
            # the row at t = 0 shows the consistent start, not a step
            out[name] = norm(run[name][1:], factor * exact[ours][1:])
    return out


@pytest.mark.parametrize("example", ALL, ids=lambda e: e.name)
def test_implicit_scheme_has_order_one(example):
    orders = observed(lambda h: errors(example, h, example.stop, 1.0), example.steps, example.stop)
    for name, order in orders.items():
        assert abs(order - 1.0) <= 0.1, f"{name}: {orders}"


def test_unloaded_friction_is_exact_in_speed_and_first_order_in_force():
    example = FRICTION_FREE
    h = example.exact.switches[0] / 1000.5
    got = errors(example, h, example.stop, 1.0)
    assert got["i(l1)"] <= 2e-9 * h * 9.81  # the impulsive start lasts 1e-9 of a step
    # half of the friction force is missing in the one step that contains the stop
    assert got["v(b)"] == pytest.approx(0.5 * 9.81 / int(example.stop / h), rel=1e-6)


@pytest.mark.parametrize("example", [*FRICTION_LOADED, SPRING, ZENER], ids=lambda e: e.name)
def test_half_theta_has_order_two_before_the_first_switching(example):
    stop = 0.95 * example.exact.switches[0]
    example_states = Example(
        example.name, example.deck, example.exact, example.states, {}, stop, example.steps
    )
    orders = observed(lambda h: errors(example_states, h, stop, 0.5), (4e-2, 2e-2, 1e-2, 5e-3))
    for name, order in orders.items():
        assert abs(order - 2.0) <= 0.1, f"{name}: {orders}"


def test_rigid_impact_hands_over_the_impulse():
    h = 1e-4
    run = transient(RIGID.deck, h, 30000, ["i(d1)", "v(v)", "v(x)"])
    hit = RIGID.exact.switches[0]
    (impulse,) = (i for i in run.solution.impulses if i.element == "d1")
    # positions of first order bring the impact h g t / (2 v) early, with the speed of that instant
    assert impulse.time == pytest.approx(hit, abs=0.6 * h)
    assert impulse.value == pytest.approx(np.sqrt(1 + 2 * 9.81 * 6.0), abs=9.81 * h)
    # afterwards the floor carries the weight, from the first row on
    weight = h * run["i(d1)"][run.t > hit + h].sum()
    assert weight == pytest.approx(9.81 * (3.0 - hit), abs=2 * 9.81 * h)
    assert run["v(v)"][-1] == pytest.approx(0.0, abs=1e-12)
    assert run["v(x)"].min() >= -1e-12


@pytest.mark.parametrize("h", [1e-3, 1e-4])
def test_bridge_with_a_step_of_many_periods_lands_on_zero(h):
    run = transient(BRIDGE.deck, h, 40, ["v(n1)", "i(l1)"])
    v = np.abs(run["v(n1)"])
    # the first step sees 5 A through L/h beside R and C/h: that is the largest voltage of all
    assert v[1:].max() <= 5.0 / (h / 1e-3 + 1 / 2000) * (1 + 1e-3)
    assert v[-1] <= 1e-12
    assert np.abs(run["i(l1)"][-1]) <= 1e-12
