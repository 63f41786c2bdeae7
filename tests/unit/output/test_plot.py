"""Pictures: panels, units, formats, long and many waveforms."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.text import Text

import nsspice
from nsspice.analyses.results.loop_report import Crossing, LoopReport
from nsspice.analyses.results.spectrum import Spectrum
from nsspice.analyses.solution.solution import Solution
from nsspice.errors import OutputError, UsageError
from nsspice.output.axes import label_apart
from nsspice.output.envelope import band, envelope
from nsspice.output.plot import new_figure


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


def test_rounding_noise_is_no_oscillation():
    """The output of a regulator was drawn as the band that its last digits fill."""
    noise = 4.0 + 1e-15 * np.random.default_rng(0).normal(size=20_000)
    (axes,) = transient(v_out=noise).plot().axes
    assert not axes.collections
    assert _labels(axes) == ["v(out)"]


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


def _labels(axes) -> list[str]:
    _, labels = axes.get_legend_handles_labels()
    return labels


def test_an_oscillation_that_dies_out_keeps_its_tail_as_a_line():
    """The whole curve was a pale band, in which a calm end could not be seen."""
    t = np.linspace(0.0, 1.0, 40_001)
    y = np.where(t < 0.75, np.sin(4000.0 * t), 0.2 * t)
    (axes,) = transient(v_a=y).plot().axes
    (filled,) = axes.collections
    assert filled.get_datalim(axes.transData).intervalx[1] == pytest.approx(15.0, abs=0.2)
    tail = next(line for line in axes.lines if line.get_label() == "_" and line.get_alpha())
    x, z = (np.asarray(v)[~np.isnan(tail.get_ydata())] for v in tail.get_data())
    assert (x[0], x[-1]) == pytest.approx((15.0, 20.0), abs=0.2)
    assert z[-1] == pytest.approx(0.2)


def test_a_band_has_the_extremes_although_its_parts_are_shorter_than_a_period():
    t = np.linspace(0.0, 1.0, 40_001)
    found = band(t, np.sin(2.0 * np.pi * 230.0 * t))
    assert found is not None
    assert found.high[found.fast].min() == pytest.approx(1.0, abs=0.02)
    assert found.low[found.fast].max() == pytest.approx(-1.0, abs=0.02)
    # a hundred periods are told apart by the eye
    assert band(t, np.sign(np.sin(2.0 * np.pi * 100.0 * t))) is None


def test_one_panel_for_each_scale():
    t = np.linspace(0.0, 1.0, 50)
    figure = transient(v_grid=325.0 * t, v_bus=400.0 * t, v_logic=5.0 * t, i_l1=t).plot()
    assert [_labels(axes) for axes in figure.axes] == [
        ["v(grid)", "v(bus)"],
        ["v(logic)"],
        ["i(l1)"],
    ]


def test_groups_of_names_are_panels_as_asked():
    t = np.linspace(0.0, 1.0, 50)
    figure = transient(v_a=t, v_b=t, i_l=t).plot(columns=[["v(a)", "i(l)"], "v(b)"])
    assert [_labels(axes) for axes in figure.axes] == [["v(a)", "i(l)"], ["v(b)"]]


BUCK = """Buck converter
Vin in 0 24
S1 in sw g 0 ideal
D1 0 sw
L1 sw out 100u
C1 out 0 100u IC=12
R1 out 0 5
Vg g 0 PULSE(0 1 0 0 0 4u 10u)
.model ideal SW(VT=0.5)
.tran 1u 30u uic
"""


def test_nobody_has_chosen_outputs_inductor_currents_gates_and_who_conducts():
    figure = nsspice.run(BUCK)[0].plot()
    # the output moves by 0.1 V: next to the 24 V of the switch node it would be a flat line
    assert [_labels(axes) for axes in figure.axes[:3]] == [["v(sw)"], ["v(out)"], ["i(l1)"]]
    strips = figure.axes[3]
    assert [text.get_text() for text in strips.get_yticklabels()] == ["v(g)", "s1", "d1"]
    # the gate, the switch and the diode over three periods of 10 us: on for 4 us, on, off
    parts = [
        image.get_array()[0, :, 3] / image.get_array()[0, :, 3].max() for image in strips.images
    ]
    at = [int(x / 30.0 * 700) for x in (2.0, 6.0, 12.0, 18.0)]
    assert [p[at].round().tolist() for p in parts] == [[1, 0, 1, 0], [1, 0, 1, 0], [0, 1, 0, 1]]
    assert parts[0].mean() == pytest.approx(0.4, abs=0.002)
    # only what was asked for
    asked = nsspice.run(BUCK, signals=["v(g)", "v(out)"])[0].plot()
    assert [_labels(axes) for axes in asked.axes[:1]] == [["v(g)", "v(out)"]]


def test_a_control_that_has_more_than_two_levels_is_no_strip():
    deck = BUCK.replace("PULSE(0 1 0 0 0 4u 10u)", "SIN(0.5 1 100k)")
    figure = nsspice.run(deck)[0].plot()
    assert [text.get_text() for text in figure.axes[-1].get_yticklabels()] == ["s1", "d1"]


def test_strips_of_many_changes_are_shares_without_moire():
    deck = BUCK.replace(".tran 1u 30u uic", ".tran 10u 5m uic")
    axes = nsspice.run(deck)[0].plot().axes
    strips, last = (panel for panel in axes if panel.images)
    gate = strips.images[0].get_array()[0, :, 3]
    assert gate.size == 100
    assert np.ptp(gate) < 0.05
    assert gate.mean() == pytest.approx(0.4, abs=0.01)
    # the last three periods of 10 us have a column of their own
    low, high = last.images[0].get_extent()[:2]
    assert high - low == pytest.approx(0.03, rel=1e-3)
    shown = last.images[0].get_array()[0, :, 3]
    assert np.count_nonzero(np.diff(shown > 0.5)) in (5, 6)


def test_steps_are_a_family_with_the_parameter_as_colour(tmp_path):
    deck = BUCK.replace("R1 out 0 5", "R1 out 0 {r}\n.param r=5") + ".step param r list 1 2 8\n"
    figure = nsspice.plot(nsspice.run(deck), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 1000
    # v(in) is the same in all runs
    names = [axes.get_ylabel().split()[0] for axes in figure.axes]
    assert names == ["v(sw)", "v(out)", "i(l1)"]
    lines = figure.axes[1].lines
    assert _labels(figure.axes[1]) == ["r = 1", "r = 2", "r = 8"]
    assert len({line.get_color() for line in lines}) == 3
    assert {line.get_linestyle() for line in lines} == {"-"}
    assert lines[0].get_ydata()[-1] < lines[2].get_ydata()[-1]


def test_a_family_of_operating_points_has_nothing_to_draw():
    with pytest.raises(UsageError, match="NS4009"):
        nsspice.plot(
            nsspice.run("a\n.param r=1\nV1 a 0 1\nR1 a 0 {r}\n.op\n.step param r list 1 2\n")
        )


def test_pictures_for_dark_pages(solution):
    from matplotlib.colors import to_rgb

    figure = solution.plot(dark=True)
    assert max(to_rgb(figure.get_facecolor())) < 0.2
    for axes in figure.axes:
        assert max(to_rgb(axes.get_facecolor())) < 0.2
        assert min(to_rgb(axes.yaxis.label.get_color())) > 0.7
        assert min(to_rgb(axes.get_yticklabels()[0].get_color())) > 0.7
    (name,) = figure.axes[0].get_legend().get_texts()
    assert min(to_rgb(name.get_color())) > 0.7


def test_a_ripple_is_not_hidden_by_a_forced_zero():
    t = np.linspace(0.0, 1.0, 200)
    low, high = transient(v_out=12.0 + 0.01 * np.sin(20.0 * t)).plot().axes[0].get_ylim()
    assert high - low < 0.03
    # what swings through most of its size has the zero line
    assert transient(v_out=3.0 + 2.0 * np.sin(20.0 * t)).plot().axes[0].get_ylim()[0] <= 0.0


def test_a_long_title_is_whole():
    title = "Buck converter " * 12
    figure = transient(v_a=np.linspace(0.0, 1.0, 50)).plot()
    assert "\n" not in figure.get_suptitle()
    figure = Solution("tran", title, "time", np.arange(3.0), {"v(a)": np.arange(3.0)}).plot()
    assert figure.get_suptitle().replace("\n", " ") == title.strip()


FILTER = """Filter
.param r=10
V1 in 0 AC 1
L1 in out 100u
C1 out 0 10u
R1 out 0 {r}
.ac dec 20 100 1meg
.step param r list 1 3 10 30 100 300 1k 3k 10k
"""


def test_responses_of_a_step_are_one_picture_on_a_scale_of_decades():
    figure = nsspice.plot(nsspice.run(FILTER))
    top, bottom, bar = figure.axes
    assert (top.get_xscale(), bar.get_yscale()) == ("log", "log")
    figure.canvas.draw()
    ticks = [t.get_text() for t in bottom.get_xticklabels()]
    assert all("10^" not in t for t in ticks)
    assert "100 k" in ticks
    # a line has the colour that the bar shows at its value: 100 is the middle of 1 .. 10 000
    line = top.lines[4]
    middle = bar.collections[-1].cmap(bar.collections[-1].norm(100.0))
    assert np.allclose(line.get_color(), middle)
    assert float(bar.collections[-1].norm(100.0)) == pytest.approx(0.5)


def test_margins_are_marked_between_the_curve_and_the_critical_levels():
    f = np.geomspace(1.0, 1e3, 31)
    loop = 20.0 / (1.0 + 1j * f / 10.0) ** 3
    report = LoopReport((Crossing(25.2, -24.1),), (Crossing(17.3, -7.96),))
    signals = {"re(t)": loop.real, "im(t)": loop.imag}
    figure = Solution("loop", "three poles", "frequency", f, signals, loop=report).plot()
    top, bottom = figure.axes
    levels = [line.get_ydata()[0] for line in bottom.lines if line.get_linestyle() == "--"]
    assert levels == [-180.0]
    segments = [line.get_ydata() for line in bottom.lines if len(line.get_ydata()) == 2]
    assert any(sorted(y) == pytest.approx([-204.1, -180.0]) for y in segments)
    segments = [line.get_ydata() for line in top.lines if len(line.get_ydata()) == 2]
    assert any(sorted(y) == pytest.approx([0.0, 7.96]) for y in segments)


def test_a_spectrum_has_its_largest_lines_and_no_rounding():
    t = np.linspace(0.0, 1e-3, 200)
    found = Spectrum("v(out)", 1e3, (1e-17 + 0j, 0.5 + 0j, 1e-17 + 0j, 0.05 + 0j), 0.71, 0.1)
    solution = Solution("pss", "s", "time", t, {"v(out)": np.sin(t)}, spectra=[found])
    panel = solution.plot().axes[-1]
    stems = {round(float(s[0][0]), 3): float(s[1][1]) for s in panel.collections[0].get_segments()}
    assert stems == {1.0: 1.0, 3.0: 0.1}
    assert "mean 0 V" in panel.get_title()
    lines = solution.summary().splitlines()
    first = next(k for k, line in enumerate(lines) if "THD" in line)
    assert [line.split()[0] for line in lines[first + 1 : first + 3]] == ["1", "3"]
    assert "1 other zero to rounding" in lines[first + 3]


def test_names_of_points_do_not_overlap():
    figure = new_figure()
    panel = figure.subplots()
    panel.plot([0.0, 1.0], [0.0, 1.0], "o")
    near = [(f"element_{k}", (0.5, 0.5 + 0.001 * k)) for k in range(12)]
    texts = label_apart(figure, panel, near)
    figure.canvas.draw()
    boxes = [Text.get_window_extent(text) for text in texts]
    # each is near its point, and what has room is not moved
    assert all(abs(box.y0 - boxes[0].y0) < 250.0 for box in boxes)
    (alone,) = label_apart(figure, panel, [("far", (0.1, 0.9))])
    assert alone.arrow_patch is None
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])


def test_a_load_is_the_output_of_a_circuit_that_names_none():
    rectifier = """Bridge rectifier
V1 a b SIN(0 325 50)
D1 a p
D2 b p
D3 n a
D4 n b
C1 p n 100u
R1 p n 1k
Rg n 0 1meg
.tran 0.1m 40m
"""
    axes = nsspice.run(rectifier)[0].plot().axes
    assert "v(p,n)" in [name for panel in axes for name in _labels(panel)]
