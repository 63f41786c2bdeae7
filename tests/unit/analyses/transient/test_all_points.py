"""Rows at the solver's points, and both sides of jumps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.analyses.transient.union_of_instants import Merger, align

STEP = """a source steps across a capacitor
V1 a 0 PULSE(0 5 1m 0 0 1m 4m)
D1 a b
C1 b 0 1u IC=0
R1 b 0 1k
V2 c 0 PULSE(0 1 0.55m 0 0 1m 4m)
R3 c 0 1
"""


def test_both_sides_of_every_jump_are_rows():
    sol = nsspice.tran(nsspice.read(STEP), 2e-3, 2e-4, step=1e-4, uic=True, all_points=True)
    t = sol.time
    assert np.all(np.diff(t) >= 0.0)
    twice = t[1:][np.diff(t) == 0.0]
    assert twice.tolist() == pytest.approx([0.55e-3, 1e-3, 1.55e-3, 2e-3])
    k = int(np.flatnonzero(np.diff(t) == 0.0)[1])
    assert sol["v(b)"][k] == pytest.approx(0.0, abs=1e-12)
    assert sol["v(b)"][k + 1] == pytest.approx(5.0, rel=1e-9)
    # the steps of 0.1 ms, each jump off the grid of one island brings a point of its own
    assert t.size == 1 + 20 + 2 + 4


def test_points_begin_at_the_start_of_the_rows():
    sol = nsspice.tran(
        nsspice.read(STEP), 2e-3, 2e-4, step=1e-4, start=5e-4, uic=True, all_points=True
    )
    assert sol.time[0] == 5e-4


def test_a_measure_sees_a_peak_that_ends_in_a_jump():
    """A ramp that falls at a row: the row holds the value after the fall."""
    deck = (
        "saw\nV1 a 0 PWL(0 0 1m 1 1m 0 2m 0)\nR1 a 0 1\n.tran 0.1m 2m\n.measure tran m MAX v(a)\n"
    )
    (sol,) = nsspice.read(deck).run()
    assert sol["v(a)"].max() == pytest.approx(0.9)
    assert sol.measures["m"] == 1.0
    assert sol.time.size == 21


def test_a_window_from_a_jump_on_holds_only_the_side_after_it():
    deck = (
        "saw\nV1 a 0 PWL(0 0 1m 1 1m 0 2m 0.5)\nR1 a 0 1\n.tran 0.1m 2m\n"
        ".measure tran m MAX v(a) FROM=1m TO=2m\n"
    )
    (sol,) = nsspice.read(deck).run()
    assert sol.measures["m"] == 0.5


#: 1 F between a switched source of 1 V and 1 Ohm: at 1 s the current jumps from 0 to 1 A and decays
CHARGE = """a switch charges a capacitor
V1 a 0 1
V2 g 0 PULSE(0 1 1 0 0 10 20)
S1 a b g 0 SW
R1 b c 1
C1 c 0 1 IC=0
.model SW SW(VT=0.5)
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_every_engine_shows_both_sides_of_a_switching(method):
    sol = nsspice.tran(
        nsspice.read(CHARGE + ".save i(r1) v(c)\n"),
        2.0,
        0.3,
        uic=True,
        method=method,
        all_points=True,
        reltol=1e-8,
    )
    assert sol.islands[0].method == method
    t = sol.time
    (k,) = np.flatnonzero(np.diff(t) == 0.0)
    assert t[k] == pytest.approx(1.0, rel=1e-12)
    assert sol["i(r1)"][k] == pytest.approx(0.0, abs=1e-12)
    # right after the switching the current is 1 A; a stepper finds it from short steps
    assert sol["i(r1)"][k + 1] == pytest.approx(1.0, rel=1e-9 if method == "modewise" else 1e-5)
    assert np.all(np.diff(t) >= 0.0)
    if method != "moreau":
        grid = np.append(np.arange(7) * 0.3, 2.0)
        assert all(np.min(np.abs(t - row)) < 1e-12 for row in grid)
        exact = np.where(t > 1.0, 1.0 - np.exp(1.0 - np.maximum(t, 1.0)), 0.0)
        # of one step the error is below 1e-8 of the largest voltage; there are some dozen steps
        tolerance = 1e-12 if method == "modewise" else 1e-6
        np.testing.assert_allclose(sol["v(c)"], exact, atol=tolerance)


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_a_switching_at_a_row_stands_twice_not_thrice(method):
    sol = nsspice.tran(nsspice.read(CHARGE), 2.0, 0.5, uic=True, method=method, all_points=True)
    assert np.count_nonzero(np.abs(sol.time - 1.0) < 1e-9) == 2


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_measure_sees_the_first_current_of_a_switching_between_rows(method):
    card = ".options method={}\n.tran 0.3 2 uic\n.measure tran top MAX i(r1)\n"
    (sol,) = nsspice.read(CHARGE + card.format(method)).run()
    assert sol.islands[0].method == method
    assert sol["i(r1)"].max() < 0.9
    # the fixed steps of moreau end 0.03 s from each other at most: the first is that late
    assert sol.measures["top"] == pytest.approx(1.0, rel=0.04 if method == "moreau" else 1e-5)


