"""Curves against closed forms on sampled analytic waveforms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nsspice.analyses.signals.curve import Curve


def sine(points: int = 2001, periods: float = 3.0) -> Curve:
    x = np.linspace(0.0, periods, points)
    return Curve.of(x, np.sin(2 * np.pi * x))


def test_integrals_of_a_line_are_exact():
    curve = Curve.of(np.array([0.0, 0.3, 2.0]), np.array([1.0, 1.6, 5.0]))  # y = 1 + 2 x
    assert curve.integral() == pytest.approx(6.0, rel=1e-15)
    assert curve.mean() == pytest.approx(3.0, rel=1e-15)
    # integral of (1 + 2x)^2 over 0..2 is (5^3 - 1^3) / 6
    assert curve.rms() == pytest.approx(np.sqrt(124 / 6 / 2), rel=1e-15)


def test_integrals_of_a_sine_converge_with_the_square_of_the_row_distance():
    errors = []
    for points in (301, 601):
        half = sine(points).window(0.0, 0.5)
        errors.append([abs(half.mean() - 2 / np.pi), abs(half.rms() - np.sqrt(0.5))])
    ratio = np.array(errors[0]) / np.array(errors[1])
    assert ratio == pytest.approx([4.0, 4.0], rel=0.02)


def test_window_interpolates_its_ends():
    curve = Curve.of(np.array([0.0, 1.0, 2.0]), np.array([0.0, 10.0, 0.0])).window(0.25, 1.5)
    assert curve.x.tolist() == [0.25, 1.0, 1.5]
    assert curve.y.tolist() == [2.5, 10.0, 5.0]


def test_window_within_one_row_distance():
    curve = Curve.of(np.array([0.0, 1.0]), np.array([0.0, 1.0])).window(0.25, 0.5)
    assert curve.x.tolist() == [0.25, 0.5]
    assert curve.mean() == 0.375


def test_window_outside_is_empty():
    assert sine().window(4.0, 5.0).x.size == 0
    assert np.isnan(sine().window(4.0, 5.0).mean())


def test_crossings_of_a_sine():
    curve = sine(20001)
    assert curve.crossings(0.5, "rise") == pytest.approx(np.arange(3) + 1 / 12, abs=2e-8)
    assert curve.crossings(0.5, "fall") == pytest.approx(np.arange(3) + 5 / 12, abs=2e-8)
    assert curve.crossings(0.5).size == 6
    assert curve.crossings(1.5).size == 0


def test_a_row_on_the_level_counts_once():
    curve = Curve.of(np.arange(5.0), np.array([-1.0, 0.0, 1.0, 0.0, -1.0]))
    assert curve.crossings(0.0, "rise").tolist() == [1.0]
    assert curve.crossings(0.0, "fall").tolist() == [3.0]


def test_a_falling_sweep_is_turned_round():
    curve = Curve.of(np.array([2.0, 1.0, 0.0]), np.array([4.0, 1.0, 0.0]))
    assert curve.at(1.5) == 2.5
    assert curve.integral() == 3.0


def test_slope_of_a_line_and_at_a_corner():
    curve = Curve.of(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 3.0]))
    assert curve.slope(0.5) == 1.0
    assert curve.slope(1.0) == 1.5
    assert curve.slope(0.0) == 1.0
    assert curve.slope(2.0) == 2.0
    assert np.isnan(curve.slope(2.5))


def test_slope_of_a_sine():
    assert sine(20001).slope(0.25 + 1 / 12) == pytest.approx(2 * np.pi * -0.5, rel=1e-3)


def test_outside_the_curve_there_is_no_value():
    assert np.isnan(sine().at(3.1))
    assert np.isnan(sine().at(-0.1))
    assert not np.isnan(sine().at(3.0 + 1e-13))


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=30),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
)
def test_windows_add_up(values, one, two):
    curve = Curve.of(np.linspace(0.0, 1.0, len(values)), np.array(values))
    low, high = sorted((one, two))
    parts = [(None, low), (low, high), (high, None)]
    total = sum(curve.window(*part).integral() for part in parts)
    assert total == pytest.approx(curve.integral(), abs=1e-9)
