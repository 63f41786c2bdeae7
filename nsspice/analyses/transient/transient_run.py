"""The stages of a transient run, in the order in which `run_tran` calls them.

What controls it and what nobody asks for is settled first; then every island gets its engine and a
place for its signals, and the rows a way out.  The islands advance side by side.  What they leave
becomes a solution, with what is to be said of it.
"""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from ...circuit import Circuit
from ...circuit.blocks import Blocks
from ...circuit.dependencies import Skipped, needed
from ...errors import NumericalError
from ..certificate.certificate import Certificate
from ..certificate.hidden_motion import OutputPoints
from ..certificate.huge_currents import huge_currents
from ..certificate.left_lines import left_lines
from ..certificate.node_reach import NodeReach
from ..certificate.written_rows import WrittenRows, conditions_of
from ..request.cards import Tran
from ..request.interrupts import Interrupts
from ..request.measured_signals import Watched
from ..request.recorder import Recorder
from ..request.request import Request
from ..request.restart_state import Beginning
from ..request.row_sinks import GrowingStore, Store
from ..request.settings import Settings
from ..signals.curve import Floats
from ..signals.events import Events
from ..solution.default_signals import view_of
from ..solution.recording import Recording
from ..solution.solution import FinePoints, Solution
from .advance import Outlet, advance_all
from .blocks import split
from .handover_to_steps import Race
from .island_runner import IslandRunner
from .row_checks import copies_of, limits, unwatched, violations

if TYPE_CHECKING:
    from ..request.controller import Controller
    from .delays import Delays
    from .memory import Memory
    from .schedule import Schedule