def test_a_diode_that_starts_to_conduct_makes_its_current_jump():
    """1 uF across a diode and a ramp of 1 kV/s from -1 V: from 1 ms on 1 uF 1 kV/s = 1 mA flow."""
    deck = "peak\nV1 a 0 PWL(0 -1 4m 3)\nD1 a b\nC1 b 0 1u IC=0\n.model D D(ideal)\n"
    sol = nsspice.tran(nsspice.read(deck), 3e-3, 0.7e-3, uic=True, all_points=True)
    (k,) = np.flatnonzero(np.diff(sol.time) == 0.0)
    assert sol.time[k] == pytest.approx(1e-3, rel=1e-9)
    assert sol["i(d1)"][k] == pytest.approx(0.0, abs=1e-12)
    assert sol["i(d1)"][k + 1] == pytest.approx(1e-3, rel=1e-12)


def test_rounding_at_a_zero_crossing_is_no_jump():
    """A resonance with ideal diodes in series: at each crossing all voltages are rounding."""
    deck = (
        "bridge\nC0 n1 0 1u IC=10\nL1 n1 0 10m IC=0\nD1 n1 p\nD2 0 p\nD3 n 0\nD4 n n1\n"
        "R1 p n 1k\n.tran 1m 10m uic\n"
    )
    (sol,) = nsspice.read(deck).run()
    assert sol.islands[0].stats["events"] > 10
    assert sol.with_jumps().axis.size == sol.time.size


def test_islands_keep_their_own_jumps():
    sol = nsspice.tran(nsspice.read(STEP), 2e-3, 2e-4, uic=True)
    rows = sol.with_jumps()
    assert rows.axis.size > sol.time.size
    assert set(np.unique(rows["v(c)"])) <= {0.0, 1.0}
    at = np.flatnonzero(rows.axis == 1e-3)
    assert rows["v(b)"][at].tolist() == pytest.approx([0.0, 5.0])


def test_merger_hands_on_what_align_gives_at_once():
    rng = np.random.default_rng(7)
    parts = []
    for width in (2, 3):
        t = np.sort(np.concatenate([[0.0, 1.0], np.round(rng.uniform(0, 1, 40), 2)]))
        parts.append(np.column_stack([t, rng.normal(size=(t.size, width - 1))]))
    merger = Merger([2, 3])
    got, places = [], [0, 0]
    while any(p < part.shape[0] for p, part in zip(places, parts, strict=True)):
        k = int(rng.integers(2))
        size = int(rng.integers(1, 6))
        merger.add(k, parts[k][places[k] : places[k] + size])
        places[k] += size
        if places[k] >= parts[k].shape[0]:
            merger.end(k)
        got.append(merger.take())
    got.append(merger.take())
    np.testing.assert_allclose(np.concatenate(got), align(parts), atol=1e-12)


