"""Running everything a deck asks for: its analyses, for every value of its ``.step`` cards."""

from __future__ import annotations

import copy
import itertools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...circuit import Circuit, build
from ...circuit.blocks import Blocks
from ...errors import Diagnostic, NsspiceError, NumericalError, UsageError
from ...lazy import resolve
from ...netlist.alteration import altered
from ...netlist.deck import (
    Alteration,
    Analysis,
    Deck,
    Measure,
    PssCard,
    Run,
    Sweep,
    TranCard,
    kind_of,
)
from ..request.cards import Tran
from ..request.load import need_circuit, read, read_again
from ..request.measured_signals import Watched, measured_signals
from ..request.notebook_progress import Progress, shown_in_notebook
from ..request.request import Request, named_controllers
from ..request.row_sinks import Sink
from ..request.settings import foreign_method
from ..solution.recording import named
from ..solution.refusal import check_on_failure, judge
from ..solution.solution import Solution
from ..transient.transient import run_tran

if TYPE_CHECKING:
    from ..request.controller import Controller
    from ..steady.steady_state import Pss

#: runs of one analysis over all .step cards; each has a table of its own
MAX_RUNS = 100_000


@dataclass(frozen=True, slots=True)
class Job:
    """One analysis for one combination of stepped values.

    Parameters
    ----------
    card : OpCard, DcCard or TranCard
    label : str
        What distinguishes it from the other jobs of the deck: ``""``, ``"tran"``, ``"dc2.step3"``.
    steps : tuple of (Sweep, float)
        Stepped quantities with their value.
    alterations : tuple of Alteration
        What a ``.control`` program has altered.
    number : int or None
        Which of the runs of the program it is.
    """

    card: Analysis
    label: str
    steps: tuple[tuple[Sweep, float], ...] = ()
    alterations: tuple[Alteration, ...] = ()
    number: int | None = None

    @property
    def kind(self) -> str:
        """What :func:`kind_of` says of the card."""
        return kind_of(self.card)

    @property
    def values(self) -> dict[str, float]:
        """The stepped and altered values by name."""
        changed = {a.label: a.values[0] for a in self.alterations}
        return {**changed, **{sweep.name: value for sweep, value in self.steps}}


def jobs_of(deck: Deck) -> list[Job]:
    """Return the jobs of a deck in order.

    Raises
    ------
    UsageError
        NS4006 if the deck has no analysis, NS4017 if it asks for too many runs.
    """
    if not deck.analyses:
        hint = "add .tran tstep tstop, .dc source start stop step, or .op"
        unread = [w for w in deck.warnings if w.code in ("NS1090", "NS1093") and w.hint]
        if unread:
            hint = f"{unread[0].message.partition(':')[0]}; {unread[0].hint}"
        elif re.match(r"\s*\.(?!title)", deck.title, re.IGNORECASE):
            hint = f"{deck.title.split()[0]} is on the first line, which is the title; {hint}"
        raise UsageError(
            Diagnostic("NS4006", f"{deck.file} asks for no analysis", hint=hint),
        )
    runs = deck.runs or [Run(card) for card in deck.analyses]
    kinds = [kind_of(run.card) for run in runs]
    count = len(deck.runs or [1]) * math.prod(len(sweep.values) for sweep in deck.steps)
    if count > MAX_RUNS:
        factors = [len(deck.runs)] if deck.runs else []
        text = " x ".join(map(str, [*factors, *(len(sweep.values) for sweep in deck.steps)]))
        what = "the .step cards ask" if deck.steps else "the .control block asks"
        message = f"{what} for {text} = {count} runs, more than {MAX_RUNS}"
        hint = "use fewer points, or call nsspice.tran in a loop and keep what you need"
        where = deck.steps[-1].span if deck.steps else None
        raise UsageError(Diagnostic("NS4017", message, where, hint))
    points = list(itertools.product(*(sweep.values for sweep in reversed(deck.steps))))
    jobs = []
    for k, (run, kind) in enumerate(zip(runs, kinds, strict=True)):
        program = k if deck.runs else None
        number = kinds[:k].count(kind) + 1
        name = "" if len(kinds) == 1 else kind if number == 1 else f"{kind}{number}"
        for j, values in enumerate(points):
            step = f"step{j + 1}" if deck.steps else ""
            pairs = list(zip(deck.steps, reversed(values), strict=True))
            steps = tuple(pair for pair in pairs if pair[0].kind != "model")
            changed = tuple(_of_model(*pair) for pair in pairs if pair[0].kind == "model")
            label = ".".join(filter(None, [name, step]))
            jobs.append(Job(run.card, label, steps, (*run.alterations, *changed), program))
    return jobs


