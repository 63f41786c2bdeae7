"""Runs of an assembled problem by the compiled engines, one interval between two restarts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ...problems.descriptor import Functional
from ...solvers.audit import Auditor
from ...solvers.implicit import ImplicitStepper
from ...solvers.modewise import ModewiseStepper, NotModewise
from ...solvers.moreau import MoreauStepper
from ...solvers.sdirk import Accuracy, SdirkStepper
from ...solvers.stepper import Jump, UnsolvedStep
from ..equations.assembly import Assembly
from ..terms.errors import unsolved, wrong

Floats = npt.NDArray[np.float64]
Stepper = ImplicitStepper | ModewiseStepper

METHODS = ("auto", "modewise", "sdirk", "moreau")
_BLOCK = 1 << 12
_NEVER = 1 << 62
#: longest implicit step of the mode-wise engine, as a part of the run, where no mode is proved
_SHORT = 1e-3
#: implicit steps that are not worth a word
_FEW = 8
#: states that an impulsive step moves by less than this part were consistent: it ends at 1e-11 of
#: the distance of rows, and leaves a motion of that size
_STILL = 1e-9


@dataclass(frozen=True, slots=True)
class Plan:
    """How to run: ends and rows [s], method, and what it is asked for.

    Parameters
    ----------
    stop : float
        End, counted from the start.
    rows : float
        Distance of output rows.
    method : str
        One of ``METHODS``.
    theta : float
        Weight of the new state.
    step : float or None
        Length of steps, the longest one where errors are controlled.
    reltol : float
        Error of one controlled step.
    """

    stop: float
    rows: float
    method: str = "auto"
    theta: float = 1.0
    step: float | None = None
    reltol: float = 1e-9


@dataclass(slots=True)
class Interval:
    """What an engine left of one run.

    Parameters
    ----------
    rows : ndarray, shape (k, 1 + outputs)
        Time first.
    jumps : list of Jump
    events : tuple
        Times, pairs, and whether they conduct from then on.
    stats : dict
    checks : dict
        What the independent check of the recorded points found.
    method, note : str
    end : (ndarray, ndarray)
        Unknowns and multipliers at the end.
    """

    rows: Floats
    jumps: list[Jump]
    events: tuple[Any, Any, Any]
    stats: dict[str, float]
    checks: dict[str, Any]
    method: str
    note: str = ""
    end: tuple[Floats, Floats] = field(default_factory=lambda: (np.zeros(0), np.zeros(0)))


def choose(assembly: Assembly, plan: Plan) -> tuple[str, str]:
    """Return the engine for a problem, and why it is not an exact one.

    Raises
    ------
    UsageError
        NS6004 for a method that does not exist.
    """
    if plan.method not in METHODS:
        raise wrong(
            "NS6004", f"there is no method {plan.method!r}", f"methods: {', '.join(METHODS)}"
        )
    if plan.method != "auto":
        return plan.method, ""
    if plan.step is not None or plan.theta != 1.0:
        return "moreau", ""
    if assembly.system.smooth is not None:
        return "sdirk", "smooth nonlinear terms have no closed form"
    return "modewise", ""


def create(
    assembly: Assembly, outputs: Sequence[Functional], plan: Plan
) -> tuple[Stepper, str, str]:
    """Return the engine of a run, its name and a note.

    Raises
    ------
    UsageError
        NS6004 if the method that was asked for cannot treat the problem.
    """
    system = assembly.system
    method, note = choose(assembly, plan)
    if method == "modewise":
        try:
            return ModewiseStepper(system, outputs), method, note
        except NotModewise as reason:
            if plan.method == "modewise":
                raise wrong(
                    "NS6004",
                    f"method='modewise' cannot handle the problem: {reason}",
                    "method='auto' chooses a method that can",
                ) from reason
            method, note = "sdirk", f"not modewise: {reason}"
    if method == "sdirk":
        return SdirkStepper(system, outputs, Accuracy(plan.reltol)), method, note
    return MoreauStepper(system, outputs), method, note


def run_interval(
    assembly: Assembly,
    outputs: Sequence[Functional],
    plan: Plan,
    z0: Floats,
    *,
    first_row: float = 0.0,
    contacts: Sequence[int] = (),
    fresh: bool = True,
) -> Interval:
    """Run an engine from given states to the end, or until a contact is hit.

    Parameters
    ----------
    assembly : Assembly
    outputs : sequence of Functional
    plan : Plan
    z0 : ndarray, shape (n,)
        States; the other unknowns follow.
    first_row : float
        Time of the first row [s].
    contacts : sequence of int
        Pairs whose impulses end the run, and their closing.
    fresh : bool
        The states are those of a user, who may have given some that the conditions do not allow.

    Raises
    ------
    NumericalError
        NS6020 if a step has no solution.
    """
    begin = None
    try:
        if fresh:
            begin = _consistent(assembly, plan, z0)
    except UnsolvedStep as problem:
        raise _failure(assembly, problem) from problem
    if begin is not None:
        z0 = begin.after
        if any(begin.multipliers[k] != 0.0 for k in contacts):
            return _only(begin, outputs, plan)
    stepper, method, note = create(assembly, outputs, plan)
    exact = isinstance(stepper, ModewiseStepper)
    auditor = Auditor(assembly.system, timed=True)
    if isinstance(stepper, ModewiseStepper):
        stepper.watch(False)
    else:
        stepper.watch(_NEVER if method == "sdirk" else 1, 1)
    auditor.accompany(stepper)
    step = plan.step or (plan.stop / 50.0 if method == "sdirk" else plan.rows)
    if method == "sdirk" and assembly.system.timed:
        step = min(step, max(plan.rows, plan.stop / 1000.0))
    if exact:
        step = plan.stop * _SHORT
    stepper.plan(0.0, plan.stop, step, first_row, plan.rows)
    blocks: list[Floats] = []
    try:
        stepper.start_charges(0.0, assembly.system.E.dot(z0), step)
        done, size = False, 16 if contacts else _BLOCK
        while not done:
            rows, done = stepper.advance(size)
            blocks.append(rows.copy())
            _check(auditor, stepper)
            if contacts and _closed(stepper, contacts):
                break
    except UnsolvedStep as problem:
        raise _failure(assembly, problem) from problem
    if exact and stepper.statistics["fixed_steps"] > _FEW:
        note = f"implicit first-order steps where {_trouble(stepper)}"
    return Interval(
        np.concatenate(blocks) if blocks else np.zeros((0, 1 + len(outputs))),
        [*([] if begin is None else [begin]), *stepper.jumps],
        stepper.events,
        stepper.statistics,
        auditor.result(),
        method,
        note,
        stepper.state,
    )


def _consistent(assembly: Assembly, plan: Plan, z0: Floats) -> Jump | None:
    """Return the jump from given states to those that the conditions allow, None without any.

    The impulsive step finds it: the limit of an implicit step that has no length.
    """
    system = assembly.system
    if not system.m:
        return None
    first = MoreauStepper(system, ())
    first.plan(0.0, plan.stop, plan.rows, 0.0, plan.rows)
    found = first.start_charges(0.0, system.E.dot(z0), plan.rows)
    if found is None:
        return None
    moved = np.abs(system.E.dot(found.after - z0))
    if np.max(moved, initial=0.0) <= _STILL * np.max(np.abs(system.E.dot(z0)), initial=0.0):
        return None
    return replace(found, before=z0.copy())


def _only(jump: Jump, outputs: Sequence[Functional], plan: Plan) -> Interval:
    """Return an interval that ends with an impact at its very start."""
    none = np.zeros(0)
    return Interval(
        np.zeros((0, 1 + len(outputs))),
        [jump],
        (none, none.astype(np.uintp), none.astype(bool)),
        {},
        {"laws": 0.0, "complementarity": 0.0, "checks": 0, "worst_row": None},
        "modewise" if plan.method == "auto" else plan.method,
        end=(jump.after, jump.multipliers),
    )


def _trouble(stepper: Stepper) -> str:
    why = stepper.trouble if isinstance(stepper, ModewiseStepper) else None
    return f"a mode could not be reduced: {why}" if why else "events accumulated"


def _closed(stepper: Stepper, contacts: Sequence[int]) -> bool:
    """Return whether a contact has been hit, or has closed."""
    _, pairs, on = stepper.events
    return bool(np.isin(pairs[on], contacts).any()) or any(
        jump.multipliers[k] != 0.0 for jump in stepper.jumps for k in contacts
    )


def _check(auditor: Auditor, stepper: Stepper) -> None:
    """Hand recorded points to the check that shares no code with the engines."""
    if isinstance(stepper, ModewiseStepper | SdirkStepper):
        auditor.check_intervals(stepper.take_intervals())
    records = stepper.take_records()
    if len(records):
        auditor.check(records)


def _failure(assembly: Assembly, problem: UnsolvedStep) -> Exception:
    """Return the error of a step without a solution, with the names of what contradicts."""
    time = problem.time + assembly.offset
    named = ""
    certificate = problem.certificate
    if certificate is not None:
        rows = [assembly.rows[k] for k in certificate.rows]
        pairs = [assembly.pairs[k] for k in certificate.pairs]
        named = f": the equations of {', '.join(rows)}" if rows else ""
        if pairs:
            named += f"{' and' if rows else ':'} the conditions of {', '.join(pairs)}"
        named += " contradict each other"
    elif problem.worst_row is not None:
        named = f": the equation of {assembly.rows[problem.worst_row]} is violated"
    return unsolved(
        f"no solution at t = {time:.9g}{named}",
        "check the initial values, and that the conditions are compatible",
        time=time,
        residual=problem.residual,
    )
