"""Runs of differential variational inequalities, as solutions with names, events and impulses."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..analyses.certificate import Certificate
from ..analyses.events import Events
from ..analyses.solution import Impulse, IslandRun, Solution
from ..errors import Diagnostic
from .assembly import Assembly, Model, assemble, start_vector
from .engines import Plan, Stretch, run_stretch
from .errors import wrong
from .impacts import Impacts
from .scheme import Scheme, march

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Task:
    """A model with its start, as runs take it.

    Parameters
    ----------
    model : Model
    start : dict of str to float
        States at the beginning.
    signals : list of str
        Variables to return, in order.
    kind, reason : str
        Class of the problem, and why.
    title : str
    begin : float
        Instant of the start [s].
    """

    model: Model
    start: Mapping[str, float]
    signals: Sequence[str]
    kind: str
    reason: str
    title: str = ""
    begin: float = 0.0


def simulate(task: Task, plan: Plan, impacts: Impacts) -> Solution:
    """Run a problem by a compiled engine, with impacts where contacts have restitution.

    Raises
    ------
    NumericalError
        NS6020 if a step has no solution.
    """
    begun = clock.perf_counter()
    assembly = assemble(task.model, task.begin)
    outputs = [assembly.places[name] for name in task.signals]
    z0 = start_vector(assembly, task.start)
    parts: list[Stretch] = []
    tables: list[Floats] = []
    warnings: list[Diagnostic] = []
    impulses: list[Impulse] = []
    events: list[Events] = []
    here = 0.0  # since the start
    bouncing = impacts.pairs(assembly)
    while True:
        grid = np.ceil(here / plan.rows * (1.0 - 1e-15)) if here else 0.0
        first = max(0.0, grid * plan.rows - here)
        rest = Plan(plan.stop - here, plan.rows, plan.method, plan.theta, plan.step, plan.reltol)
        part = run_stretch(
            assembly, outputs, rest, z0, first_row=first, until=tuple(bouncing), fresh=not parts
        )
        parts.append(part)
        impact = impacts.first(part, bouncing)
        end = np.inf if impact is None else impact.time
        table = part.rows[part.rows[:, 0] < end].copy()
        table[:, 0] += task.begin + here
        tables.append(table)
        times, pairs, on = part.events
        kept = times < end
        events.append(
            Events(times[kept] + task.begin + here, pairs[kept], on[kept], assembly.pairs)
        )
        for jump in part.jumps:
            if jump.time < end or jump is impact:
                factor = 1.0 if jump is not impact else impacts.weight(jump, bouncing, assembly)
                impulses += [
                    Impulse(task.begin + here + jump.time, name, factor * float(value), "")
                    for name, value in zip(assembly.pairs, jump.multipliers, strict=True)
                    if value != 0.0
                ]
        if impact is None:
            break
        z0 = impacts.after(impact, bouncing, assembly)
        here += impact.time
        if impacts.accumulated(impact.time, plan.stop, bouncing):
            warnings.append(impacts.told(task.begin + here, impact.time))
            z0, bouncing = impact.after, {}
        if here >= plan.stop:
            break
        assembly = assemble(task.model, task.begin + here)
        outputs = [assembly.places[name] for name in task.signals]
    table = np.concatenate(tables)
    last = parts[-1]
    return Solution(
        "tran",
        task.title,
        "time",
        table[:, 0],
        {name: table[:, 1 + k] for k, name in enumerate(task.signals)},
        list(task.signals),
        events=Events.merged(events),
        impulses=impulses,
        islands=[
            IslandRun(
                1,
                task.kind,
                task.reason,
                last.method,
                assembly.system.n,
                assembly.system.m,
                plan.theta if last.method == "moreau" else None,
                plan.step,
                dict(last.stats),
                last.note,
                plan.reltol if last.method == "sdirk" else None,
            )
        ],
        certificate=_certificate(assembly, parts),
        warnings=warnings,
        wall_time=clock.perf_counter() - begun,
    )


def _certificate(assembly: Assembly, parts: Sequence[Stretch]) -> Certificate:
    found = []
    for part in parts:
        checks = part.checks
        row = checks["worst_row"]
        worst = "" if row is None else assembly.rows[row]
        found.append(
            Certificate(
                checks["laws"],
                checks["complementarity"],
                checks["checks"],
                int(part.stats.get("undetermined", 0)),
                worst=worst,
            )
        )
    return Certificate.total(found)


def step_through(task: Task, scheme: Scheme, stop: float, step: float) -> Solution:
    """Run a problem by one of the schemes of the thesis, with a row at each step.

    Raises
    ------
    NumericalError
        NS6020 if a step has no solution.
    """
    begun = clock.perf_counter()
    start = {name: float(value) for name, value in task.start.items()}
    found = march(task.model, scheme, start, task.begin, task.begin + stop, step)
    count = found.times.size - 1
    warnings = []
    if scheme.variant == 2:
        warnings.append(
            Diagnostic(
                "NS6030",
                "variant 2 takes the variational inequality at the old state: without a regular "
                "D its multipliers chatter and do not converge",
                hint="variant=1 holds it at the new state",
                severity="warning",
            )
        )
    stats = {
        "steps": count,
        "solved": found.solved,
        "residual": found.residual,
    }
    return Solution(
        "tran",
        task.title,
        "time",
        found.times,
        {name: found.values[name] for name in task.signals},
        list(task.signals),
        islands=[
            IslandRun(
                1,
                task.kind,
                task.reason,
                "scheme",
                len(task.model.rows),
                len(task.model.pairs),
                scheme.theta,
                stop / count,
                stats,
                f"variant {scheme.variant} of (3.5)"
                if scheme.coefficients == "average"
                else "(3.8)",
            )
        ],
        certificate=Certificate(found.residual, found.residual, count),
        warnings=warnings,
        wall_time=clock.perf_counter() - begun,
    )


def check_run(stop: float, rows: int, step: float | None) -> None:
    """Refuse a run that goes nowhere.

    Raises
    ------
    UsageError
        NS6004.
    """
    if not (np.isfinite(stop) and stop > 0.0):
        raise wrong("NS6004", f"a run cannot last {stop} s", "give a positive length of time")
    if not (isinstance(rows, int) and rows >= 1):
        raise wrong("NS6004", f"{rows!r} rows are no number of rows", "give a whole number")
    if step is not None and not (np.isfinite(step) and step > 0.0):
        raise wrong("NS6004", f"a step cannot be {step}", "give a positive step")