def _of_model(sweep: Sweep, value: float) -> Alteration:
    """Return the change of a stepped parameter of a model, ``@model[parameter]``."""
    name, _, key = sweep.name[1:-1].partition("[")
    return Alteration("model", name, key, (value,), sweep.span)


def run(
    circuit: Circuit | str | Path,
    *,
    params: Mapping[str, float] | None = None,
    method: str | None = None,
    theta: float | None = None,
    step: float | None = None,
    reltol: float | None = None,
    accuracy: str | None = None,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    all_points: bool = False,
    everything: bool = False,
    tol: float | None = None,
    refine: bool = False,
    controllers: Sequence[Controller] = (),
    on_failure: str = "raise",
    progress: Progress | None = None,
) -> list[Solution]:
    """Run all analyses of a deck and evaluate its measures.

    Parameters
    ----------
    circuit : Circuit, str or Path
        A circuit, or anything that :func:`nsspice.read` accepts: ``"deck.net"``.
    params : mapping of str to float, optional
        Values that replace those of top-level ``.param`` cards when a deck is read.
    method, theta, step, reltol, accuracy, signals, extra, all_points, everything
        As for :func:`nsspice.tran`.
    tol : float, optional
        Error wanted in transients, relative to the range of each stored quantity: method and step
        are chosen to meet it, and ``error`` of the solution says what was reached.
    refine : bool
        Estimate the error of fixed steps by halving them twice; see ``error`` of the solution.
    controllers : sequence of Controller
        As for :func:`nsspice.tran`; each run begins with copies of them.
    on_failure : str
        As for :func:`nsspice.tran`; it applies after all analyses have been run.
    progress : callable, optional
        Called with the fraction of all analyses completed, 0 to 1. Without it, longer runs in a
        notebook show a progress bar.

    Returns
    -------
    list of Solution
        One for each analysis and ``.step`` value; fewer if Ctrl-C stopped the run; the last one
        then has ``interrupted`` set.

    Raises
    ------
    NumericalError
        If an analysis has no solution, or ``tol`` is not reached; ``partial`` holds what was
        computed before.
    CertificateError
        NS3003 if a certificate fails: ``solution`` holds the first such run, ``solutions`` all.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''stepped divider
    ... .param r=1k
    ... V1 a 0 1
    ... R1 a b {r}
    ... R2 b 0 1k
    ... .op
    ... .step param r list 1k 3k
    ... ''')
    >>> [float(s["v(b)"][0]) for s in circuit.run()]
    [0.5, 0.25]
    """
    if isinstance(circuit, str | Path):
        circuit = read(circuit, params)
    elif params:
        raise TypeError("params= applies when a deck is read: nsspice.read(deck, params)")
    need_circuit(circuit)
    check_on_failure(on_failure)
    check_tolerance(tol, refine)
    request = Request(
        method,
        theta,
        step,
        signals=signals,
        extra=tuple(extra),
        all_points=all_points,
        reltol=reltol,
        everything=everything,
        accuracy=accuracy,
        controllers=named_controllers(circuit, controllers),
    )
    jobs = jobs_of(circuit.deck)
    execute: Callable[..., Solution] = run_job
    if tol is not None or refine:
        from .refinement import run_estimated

        execute = partial(run_estimated, tol=tol)
    solutions: list[Solution] = []
    with shown_in_notebook(circuit.deck.title, progress) as watcher:
        for k, job in enumerate(jobs):
            share = None if watcher is None else _share(watcher, k, len(jobs))
            solutions.append(execute(circuit, job, request, progress=share))
            if solutions[-1].interrupted:
                break
    judge(solutions, on_failure)
    return solutions


def check_tolerance(tol: float | None, refine: bool) -> None:
    """Raise UsageError unless at most one estimate is asked for, with a sensible tolerance."""
    if tol is not None and not 0.0 < tol < 1.0:
        hint = "give a fraction of the signals' range, such as 1e-6"
        raise UsageError(Diagnostic("NS4005", f"--tol cannot be {tol:g}", hint=hint))
    if tol is not None and refine:
        hint = "drop one"
        raise UsageError(
            Diagnostic("NS4005", "--tol and --refine cannot be used together", hint=hint)
        )


