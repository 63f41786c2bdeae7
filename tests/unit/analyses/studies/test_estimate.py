"""Runs to a tolerance and estimates by halving, against closed forms."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import nsspice
from nsspice.analyses import Request, jobs_of
from nsspice.analyses.studies.refinement import run_estimated
from nsspice.cli.app import app

RLC = """damped oscillator
C1 a 0 1u IC=1
L1 a b 1m IC=0
R1 b 0 10
.tran 5u 0.5m uic
"""


def exact(t):
    """Return voltage and current: v'' + (R/L) v' + v/(LC) = 0, i = -C v'."""
    a, w0 = 10 / (2 * 1e-3), 1 / math.sqrt(1e-9)
    w = math.sqrt(w0 * w0 - a * a)
    voltage = np.exp(-a * t) * (np.cos(w * t) + a / w * np.sin(w * t))
    return {"v(a)": voltage, "i(l1)": 1e-6 * w0 * w0 / w * np.exp(-a * t) * np.sin(w * t)}


def estimated(tol=None, **request):
    circuit = nsspice.read(RLC)
    (job,) = jobs_of(circuit.deck)
    solution = run_estimated(circuit, job, Request(**request), tol=tol)
    true = exact(solution.time)
    errors = [np.abs(solution[k] - v).max() / np.ptp(v) for k, v in true.items()]
    return solution, float(max(errors))


@pytest.mark.parametrize(
    ("method", "tol"),
    [(None, 1e-8), ("modewise", 1e-6), ("sdirk", 1e-4), ("sdirk", 1e-8), ("moreau", 1e-3)],
)
def test_a_tolerance_is_met_and_the_estimate_is_honest(method, tol):
    solution, error = estimated(tol, method=method)
    assert error <= tol
    # the estimate is a distance from a coarser run: never far below the error
    assert error <= 2.0 * solution.error.value + 1e-12
    assert solution.error.value <= tol
    assert solution.islands[0].method == (method or "modewise")
    assert "error about" in solution.summary()


def test_halving_finds_order_and_error():
    solution, error = estimated(step=1e-6)
    assert solution.error.order == pytest.approx(1.0, abs=0.1)
    assert solution.error.value == pytest.approx(error, rel=0.15)
    assert solution.islands[0].step == pytest.approx(1e-6)
    trapezoid, small = estimated(step=1e-6, theta=0.5)
    assert trapezoid.error.order == pytest.approx(2.0, abs=0.1)
    assert trapezoid.error.value == pytest.approx(small, rel=0.15)


def test_a_tolerance_out_of_reach_is_told():
    with pytest.raises(nsspice.NumericalError, match="tolerance 1e-16 was not reached") as caught:
        estimated(1e-16, method="sdirk")
    assert caught.value.partial.row_count == 101


def test_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rlc.net").write_text(RLC)
    run = CliRunner().invoke
    result = run(app, ["run", "rlc.net", "--tol", "1e-6", "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)["runs"][0]["error"]
    assert found["reached"]
    assert found["value"] <= 1e-6
    assert len((tmp_path / "rlc.csv").read_text().splitlines()) == 102
    result = run(app, ["run", "rlc.net", "--refine"])
    assert result.exit_code == 0
    assert "observed order" in result.stderr
    result = run(app, ["run", "rlc.net", "--tol", "1e-16", "--method", "sdirk"])
    assert result.exit_code == 3
    assert "NS3006" in result.stderr
    assert (tmp_path / "rlc.csv").exists()
    assert run(app, ["run", "rlc.net", "--tol", "2"]).exit_code == 2
    assert run(app, ["run", "rlc.net", "--tol", "1e-3", "--refine"]).exit_code == 2


@pytest.mark.parametrize(
    "options",
    [
        ["--tol", "1e-3", "--step", "1u"],
        ["--tol", "1e-3", "--method", "sdirk", "--theta", "0.5"],
        ["--tol", "1e-3", "--method", "moreau", "--reltol", "1e-3"],
        ["--refine", "--method", "modewise"],
        ["--refine", "--reltol", "1e-3"],
    ],
)
def test_what_a_tolerance_or_an_estimate_chooses_is_not_dropped(tmp_path, monkeypatch, options):
    """They were dropped in silence."""
    (tmp_path / "rlc.net").write_text(RLC)
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["run", "rlc.net", *options])
    assert result.exit_code == 2
    assert "NS4005" in result.stderr
    assert options[-2] in result.stderr
    assert not (tmp_path / "rlc.csv").exists()


RECOVERY = """reverse recovery: nothing stores but a junction
V1 a 0 PULSE(10 -10 100n 1n 1n 300n 1u)
R1 a b 100
D1 b 0 dmod
.model dmod D(IS=1e-14 TT=50n CJO=2p)
.tran 10n 500n
"""


def test_charges_of_junctions_count():
    """Their circuits passed for ones without storage, whose error is nothing: 4 V of 20 V."""
    circuit = nsspice.read(RECOVERY)
    exact = nsspice.tran(circuit, method="sdirk", reltol=1e-9)["v(b)"]
    (job,) = jobs_of(circuit.deck)
    found = run_estimated(circuit, job, Request(method="moreau"), tol=1e-4)
    error = np.abs(found["v(b)"] - exact).max() / np.ptp(exact)
    assert found.error.reached
    # of first order: twice the step errs by twice as much, so that the distance is the error
    assert error < 2.0 * found.error.value
    rough = run_estimated(circuit, job, Request(method="moreau", step=10e-9))
    assert rough.error.value > 0.1
    assert rough.error.signal == "v(b)"
