"""Rows at the solver's points, and both sides of jumps."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.merge import Merger, align

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