def _share(progress: Progress, k: int, count: int) -> Progress:
    return lambda done: progress((k + done) / count)


def run_job(
    circuit: Circuit,
    job: Job,
    request: Request,
    *,
    progress: Progress | None = None,
    sink: Sink | None = None,
) -> Solution:
    """Run one job and evaluate its measures.

    Parameters
    ----------
    circuit : Circuit
        Of the deck without steps.
    job : Job
    request : Request
    progress, sink
        As for :func:`nsspice.tran`.

    Raises
    ------
    NsspiceError
        Which names the values of the ``.step`` cards, if there are any.
    """
    try:
        return _run_job(circuit, job, request, progress, sink)
    except NsspiceError as error:
        if job.values:
            values = ", ".join(f"{name} = {value:g}" for name, value in job.values.items())
            error.amend(f"({values})" if job.alterations else f"(.step: {values})")
        raise


def of_job(circuit: Circuit, job: Job, request: Request) -> tuple[Circuit, Job, Request]:
    """Return the circuit of a job, the job with the card of its deck, and the values of its steps.

    Parameters
    ----------
    circuit : Circuit
        Of the deck without steps.
    job : Job
    request : Request
        Comes back with the temperature and the values of elements.
    """
    deck = circuit.deck
    parameters = {s.name: v for s, v in job.steps if s.kind == "param"}
    if job.steps:
        from ..static.statics import check_sweep

        for sweep, _ in job.steps:
            check_sweep(circuit, sweep)
    temperature = next((v for s, v in job.steps if s.kind == "temp"), None)
    if deck.thermal and temperature is not None:
        parameters["temper"] = temperature
    if job.alterations:
        circuit, job = altered_circuit(circuit, job, parameters)
    elif parameters:
        circuit = read_again(deck, parameters)
        job = replace(job, card=circuit.deck.analyses[deck.analyses.index(job.card)])
    request = replace(
        request,
        temperature=temperature,
        values={s.name: v for s, v in job.steps if s.kind == "element"},
    )
    return circuit, job, request


def _run_job(
    circuit: Circuit, job: Job, request: Request, progress: Progress | None, sink: Sink | None
) -> Solution:
    deck = circuit.deck
    request.settings(deck)  # refuses what is impossible
    warnings = [w for w in (foreign_method(deck),) if w is not None]
    circuit, job, request = of_job(circuit, job, request)
    parameters = {s.name: v for s, v in job.steps if s.kind == "param" and not job.alterations}
    if request.controllers and job.kind not in ("tran", "pss", "op"):
        request.refuse_controllers()
    measures = [
        m
        for m in circuit.deck.measures
        if m.analysis == job.kind and (m.runs is None or job.number in m.runs)
    ]
    request = replace(
        request,
        extra=[*request.extra, *measured_signals(measures)],
        progress=progress,
        sink=sink,
        controllers=copy.deepcopy(request.controllers),
    )
    try:
        solution = _runner(job.kind)(circuit, job.card, request)
    except NumericalError as error:
        if isinstance(error.partial, Solution):
            error.partial.parameters = job.values
        raise
    solution.parameters = job.values
    solution.warnings = [*warnings, *solution.warnings]
    if parameters:
        _repeat_with(solution, deck, parameters)
    if not solution.interrupted:
        _add_results(circuit, solution, job, request, measures)
    if job.values and not (request.follow or request.record):
        solution.recording = None  # of one run it may fill memory, of a thousand it does
    return solution


def _repeat_with(solution: Solution, deck: Deck, parameters: Mapping[str, float]) -> None:
    """Let a run be repeated with the values of its step."""
    from ..static.statics import SolvedAgain
    from ..transient.transient import Rerun

    if isinstance(solution.again, Rerun):
        solution.again = replace(solution.again, deck=deck, parameters=parameters)
    if isinstance(solution.more, Rerun | SolvedAgain):
        solution.more = replace(solution.more, deck=deck, parameters=parameters)


