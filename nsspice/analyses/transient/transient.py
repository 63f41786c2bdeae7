"""Transient analysis: every island through time on its own, rows put side by side."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import partial
from typing import TYPE_CHECKING

from ...circuit import Circuit
from ...circuit.blocks import Blocks
from ...circuit.dependencies import Skipped, needed
from ...dataclass import dataclass
from ...errors import Diagnostic, NumericalError, UsageError
from ...netlist.deck import Deck, TranCard
from ..certificate.certificate import Certificate
from ..certificate.hidden_motion import OutputPoints
from ..certificate.huge_currents import huge_currents
from ..certificate.left_lines import left_lines
from ..certificate.node_reach import NodeReach
from ..certificate.written_rows import WrittenRows, conditions_of
from ..request.cards import Tran
from ..request.interrupts import Interrupts
from ..request.load import again, need_circuit
from ..request.measured_signals import Watched
from ..request.notebook_progress import Progress
from ..request.recorder import Recorder
from ..request.request import Request, named_controllers
from ..request.restart_state import Beginning
from ..request.row_sinks import GrowingStore, Sink, Store
from ..request.settings import Settings
from ..request.values import checked_values
from ..signals.curve import Floats
from ..signals.events import Events
from ..solution.default_signals import view_of
from ..solution.recording import Recording
from ..solution.refusal import check_on_failure, judge
from ..solution.solution import FinePoints, Solution
from .advance import Outlet, advance_all
from .blocks import split
from .handover_to_steps import Race
from .island_runner import IslandRunner
from .row_checks import copies_of, limits, unwatched, violations

if TYPE_CHECKING:
    from ..averages.integrals import Integrals
    from ..request.controller import Controller
    from .memory import Memory


def tran(
    circuit: Circuit,
    stop: float | None = None,
    row_step: float | None = None,
    *,
    step: float | None = None,
    start: float = 0.0,
    uic: bool | None = None,
    method: str | None = None,
    theta: float | None = None,
    reltol: float | None = None,
    accuracy: str | None = None,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    sink: Sink | None = None,
    keep: bool = True,
    all_points: bool = False,
    everything: bool = False,
    controllers: Sequence[Controller] = (),
    on_failure: str = "raise",
) -> Solution:
    """Simulate a circuit in time.

    Parameters
    ----------
    circuit : Circuit
        From :func:`nsspice.read`.
    stop : float, optional
        End [s]; without it everything comes from the deck's first ``.tran`` card.
    row_step : float, optional
        Spacing of the output rows [s]; a thousandth of the time shown by default.
    step : float, optional
        Solver step [s]; by default SPICE's largest step. With ``sdirk`` it is the longest step.
    start : float
        First output row [s].
    uic : bool, optional
        Start from the initial values of the elements instead of the DC solution.
    method : str, optional
        ``auto``, ``modewise`` (exact), ``sdirk`` (steps with error control) or ``moreau`` (fixed
        steps); ``euler-newton`` or ``euler-newton-rate`` for circuits without energy storage.
    theta : float, optional
        Weight of the new state: 1 implicit (default), 0.5 trapezoidal in the smooth part.
    reltol : float, optional
        Error of one step of ``sdirk``, relative to the range of each unknown so far; 1e-5 by
        default.
    accuracy : str, optional
        ``waveforms`` (default), or ``energy``: errors of ``sdirk`` are measured by the energy
        exchanged in a period of the sources, 1e-4 of it by default.  Means and powers are accurate,
        ringing of little energy is damped.
    signals : sequence of str, optional
        Signals to return; by default those of the deck's ``.save`` cards, or the default set.
    extra : sequence of str
        Signals to record that are not among ``columns``.
    temperature : float, optional
        [degrees Celsius]
    values : mapping of str to float, optional
        Values of R, L, C or sources by element name that replace the deck's [Ohm, H, F, V or A].
    progress : callable, optional
        Called with the fraction completed, 0 to 1.
    sink : Sink, optional
        Takes the rows while they are computed.
    keep : bool
        If False, only the sink gets the rows; the solution then has the first and last row.
    all_points : bool
        Rows at the solver's own points (with fixed steps instead of the grid), and on both sides
        of each jump: the time of a jump appears twice, before and after.
    everything : bool
        Also simulate parts on which none of the signals depends; otherwise ``skipped`` of the
        solution and its certificate name them.
    controllers : sequence of Controller
        Functions that are called at sampling instants and set sources.
    on_failure : str
        What to do if the certificate fails: ``raise`` a CertificateError, ``warn`` (a
        CertificateWarning, also among the ``warnings`` of the solution), or ``ignore``.

    Returns
    -------
    Solution
        With ``interrupted`` set if Ctrl-C stopped it; the rows up to there are complete.

    Raises
    ------
    NumericalError
        If a step has no solution; ``partial`` holds what was computed before.
    CertificateError
        NS3003 if the certificate fails, unless ``on_failure`` says otherwise; ``solution`` is the
        run.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''RC
    ... V1 a 0 1
    ... R1 a b 1
    ... C1 b 0 1 IC=0
    ... ''')
    >>> sol = nsspice.tran(circuit, stop=1.0, step=1e-3, uic=True)
    >>> abs(float(sol["v(b)"][-1]) - (1 - 2.718281828**-1)) < 2e-4
    True
    """
    need_circuit(circuit)
    check_on_failure(on_failure)
    if stop is not None:
        analysis = Tran(stop, row_step, start, None, bool(uic))
        if row_step is not None and row_step > stop:
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    f"the row spacing, {row_step:g} s, is longer than the run, {stop:g} s",
                    hint="stop is the first argument: tran(circuit, stop, row_step)",
                )
            )
    else:
        analysis = _from_deck(circuit, uic)
    request = Request(
        method,
        theta,
        step,
        signals=signals,
        extra=extra,
        keep=keep,
        all_points=all_points,
        reltol=reltol,
        everything=everything,
        accuracy=accuracy,
        temperature=temperature,
        values=checked_values(circuit, values),
        progress=progress,
        sink=sink,
        controllers=named_controllers(circuit, controllers),
    )
    settings, watched = request.settings(circuit.deck), Watched.of(circuit, analysis)
    solution = run_tran(circuit, analysis, settings, request, watched=watched)
    judge([solution], on_failure)
    return solution


def _from_deck(circuit: Circuit, uic: bool | None) -> Tran:
    for card in circuit.deck.analyses:
        if isinstance(card, TranCard):
            found = Tran.from_card(card)
            if uic is None:
                return found
            return Tran(found.stop, found.row_step, found.start, found.max_step, uic)
    raise UsageError(
        Diagnostic(
            "NS4006",
            f"{circuit.deck.file} has no .tran card",
            hint="pass stop=, or add .tran tstep tstop to the deck",
        )
    )


def run_tran(
    circuit: Circuit,
    analysis: Tran,
    settings: Settings,
    request: Request,
    *,
    watched: Watched | None = None,
    beginnings: Sequence[Beginning | None] | None = None,
    periodic_sources: bool = False,
    controllers: tuple[Controller, ...] | None = None,
    memory: Memory | None = None,
) -> Solution:
    """Run one transient analysis; see :func:`tran`.

    Signals that are ``watched`` are recorded between the rows.  ``beginnings`` are the states from
    which islands begin, where they are given; sources that repeat are continued into the past if
    they are ``periodic_sources``.  ``controllers`` are those of an orbit, with their ``memory``.
    """
    begin = clock.perf_counter()
    analysis = analysis.bounded(settings.max_step)
    if controllers is None:
        controllers = request.all_controllers(circuit)
    delays = None
    if circuit.deck.delays:
        from .delays import Delays

        delays = Delays(circuit, settings.reltol)
        analysis = analysis.bounded(delays.longest_step)
        delays.begin(request, analysis)
        request = replace(request, extra=(*request.extra, *delays.signals))
    schedule = None
    if controllers or delays is not None:
        from .controlled import advance_controlled, started
        from .schedule import Schedule

        schedule = Schedule.of(circuit, controllers, analysis.stop, memory)
    if schedule is not None:
        request = schedule.wanted(request)
    columns, names = request.names(circuit)
    keep, all_points, sink = request.keep, request.all_points, request.sink
    whole, skipped, asked = circuit, Skipped(), analysis
    chosen = request.signals is not None or bool(circuit.deck.saves)
    if chosen and not request.everything and beginnings is None:
        measured = [] if watched is None else [part for _, part in watched.parts]
        circuit, skipped = needed(circuit, [*names, *measured])
        if skipped and watched is not None:
            watched = watched.within(circuit)
    # without points of its own between them a table may hide what happens
    shown = (keep or sink is not None) and not all_points and request.rows

    def prepare(parts: Blocks) -> tuple[Recorder, list[IslandRunner], list[Race | None]]:
        local = watched if watched is None or not parts else watched.within(parts.circuit)
        beside = [(link.source, link.signal) for link in parts.links]
        recorder = Recorder(parts.circuit, names, beside)

        def runner(k: int, settings: Settings) -> IslandRunner:
            found = IslandRunner(
                parts.circuit,
                k,
                parts.circuit.islands[k],
                recorder.local[k],
                asked,
                settings,
                request.temperature,
                {
                    **(request.values if schedule is None else schedule.values(request)),
                    **({} if delays is None else delays.values),
                },
                sides=(keep or watched is not None) and not all_points,
                watched=local,
                all_points=all_points,
                beginning=None if beginnings is None else beginnings[k],
                periodic_sources=periodic_sources,
                aliases=shown,
                links=parts.links,
                clock=None if schedule is None else schedule.sources.clock,
                delayed=() if delays is None else delays.signals,
            )
            found.analysis = analysis
            return found

        count = len(parts.circuit.islands)
        # what blocks hand on is in closed forms; orbits are continued as they were found
        free = settings.method == "auto" and not settings.stepped and not parts.links
        free = free and schedule is None
        steps = replace(settings, method="sdirk")
        races = [
            Race(partial(runner, k, steps)) if free and beginnings is None else None
            for k in range(count)
        ]
        return recorder, [runner(k, settings) for k in range(count)], races

    judged = circuit
    parts = Blocks(circuit)
    if beginnings is None and not periodic_sources and schedule is None:
        parts = split(circuit, settings, analysis, request)
    recorder, runners, races = prepare(parts)
    if not all(runner.drives for runner in runners):
        parts = Blocks(circuit)
        recorder, runners, races = prepare(parts)
    circuit = parts.circuit
    fewer = not (request.rows or all_points) and schedule is None
    # steps of other engines are cut by the distance of output points
    if fewer and all(r.method == "modewise" and r.step and not r.island.timed for r in runners):
        analysis = analysis.thinned()
        for runner in runners:
            runner.analysis = analysis
    rows = analysis.row_count
    width = 1 + len(names)
    store = GrowingStore(width) if keep and all_points else Store(rows if keep else 2, width)
    if sink is not None:
        sink.open(["time", *columns])
    outlet = Outlet(recorder, store, sink, keep)
    held = () if schedule is None else tuple(schedule.sources.values)
    conditions = conditions_of(judged, analysis, request.temperature, request.values)
    # sources that are continued into the past are not the deck's, and points of other islands are
    # on lines between their own
    if not periodic_sources and not (all_points and len(runners) > 1):
        outlet.judge = WrittenRows(judged, names, conditions, held)
    begun = list(runners)
    if not all_points:
        judge = outlet.judge
        reach = NodeReach(judged.devices, conditions) if judge is None else judge.reach
        outlet.copies = copies_of(runners, recorder, reach)
    points = OutputPoints(columns, [r.between for r in runners if r.between is not None])
    if shown and not keep:

        def see(block: Floats) -> None:
            for runner in runners:
                runner.hand_over()
            points.see(block)

        outlet.watch = see
    failure: NumericalError | None = None
    interrupted = False
    with Interrupts() as interrupts:
        try:
            if schedule is not None:
                runners = started(schedule, lambda: prepare(parts)[1], recorder)
                if delays is not None:
                    delays.attend(runners, recorder)
                between = [r.between for r in runners if r.between is not None]
                points = OutputPoints(columns, between)
            else:
                for runner in runners:
                    runner.start()
                    interrupts.check()
            outlet.limits = lambda: limits(runners)
            if schedule is not None:
                interrupted = advance_controlled(
                    runners, schedule, outlet, analysis, request.progress, interrupts, delays
                )
            elif all_points:
                from .all_points import advance_points

                interrupted = advance_points(
                    runners, outlet, analysis, request.progress, interrupts
                )
            else:
                interrupted = advance_all(
                    runners, races, outlet, rows, analysis, request.progress, interrupts
                )
        except KeyboardInterrupt:
            interrupted = True
        except NumericalError as error:
            failure = error
        if sink is not None and (failure is None or outlet.rows):
            sink.close()
    found = [runner.jumps() for runner in runners]
    jumps = sorted((j for told, _ in found for j in told), key=lambda j: j.time)
    table = outlet.table
    solution = Solution(
        "tran",
        circuit.deck.title,
        "time",
        table[:, 0],
        {name: table[:, 1 + k] for k, name in enumerate(names)},
        columns,
        events=Events.merged(runner.events() for runner in runners),
        impulses=[impulse for jump in jumps for impulse in jump.impulses],
        jumps=jumps,
        islands=[runner.report(n) for runner, (_, n) in zip(runners, found, strict=True)],
        certificate=Certificate.total(runner.certificate() for runner in runners)
        .at_rows(*violations(outlet, runners, begun))
        .without(skipped),
        interrupted=interrupted,
        wall_time=clock.perf_counter() - begin,
        row_count=outlet.rows,
        view=None if request.signals or circuit.deck.saves else view_of(circuit, "tran", columns),
    )
    for runner, island in zip(runners, solution.islands, strict=True):
        solution.warnings += runner.warnings()
        island.unwatched = unwatched(runner)
    if (left := left_lines(solution.events)) is not None:
        solution.warnings.append(left)
    if shown and keep:
        points.see(table)
    if (hidden := points.warning()) is not None:
        solution.warnings.append(hidden)
    if not shown and keep:
        points.see(table)  # all of them
    if (huge := huge_currents(names, points.sizes)) is not None:
        solution.warnings.append(huge)
    if watched is not None:
        try:
            solution.recording = _recording(circuit, runners, recorder.local, watched)
        except NumericalError:
            if not keep:  # nothing else is wanted
                raise
    if failure is None and not interrupted and schedule is None:
        # controllers have states of their own: their functions are not called again
        same = replace(request, extra=(), everything=False, progress=None, sink=None)
        solution.again = Rerun(whole.deck, analysis, settings, same, beginnings, periodic_sources)
        solution.more = solution.again if keep else None
    if keep and any(runner.sides for runner in runners):
        solution.fine = _Fine(runners, recorder, table)
    if failure is not None:
        failure.partial = solution
        raise failure
    return solution


def _recording(
    circuit: Circuit,
    runners: Sequence[IslandRunner],
    names: Sequence[Sequence[str]],
    window: Watched,
) -> Recording:
    """Return what islands have recorded of the signals that are watched."""
    followed = [tuple(n[j] for j in r.followed) for r, n in zip(runners, names, strict=True)]
    pieces = [runner.record() for runner in runners]
    stop, analysis = window.stop, runners[0].analysis
    for part in pieces:
        if part is not None:  # what is too much to be kept ends early
            reached = float(part.end[-1])
            late = reached < min(stop, analysis.stop) * (1.0 - 1e-9)
            stop = reached if late else stop
    return Recording(circuit, followed, pieces, window.start, stop)


@dataclass(frozen=True, slots=True)
class Rerun:
    """Runs an analysis once more, and records other signals.

    It holds the deck, since a circuit holds the systems that were assembled of it.

    Parameters
    ----------
    deck : Deck
    analysis : Tran
    settings : Settings
    request : Request
    beginnings, periodic_sources
        As for ``run_tran``.
    parameters : mapping of str to float
        Values by parameter name that replace those of the deck.
    """

    deck: Deck
    analysis: Tran
    settings: Settings
    request: Request
    beginnings: Sequence[Beginning | None] | None
    periodic_sources: bool
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __call__(self, names: Sequence[str], start: float, stop: float) -> Recording:
        """Record signals between two instants [s]."""
        circuit = again(self.deck, self.parameters)
        watched = Watched.signals(circuit, names, start, stop)
        request = replace(self.request, signals=names, keep=False, all_points=False)
        solution = self._run(circuit, request, watched)
        assert solution.recording is not None
        return solution.recording

    def circuit(self) -> Circuit:
        """Return the circuit that was run."""
        return again(self.deck, self.parameters)

    def integrals(self) -> Integrals:
        """Return integrals of the signals in closed form."""
        from ..averages.integrable_run import integrals_of

        circuit = again(self.deck, self.parameters)
        blocks = Blocks(circuit)
        if self.beginnings is None:
            blocks = split(circuit, self.settings, self.analysis, self.request)
        return integrals_of(blocks, self.analysis, self.request, self.beginnings)

    def rows(self, names: Sequence[str]) -> Solution:
        """Return other signals at the same output points."""
        circuit = again(self.deck, self.parameters)
        return self._run(circuit, replace(self.request, signals=names, keep=True))

    def _run(self, circuit: Circuit, request: Request, watched: Watched | None = None) -> Solution:
        return run_tran(
            circuit,
            self.analysis,
            self.settings,
            request,
            watched=watched,
            beginnings=self.beginnings,
            periodic_sources=self.periodic_sources,
        )


class _Fine:
    """Puts both sides of jumps, and points kept between rows, into the rows, at the first call."""

    def __init__(self, runners: Sequence[IslandRunner], recorder: Recorder, table: Floats) -> None:
        self._sides = [runner.sides or [] for runner in runners]
        self._widths = [runner.width for runner in runners]
        self._recorder, self._table = recorder, table
        self._found: tuple[FinePoints | None] | None = None

    def __call__(self) -> FinePoints | None:
        if self._found is None:
            from .all_points import with_sides

            self._found = (with_sides(self._sides, self._widths, self._recorder, self._table),)
        return self._found[0]
