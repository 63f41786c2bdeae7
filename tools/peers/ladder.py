"""The runs of the peers as measurements beside our own, errors against the exact engine."""

from __future__ import annotations

import json
import math
import os
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from nsspice.analyses.request.cards import Tran
from nsspice.analyses.request.request import Request
from nsspice.analyses.request.settings import Settings
from nsspice.analyses.transient.transient import run_tran
from nsspice.compare.cost import CostReport, Measurement
from nsspice.compare.cost.problem import Problem
from nsspice.errors import NsspiceError

from .describe import CannotError, complementarity_system, elements

HERE = Path(__file__).parent
SICONOS_PYTHON = "/usr/bin/python3"  # where Debian's python3-siconos is
ROWS = 50_000  # between them the exact waveform is taken as straight
PATIENCE = 300.0  # [s] for all runs of one peer


def measure(report: CostReport, problem: Problem, limit: float) -> None:
    """Append the runs of Pulsim and Siconos to a report, or the reason why there are none.

    Errors are those at the peer's own points: interpolation between them would not be its fault.
    As of our own runs, the least time of two turns counts.
    """
    fine = _exact(problem)
    pythons = {
        "pulsim": os.environ.get("PULSIM_PYTHON"),
        "siconos": os.environ.get("SICONOS_PYTHON", SICONOS_PYTHON),
    }
    found: dict[str, list[Any]] = {}
    for peer, python in pythons.items():
        try:
            if fine is None:
                raise CannotError("smooth laws have no exact solution to measure against")
            found[peer] = _runs(peer, python, problem, limit)
        except CannotError as reason:
            report.absent.append(f"{peer}: {reason}")
    for peer, lines in found.items():
        again = {}
        with suppress(CannotError):  # the first turn counts
            second = _runs(peer, pythons[peer], problem, limit)
            again = {_setting(line): line.get("seconds", math.inf) for line in second}
        for line in lines:
            if "seconds" in line:
                line["seconds"] = min(line["seconds"], again.get(_setting(line), math.inf))
            report.rows.append(_row(report, line, fine, problem.signals))


def _setting(line: dict[str, Any]) -> tuple[str, str, float]:
    return line["method"], line["parameter"], line["value"]


def _exact(problem: Problem) -> Any:
    """Return the exact waveforms on a fine grid with all switchings, or None."""
    given = problem.analysis
    rows = Tran(given.stop, given.stop / ROWS, 0.0, given.max_step, given.uic)
    try:
        request = Request(signals=problem.signals, all_points=True)
        return run_tran(problem.circuit, rows, Settings("modewise"), request)
    except NsspiceError:
        return None


def _runs(peer: str, python: str | None, problem: Problem, limit: float) -> list[Any]:
    job: dict[str, Any] = {
        "signals": problem.signals,
        "stop": problem.analysis.stop,
        "row": problem.analysis.row_distance,
        "limit": limit,
    }
    if peer == "pulsim":
        job["elements"] = elements(problem.circuit)
    else:
        job |= complementarity_system(problem.circuit, problem.signals)
    if not python:
        raise CannotError(f"{peer.upper()}_PYTHON names no Python that has it")
    try:
        done = subprocess.run(
            [python, str(HERE / f"{peer}_runs.py")],
            input=json.dumps(job),
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CannotError(str(error)) from error
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    if not lines:
        raise CannotError((done.stderr.strip().splitlines() or ["no answer"])[-1])
    return lines


def _row(report: CostReport, line: dict[str, Any], fine: Any, signals: list[str]) -> Measurement:
    nan = float("nan")
    setting = _setting(line)
    if "note" in line:
        return Measurement(*setting, 0, nan, nan, nan, nan, line["note"])
    t = np.minimum(np.array(line["t"]), fine.time[-1])  # the last may lie beyond by rounding
    largest = mean = 0.0
    for name, span in zip(signals, report.reference.graph.span, strict=True):
        gap = np.abs(np.array(line["values"][name]) - np.interp(t, fine.time, fine[name])) / span
        gap = np.where(np.isfinite(gap), gap, np.inf)
        largest = max(largest, float(gap.max()))
        weight = float(t[-1] - t[0])
        mean = max(mean, float(np.trapezoid(gap, t)) / weight if weight else nan)
    order = nan
    last = next((r for r in reversed(report.rows) if r.method == line["method"]), None)
    if last is not None and min(largest, last.error) > 0.0 and line["steps"] > last.steps > 0:
        order = math.log(last.error / largest) / math.log(line["steps"] / last.steps)
    return Measurement(*setting, line["steps"], largest, mean, line["seconds"], order)
