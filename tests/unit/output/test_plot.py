"""Pictures: panels, units, formats, long and many waveforms."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.analyses.solution import Solution
from nsspice.errors import OutputError, UsageError
from nsspice.output.envelope import envelope


def transient(**signals: np.ndarray) -> Solution:
    named = {name[0] + "(" + name[2:] + ")": y for name, y in signals.items()}
    rows = next(iter(named.values())).size
    return Solution("tran", "a $5 title", "time", np.linspace(0.0, 20e-3, rows), named)


@pytest.fixture
def solution() -> Solution:
    t = np.linspace(0.0, 1.0, 200)
    return transient(v_a=5e3 * np.sin(t), i_r1=2e-3 * np.cos(t), p_r1=10.0 * t)


def test_voltages_currents_and_powers_have_panels_of_their_own(solution):
    figure = solution.plot()
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["Voltage [kV]", "Current [mA]", "Power [W]"]
    assert figure.axes[-1].get_xlabel() == "Time [ms]"
    assert [line.get_label() for line in figure.axes[0].lines if line.get_label()[0] != "_"] == [
        "v(a)"
    ]


def test_values_are_scaled_with_their_prefix(solution):
    figure = solution.plot()
    x, y = figure.axes[1].lines[0].get_data()
    assert x[-1] == pytest.approx(20.0)
    assert y[0] == pytest.approx(2.0)


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_formats(solution, tmp_path, ending):
    solution.plot(tmp_path / f"a.{ending}")
    start = (tmp_path / f"a.{ending}").read_bytes()[:60]
    assert {"png": b"PNG", "svg": b"<?xml", "pdf": b"%PDF"}[ending] in start


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_two_runs_give_identical_pictures(solution, tmp_path, ending):
    for name in "ab":
        solution.plot(tmp_path / f"{name}.{ending}")
    first, second = (tmp_path / f"{name}.{ending}" for name in "ab")
    assert first.read_bytes() == second.read_bytes()


def test_unknown_format(solution, tmp_path):
    with pytest.raises(UsageError, match=r"\.png, \.svg or \.pdf"):
        solution.plot(tmp_path / "a.bmp")


def test_missing_folder(solution, tmp_path):
    with pytest.raises(OutputError, match="NS4001"):
        solution.plot(tmp_path / "no" / "a.png")


def test_nothing_to_draw():
    with pytest.raises(UsageError, match="nothing to draw"):
        Solution("op", "t", "", np.zeros(1), {"v(a)": np.ones(1)}).plot()


def test_long_waveforms_keep_their_peaks():
    y = np.zeros(1_000_000)
    y[123_456] = 7.0
    figure = transient(v_a=y).plot()
    drawn = figure.axes[0].lines[0].get_ydata()
    assert drawn.size <= 8000
    assert drawn.max() == 7.0


def test_many_signals_are_thinned_and_the_picture_says_so():
    t = np.linspace(0.0, 1.0, 50)
    figure = transient(**{f"v_n{k}": t * k for k in range(100)}).plot()
    legend = figure.axes[0].get_legend()
    assert len(legend.get_texts()) == 24
    assert legend.get_title().get_text() == "60 of 100 drawn, 24 named"
    assert legend.get_texts()[-1].get_text() == "v(n99)"


def test_a_constant_is_not_blown_up_to_its_rounding_noise():
    noise = 5.0 + 1e-15 * np.random.default_rng(0).normal(size=100)
    low, high = transient(v_a=noise).plot().axes[0].get_ylim()
    assert high - low > 5e-3


def test_nested_sweeps_are_one_curve_per_outer_value():
    inner = np.tile(np.linspace(-1.0, 1.0, 11), 3)
    figure = Solution("dc", "s", "v1", inner, {"v(a)": inner**2}).plot()
    assert len([x for x in figure.axes[0].lines if len(x.get_xdata()) == 11]) == 3
    assert figure.axes[0].get_xlabel() == "v1 [V]"


def test_holes_are_drawn_as_holes():
    y = np.linspace(0.0, 1.0, 10)
    y[4] = np.nan
    assert transient(v_a=y).plot().axes[0].get_ylabel() == "Voltage [V]"


def test_envelope_leaves_short_curves_alone():
    x = np.arange(10.0)
    assert envelope(x, x, 10)[0] is x


def test_fast_oscillations_become_pale_bands_below_the_slow_curves():
    t = np.linspace(0.0, 1.0, 20_001)
    figure = transient(v_sw=np.sign(np.sin(2e4 * t)), v_out=np.sin(3.0 * t)).plot()
    (band,) = figure.axes[0].collections
    labels = [line.get_label() for line in figure.axes[0].lines]
    assert band.get_label() == "v(sw)"
    assert "v(out)" in labels
    assert "v(sw)" not in labels
    assert band.get_zorder() < figure.axes[0].lines[0].get_zorder()
    low, high = band.get_datalim(figure.axes[0].transData).intervaly
    assert (low, high) == (-1.0, 1.0)
