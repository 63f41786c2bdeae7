"""What accuracy costs: reference, ladders, the cheapest way to a target."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from click.testing import CliRunner

import nsspice
from nsspice.analyses.request.settings import Settings
from nsspice.cli.app import app
from nsspice.compare.cost import CostReport, Measurement, make_reference, ngspice_ladders
from nsspice.compare.cost.graph import Graph
from nsspice.compare.cost.problem import GivenUp, Problem
from nsspice.compare.cost.reference import Reference
from nsspice.compare.cost.timer import Timer
from nsspice.errors import Diagnostic

pytestmark = pytest.mark.usefixtures("clock")

RC = """RC
V1 a 0 SIN(0 1 1k)
R1 a b 1k
C1 b 0 1u IC=0
.tran 20u 2m uic
"""
SMOOTH = """smooth rectifier
V1 a 0 SIN(0 5 1k)
R0 a b 10
D1 b c DX
C1 c 0 1u IC=0
R1 c 0 1k
.model DX D(IS=1e-12)
.tran 50u 1m uic
"""


def exact_rc(t):
    w, tau = 2e3 * math.pi, 1e-3
    k = 1.0 / (1.0 + (w * tau) ** 2)
    return k * (np.sin(w * t) - w * tau * np.cos(w * t) + w * tau * np.exp(-t / tau))


def test_reference_is_as_sure_as_it_says():
    problem = Problem.of(nsspice.read(RC))
    assert problem.signals == ["v(b)"]
    reference = make_reference(problem)
    true = exact_rc(problem.analysis.rows())
    error = np.abs(reference.graph.low[:, 0] - true).max() / np.ptp(true)
    assert "mode-wise" in reference.how
    assert error <= max(reference.error, 1e-13)
    assert reference.error < 1e-10


def test_reference_without_the_exact_engine():
    reference = make_reference(Problem.of(nsspice.read(SMOOTH)))
    assert "sdirk" in reference.how
    assert 0.0 < reference.error < 1e-6


JUMP = """1 uF at 10 V meets an empty 1 uF at 1 ms
C1 a 0 1u IC=10
R1 a 0 1k
V1 g 0 PULSE(0 1 1m 0 0 1 2)
S1 a b g 0 SW
C2 b 0 1u IC=0
.model SW SW(VT=0.5 VH=0)
.tran 0.1m 2m uic
"""


@pytest.mark.parametrize("settings", [Settings("modewise"), Settings("sdirk", reltol=1e-8)])
def test_both_sides_of_a_jump_at_a_row_are_right(settings):
    problem = Problem.of(nsspice.read(JUMP), ["v(a)"])
    graph = problem.graph(problem.run(settings)[0])
    before = 10.0 * math.exp(-1.0)
    assert graph.low[10, 0] == pytest.approx(before / 2.0, rel=1e-7)
    assert graph.high[10, 0] == pytest.approx(before, rel=1e-7)
    assert np.flatnonzero(graph.high > graph.low).tolist() == [10]
    reference = make_reference(problem)
    table = reference.graph.high.copy()
    assert reference.distance(table) == (0.0, 0.0)
    table[10] += 1.0
    largest, mean = reference.distance(table)
    assert largest == pytest.approx(1.0 / np.ptp(graph.high), rel=1e-7)
    assert mean == pytest.approx(largest / table.shape[0])


def test_a_reference_whose_longest_step_rules_is_compared_with_another_one():
    # steps of a nanosecond: every tolerance takes the same ones, and finds the same again
    text = SMOOTH.replace("50u 1m", "5n 1u")
    reference = make_reference(Problem.of(nsspice.read(text)))
    finer = make_reference(Problem.of(nsspice.read(text.replace("5n 1u", "5n 1u 0 1n"))))
    error, _ = reference.distance(finer.graph.low)
    assert 0.0 < error <= reference.error


def test_errors_of_what_is_constant_are_shares_of_its_size():
    problem = Problem.of(
        nsspice.read(SMOOTH.replace("V1 a", "V2 e 0 3.6\nR2 e c 10k\nV1 a")), ["v(e)"]
    )
    assert make_reference(problem).graph.span == pytest.approx(3.6)


def test_the_longest_step_of_the_deck_does_not_bound_the_ladder():
    bounded = nsspice.read(SMOOTH.replace("50u 1m", "50u 1m 0 0.5u"))
    report = nsspice.cost(bounded, methods=["sdirk"], limit=0.02)
    assert report.ladders()["sdirk"][0].steps < 500


def test_orders_and_errors_of_the_ladders():
    report = nsspice.cost(
        nsspice.read(RC), methods=["modewise", "sdirk", "sdirk2", "moreau"], limit=0.5
    )
    ladders = report.ladders()
    assert ladders["modewise"][0].error < 1e-9
    assert ladders["moreau"][-1].order == pytest.approx(1.0, abs=0.05)
    # steps are powers of two, so that single orders of a ladder of tolerances scatter
    rows = [r for r in ladders["sdirk2"] if r.steps > 200]
    slope = np.polyfit(np.log([r.steps for r in rows]), np.log([r.error for r in rows]), 1)[0]
    assert slope == pytest.approx(-2.0, abs=0.25)
    assert min(r.error for r in ladders["sdirk"]) < 1e-8
    true = exact_rc(np.arange(101) * 20e-6)
    run = nsspice.tran(nsspice.read(RC), method="moreau", step=20e-6)
    error = np.abs(run["v(b)"] - true).max() / np.ptp(true)
    assert ladders["moreau"][0].error == pytest.approx(error, rel=1e-6)


def made(method: str, error: float, seconds: float, order: float = math.nan) -> Measurement:
    return Measurement(method, "h", 1e-6, 100, error, error / 2, seconds, order)


def test_cheapest_way_is_measured_or_extrapolated_by_the_order():
    reference = Reference(Graph.of_table(np.zeros((2, 1))), 1e-12, "by hand")
    rows = [
        made("slow", 1e-3, 1.0),
        made("slow", 1e-4, 10.0, 1.0),
        made("quick", 1e-3, 0.1),
        made("quick", 1e-7, 0.5, 4.0),
        made("hopeless", 1e-1, 1.0),
    ]
    report = CostReport("t", ["v(a)"], reference, rows)
    quick, slow = report.cheapest(1e-6)
    assert (quick.method, quick.seconds, quick.measured) == ("quick", 0.5, True)
    # first order: a hundredth of the error takes a hundred times as long
    assert (slow.method, slow.measured) == ("slow", False)
    assert slow.seconds == pytest.approx(1000.0)
    assert "quick" in report.describe(1e-6).splitlines()[-2]


def test_longest_steps_of_ngspice_make_its_ladder():
    problem = Problem.of(nsspice.read(SMOOTH))
    report = nsspice.cost(problem.circuit, methods=list(ngspice_ladders.LADDERS), limit=1.0)
    ladders = report.ladders()
    # no ideal diode whose place a sharp junction could take
    assert set(ladders) == {"ngspice", "ngspice-trap", "ngspice-tight"}
    steps = [row.value for row in ladders["ngspice-trap"]]
    assert steps[1] == pytest.approx(1e-7)
    assert steps == sorted(steps, reverse=True)
    errors = [row.error for row in ladders["ngspice-trap"]]
    assert errors[-1] < 0.1 * errors[0]


def test_nothing_to_measure_is_told():
    with pytest.raises(nsspice.UsageError, match=r"no .tran card"):
        nsspice.cost(nsspice.read("t\nV1 a 0 1\nR1 a 0 1\n.op\n"))
    with pytest.raises(nsspice.UsageError, match="did you mean moreau"):
        nsspice.cost(nsspice.read(RC), methods=["morau"])


def test_a_method_that_cannot_is_listed():
    report = nsspice.cost(nsspice.read(SMOOTH), methods=["modewise", "moreau"], limit=0.01)
    assert any(reason.startswith("modewise:") for reason in report.absent)
    assert "not measured: modewise" in report.describe()


def test_command_line(tmp_path):
    deck, picture = tmp_path / "rc.net", tmp_path / "rc.svg"
    deck.write_text(RC)
    args = ["cost", str(deck), "--methods", "modewise sdirk", "--target", "1u", "--limit", "0.02"]
    result = CliRunner().invoke(app, [*args, "--json", "--plot", str(picture)])
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert data["cheapest"][0]["measured"]
    assert data["reference"]["error"] < 1e-9
    assert {run["method"] for run in data["runs"]} == {"modewise", "sdirk"}
    assert picture.stat().st_size > 1000
    text = CliRunner().invoke(app, [*args, "-q"]).stdout
    assert "cheapest method for 1e-06" in text


def test_each_ladder_has_a_look_of_its_own_and_the_legend_covers_none():
    """The ninth ladder had the colour and the line of the first, and the legend lay on points."""
    own = ["modewise", "sdirk", "sdirk2", "moreau", "moreau-half"]
    peers = ["ngspice", "ngspice-trap", "ngspice-tight", "ngspice-junction", "pulsim-dsed"]
    peers += ["pulsim-trbdf2", "pulsim-fixed", "siconos", "siconos-half"]
    run = partial(Measurement, parameter="h", value=1e-6, steps=10, error=1e-3, l1=1e-4)
    rows = [run(name, seconds=10.0**-k) for k, name in enumerate(own + peers)]
    reference = nsspice.cost(nsspice.read(RC), methods=["modewise"]).reference
    figure = CostReport("costs $1 and $2", ["v(c)"], reference, rows).plot()
    figure.draw_without_rendering()
    (axes,) = figure.axes
    curves = [line for line in axes.lines if line.get_label() in own + peers]
    looks = {(line.get_color(), line.get_linestyle()) for line in curves}
    assert len(looks) == len(curves) == len(own + peers)
    assert [line.get_linewidth() > 2.0 for line in curves] == [True] * 5 + [False] * 9
    assert [line.get_markerfacecolor() == "none" for line in curves] == [False] * 5 + [True] * 9
    (legend,) = figure.legends
    told = [text.get_text() for text in legend.get_texts()]
    assert told == ["nsspice", *own, "other programs", *peers]
    assert not legend.get_window_extent().overlaps(axes.get_window_extent())


def test_the_target_is_marked_with_the_cheapest_run_that_reaches_it():
    run = partial(Measurement, parameter="h", value=1e-6, steps=10, l1=1e-4)
    rows = [
        run("sdirk", error=1e-4, seconds=1e-3),
        run("sdirk", error=1e-6, seconds=2e-2),
        run("ngspice", error=1e-6, seconds=5e-1),
    ]
    reference = nsspice.cost(nsspice.read(RC), methods=["modewise"]).reference
    (axes,) = CostReport("costs", ["v(c)"], reference, rows).plot(target=1e-5).axes
    (ring,) = [line for line in axes.lines if line.get_markersize() == 14]
    assert ring.get_xydata().tolist() == [[1e-6, 2e-2]]
    assert "target 1e-05" in {text.get_text().strip() for text in axes.texts}
    assert any("sdirk h=1e-06, 20 ms" in text.get_text() for text in axes.texts)


def test_rungs_of_a_deck_with_laws_of_the_time_take_the_steps_of_a_run():
    """Rungs whose steps were a fiftieth of the run missed pulses, whatever their tolerance."""
    circuit = nsspice.read("""Comparator and a carrier that only an expression knows
