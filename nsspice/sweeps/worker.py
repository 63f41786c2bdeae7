"""Runs of some points of a sweep, one after the other, in this process."""

from __future__ import annotations

import tempfile
import threading
import time
from collections import OrderedDict
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..analyses.request.request import Neighbour, Request
from ..analyses.request.targets import check, with_model_values
from ..analyses.results.loss_table import LossTable
from ..analyses.solution.refusal import failure_of
from ..analyses.solution.solution import Solution
from ..analyses.studies.batch import jobs_of, run_job
from ..circuit import Circuit, build
from ..errors import NsspiceError
from ..netlist.deck import Sweep
from ..netlist.parsing import Outline
from ..netlist.text.source import read_text
from .plan import Plan
from .points import Floats

#: decks that a worker keeps ready
_READY = 4


class Outcome(NamedTuple):
    """What one point gives.

    Parameters
    ----------
    values : dict of str to float
        Measures by name, empty if the point failed.
    code, message : str
        Of the error, empty if there is none.
    seconds : float
        Processor time [s].
    """

    values: dict[str, float]
    code: str
    message: str
    seconds: float


class UnknownPlan(Exception):
    """A process is asked for points of a plan that it has not seen yet."""


@dataclass(slots=True)
class _Ready:
    """A plan whose files are in place."""

    plan: Plan
    folder: Path
    known: tuple[tuple[float, ...], Circuit] | None = None
    outline: Outline | None = None
    _temporary: tempfile.TemporaryDirectory[str] | None = field(default=None, repr=False)

    @classmethod
    def of(cls, plan: Plan) -> _Ready:
        root = Path(plan.root)
        if all(_holds(root / name, text) for name, text in plan.files):
            return cls(plan, root / plan.folder)
        # another machine, or the files have changed since: what was read at the start counts
        temporary = tempfile.TemporaryDirectory(prefix="nsspice-")
        root = Path(temporary.name)
        for name, text in plan.files:
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        (root / plan.folder).mkdir(parents=True, exist_ok=True)
        return cls(plan, root / plan.folder, None, None, temporary)

    def circuit(self, row: Floats) -> Circuit:
        """Return the circuit with the parameters of a point; values of elements come later."""
        plan = self.plan
        chosen = [(t, float(v)) for t, v in zip(plan.targets, row, strict=True)]
        read = tuple(v for t, v in chosen if t.kind in ("param", "model"))
        if self.known is not None and self.known[0] == read:
            return self.known[1]
        outline, self.outline = self.outline or plan.outline(self.folder), None
        deck = plan.deck(outline, {t.name: v for t, v in chosen if t.kind == "param"})
        if not outline.scripts:  # programs keep what they have computed
            self.outline = outline
        models = {(t.model, t.key): v for t, v in chosen if t.kind == "model"}
        circuit = build(with_model_values(deck, models) if models else deck)
        self.known = read, circuit
        return circuit


_ready: OrderedDict[tuple[str, int], _Ready] = OrderedDict()
_plans: OrderedDict[str, Plan] = OrderedDict()
_lock = threading.Lock()


def learn(plan: Plan) -> str:
    """Keep a plan for chunks that name its key, which is returned."""
    key = plan.key
    with _lock:
        _plans[key] = plan
        while len(_plans) > _READY:
            _plans.popitem(last=False)
    return key


def run_chunk(key: str, rows: Floats, plan: Plan | None = None) -> list[Outcome]:
    """Run some points in order.

    Parameters
    ----------
    key : str
        Of the plan.
    rows : ndarray, shape (k, n)
        Values of the plan's targets.
    plan : Plan, optional
        Sent where the process may not know it.

    Raises
    ------
    UnknownPlan
        If the process does not know the plan: send it.
    """
    if plan is not None and key not in _plans:
        learn(plan)
    ready = _ready_for(key)
    # steady states are continued from the point before, within the chunk alone: results do not
    # depend on who has run which chunk
    neighbour = Neighbour()
    return [_point(ready, row, neighbour) for row in rows]


def _ready_for(key: str) -> _Ready:
    """Return a plan with its files in place; one for each thread, since circuits are shared."""
    home = key, threading.get_ident()
    with _lock:
        found = _ready.get(home)
        plan = _plans.get(key)
    if found is None:
        if plan is None:
            raise UnknownPlan(key)
        found = _Ready.of(plan)
        with _lock:
            _ready[home] = found
            while len(_ready) > 4 * _READY:
                _ready.popitem(last=False)
    return found


def _point(ready: _Ready, row: Floats, neighbour: Neighbour) -> Outcome:
    """Run one point; an error of the circuit is an outcome, too."""
    begin = time.process_time()
    try:
        values = _measured(ready, row, neighbour)
    except NsspiceError as error:
        first = error.diagnostics[0]
        return Outcome({}, first.code, first.message, time.process_time() - begin)
    return Outcome(values, "", "", time.process_time() - begin)


def _measured(ready: _Ready, row: Floats, neighbour: Neighbour) -> dict[str, float]:
    """Return all measures of a point.

    Raises
    ------
    NsspiceError
        If an analysis has no solution, or a certificate fails.
    """
    plan, circuit = ready.plan, ready.circuit(row)
    check(circuit, plan.targets, row.tolist())
    jobs = jobs_of(circuit.deck)
    place = jobs[0].card.span
    steps = tuple(
        (Sweep(t.name, "temp" if t.kind == "temp" else "element", (v,), place), v)
        for t, v in zip(plan.targets, row.tolist(), strict=True)
        if t.kind in ("temp", "element")
    )
    o = plan.options
    request = Request(
        o.method,
        o.theta,
        o.step,
        reltol=o.reltol,
        accuracy=o.accuracy,
        keep=False,
        record=True,
        rows=False,
        power=o.power,
        loads=o.loads,
        neighbour=neighbour,
        controllers=o.controllers,
    )
    found: dict[str, float] = {}
    for job in jobs:
        solution = run_job(circuit, replace(job, steps=steps), request)
        failure = failure_of(solution)
        if failure is not None:
            raise failure
        found |= values_of(solution)
    return found


def values_of(solution: Solution) -> dict[str, float]:
    """Return the numbers of a solution: measures, margins of a loop gain, powers."""
    found = dict(solution.measures)
    if solution.loop is not None:
        found |= solution.loop.margins()
    if solution.powers is not None:
        found |= _powers(solution.powers)
    return found


def _powers(powers: LossTable) -> dict[str, float]:
    found = {f"p({row.element})": row.power for row in powers.rows}
    found |= {f"psw({row.element})": row.switching for row in powers.rows if row.switching}
    found |= {f"tj({r.element})": r.junction for r in powers.rows if not np.isnan(r.junction)}
    if powers.loads:
        efficiency = powers.efficiency
        found["efficiency"] = np.nan if efficiency is None else efficiency
        found["losses"] = powers.lost + powers.switching
    return found


def _holds(path: Path, text: str) -> bool:
    """Return whether a file has this text."""
    try:
        return read_text(path) == text
    except (OSError, ValueError):
        return False