def _add_results(
    circuit: Circuit, solution: Solution, job: Job, request: Request, measures: Sequence[Measure]
) -> None:
    """Compute what other cards ask for: measures, spectra, powers, sensitivities."""
    deck = circuit.deck
    if measures:
        from ..transient.measure import evaluate_measures

        evaluate_measures(solution, measures)
    if job.kind in ("tran", "pss") and (deck.fours or request.power):
        from ..averages.spectrum import add_powers, add_spectra

        add_spectra(solution, deck.fours)
        if request.power:
            add_powers(circuit, solution, request.loads)
    if not deck.sensitivities:
        return
    if job.kind in ("op", "pss") and solution.axis.size:
        from ..steady.sensitivity import add_sensitivities

        add_sensitivities(circuit, solution, request)
    if any(not sens.signals for sens in deck.sensitivities):
        from .measured_slopes import add_slopes

        request.refuse_controllers()
        add_slopes(circuit, solution, job, request)


def altered_circuit(
    circuit: Circuit, job: Job, parameters: Mapping[str, float]
) -> tuple[Circuit, Job]:
    """Return the circuit that a program has altered, and the job with the card of its deck."""
    deck = circuit.deck
    given = {a.name: a.values[0] for a in job.alterations if a.kind == "param"}
    given.update(parameters)
    if given:
        fresh = read_again(deck, given).deck
        job = replace(job, card=fresh.analyses[deck.analyses.index(job.card)])
        deck = fresh
    return build(altered(deck, job.alterations)), job


def _tran(circuit: Circuit, card: TranCard, request: Request) -> Solution:
    """Run a transient, and integrate it where spectra, powers or temperatures are asked for."""
    deck, settings = circuit.deck, request.settings(circuit.deck)
    analysis = Tran.from_card(card)
    if request.stop is not None:
        analysis = replace(analysis, stop=request.stop)
    beginnings = None
    controlled = bool(request.controllers or deck.sampled or deck.delays)
    if card.orbit:
        request.refuse_controllers()
        from ..steady.steady_state import find_orbits

        _, orbits = find_orbits(circuit, _pss_of(circuit, card), request)
        beginnings = [None if o is None else o.beginning for o in orbits]
    wanted = replace(
        request,
        keep=request.keep or any(m.analysis == "tran" for m in deck.measures),
        everything=request.everything or request.power,
    )
    watched = Watched.of(circuit, analysis, named(request.follow), every=request.record)
    solution = run_tran(circuit, analysis, settings, wanted, watched=watched, beginnings=beginnings)
    if (request.power or _needs_integrals(deck)) and not controlled:
        from ..averages.integrable_run import integrals_of
        from ..transient.blocks import split

        blocks = Blocks(circuit)
        if beginnings is None:
            blocks = split(circuit, settings, analysis, request)
        solution.integrals = integrals_of(blocks, analysis, request, beginnings)
    return solution


#: where the other analyses are: what a card becomes, and what runs it
_ANALYSES = {
    "dc": ("request.cards:Dc", "static.statics:run_dc"),
    "pss": ("steady.steady_state:Pss", "steady.steady_state:run_pss"),
    "ac": ("steady.small_signal:Ac", "steady.small_signal:run_ac"),
    "loop": ("steady.loop_gain:Loop", "steady.loop_gain:run_loop"),
    "noise": ("steady.noise:Noise", "steady.noise:run_noise"),
    "tf": ("steady.transfer:Tf", "steady.transfer:run_tf"),
    "pz": ("steady.poles:Pz", "steady.poles:run_pz"),
    "sp": ("steady.scattering:Sp", "steady.scattering:run_sp"),
}


def _runner(kind: str) -> Callable[[Circuit, Any, Request], Solution]:
    """Return what runs a card; of the analyses only those are imported that a deck asks for."""
    if kind == "tran":
        return _tran
    if kind == "op":
        from ..static.statics import run_op

        return lambda circuit, card, request: run_op(circuit, request)
    card, run = (resolve(f".analyses.{place}") for place in _ANALYSES[kind])
    return lambda circuit, given, request: run(circuit, card.from_card(given), request)


def _needs_integrals(deck: Deck) -> bool:
    """Return whether a transient is asked for spectra, switching losses or temperatures."""
    measures = [m for m in deck.measures if m.analysis == "tran"]
    return bool(deck.fours) or any(m.is_spectral or m.is_hot for m in measures)


def _pss_of(circuit: Circuit, card: TranCard) -> Pss:
    """Return the periodic steady state from which a transient begins."""
    from ..steady.steady_state import Pss

    found = next((c for c in circuit.deck.analyses if isinstance(c, PssCard)), None)
    return Pss(span=card.span) if found is None else Pss.from_card(found)
