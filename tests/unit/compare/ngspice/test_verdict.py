"""Norms at the rows of nsspice: slack in time, ranges, windows."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.analyses.request.cards import Tran
from nsspice.analyses.solution.solution import Solution
from nsspice.compare.ngspice import NgspiceRun, Options, Translation
from nsspice.compare.ngspice.deck_writer import Substitute
from nsspice.compare.ngspice.verdict import band, default_slack, distances
from nsspice.errors import UsageError


def ngspice(axis, substitutes=(), **signals):
    options = Options(max_step=0.05, edge=0.01)
    translation = Translation("", Tran(1.0), options, {}, tuple(substitutes))
    vectors = {f"v({name})": np.asarray(y, dtype=float) for name, y in signals.items()}
    return NgspiceRun(np.asarray(axis), vectors, 0.0, 0, 0, 0, "", "", translation, {})


def solution(axis, **signals):
    named = {f"v({name})": np.asarray(y, dtype=float) for name, y in signals.items()}
    return Solution("tran", "", "time", np.asarray(axis, dtype=float), named)


def test_a_constant_offset():
    rows = np.linspace(0.0, 1.0, 11)
    run = ngspice([0.0, 1.0], a=[0.0, 2.0])
    (one,) = distances(solution(rows, a=2.0 * rows + 0.1), run, ["v(a)"])
    assert one.maximum == pytest.approx(0.1)
    assert one.l1 == pytest.approx(0.1)
    assert one.rms == pytest.approx(0.1)
    assert one.span == pytest.approx(2.0)
    assert one.share("max") == pytest.approx(0.05)


def test_a_late_jump_is_within_the_slack_and_not_without():
    rows = np.linspace(0.0, 1.0, 21)
    step = (rows >= 0.5).astype(float)
    run = ngspice([0.0, 0.5, 0.51, 1.0], a=[0.0, 0.0, 1.0, 1.0])
    (strict,) = distances(solution(rows, a=step), run, ["v(a)"])
    assert strict.maximum == 1.0
    (loose,) = distances(solution(rows, a=step), run, ["v(a)"], slack=0.02)
    assert loose.maximum == 0.0
    assert loose.sharp == 1.0


def test_slack_does_not_hide_a_wrong_value():
    rows = np.linspace(0.0, 1.0, 21)
    run = ngspice([0.0, 1.0], a=[0.0, 1.0])
    (one,) = distances(solution(rows, a=rows + 0.3), run, ["v(a)"], slack=0.1)
    assert one.maximum == pytest.approx(0.2)


def test_default_slack_is_none_where_ngspice_has_every_law():
    assert default_slack(ngspice([0.0, 1.0])) == 0.0
    replaced = [Substitute(("d1",), "ideal diode", "sidiode()")]
    assert default_slack(ngspice([0.0, 1.0], replaced)) == pytest.approx(0.11)


def test_small_signals_are_measured_against_the_large_ones():
    rows = np.linspace(0.0, 1.0, 3)
    run = ngspice([0.0, 1.0], a=[0.0, 100.0], b=[0.0, 0.0])
    found = distances(solution(rows, a=100.0 * rows, b=rows * 0.0 + 1e-3), run, ["v(a)", "v(b)"])
    assert found[1].span == pytest.approx(0.1)
    assert found[1].share("max") == pytest.approx(0.01)


def test_rounding_is_no_range():
    rows = np.linspace(0.0, 1.0, 3)
    run = ngspice([0.0, 1.0], a=[5.0, 5.0 + 1e-15])
    (one,) = distances(solution(rows, a=rows * 0.0 + 5.0), run, ["v(a)"])
    assert one.span == pytest.approx(5.0)


def test_rows_without_a_counterpart_are_left_out():
    rows = np.linspace(0.0, 1.0, 11)
    run = ngspice([0.05, 1.0], a=[0.0, 0.0])  # uic: ngspice starts after the first instant
    off = np.where(rows == 0.0, 9.0, 0.0)
    (one,) = distances(solution(rows, a=off), run, ["v(a)"])
    assert one.maximum == 0.0
    with pytest.raises(UsageError, match="no row to compare"):
        distances(solution(rows, a=off), run, ["v(a)"], (2.0, None))


def test_band_against_a_fine_grid():
    rng = np.random.default_rng(5)
    x = np.cumsum(rng.uniform(0.01, 0.2, 60))
    y = rng.normal(size=60)
    at = rng.uniform(x[0], x[-1], 200)
    low, high = band(x, y, at, 0.13)
    for t, a, b in zip(at, low, high, strict=True):
        grid = np.union1d(np.linspace(t - 0.13, t + 0.13, 50), x[np.abs(x - t) <= 0.13])
        values = np.interp(grid, x, y)
        assert a == pytest.approx(values.min(), abs=1e-12)
        assert b == pytest.approx(values.max(), abs=1e-12)