@pytest.mark.parametrize(("method", "known"), [("modewise", 1e-10), ("sdirk", 1e-4)])
def test_an_island_is_right_at_the_points_of_another(method, known):
    """A discharge beside a rectifier: lines between their own points would be off by per cents.

    The exact engine's pieces follow to 1e-11 of the largest value, the steps to ten times their
    tolerance of 1e-5.
    """
    one = "discharge\nC1 a 0 1u IC=1\nR1 a 0 1k\n"
    other = "V2 s 0 SIN(0 1 730)\nD2 s b\nC2 b 0 1u IC=0.5\nR2 b 0 300\n"
    card = ".tran 1m 5m uic\n"
    alone = nsspice.tran(nsspice.read(one + card), method=method, all_points=True)
    sol = nsspice.tran(nsspice.read(one + other + card), method=method, all_points=True)
    assert sol.time.size > alone.time.size + 5
    assert sol["v(a)"] == pytest.approx(np.exp(-sol.time / 1e-3), abs=known)


def test_command_line(tmp_path):
    from click.testing import CliRunner

    from nsspice.cli.app import app

    (tmp_path / "a.net").write_text(STEP + ".tran 0.2m 2m uic\n")
    out = tmp_path / "a.csv"
    found = CliRunner().invoke(
        app, ["run", str(tmp_path / "a.net"), "--all-points", "-o", str(out), "-q"]
    )
    assert found.exit_code == 0, found.output
    table = np.genfromtxt(out, delimiter=",", skip_header=1)
    assert np.count_nonzero(np.diff(table[:, 0]) == 0.0) == 4


def test_steps_with_error_control_end_on_rows_where_they_can():
    """A row inside a step costs a stage, and errs as the continuous solution does."""
    deck = "rc\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 0.1u IC=0.3\n.tran 1u 1m uic\n.end\n"
    circuit = nsspice.read(deck)
    sol = nsspice.tran(circuit, 1e-3, 4e-6, step=2e-6, method="sdirk", uic=True, all_points=True)
    rows = 4e-6 * np.arange(251)
    # the first steps are short, none of the later ones ends beside a row
    late = sol.time[sol.time > 1e-4]
    beside = np.abs(np.subtract.outer(late, 2e-6 * np.arange(501))).min(axis=1) > 1e-18
    # but for two extremes of each of v(b) and i(v1)
    assert np.count_nonzero(beside) == 4
    assert np.isin(rows, sol.time).all()
    w, tau = 2e3 * np.pi, 1e-4
    forced = (np.sin(w * sol.time) - w * tau * np.cos(w * sol.time)) / (1 + (w * tau) ** 2)
    exact = forced + (0.3 + w * tau / (1 + (w * tau) ** 2)) * np.exp(-sol.time / tau)
    assert np.abs(sol["v(b)"] - exact).max() < 1e-7


def test_points_of_a_long_run_stand_in_order():
    """Extremes inside an interval that several blocks of 4096 rows share come before later rows."""
    deck = "one interval\nV1 a 0 SIN(0 1 1k)\nR1 a b 10\nL1 b c 1m\nC1 c 0 1u\n"
    sol = nsspice.tran(nsspice.read(deck), 10e-3, 1.1e-6, all_points=True, signals=["v(a)"])
    assert sol.time.size > 2 * 4096
    assert np.all(np.diff(sol.time) > 0.0)
    tops = (0.25 + 0.5 * np.arange(20)) * 1e-3
    rows = np.searchsorted(sol.time, tops - 1e-15)
    assert sol.time[rows] == pytest.approx(tops, rel=1e-9)
    assert np.abs(sol["v(a)"][rows]) == pytest.approx(1.0, rel=1e-15)


def test_points_of_a_converter_stand_in_order():
    circuit = nsspice.read(Path(__file__).parents[4] / "netlists/converters/buck.net")
    sol = nsspice.tran(circuit, all_points=True)
    assert np.all(np.diff(sol.time) >= 0.0)
