"""Runs of differential variational inequalities, as solutions with names, events and impulses."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from ...analyses.certificate.certificate import Certificate
from ...analyses.results.jumps import Impulse
from ...analyses.signals.events import Events
from ...analyses.solution.solution import IslandRun, Solution
from ...errors import Diagnostic
from ..equations.assembly import Assembly, Model, assemble, start_vector
from ..terms.errors import wrong
from .engines import Interval, Plan, run_interval
from .impacts import Impacts, states_of
from .resting import first_turn
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
    guess : dict of str to float
        Starts of unknowns without rates, which pick one of several solutions.
    """

    model: Model
    start: Mapping[str, float]
    signals: Sequence[str]
    kind: str
    reason: str
    title: str = ""
    begin: float = 0.0
    guess: Mapping[str, float] = field(default_factory=dict)


def simulate(task: Task, plan: Plan, impacts: Impacts) -> Solution:
    """Run a problem by a compiled engine, with impacts where contacts have restitution.

    Raises
    ------
    NumericalError
        NS6020 if a step has no solution.
    """
    begun = clock.perf_counter()
    contacts = impacts.contacts
    contacts.settle({**task.start, "time": task.begin})
    parts: list[Interval] = []
    tables: list[Floats] = []
    warnings: list[Diagnostic] = []
    impulses: list[Impulse] = []
    events: list[Events] = []
    here = 0.0  # since the start
    known: Mapping[str, float] = task.start
    while True:
        assembly = assemble(contacts.held(), task.begin + here)
        outputs = [assembly.places[name] for name in task.signals]
        grid = np.ceil(here / plan.rows * (1.0 - 1e-15)) if here else 0.0
        rest = replace(plan, stop=plan.stop - here)
        pairs = {assembly.pairs.index(name): name for name in contacts.accelerations}
        z0 = start_vector(assembly, known)
        part = run_interval(
            assembly,
            outputs,
            rest,
            z0,
            first_row=max(0.0, grid * plan.rows - here),
            contacts=tuple(pairs),
            fresh=not parts,
        )
        parts.append(part)
        turn = first_turn(part, pairs, contacts.closed)
        if turn is not None and turn.time >= rest.stop:
            turn = None
        end = np.inf if turn is None else turn.time
        table = part.rows[part.rows[:, 0] < end].copy()
        table[:, 0] += task.begin + here
        tables.append(table)
        times, turned, on = part.events
        kept = times <= end
        events.append(
            Events(times[kept] + task.begin + here, turned[kept], on[kept], assembly.pairs)
        )
        happened = [(jump.time, jump.multipliers) for jump in part.jumps if jump.time < end]
        if turn is not None:
            before = turn.jump.before if turn.jump else _state_at(turn.time, assembly, rest, z0)
            after, impulse, told = impacts.pass_through(turn, before, here, assembly)
            warnings += told
            happened.append((turn.time, impulse))
            known = states_of(assembly, after, turn.time)
        impulses += [
            Impulse(task.begin + here + time, name, float(value), "")
            for time, multipliers in happened
            for name, value in zip(assembly.pairs, multipliers, strict=True)
            if value != 0.0
        ]
        if turn is None:
            break
        here += turn.time
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


def _state_at(time: float, assembly: Assembly, plan: Plan, z0: Floats) -> Floats:
    """Return the unknowns at an instant of an interval, shape (n,)."""
    if time == 0.0:
        return z0
    short = replace(plan, stop=time, rows=time)
    return run_interval(assembly, [], short, z0, fresh=False).end[0]


def _certificate(assembly: Assembly, parts: Sequence[Interval]) -> Certificate:
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
    found = march(task.model, scheme, start, task.begin, task.begin + stop, step, near=task.guess)
    count = found.times.size - 1
    warnings = []
    if scheme.variant == 2:
        warnings.append(
            Diagnostic(
                "NS6030",
                "variant 2 uses the variational inequality at the old state: without a regular "
                "D its multipliers chatter and do not converge",
                hint="use variant=1: it holds at the new state",
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
        raise wrong("NS6004", f"{rows!r} is not a number of rows", "give a whole number")
    if step is not None and not (np.isfinite(step) and step > 0.0):
        raise wrong("NS6004", f"a step cannot be {step}", "give a positive step")
