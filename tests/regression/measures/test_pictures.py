"""Pictures are drawn on the points of the engine, with both sides of every jump."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.analyses.solution.plot_points import drawn
from nsspice.output.envelope import band, envelope

DECK = Path(__file__).with_name("al.net").read_text()


@pytest.fixture(scope="module")
def start() -> nsspice.Solution:
    return nsspice.tran(nsspice.read(DECK), 60e-6, 10e-6, uic=True)


def test_edges_of_an_ideal_switch_are_upright(start: nsspice.Solution) -> None:
    shown = drawn(start, ["v(sw)", "i(l1)"])
    edges = np.flatnonzero(np.abs(np.diff(shown["v(sw)"])) > 12.0)
    assert edges.size == 11
    assert np.diff(shown.time)[edges] == pytest.approx(np.zeros(11), abs=1e-18)
    # the coil has its peaks where the switch opens
    peak = shown.time[shown["i(l1)"].argmax()]
    assert (peak / 5e-6) % 2.0 == pytest.approx(1.0, abs=1e-9)
    assert not np.any(np.diff(shown.time) < 0.0)


def test_a_plot_shows_the_ripple_that_output_points_hide() -> None:
    sol = nsspice.tran(nsspice.read(DECK), 60e-6, 10e-6, uic=True)
    figure = sol.plot(columns=["i(l1)"])
    (curve, *_) = [line for line in figure.axes[0].lines if line.get_label() == "i(l1)"]
    assert max(curve.get_ydata()) == pytest.approx(sol.maximum("i(l1)"), rel=1e-6)


def test_columns_of_a_picture_have_one_width_wherever_the_points_are() -> None:
    x = np.concatenate([np.linspace(0.0, 1e-3, 50_000), np.linspace(1e-3, 1.0, 50_000)[1:]])
    y = np.sin(40.0 * x)
    y[30_000] = 5.0
    u, v = envelope(x, y, 1000)
    assert v.max() == 5.0
    assert u.size <= 4000
    assert np.diff(u).max() < 2.1e-3
    assert np.interp(0.5, u, v) == pytest.approx(np.sin(20.0), abs=0.05)
    # a burst in a thousandth of the picture is no band
    assert band(x, np.where(x < 1e-3, np.sin(1e6 * x), 0.0)) is None
