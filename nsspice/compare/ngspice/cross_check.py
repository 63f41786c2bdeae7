"""The whole cross-check of a deck: both simulations, norms, verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...analyses.request.cards import Dc, Op, Tran
from ...analyses.request.load import read_again
from ...analyses.request.request import Request
from ...analyses.signals.signal_names import unit
from ...analyses.solution.solution import Solution
from ...analyses.studies.batch import Job, altered_circuit, jobs_of, run_job
from ...circuit import Circuit
from ...errors import Diagnostic, UsageError
from ...netlist.deck import DcCard, TranCard
from ...output.si import number
from .options import Options
from .result import NgspiceError, NgspiceRun
from .runs import run
from .verdict import SignalDistance, default_slack, distances


@dataclass(frozen=True, slots=True)
class CrossCheck:
    """Both runs of a deck and how far they lie apart.

    Parameters
    ----------
    solution : Solution
    run : NgspiceRun
    rows : list of SignalDistance
    norm : str
        ``max``, ``l1`` or ``rms``: the one that decides.
    tolerance : float
        Largest allowed, as a share of the range, or in volts and amperes if ``absolute``.
    absolute : bool
    slack : float
        Allowed difference of instants [s].
    """

    solution: Solution
    run: NgspiceRun
    rows: list[SignalDistance]
    norm: str
    tolerance: float
    absolute: bool
    slack: float

    def agrees(self, row: SignalDistance) -> bool:
        """Return whether one signal lies within the tolerance."""
        value = row.by_name(self.norm) if self.absolute else row.share(self.norm)
        return value <= self.tolerance

    @property
    def passed(self) -> bool:
        """True if all signals lie within the tolerance."""
        return all(self.agrees(row) for row in self.rows)

    @property
    def worst(self) -> SignalDistance:
        """The signal with the largest distance."""
        return max(self.rows, key=lambda row: row.share(self.norm))

    def describe(self) -> str:
        """Return the report as text."""
        return "\n".join([*self._ngspice(), *self._nsspice(), "", *self._table(), self._verdict()])

    def _ngspice(self) -> list[str]:
        run, options = self.run, self.run.translation.options
        work = f"{number(run.seconds, 's', 3)}"
        if run.points:
            work = f"{run.points} points, {run.rejected} rejected, {work}"
        lines = [f"{run.version} ({run.runner}): {work}"]
        step = f", steps <= {number(options.max_step, 's', 3)}" if options.max_step else ""
        lines.append(
            f"  reltol={options.reltol:g} abstol={options.abstol:g} vntol={options.vntol:g} "
            f"method={options.method}{step}"
        )
        if options.rshunt:
            lines.append(f"  {number(options.rshunt, 'Ohm', 3)} from every node to ground (rshunt)")
        if self.slack:
            lines.append(f"  instants may differ by {number(self.slack, 's', 3)}")
        lines += [f"  {substitute}" for substitute in run.translation.substitutes]
        lines += [f"  failed with {failed_with(failure)}" for failure in run.attempts]
        return lines

    def _nsspice(self) -> list[str]:
        runs = self.solution.islands
        methods = ", ".join(dict.fromkeys(island.method for island in runs))
        steps = [island.step for island in runs if island.step]
        step = f", step {number(min(steps), 's', 3)}" if steps else ""
        wall = number(self.solution.wall_time, "s", 3)
        return [f"nsspice: {methods}{step}, {self.solution.row_count} rows, {wall}"]

    def _table(self) -> list[str]:
        width = max(len("signal"), *(len(row.signal) for row in self.rows))
        head = ("max", "l1", "range", "max/range", "l1/range")
        lines = [f"{'signal':<{width}}  " + "  ".join(f"{name:>11}" for name in head)]
        for row in self.rows:
            symbol = unit(row.signal)
            cells = [number(c, symbol, 4) for c in (row.maximum, row.l1, row.span)]
            cells += [f"{row.share(norm):.1e}" for norm in ("max", "l1")]
            text = "  ".join(f"{cell:>11}" for cell in cells)
            lines.append(f"{row.signal:<{width}}  {text}  {'ok' if self.agrees(row) else 'FAIL'}")
        return lines

    def _verdict(self) -> str:
        failed = sum(not self.agrees(row) for row in self.rows)
        what = f"{self.norm} distance <= {self.tolerance:g}"
        what += "" if self.absolute else " of the range"
        verdict = "all within" if not failed else f"{failed} of {len(self.rows)} outside"
        return f"{verdict} {what}, against ngspice"

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        run, options = self.run, self.run.translation.options
        return {
            "norm": self.norm,
            "tolerance": self.tolerance,
            "absolute": self.absolute,
            "passed": self.passed,
            "slack": self.slack,
            "ngspice": {
                "version": run.version,
                "runner": run.runner,
                "seconds": run.seconds,
                "points": run.points,
                "rejected": run.rejected,
                "options": {
                    name: getattr(options, name)
                    for name in (
                        "reltol",
                        "abstol",
                        "vntol",
                        "gmin",
                        "rshunt",
                        "method",
                        "max_step",
                    )
                    + (() if run.translation.exact else ("junction", "ron", "roff", "edge"))
                },
                "substitutes": [
                    {"elements": list(s.elements), "law": s.law, "used": s.used}
                    for s in run.translation.substitutes
                ],
                "failed_before": [
                    {
                        "ron": e.translation.options.ron,
                        "roff": e.translation.options.roff,
                        "reltol": e.translation.options.reltol,
                        "rshunt": e.translation.options.rshunt,
                        "reason": e.reason,
                        "time": e.time,
                    }
                    for e in run.attempts
                ],
            },
            "signals": [{**row.to_dict(), "passed": self.agrees(row)} for row in self.rows],
        }


def failed_with(failure: NgspiceError) -> str:
    """Return under which options ngspice failed, how, and when."""
    tried, exact = failure.translation.options, failure.translation.exact
    words = [] if exact else [f"ron={tried.ron:g} roff={tried.roff:g}"]
    words.append(f"reltol={tried.reltol:g}")
    words += [f"rshunt={tried.rshunt:g}"] if tried.rshunt else []
    at = "" if failure.time is None else f" at {number(failure.time, 's', 3)}"
    return f"{' '.join(words)}: {failure.reason}{at}"


def cross_check(
    circuit: Circuit,
    *,
    request: Request | None = None,
    job: Job | None = None,
    options: Options | None = None,
    tolerance: float = 1e-3,
    norm: str = "max",
    absolute: bool = False,
    window: tuple[float | None, float | None] = (None, None),
    slack: float | None = None,
) -> CrossCheck:
    """Simulate a deck with nsspice and with ngspice and compare the waveforms.

    Parameters
    ----------
    circuit : Circuit
    request : Request, optional
        How nsspice is to run it, and which signals are compared.
    job : Job, optional
        Which analysis; the first transient or sweep of the deck if left out.
    options : Options, optional
        How ngspice is to run it.
    tolerance, norm, absolute
        What decides: see ``CrossCheck``.
    window : (float or None, float or None)
        Begin and end of the comparison.
    slack : float, optional
        By how much instants may differ [s]; two steps of ngspice where it has substitutes, else 0.

    Raises
    ------
    UsageError
        NS4013 if ngspice is not installed, NS4014 if it cannot do the deck at all.
    NgspiceError
        If ngspice does not finish.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''half wave
    ... V1 in 0 SIN(0 10 50)
    ... D1 in out
    ... R1 out 0 1k
    ... .tran 0.1m 20m
    ... ''')
    >>> cross_check(circuit, tolerance=1e-5).passed
    True
    """
    request = request or Request()
    job = job or first_job(circuit)
    solution = run_job(circuit, job, request)
    if solution.interrupted:
        raise KeyboardInterrupt
    signals = [name for name in solution.columns if name[:2] in ("v(", "i(")]
    if not signals:
        raise UsageError(
            Diagnostic(
                "NS4009",
                "there is no voltage or current to compare",
                hint="list them with --signals",
            )
        )
    parameters = {s.name: v for s, v in job.steps if s.kind == "param"}
    if job.alterations:
        circuit, job = altered_circuit(circuit, job, parameters)
        parameters = {}
    result = run(
        read_again(circuit.deck, parameters) if parameters else circuit,
        _analysis(job, request),
        signals,
        options,
        values={s.name: v for s, v in job.steps if s.kind == "element"},
        temperature=next((v for s, v in job.steps if s.kind == "temp"), None),
    )
    slack = default_slack(result) if slack is None else slack
    rows = distances(solution, result, signals, window, slack)
    return CrossCheck(solution, result, rows, norm, tolerance, absolute, slack)


def first_job(circuit: Circuit) -> Job:
    """Return the first transient or sweep of a deck, else its operating point."""
    jobs = jobs_of(circuit.deck)
    return next((job for job in jobs if job.kind != "op"), jobs[0])


def _analysis(job: Job, request: Request) -> Op | Dc | Tran:
    card = job.card
    if isinstance(card, TranCard):
        task = Tran.from_card(card)
        if request.stop is not None:
            return Tran(request.stop, task.row_step, task.start, task.max_step, task.uic)
        return task
    return Dc.from_card(card) if isinstance(card, DcCard) else Op()