class TransientRun:
    """One transient analysis; see ``run_tran`` for the parameters."""

    def __init__(
        self,
        circuit: Circuit,
        analysis: Tran,
        settings: Settings,
        request: Request,
        watched: Watched | None,
        beginnings: Sequence[Beginning | None] | None,
        periodic_sources: bool,
    ) -> None:
        self._begin = clock.perf_counter()
        self.circuit, self.settings, self.request = circuit, settings, request
        self.analysis = analysis.bounded(settings.max_step)
        self.watched, self.beginnings = watched, beginnings
        self.periodic_sources = periodic_sources
        self.delays: Delays | None = None
        self.schedule: Schedule | None = None
        self.skipped = Skipped()

    def control(self, controllers: tuple[Controller, ...] | None, memory: Memory | None) -> None:
        """Arrange what acts on the circuit at instants of its own: controllers, delayed signals."""
        circuit, request = self.circuit, self.request
        if controllers is None:
            controllers = request.all_controllers(circuit)
        if circuit.deck.delays:
            from .delays import Delays

            delays = self.delays = Delays(circuit, self.settings.reltol)
            self.analysis = self.analysis.bounded(delays.longest_step)
            delays.begin(request, self.analysis)
            request = replace(request, extra=(*request.extra, *delays.signals))
        if controllers or self.delays is not None:
            from .schedule import Schedule

            self.schedule = Schedule.of(circuit, controllers, self.analysis.stop, memory)
            request = self.schedule.wanted(request)
        self.request = request

    def leave_out(self) -> None:
        """Find the signals of the rows, and drop the elements that none of them depends on."""
        request, watched = self.request, self.watched
        self.columns, self.names = request.names(self.circuit)
        chosen = request.signals is not None or bool(self.circuit.deck.saves)
        if chosen and not request.everything and self.beginnings is None:
            measured = [] if watched is None else [part for _, part in watched.parts]
            self.circuit, self.skipped = needed(self.circuit, [*self.names, *measured])
            if self.skipped and watched is not None:
                self.watched = watched.within(self.circuit)
        # without points of its own between them a table may hide what happens
        rows = request.keep or request.sink is not None
        self.shown = rows and not request.all_points and request.rows

    def place_islands(self) -> None:
        """Give every island its engine; blocks that drive others one way go first."""
        settings, request = self.settings, self.request
        self.judged, self.asked = self.circuit, self.analysis
        self.parts = Blocks(self.circuit)
        if self.beginnings is None and not self.periodic_sources and self.schedule is None:
            self.parts = split(self.circuit, settings, self.analysis, request)
        self.recorder, self.runners, self.races = self._placed()
        if not all(runner.drives for runner in self.runners):
            self.parts = Blocks(self.circuit)
            self.recorder, self.runners, self.races = self._placed()
        self.circuit = self.parts.circuit
        fewer = not (request.rows or request.all_points) and self.schedule is None
        # steps of other engines are cut by the distance of output points
        exact = (r.method == "modewise" and r.step and not r.island.timed for r in self.runners)
        if fewer and all(exact):
            self.analysis = self.analysis.thinned()
            for runner in self.runners:
                runner.analysis = self.analysis

    def _placed(self) -> tuple[Recorder, list[IslandRunner], list[Race | None]]:
        """Return a runner for each island, and those that may take over where it is slow."""
        parts, settings = self.parts, self.settings
        beside = [(link.source, link.signal) for link in parts.links]
        recorder = Recorder(parts.circuit, self.names, beside)
        count = len(parts.circuit.islands)
        # what blocks hand on is in closed forms; orbits are continued as they were found
        free = settings.method == "auto" and not settings.stepped and not parts.links
        free = free and self.schedule is None and self.beginnings is None
        race = partial(self._runner, recorder, settings=replace(settings, method="sdirk"))
        races = [Race(partial(race, k)) if free else None for k in range(count)]
        return recorder, [self._runner(recorder, k, settings) for k in range(count)], races

    def _runner(self, recorder: Recorder, k: int, settings: Settings) -> IslandRunner:
        parts, request, watched, delays = self.parts, self.request, self.watched, self.delays
        schedule, all_points = self.schedule, request.all_points
        found = IslandRunner(
            parts.circuit,
            k,
            parts.circuit.islands[k],
            recorder.local[k],
            self.asked,
            settings,
            request.temperature,
            {
                **(request.values if schedule is None else schedule.values(request)),
                **({} if delays is None else delays.values),
            },
            sides=(request.keep or watched is not None) and not all_points,
            watched=watched if watched is None or not parts else watched.within(parts.circuit),
            all_points=all_points,
            beginning=None if self.beginnings is None else self.beginnings[k],
            periodic_sources=self.periodic_sources,
            aliases=self.shown,
            links=parts.links,
            clock=None if schedule is None else schedule.sources.clock,
            delayed=() if delays is None else delays.signals,
        )
        found.analysis = self.analysis
        return found

    def open_rows(self) -> None:
        """Make the way of the rows: table, sink, and who judges what is written."""
        request, runners, schedule = self.request, self.runners, self.schedule
        keep, all_points, sink = request.keep, request.all_points, request.sink
        width = 1 + len(self.names)
        rows = self.analysis.row_count if keep else 2
        store = GrowingStore(width) if keep and all_points else Store(rows, width)
        if sink is not None:
            sink.open(["time", *self.columns])
        outlet = self.outlet = Outlet(self.recorder, store, sink, keep)
        conditions = conditions_of(self.judged, self.analysis, request.temperature, request.values)
        # sources that are continued into the past are not the deck's, and points of other islands
        # are on lines between their own
        if not self.periodic_sources and not (all_points and len(runners) > 1):
            held = () if schedule is None else tuple(schedule.sources.values)
            outlet.judge = WrittenRows(self.judged, self.names, conditions, held)
        self.begun = list(runners)
        if not all_points:
            judge = outlet.judge
            reach = NodeReach(self.judged.devices, conditions) if judge is None else judge.reach
            outlet.copies = copies_of(runners, self.recorder, reach)
        self._see_between()
        if self.shown and not keep:
            outlet.watch = self._see

    def _see_between(self) -> None:
        between = [r.between for r in self.runners if r.between is not None]
        self.points = OutputPoints(self.columns, between)

    def _see(self, block: Floats) -> None:
        for runner in self.runners:
            runner.hand_over()
        self.points.see(block)

    def advance(self) -> tuple[NumericalError | None, bool]:
        """Run all islands; return what stopped them, and whether that was the user."""
        failure: NumericalError | None = None
        interrupted = False
        with Interrupts() as interrupts:
            try:
                interrupted = self._advance(interrupts)
            except KeyboardInterrupt:
                interrupted = True
            except NumericalError as error:
                failure = error
            sink = self.request.sink
            if sink is not None and (failure is None or self.outlet.rows):
                sink.close()
        # what refers back to the run would keep its systems until garbage is collected
        self.races, self.outlet.watch = [], None
        return failure, interrupted

    def _advance(self, interrupts: Interrupts) -> bool:
        outlet, analysis, progress = self.outlet, self.analysis, self.request.progress
        if self.schedule is not None:
            from .controlled import advance_controlled, started

            self.runners = started(self.schedule, lambda: self._placed()[1], self.recorder)
            if self.delays is not None:
                self.delays.attend(self.runners, self.recorder)
            self._see_between()
        else:
            for runner in self.runners:
                runner.start()
                interrupts.check()
        runners = self.runners
        outlet.limits = lambda: limits(runners)
        if self.schedule is not None:
            return advance_controlled(
                self.runners, self.schedule, outlet, analysis, progress, interrupts, self.delays
            )
        if self.request.all_points:
            from .all_points import advance_points

            return advance_points(self.runners, outlet, analysis, progress, interrupts)
        return advance_all(
            self.runners, self.races, outlet, analysis.row_count, analysis, progress, interrupts
        )

    def solution(self, interrupted: bool) -> Solution:
        """Return what the islands have left."""
        request, runners, outlet = self.request, self.runners, self.outlet
        found = [runner.jumps() for runner in runners]
        jumps = sorted((j for told, _ in found for j in told), key=lambda j: j.time)
        table, deck = outlet.table, self.circuit.deck
        every = request.signals or deck.saves
        return Solution(
            "tran",
            deck.title,
            "time",
            table[:, 0],
            {name: table[:, 1 + k] for k, name in enumerate(self.names)},
            self.columns,
            events=Events.merged(runner.events() for runner in runners),
            impulses=[impulse for jump in jumps for impulse in jump.impulses],
            jumps=jumps,
            islands=[runner.report(n) for runner, (_, n) in zip(runners, found, strict=True)],
            certificate=Certificate.total(runner.certificate() for runner in runners)
            .at_rows(*violations(outlet, runners, self.begun))
            .without(self.skipped),
            interrupted=interrupted,
            wall_time=clock.perf_counter() - self._begin,
            row_count=outlet.rows,
            view=None if every else view_of(self.circuit, "tran", self.columns),
        )

    def warn(self, solution: Solution) -> None:
        """Say what the islands, the events and the distance of the rows give reason to say."""
        for runner, island in zip(self.runners, solution.islands, strict=True):
            solution.warnings += runner.warnings()
            island.unwatched = unwatched(runner)
        points, keep, table = self.points, self.request.keep, self.outlet.table
        if self.shown and keep:
            points.see(table)
        said = [left_lines(solution.events), points.warning()]
        if not self.shown and keep:
            points.see(table)  # all of them
        said.append(huge_currents(self.names, points.sizes))
        solution.warnings += [warning for warning in said if warning is not None]

    def keep_signals(self, solution: Solution) -> None:
        """Hand on what was recorded between the rows, and both sides of jumps."""
        if self.watched is not None:
            try:
                solution.recording = _recording(
                    self.circuit, self.runners, self.recorder.local, self.watched
                )
            except NumericalError:
                if not self.request.keep:  # nothing else is wanted
                    raise
        if self.request.keep and any(runner.sides for runner in self.runners):
            solution.fine = _Fine(self.runners, self.recorder, self.outlet.table)


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
