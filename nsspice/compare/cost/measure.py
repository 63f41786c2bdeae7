"""Running the ladders."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from ...analyses.request.arguments import several
from ...analyses.request.load import need_circuit
from ...analyses.request.settings import Settings
from ...circuit import Circuit
from ...errors import Diagnostic, NsspiceError, UsageError, suggest
from ...output.si import number
from . import ngspice_ladders
from .problem import Problem
from .reference import Reference, make_reference
from .report import CostReport, Measurement
from .timer import Timer

#: Called with a sentence before each run.
Notice = Callable[[str], None]

_TOLERANCES = tuple(10.0**-k for k in range(2, 13))
_DIVISIONS = tuple(4**k for k in range(16))

#: ladders by name, settings that vary along them: our own, and all
OWN = ("modewise", "sdirk", "sdirk2", "moreau", "moreau-half")
LADDERS = (*OWN, *ngspice_ladders.LADDERS)


def cost(
    circuit: Circuit,
    *,
    target: float | None = None,
    methods: Sequence[str] | None = None,
    signals: Sequence[str] | None = None,
    limit: float = 2.0,
    reference: Reference | None = None,
    notice: Notice | None = None,
    result: Notice | None = None,
) -> CostReport:
    """Measure what each digit of accuracy costs in a transient, with every method.

    Parameters
    ----------
    circuit : Circuit
        Its first ``.tran`` card is run.
    target : float, optional
        The runs go down to this error at least, if ``limit`` allows.
    methods : sequence of str, optional
        Of ``LADDERS``; all that apply by default.  ``sdirk2`` is the method of order two,
        ``moreau-half`` the one with theta = 0.5.  The longest step of ngspice varies: ``ngspice``
        is Gear's method, ``ngspice-trap`` the trapezoidal rule, ``ngspice-tight`` the same with
        reltol = 1e-6, ``ngspice-junction`` has diodes of N = 0.01.
    signals : sequence of str, optional
        Signals whose errors are measured; capacitor voltages and inductor currents by default.
    limit : float
        Longest time of one run [s]: a series ends before a run that would take longer, and a run
        that does take longer is stopped, with a note.  A run of the reference may take three times
        as long, and 6 s at least; the first one, where the exact engine does not apply, takes as
        long as it needs.
    reference : Reference, optional
        A reference other than the deck's own.
    notice, result : callable, optional
        Called with a sentence before each run, and after it with its result.

    Returns
    -------
    CostReport
        If Ctrl-C stopped it, with the measurements so far and ``interrupted`` set.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''RC
    ... V1 a 0 SIN(0 1 1k)
    ... R1 a b 1k
    ... C1 b 0 1u IC=0
    ... .tran 20u 2m uic
    ... ''')
    >>> report = nsspice.cost(circuit, methods=["sdirk", "moreau"], limit=0.02)
    >>> report.ladders()["moreau"][0].error < 0.1
    True
    """
    need_circuit(circuit)
    if target is not None and not target > 0.0:
        hint = "give a fraction of the signals' range, such as 1e-6"
        raise UsageError(Diagnostic("NS4005", f"the target cannot be {target:g}", hint=hint))
    methods = several(methods, "the methods", '["sdirk"]')
    for name in methods:
        if name not in LADDERS:
            raise _unknown(name)
    say, tell = notice or _silent, result or _silent
    problem = Problem.of(circuit, signals)
    report = CostReport(circuit.deck.title, problem.signals, reference or Reference.none())
    timer = Timer()
    try:
        say("the deck as it is")
        report.default = _default(problem, limit, timer)
        tell(report.default)
        if reference is None:
            say("reference")
            report.reference = make_reference(problem, limit)
            tell(f"{report.reference.how}: {report.reference.error:.1e}")
        _ladders(report, problem, methods or LADDERS, target, limit, timer, (say, tell))
    except KeyboardInterrupt:
        report.interrupted = True
    return report


def _silent(text: str) -> None:
    """Say nothing."""


def _default(problem: Problem, limit: float, timer: Timer) -> str:
    """Return what a run of the deck as it is costs, in words."""
    settings = Settings.of(problem.circuit.deck)
    try:
        solution, spent = problem.run(settings, limit)
    except NsspiceError as failure:
        return failure.diagnostics[0].message
    methods = ", ".join(dict.fromkeys(island.method for island in solution.islands))
    spent = timer.least("", math.nan, spent, partial(_seconds, problem, settings))
    return f"{methods}, {number(spent, 's', 3)}"


def _ladders(
    report: CostReport,
    problem: Problem,
    names: Sequence[str],
    target: float | None,
    limit: float,
    timer: Timer,
    words: tuple[Notice, Notice],
) -> None:
    """Measure one ladder after the other, down to an error."""
    reference, (say, tell) = report.reference, words
    floor = max(reference.error, 1e-13) if math.isfinite(reference.error) else 1e-12
    goal = floor if target is None else max(floor, min(target, 1e-9))
    for name in names:
        before = len(report.rows)
        try:
            if name in ngspice_ladders.LADDERS:
                report.rows += ngspice_ladders.measure(problem, name, reference, limit, timer, say)
                for row in report.rows[before:]:
                    tell(row.sentence)
            else:
                _ladder(report, problem, name, goal, limit, timer, words)
        except NsspiceError as error:
            report.absent.append(f"{name}: {error.diagnostics[0].message}")
    if problem.analysis.max_step is None:  # which rules the runs of the reference, not the ladder
        _show(report, reference)
    say("repeating short runs")
    report.rows = timer.second_turn(report.rows)


def _unknown(name: str) -> UsageError:
    from ...errors import Diagnostic

    hint = suggest(name, LADDERS) or f"methods: {', '.join(LADDERS)}"
    return UsageError(Diagnostic("NS4004", f"there is no method {name!r}", None, hint))


def _settings(problem: Problem, name: str) -> Iterator[tuple[str, float, Settings]]:
    """Yield the varied parameter, its value, and the settings of one ladder from coarse to fine."""
    if name == "modewise":
        yield "", float("nan"), Settings("modewise")
    elif name.startswith("sdirk"):
        # tmax of the deck would set the price of all loose tolerances
        free = replace(problem.analysis, max_step=None).longest_step(timed=problem.timed)
        for tolerance in _TOLERANCES:
            order = 2 if name == "sdirk2" else 4
            yield "reltol", tolerance, Settings("sdirk", step=free, reltol=tolerance, order=order)
    else:
        theta = 0.5 if name == "moreau-half" else 1.0
        start = problem.analysis.row_distance
        for division in _DIVISIONS:
            yield "h", start / division, Settings("moreau", theta, start / division)


def _ladder(
    report: CostReport,
    problem: Problem,
    name: str,
    goal: float,
    limit: float,
    timer: Timer,
    words: tuple[Notice, Notice],
) -> None:
    say, tell = words
    last: Measurement | None = None
    spent = 0.0
    for parameter, value, settings in _settings(problem, name):
        # a step four times as fine takes four times as long, a tenth of a tolerance up to 3.2
        if last is not None and (4.0 * spent > limit or last.error < goal):
            return
        say(f"{name} {parameter}={value:.3g}" if parameter else name)
        try:
            solution, spent = problem.run(settings, limit)
        except NsspiceError as failure:
            if last is None and name == "modewise":
                raise
            nan = float("nan")
            note = failure.diagnostics[0].message
            report.rows.append(Measurement(name, parameter, value, 0, nan, nan, nan, nan, note))
            tell(report.rows[-1].sentence)
            return
        spent = timer.least(name, value, spent, partial(_seconds, problem, settings))
        steps = _steps(solution.stats)
        error, l1 = report.reference.distance(problem.table(solution))
        found = Measurement(name, parameter, value, steps, error, l1, spent)
        if last is not None and error > 0.0 and last.error > 0.0 and steps > last.steps:
            order = math.log(last.error / error) / math.log(steps / last.steps)
            found = replace(found, order=order)
        report.rows.append(found)
        tell(found.sentence)
        last = found


def _show(report: CostReport, reference: Reference) -> None:
    """Let a ladder of sdirk that the limit has cut short go on by the runs of the reference.

    The finest of them may be the reference itself: it errs by no more than that is known to.
    """
    own = [k for k, row in enumerate(report.rows) if row.method == "sdirk"]
    if not own or not math.isfinite(reference.error):
        return
    done = [report.rows[k].value for k in own if not report.rows[k].note]
    last, more = (done[-1] if done else math.inf), []
    # of two runs with one tolerance the second has the shorter steps
    for tolerance, run in {run.tolerance: run for run in reference.runs}.items():
        if tolerance < 0.99 * last:
            error, l1 = reference.distance(run.table)
            error = max(error, reference.error)
            found = Measurement("sdirk", "reltol", tolerance, run.steps, error, l1, run.seconds)
            more.append(found)
    report.rows[own[-1] + 1 : own[-1] + 1] = more


def _seconds(problem: Problem, settings: Settings) -> float:
    return problem.run(settings)[1]


def _steps(stats: dict[str, Any]) -> int:
    return int(stats.get("steps", 0) or stats.get("segments", 0))
