"""Distances of curves against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nsspice.analyses.signals.curve import Curve
from nsspice.compare.norms import distance


def curve(x: list[float], y: list[float]) -> Curve:
    return Curve(np.array(x), np.array(y))


def test_rows_of_both_count():
    one = curve([0.0, 2.0], [0.0, 0.0])
    two = curve([0.0, 0.5, 2.0], [0.0, 1.0, 0.0])
    found = distance(one, two)
    assert found.maximum == 1.0
    assert found.l1 == pytest.approx(0.5)
    assert found.rms == pytest.approx(np.sqrt(1 / 3))
    assert found.span == 1.0


def test_window():
    one = curve([0.0, 4.0], [0.0, 4.0])
    two = curve([0.0, 4.0], [0.0, 0.0])
    found = distance(one, two, 1.0, 3.0)
    assert found.maximum == 3.0
    assert found.l1 == pytest.approx(2.0)
    assert found.length == 2.0


def test_only_the_common_part_counts():
    found = distance(curve([0.0, 1.0], [0.0, 0.0]), curve([0.5, 9.0], [1.0, 1.0]))
    assert found.length == 0.5
    assert found.maximum == 1.0


def test_nothing_in_common():
    assert np.isnan(distance(curve([0.0, 1.0], [0.0, 0.0]), curve([2.0, 3.0], [0.0, 0.0])).maximum)


def test_nan_is_infinitely_far():
    assert distance(curve([0.0, 1.0], [np.nan, 0.0]), curve([0.0, 1.0], [0.0, 0.0])).l1 == np.inf


values = st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=20)


@given(values, values)
def test_l1_below_rms_below_max_and_symmetric(a, b):
    one = Curve(np.linspace(0.0, 1.0, len(a)), np.array(a))
    two = Curve(np.linspace(0.0, 1.0, len(b)), np.array(b))
    there, back = distance(one, two), distance(two, one)
    slack = 1e-9 * max(1.0, there.maximum)
    assert there.l1 <= there.rms + slack <= there.maximum + 2 * slack
    assert there.l1 == pytest.approx(back.l1, abs=slack)
    assert there.maximum == back.maximum