Bt t 0 V=sin(2*pi*10k*time)**3
Bg g 0 V=if(0.5 > v(t), 1, 0)
R1 g o 1k
C1 o 0 1n
.tran 5u 10m
""")
    # sin^3 exceeds 1/2 between two instants of each period; the filter follows in exponentials
    period, tau = 1e-4, 1e-6
    above = math.asin(0.5 ** (1.0 / 3.0)) / (2.0 * math.pi) * period
    turns = [k * period + t for k in range(100) for t in (above, 0.5 * period - above)]
    rows = np.arange(2001) * 5e-6
    exact = np.empty_like(rows)
    value = level = 1.0  # the gate is high before the first turn, and at rest
    begin = 0.0
    for end in [*turns, math.inf]:
        inside = (rows >= begin) & (rows < end)
        exact[inside] = level + (value - level) * np.exp(-(rows[inside] - begin) / tau)
        value = level + (value - level) * math.exp(-(end - begin) / tau)
        begin, level = end, 1.0 - level
    reference = Reference(Graph.of_table(exact[:, None]), 3e-8, "closed form")
    report = nsspice.cost(circuit, methods=["sdirk"], limit=8.0, reference=reference)
    assert report.rows[-1].value >= 1e-8
    assert report.rows[-1].error < 1e-7


def test_short_runs_are_timed_in_two_turns():
    timer, times = Timer(), iter([0.09, 0.08, 0.02, 0.03, 0.01, 0.01, 0.01])
    first = timer.least("m", float("nan"), 0.085, lambda: next(times))
    assert first == 0.08
    long = timer.least("m", 1.0, 0.5, lambda: next(times))
    assert long == 0.5
    rows = [replace(made("m", 1e-3, first), value=float("nan")), made("m", 1e-3, long)]
    assert [row.seconds for row in timer.second_turn(rows)] == [0.02, 0.5]
    # two repetitions of each turn of the short run, none of the long one
    assert next(times) == 0.01


def test_a_run_that_fails_the_second_time_keeps_its_time():
    timer, calls = Timer(), iter([0.05, 0.04])

    def run() -> float:
        seconds = next(calls, None)
        if seconds is None:
            raise nsspice.NsspiceError(Diagnostic("NS4009", "gone"))
        return seconds

    first = timer.least("m", 1e-6, 0.06, run)
    assert first == 0.04
    row = made("m", 1e-3, first)
    assert timer.second_turn([row]) == [row]


def test_a_run_that_does_not_end_is_given_up(clock) -> None:
    # ten million periods in steps of a quarter of one
    clock.look = 0.02
    endless = RC.replace("20u 2m", "10 10k")
    problem = Problem.of(nsspice.read(endless), None)
    with pytest.raises(nsspice.StepError, match="stopped after") as caught:
        problem.run(Settings("moreau", 1.0, 2.5e-4), limit=0.05)
    assert caught.value.code == "NS3002"


def test_what_the_deck_costs_is_told_first_and_each_run_when_it_is_done():
    said = []
    report = nsspice.cost(
        nsspice.read(RC),
        methods=["modewise", "moreau"],
        limit=0.02,
        notice=lambda text: said.append(("begin", text)),
        result=lambda text: said.append(("end", text)),
    )
    assert [kind for kind, _ in said[:4]] == ["begin", "end", "begin", "end"]
    assert said[1][1] == report.default
    assert report.default.startswith("modewise, ")
    assert said[2][1] == "reference"
    rows = [text for kind, text in said[4:] if kind == "end"]
    assert len(rows) == len(report.rows)
    assert f"as it is: {report.default}" in report.describe()
    assert not report.interrupted


@pytest.mark.parametrize(("word", "rows"), [("reference", 0), ("moreau", 1)])
def test_ctrl_c_leaves_what_has_been_measured(word, rows):
    def stop(text):
        if text.startswith(word):
            raise KeyboardInterrupt

    report = nsspice.cost(nsspice.read(RC), methods=["modewise", "moreau"], limit=0.02, notice=stop)
    assert report.interrupted
    assert report.default.startswith("modewise, ")
    assert [row.method for row in report.rows] == ["modewise"] * rows
    assert "stopped early" in report.describe(1e-6)
    assert report.to_dict()["interrupted"] is True


def test_the_limit_holds_inside_a_run(clock):
    """A hundred million switchings, of which half a minute of both engines reaches a part."""
    deck = (
        "long run\nV1 a 0 PULSE(0 1 0 1n 1n 0.5u 1u)\nR1 a b 1\nC1 b 0 1u\nD1 b c\nC2 c 0 1u\n"
        "R2 c 0 1k\n.tran 1m 100\n"
    )
    clock.look = 0.02  # blocks of rows come back while the run goes on
    problem = Problem.of(nsspice.read(deck))
    for method in ("modewise", "sdirk"):
        with pytest.raises(GivenUp, match=r"stopped after 0\.1 s") as caught:
            problem.run(Settings(method), 0.1)
        done = re.search(r"([\d.e-]+) % of the run", str(caught.value))
        assert float(done[1]) < 10.0
    reference = Reference(Graph.of_table(np.zeros((2, 1))), 1e-12, "by hand")
    report = nsspice.cost(nsspice.read(deck), methods=["modewise"], limit=0.1, reference=reference)
    assert "stopped after 0.1 s" in report.default
    assert ["stopped after" in reason for reason in report.absent] == [True]
