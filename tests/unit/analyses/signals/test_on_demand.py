"""Signals that were not recorded, and expressions of signals, by their names."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import nsspice

RECTIFIER = """half-wave rectifier
.param r=100
V1 in 0 SIN(0 10 50)
D1 in out
C1 out 0 47u
R1 out 0 {r}
"""


@pytest.fixture(scope="module")
def solution() -> nsspice.Solution:
    return nsspice.run(RECTIFIER + ".tran 0.1m 40m\n")[0]


def test_signals_that_were_not_recorded_are_those_of_a_run_that_records_them(solution) -> None:
    names = ["i(r1)", "p(d1)", "p(c1)", "i(c1)"]
    recorded = nsspice.run(RECTIFIER + ".tran 0.1m 40m\n", signals=names)[0]
    for name in names:
        assert np.array_equal(solution[name], recorded[name]), name
    assert "i(r1)" not in solution.columns
    assert "i(r1)" in solution


def test_expressions_are_those_of_netlists(solution) -> None:
    assert np.array_equal(solution["v(in)-v(out)"], solution["v(in)"] - solution["v(out)"])
    loss = solution["V(out)**2 / 100"]
    assert np.allclose(loss, solution["p(r1)"], rtol=1e-12)
    assert np.array_equal(solution["if(time > 20m, v(out), 0)"][:200], np.zeros(200))
    assert solution["2*i(r1)"][-1] == 2.0 * solution["i(r1)"][-1]


@pytest.mark.parametrize("name", ["v(nix)", "v(nix)-v(out)", "v(out)-", "1+1", "out", "", "i(nix)"])
def test_what_does_not_exist_is_a_key_error(solution, name) -> None:
    with pytest.raises(KeyError, match="no signal"):
        solution[name]


def test_no_program_is_run(solution) -> None:
    with pytest.raises(KeyError):
        solution["__import__('os').system('true') + v(out)"]


def test_contained_is_what_needs_no_run() -> None:
    fresh = nsspice.run(RECTIFIER + ".tran 0.1m 1m\n")[0]
    assert "p(r1)" not in fresh
    assert fresh["p(r1)"].size == fresh.axis.size
    assert "p(r1)" in fresh


def test_sweeps_operating_points_and_steps_know_all_their_currents() -> None:
    deck = RECTIFIER + ".dc V1 -1 1 1\n.op\n.tran 1m 5m\n.step param r list 50 200\n"
    sweeps = nsspice.run(deck)
    assert [s["i(r1)"].tolist() for s in sweeps[:2]] == [[0.0, 0.0, 0.02], [0.0, 0.0, 0.005]]
    assert sweeps[2]["p(r1)"].tolist() == [0.0]
    for run, r in zip(sweeps[4:], (50.0, 200.0), strict=True):
        assert np.allclose(run["i(r1)"], run["v(out)"] / r, rtol=1e-12)


def test_the_periodic_steady_state_too() -> None:
    deck = "rectifier\nV1 in 0 SIN(0 10 50)\nD1 in out\nC1 out 0 47u\nR1 out 0 100\n.pss\n"
    orbit = nsspice.run(deck)[0]
    assert np.allclose(orbit["i(r1)"], orbit["v(out)"] / 100.0, rtol=1e-12)


def test_a_copy_from_another_process_still_knows_how(solution) -> None:
    fresh = nsspice.run(RECTIFIER + ".tran 1m 5m\n")[0]
    copy = pickle.loads(pickle.dumps(fresh))
    assert np.array_equal(copy["p(r1)"], fresh["p(r1)"])


def test_pictures_of_expressions(solution) -> None:
    figure = solution.plot(columns=["v(in)-v(out)", "i(r1)"])
    assert {line.get_label() for axes in figure.axes for line in axes.lines} >= {
        "v(in)-v(out)",
        "i(r1)",
    }


def test_run_reads_a_deck(tmp_path) -> None:
    path = tmp_path / "a.net"
    path.write_text(RECTIFIER + ".op\n")
    assert nsspice.run(path)[0].title == "half-wave rectifier"
    assert nsspice.run(str(path), params={"r": 5.0})[0]["i(r1)"].tolist() == [0.0]
    with pytest.raises(TypeError, match="params="):
        nsspice.run(nsspice.read(path), params={"r": 5.0})
