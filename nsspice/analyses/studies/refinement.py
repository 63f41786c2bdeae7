"""Transients with an estimate of their own error: to a tolerance, or by halving the step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, NumericalError, UsageError
from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import var
from ..request.method import POINTS
from ..request.notebook_progress import Progress
from ..request.request import Request
from ..request.row_sinks import Sink
from ..request.settings import Settings
from ..results.error_estimate import ErrorEstimate
from ..signals.curve import Floats
from ..signals.signal_function import Trace
from ..signals.signal_statistics import extreme, values
from ..solution.solution import Solution
from .batch import Job, run_job

#: attempts before a tolerance is given up
_ATTEMPTS = 8
#: the finest tolerance of controlled steps that rounding leaves a meaning
_FINEST = 1e-13
#: most halvings of a step from its error
_FARTHEST = 6
#: most steps of a fixed-step run that is started by itself
_MOST_STEPS = 5e7


def stored_quantities(circuit: Circuit) -> list[str]:
    """Return the voltages of capacitors and the currents of inductors, each once.

    Examples
    --------
    >>> import nsspice
    >>> stored_quantities(nsspice.read('''tank
    ... I1 0 a 1
    ... C1 a 0 1u
    ... C2 a 0 2u
    ... L1 a 0 1m
    ... '''))
    ['v(a)', 'i(l1)']
    """
    names: dict[str, None] = {}
    for device in circuit.devices:
        if device.letter == "l":
            names[f"i({device.name})"] = None
        elif device.letter == "c":
            names.update(dict.fromkeys(_voltage(*device.ends)))
    return list(names)


def junction_voltages(circuit: Circuit) -> list[str]:
    """Return the voltages of junctions that store charge, each once.

    Examples
    --------
    >>> import nsspice
    >>> junction_voltages(nsspice.read('''inverter
    ... V1 s 0 5
    ... Rc s c 1k
    ... Q1 c b 0 fast
    ... D1 0 b clamp
    ... .model fast NPN(TF=1n)
    ... .model clamp D
    ... '''))
    ['v(b,c)', 'v(b)']
    """
    names: dict[str, None] = {}
    for device in circuit.devices:
        if device.stores_energy and device.letter not in "lc":
            # base or gate to both others
            first, control, second = (*device.nodes, "", "")[:3]
            three = device.letter in "mq" and second
            between = [(control, first), (control, second)] if three else [device.ends]
            for a, b in between:
                names.update(dict.fromkeys(_voltage(a, b)))
    return list(names)


def _voltage(a: str, b: str) -> list[str]:
    """Return the signal of the voltage between two nodes; nothing between a node and itself."""
    if a == b:
        return []
    plus, minus = (b, a) if a == "0" else (a, b)
    return [f"v({plus})" if minus == "0" else f"v({plus},{minus})"]


def run_estimated(
    circuit: Circuit,
    job: Job,
    request: Request,
    *,
    tol: float | None = None,
    progress: Progress | None = None,
    sink: Sink | None = None,
) -> Solution:
    """Run a transient and estimate its error; other analyses run as ever.

    Parameters
    ----------
    circuit, job, request, progress, sink
        As for ``run_job``.
    tol : float, optional
        Error of the stored quantities that is wanted, as a share of the range of each: method
        and step are chosen to meet it.  A method that the request names is kept.
        Without it, the error of fixed steps is estimated from runs with half and a quarter of the
        step.

    Returns
    -------
    Solution
        With ``error`` set.

    Raises
    ------
    NumericalError
        NS3006 if the tolerance was not reached; ``partial`` holds the best solution.
    UsageError
        NS4005 if the request itself says what the tolerance chooses.
    """
    if job.kind != "tran":
        return run_job(circuit, job, request, progress=progress, sink=sink)
    _leave_the_choice(circuit, request, tol)
    stored = [*stored_quantities(circuit), *junction_voltages(circuit)]
    extra = [*request.extra, *stored]
    trials = _Trials(circuit, job, replace(request, keep=True, extra=extra), stored, progress)
    try:
        solution = trials.estimated(tol)
    except _Interrupted as stopped:
        solution = stopped.solution
    if sink is not None:
        names, rows = solution.table()
        sink.open(names)
        sink.write(np.ascontiguousarray(rows))
        sink.close()
    if solution.error is not None and not solution.error.reached and not solution.interrupted:
        failure = NumericalError(
            Diagnostic(
                "NS3006",
                f"the tolerance {tol:g} was not reached: {solution.error.describe()}",
                hint="the best rows are kept; allow a larger error, or try nsspice cost",
            )
        )
        failure.partial = solution
        raise failure
    return solution


def _leave_the_choice(circuit: Circuit, request: Request, tol: float | None) -> None:
    """Refuse what would be dropped.

    A tolerance chooses reltol, and the step unless steps are to be fixed: these are refined from
    the one that is given; an estimate by halving is one of fixed steps.
    """
    settings = Settings.of(circuit.deck, request.method, step=request.step)
    fixed = settings.method == "moreau"
    given: dict[str, object] = {"reltol": request.reltol}
    option, reason = "--tol", "the tolerance determines it"
    if tol is None:
        option, reason = "--refine", "only fixed steps can be halved"
        given["method"] = None if request.method in (None, "auto", "moreau") else request.method
    elif not fixed:
        given |= {"step": settings.step, "theta": request.theta}
    for name, value in given.items():
        if value is not None:
            refined = ", or use --method moreau, which halves it" if name == "step" else ""
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    f"{option} and --{name} {value} cannot be used together: {reason}",
                    hint=f"remove --{name}{refined}",
                )
            )


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


class _Interrupted(Exception):
    """Ctrl-C during a trial; its rows are what is left."""

    def __init__(self, solution: Solution) -> None:
        super().__init__()
        self.solution = solution


@dataclass(slots=True)
class _Trials:
    """Runs of one transient with changing settings."""

    circuit: Circuit
    job: Job
    request: Request
    stored: list[str]
    progress: Progress | None

    def run(self, **changes: Any) -> Solution:
        solution = run_job(
            self.circuit, self.job, replace(self.request, **changes), progress=self.progress
        )
        if solution.interrupted:
            raise _Interrupted(solution)
        return solution

    def estimated(self, tol: float | None) -> Solution:
        """Run to a tolerance, or with an estimate by halving if there is none."""
        if not self.stored:
            return self.static(tol)
        return self.by_halving() if tol is None else self.to_tolerance(tol)

    def _method(self) -> str:
        return Settings.of(self.circuit.deck, self.request.method).method

    def static(self, tol: float | None) -> Solution:
        """Run a circuit without storage; two ways to the same points show how far they are off."""
        solution = self.run(reltol=None if tol is None else max(0.1 * tol, _FINEST))
        names = [name for name in solution.columns if name[:2] in ("v(", "i(")]
        motion, axis = solution.motion(names), solution.axis
        traces = {name: Trace(motion, Expression(var(name))) for name in names}
        if any(island.method == POINTS for island in solution.islands):
            how = "rows solved one by one, difference from steps that follow the solution"
            others = [
                {n: values(t, axis, left=left) for n, t in traces.items()} for left in (False, True)
            ]
        else:
            how = "the exact engine, difference from rows solved one by one"
            others = [self.run(method="moreau", reltol=None).signals]
        worst, signal = 0.0, ""
        for name, trace in traces.items():
            # the rows may all be at zeros of a sine
            top, low = (
                extreme(trace, axis[0], axis[-1], least=least)[0] for least in (False, True)
            )
            span = top - low or abs(top) or 1.0
            apart = min(float(np.abs(solution[name] - other[name]).max()) for other in others)
            if apart / span > worst or math.isnan(apart):
                worst, signal = apart / span, name
        solution.error = ErrorEstimate(worst, signal, how, tolerance=_or_nan(tol))
        return solution

    def to_tolerance(self, tol: float) -> Solution:
        method = self._method()
        if method in ("auto", "modewise"):
            try:
                exact = self.run(method="modewise", step=None)
            except (UsageError, NumericalError):
                if method == "modewise":
                    raise
            else:
                return self._checked(exact, tol)
        if method == "moreau":
            return self._fixed(tol)
        return self._controlled(tol)

    def _checked(self, exact: Solution, tol: float) -> Solution:
        """Take the exact engine, with an independent method as a bound of its error."""
        reltol = max(0.1 * tol, _FINEST)
        other = self.run(method="sdirk", reltol=reltol, step=None)
        value, signal = self._apart(exact, other, self.stored)
        how = f"the exact engine, bounded by its difference from sdirk with reltol {reltol:g}"
        exact.error = ErrorEstimate(value, signal, how, tolerance=tol)
        return exact if value <= tol else self._controlled(tol, exact)

    def _controlled(self, tol: float, exact: Solution | None = None) -> Solution:
        """Take controlled steps: their tolerance is cut by ten until two of them agree."""
        reltol = max(min(0.1 * tol, 1e-3), 10.0 * _FINEST)
        best = self.run(method="sdirk", reltol=reltol, step=None)
        for _ in range(_ATTEMPTS):
            if reltol < 5.0 * _FINEST:
                break
            reltol *= 0.1
            finer = self.run(method="sdirk", reltol=reltol, step=None)
            value, signal = self._apart(finer, best if exact is None else exact, self.stored)
            how = f"sdirk with reltol {reltol:g}, difference from a tenfold reltol"
            if exact is not None:
                how = (
                    f"the exact engine, bounded by its difference from sdirk with reltol {reltol:g}"
                )
            best = finer
            (exact or best).error = ErrorEstimate(value, signal, how, tolerance=tol)
            if value <= tol:
                break
        return exact or best

    def _fixed(self, tol: float) -> Solution:
        """Take fixed steps: halved, then chosen by the observed order."""
        step = self._first_step()
        best, last = self.run(step=step), float("nan")
        for _ in range(_ATTEMPTS):
            half = self.run(step=0.5 * step)
            value, signal = self._apart(half, best, self.stored)
            order = math.log2(last / value) if value > 0.0 and last > 0.0 else float("nan")
            how = f"fixed steps of {0.5 * step:.3g} s, difference from twice the step"
            half.error = ErrorEstimate(value, signal, how, order, tol)
            best, last, step = half, value, 0.5 * step
            # first order, with a margin: straight to the step that should do, as far as errors of
            # steps that are too long for what happens show it
            jump = min(math.floor(math.log2(max(1.0, value / tol))), _FARTHEST)
            finer = step * 0.5**jump
            if value <= tol or self._stop() / finer > _MOST_STEPS:
                break
            if jump > 1:
                step, last = finer, float("nan")
                best = self.run(step=step)
        return half

    def by_halving(self) -> Solution:
        """Run with fixed steps, take the error from those with half and a quarter of the step."""
        step = self._first_step()
        runs = [self.run(method="moreau", step=step * 0.5**k) for k in range(3)]
        first, signal = self._apart(runs[0], runs[1], self.stored)
        second, _ = self._apart(runs[1], runs[2], self.stored)
        order = math.log2(first / second) if first > 0.0 and second > 0.0 else float("nan")
        # without a clear order the distance itself is all that is known
        regular = 0.4 <= order <= 4.5
        value = first / (1.0 - 0.5**order) if regular else max(first, second)
        how = f"by halving the step of {step:.3g} s twice, observed order {order:.2f}"
        runs[0].error = ErrorEstimate(value, signal, how, order)
        return runs[0]

    def _first_step(self) -> float:
        from ..request.cards import Tran

        card: Any = self.job.card
        settings = Settings.of(self.circuit.deck, step=self.request.step)
        return Tran.from_card(card).bounded(settings.max_step).solver_step(settings.step)

    def _stop(self) -> float:
        card: Any = self.job.card
        return self.request.stop or float(card.tstop)

    def _apart(self, a: Solution, b: Solution, names: list[str]) -> tuple[float, str]:
        """Return the largest distance of two runs as a share of the range, and its signal."""
        worst, where = 0.0, names[0] if names else ""
        for name in names:
            x, y = a[name], b[name]
            distance = _share(x, y)
            if distance > worst or math.isnan(distance):
                worst, where = distance, name
        return worst, where


def _share(x: Floats, y: Floats) -> float:
    size = min(x.size, y.size)
    span = float(np.ptp(x)) or float(np.max(np.abs(x), initial=0.0)) or 1.0
    return float(np.max(np.abs(x[:size] - y[:size]), initial=0.0)) / span
