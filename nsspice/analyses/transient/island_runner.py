"""Runs one island through time by the method that was chosen for it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...circuit import Circuit, Island, MnaSystem
from ...circuit.blocks import Link
from ...errors import Diagnostic, NumericalError
from ...problems.descriptor import Functional
from ...solvers.implicit import ImplicitStepper
from ...solvers.modewise import ModewiseStepper, NotModewise
from ...solvers.moreau import MoreauStepper
from ...solvers.polynomial import Polynomial
from ...solvers.sdirk import Accuracy, SdirkStepper
from ...solvers.stepper import UnsolvedStep
from ..certificate.certificate import TAKEN_BESIDE_EXACT, Certificate
from ..certificate.failure import chatter, high_index, lost_path, named_failure, resting, unbounded
from ..certificate.first_state import FirstState
from ..certificate.followed_path import of_linearised
from ..certificate.hidden_motion import Between
from ..certificate.impulses import jumps_of, shared_at_start
from ..certificate.island_check import Examiner, judge_of_points, sampling
from ..request.cards import Tran
from ..request.cost_hints import sentence
from ..request.measured_signals import Watched
from ..request.method import POINTS, Choice, choose, choose_static, unless_modewise
from ..request.path_following import PATH_METHODS, Following
from ..request.periodic_sources import continued
from ..request.restart_state import Beginning, with_clock, with_gates, with_waveforms
from ..request.settings import Settings
from ..results.jumps import JumpReport
from ..signals.curve import Floats
from ..signals.events import Events
from ..signals.signal_function import Pieces, turning_points
from ..solution.solution import IslandRun
from ..static.initial import initial_voltages, start
from .blocks import begin, driven_by
from .outcomes import HighIndex, Stopped, jumps, refused
from .unused_initial_values import unkept

if TYPE_CHECKING:
    from ..certificate.regularity import Judge

_BEYOND = 1.1  # times the instant at which a path was lost: how far later points are tried
_FEW = 8  # implicit steps that are not worth a word
BUDGET = 0.05  # [s] longest call inside the core: Ctrl-C waits no longer
_WAIT = 1 << 17  # numbers recorded by all islands before they are checked: many at once cost less
_SHORT = 1e-9  # of the run
_NEVER = 1 << 62
_MENDED = 10.0  # times reltol: what errors of steps move when a mode ties stores to each other
_TOLD = 8  # turns of a sampled switch that are worth a word
_POINTS = 1 << 16  # points of a static island planned at once
_ROWS = 64  # of a run for its pieces alone
#: rows in a step of a static solution at most: a piece of it has two points for each
_ROWS_IN_STEP = 4


class IslandRunner:
    """Runs one island through time, in blocks of rows."""

    def __init__(
        self,
        circuit: Circuit,
        number: int,
        island: Island,
        names: Sequence[str],
        analysis: Tran,
        settings: Settings,
        temperature: float | None,
        values: Mapping[str, float] | None,
        *,
        sides: bool = False,
        watched: Watched | None = None,
        all_points: bool = False,
        aliases: bool = False,
        beginning: Beginning | None = None,
        periodic_sources: bool = False,
        links: Sequence[Link] = (),
        clock: Polynomial | None = None,
        whole: bool = False,
        delayed: Sequence[str] = (),
    ) -> None:
        self.circuit, self.number, self.island = circuit, number, island
        self._conditions = temperature, values
        self.analysis, self.settings = analysis, settings
        self.mna: MnaSystem = island.assemble(
            temperature, values or {}, tstep=analysis.row_distance, tstop=analysis.stop
        )
        if periodic_sources:
            waveforms = self.mna.system.waveforms
            sources = [w if w.handed is not None else continued(w) for w in waveforms]
            self.mna = with_waveforms(self.mna, sources)
        self._clock = clock
        if clock is not None:
            self.mna = with_clock(self.mna, clock)
        self.beginning = beginning
        if beginning is not None:
            self.mna = with_gates(self.mna, beginning.gates)
        system = self.mna.system
        self.step: float | None = None if system.static else analysis.solver_step(settings.step)
        self.width = len(names)
        self._names, self._watched = names, watched
        self.charges: tuple[Floats, float] | None = None
        self._shared: JumpReport | None = None
        self._first: FirstState | None = None
        self._planned = 0
        self._held: Floats | None = None
        self._high: tuple[float, list[bool]] | None = None
        self._wait = _WAIT // len(circuit.islands)
        #: rows on both sides of jumps, if they are wanted, and points between the rows
        self.sides: list[Floats] | None = [] if sides else None
        #: outputs that are followed between the rows
        self.followed: list[int] = []
        self._pieces: list[Floats] = []
        #: rows that are not handed on yet: those at extremes, and those of an interval which the
        #: engine has not left, whose extremes are still to come
        self._turns = np.empty((0, 1 + len(names)))
        self.curves: list[Pieces] = []  # all signals as polynomials
        self._early: list[Floats] = []
        if all_points:
            self.followed = list(range(len(names)))
        elif watched is not None:
            self.followed = [j for j, n in enumerate(names) if (number, n) in watched.parts]
        #: pieces of signals that drive delays, since they were taken
        self.delayed: list[Floats] = []
        self._delays = bool(delayed)
        if self._delays:
            own = [j for j, name in enumerate(names) if name in delayed]
            self.followed = list(dict.fromkeys([*self.followed, *own]))
        self.judge: Judge | None = None
        self._unkept: list[Diagnostic] = []
        self.all_points = all_points
        self.method, self.note = POINTS, ""
        functionals = [self.mna.functional(name) for name in names]
        if whole:  # all unknowns and functions behind the signals, for `stored`
            functionals += [Functional(z=((j, 1.0),)) for j in range(system.n)]
            count = 0 if system.smooth is None else system.smooth.tape.outputs.size
            functionals += [Functional(f=((k, 1.0),)) for k in range(count)]
        #: points between the output points
        self.between = Between(names, functionals, analysis.row_distance) if aliases else None
        self.stepper: ImplicitStepper | ModewiseStepper = self._stepper(functionals)
        #: what other blocks hand on to this one, and it to others
        self.inputs = [link for link in links if link.target == number]
        self.outputs = [link for link in links if link.source == number]
        self._watch()
        if self.followed and self.method != POINTS:
            window = (
                (analysis.start, analysis.stop)
                if all_points or watched is None or delayed
                else (watched.start, watched.stop)
            )
            self.stepper.follow(self.followed, *window)

    def _stepper(self, functionals: Sequence[Functional]) -> ImplicitStepper | ModewiseStepper:
        """Return the solver that the settings and the system call for."""
        system, settings = self.mna.system, self.settings
        following = Following.of(self.circuit.deck, settings.method)
        if following is not None:
            moreau = MoreauStepper(system, functionals)
            self.method = following.apply(moreau, self.island, system)
            return moreau
        static = self.step is None
        kind = self.island.problem_class
        choice = choose_static(system, settings) if static else choose(kind, system, settings)
        self.method, self.note = choice
        if self.method == "modewise":
            try:
                return ModewiseStepper(system, functionals)
            except NotModewise as reason:
                if settings.method == "modewise":
                    raise refused(self.number, reason) from reason
                other = Choice(POINTS, f"not modewise: {reason}")
                self.method, self.note = other if static else unless_modewise(reason, settings)
        if static and self.method != "sdirk" and not self.all_points and self._clock is None:
            return MoreauStepper(system, functionals)
        if static or self.method == "sdirk":
            # steps that follow a static solution have points of their own, also between the rows
            self.method = "sdirk"
            self.step = self._longest_step(static)
            return SdirkStepper(system, functionals, self._accuracy)
        if settings.theta == 1.0:
            return MoreauStepper(system, functionals)
        from ...circuit.theta import theta_terms

        H, Hs = theta_terms(self.mna, settings.theta)
        return MoreauStepper(system, functionals, H=H, Hs=Hs)

    def _longest_step(self, static: bool) -> float:
        """Return the longest step with error control [s].

        Static solutions have no errors of steps that would show how fast they change: what shows in
        the rows is seen between them, too.
        """
        longest = self.analysis.longest_step(self.settings.step, self.mna.system.timed)
        return min(longest, _ROWS_IN_STEP * self.analysis.row_distance) if static else longest

    @property
    def _accuracy(self) -> Accuracy:
        settings = self.settings
        energy = settings.accuracy == "energy"
        return Accuracy(settings.reltol, settings.vntol, settings.abstol, settings.order, energy)

    def _told(self) -> str:
        """Return what errors of steps were measured by, if that was asked for."""
        if self.settings.accuracy != "energy":
            return ""
        if self.stepper.statistics.get("energies"):
            return "errors as energies: means and powers are accurate, small ringing is damped"
        static = self.mna.system.static
        why = "no element stores energy" if static else f"{self.method} has no error control"
        return f"accuracy=energy has no effect: {why}"

    def _watch(self) -> None:
        """Choose which steps are recorded for the certificate."""
        system, stepper = self.mna.system, self.stepper
        stepper.watch_closely()
        self.judge = judge_of_points(self.mna, system) if self.step is None else None
        if isinstance(stepper, ModewiseStepper):
            # whether there are several solutions is a question of short steps here
            step = None if self.step is None else _SHORT * self.analysis.stop
            self.examiner = Examiner(self.mna, step=step, timed=True)
            stepper.watch(self.sides is not None)
            self.examiner.auditor.accompany(stepper)
            return
        distance = self.step or self.analysis.row_distance
        size = 2 * system.n + system.m + 2 * len(system.waveforms)
        every, window = sampling(self.analysis.stop / distance, size)
        if self.method == "sdirk":
            every = _NEVER  # it chooses itself; jumps and single implicit steps are left
        self.examiner = Examiner(self.mna, stepper.H, stepper.Hs, step=self.step, timed=True)
        stepper.watch(every, window, self.sides is not None)
        self.examiner.auditor.accompany(stepper)

    @property
    def drives(self) -> bool:
        """True for a block that can hand on what others are driven by, or need not."""
        return not self.outputs or isinstance(self.stepper, ModewiseStepper)

    def waits_for(self, running: Collection[int]) -> int | None:
        """Return a block that has to go on before this one can, of those that are still running."""
        late = [link for link in self.inputs if link.handed.end() <= self.stepper.time]
        return next((link.source for link in late if link.source in running), None)

    def start(self) -> None:
        """Find the first state, plan the instants, and let blocks that are driven begin there."""
        if self.outputs and isinstance(self.stepper, ModewiseStepper):
            places = [self._names.index(link.signal) for link in self.outputs]
            self.stepper.hand_on(places, [link.handed for link in self.outputs])
            self._start()
            for link in self.outputs:
                begin(link, self.mna, self.stepper)
        else:
            self._start()

    def _start(self) -> None:
        analysis = self.analysis
        # the plan comes first: it says to the stepper whether switches act on a static circuit
        rows = analysis.row_distance
        if self._by_points:
            self._plan_more()
        else:
            step = self.step or analysis.solver_step(self.settings.step)
            self.stepper.plan(0.0, analysis.stop, step, analysis.start, rows)
        if self.all_points:
            self.stepper.show_all_points(analysis.start)
        try:
            if self.beginning is not None and self.step is not None:
                charges = self.beginning.charges
                if isinstance(self.stepper, ModewiseStepper):
                    self.stepper.start_given(charges, self.beginning.gates)
                else:
                    self.stepper.start_charges(0.0, charges, self.step)
                self.charges = charges, self.beginning.energy
                return
            self.charges = start(self.circuit, self.mna, self.stepper, analysis, self.step)
        except UnsolvedStep as problem:
            raise named_failure(
                self.circuit, self.mna, problem, starting=True, given=analysis.uic
            ) from problem
        if self.step is not None and not self.stepper.jumps:
            point = self.stepper.dc_point
            wanted = None if point is None else self.mna.system.E.dot(point[0])
            wanted = wanted if self.charges is None else self.charges[0]
            if wanted is not None:
                self._first = FirstState.of(self.mna.system, wanted, self.stepper.beginning[0])
        deck = self.circuit.deck
        if analysis.uic and self.charges is not None and not self.stepper.jumps:
            given, state = initial_voltages(self.circuit, self.mna), self.stepper.beginning[0]
            self._shared = shared_at_start(self.mna, given, state, self.charges[1])
        if self.step is not None and (deck.initial or deck.nodesets):
            self._unkept = unkept(self.circuit, self.mna, self.stepper.beginning[0], analysis.uic)

    @property
    def _by_points(self) -> bool:
        """True for a static island that is solved at the rows alone: no step was asked for."""
        if self._polynomial or self.step is not None or self.settings.step is not None:
            return False
        return self.sides is None or not any(map(jumps, self.mna.system.waveforms))

    def _plan_more(self) -> None:
        """Plan the next points of a static island: all at once could be more than memory holds."""
        first, self._planned = self._planned, self._planned + _POINTS
        assert isinstance(self.stepper, MoreauStepper)
        self.stepper.plan_points(self.analysis.rows(first, self._planned))

    def stored(self) -> Beginning:
        """Return where the island is as the beginning of another run; it must be ``whole``."""
        system, row = self.mna.system, self.stepper.at_wait()
        assert row is not None
        z, f = np.split(np.array(row[1 + len(self._names) :]), [system.n])
        charges = system.E.dot(z)
        if system.smooth is not None:
            charges = charges + system.smooth.Q.dot(f)
        return Beginning(charges, list(self.stepper.gates), 0.5 * float(z @ charges))

    def jumps(self) -> tuple[list[JumpReport], int]:
        """Return the jumps so far, with the impulses of elements, and how many are not reported."""
        jumps = self.stepper.jumps
        shared = [] if self._shared is None else [self._shared]
        if self.step is None or not jumps:
            return shared, 0
        state = self.stepper.state
        # an exact jump takes no time; a stepper's is spread over a part of a step
        step = 0.0 if self.method == "modewise" else self.step
        tolerance = _MENDED * self.settings.reltol if self.method == "sdirk" else 0.0
        given = initial_voltages(self.circuit, self.mna)
        told = jumps_of(self.mna, jumps, step, state, self.charges, tolerance, given)
        return shared + told, len(jumps) - len(told)

    def certificate(self) -> Certificate:
        """Return the verdict on the run so far."""
        self.hand_over()
        if self.stepper.dc_records is not None:
            # what a network at rest has is rounding: the run shows how large its currents become
            self.examiner.take(self.stepper.dc_records)
            self.stepper.dc_records = None
        stats, jumps = self.stepper.statistics, self.stepper.jumps
        exact, sums = self.method == "modewise", self.stepper.balance
        certificate = self.examiner.certificate(
            int(stats["segments"] + stats["fixed_steps"] if exact else stats["steps"]),
            int(stats["undetermined"]),
            jumps,
            self.charges,
            len(jumps) == stats["jumps"],
            sums,
            self.stepper.turns,
            self.settings.reltol if self.method == "sdirk" else 0.0,
            self.stepper.looked_at if isinstance(self.stepper, ModewiseStepper) else None,
        )
        energy = certificate.energy
        if energy is not None and self._shared is not None:
            lost = self._shared.lost
            energy = replace(energy, stored=energy.stored - lost, lost=energy.lost + lost)
            certificate = replace(certificate, energy=energy)
        if exact and energy is not None:
            taken, granted = energy.share(float(stats["taken"])), TAKEN_BESIDE_EXACT
            certificate = replace(certificate, taken=taken, granted=granted)
        elif self.method == "sdirk" and energy is not None:
            missed = 0.0 if sums is None else sums["step_error"]
            certificate = replace(certificate, taken=energy.taken, missed=missed)
        if self._first is not None:
            turned = 0.0 if energy is None else energy.turned
            certificate = certificate.at_start(self._first.error(turned))
        # how far controls of sampled switches had passed their thresholds at most
        late = max((late for _, _, late in self.stepper.chattering[0]), default=0.0)
        if late:
            certificate = replace(certificate, late=late / self.settings.reltol)
        followed = self.method in PATH_METHODS
        return of_linearised(certificate, stats) if followed else certificate

    @property
    def sampled(self) -> list[str]:
        """Switches that chatter, and therefore turn when they look at their controls."""
        return [self.mna.pair_elements[pair] for pair, _, _ in self.stepper.chattering[0]]

    def warnings(self) -> list[Diagnostic]:
        """Return what the start, the certificate and the steps have to say."""
        sampled, interval = self.stepper.chattering
        told = [k for k, turns, late in sampled if turns >= _TOLD or late > self.settings.reltol]
        elements = dict.fromkeys(self.mna.pair_elements[pair] for pair in told)
        found = [*self._unkept, *self.examiner.warnings()]
        if elements:
            found.append(chatter(self.circuit, list(elements), interval))
        rested: dict[str, float] = {}
        for pair, time in self.stepper.resting:
            element = self.mna.pair_elements[pair]
            rested[element] = min(time, rested.get(element, time))
        found += resting(self.circuit, rested)
        if self.method == "moreau" and self.settings.method == "auto" and not self.settings.stepped:
            names = ", ".join(d.name for d in self.island.devices[:3])
            found.append(
                Diagnostic(
                    "NS3069",
                    f"steps of first order around {names}, with an error that nothing controls",
                    hint=f"{self.note}; or set a shorter step= and compare",
                    severity="warning",
                )
            )
        if (torn := self.stepper.unbounded) is not None:
            found.append(unbounded(self.circuit, self.mna, *torn))
        return found

    def hand_over(self) -> None:
        """Take what the solver has left for the checks and the measures."""
        if not self.stepper.waiting:
            return
        if isinstance(self.stepper, ModewiseStepper | SdirkStepper):
            # first: they show how large currents and voltages become
            intervals = self.stepper.take_intervals()
            self.examiner.take_intervals(intervals)
            if self.between is not None:
                self.between.take(intervals)
            if self.judge is not None:
                self.judge.take_intervals(intervals)
        records = self.stepper.take_records()
        self.examiner.take(records)
        if self.judge is not None:
            self.judge.take(records)
        if self.sides is not None and (rows := self.stepper.take_sides()).size:
            self.sides.append(rows)
        if self.followed and self._polynomial and (pieces := self.stepper.take_pieces()).size:
            if self._watched is not None:
                self._pieces.append(pieces)
            if self._delays:
                self.delayed.append(pieces)
            if self.all_points:
                self.curves.append(Pieces.of_record(pieces, len(self.followed)))
                self._turns = np.concatenate([self._turns, turning_points(self.curves[-1])])

    @property
    def _polynomial(self) -> bool:
        return isinstance(self.stepper, ModewiseStepper | SdirkStepper)

    def record(self) -> Pieces | None:
        """Return what was recorded of the followed outputs, None if nothing was."""
        self.hand_over()
        count = len(self.followed)
        if count and self.method == POINTS:
            return self._followed_points()
        if self._pieces:
            return Pieces.of_record(np.concatenate(self._pieces), count)
        if self.followed and self.sides and not self._polynomial:
            rows = np.concatenate(self.sides)
            return Pieces.of_rows(rows[:, 0], rows[:, 1:].T[self.followed])
        return None

    def _followed_points(self) -> Pieces | None:
        """Return the followed outputs of an island that is solved at the rows alone.

        Steps with error control follow the solution from one row to the next.
        """
        analysis, system, watched = self.analysis, self.mna.system, self._watched
        assert watched is not None
        outputs = [self.mna.functional(self._names[j]) for j in self.followed]
        stepper = SdirkStepper(system, outputs, self._accuracy)
        stepper.follow(range(len(outputs)), watched.start, watched.stop)
        until = min(analysis.stop, watched.stop)
        stepper.plan(0.0, until, self._longest_step(static=True), 0.0, analysis.stop)
        parts, done = [], False
        try:
            start(self.circuit, self.mna, stepper, analysis, None)
            while not done:
                _, done = stepper.advance(_ROWS, BUDGET)
                stepper.take_intervals()
                stepper.take_records()
                parts.append(stepper.take_pieces())
        except UnsolvedStep as problem:
            raise named_failure(self.circuit, self.mna, problem) from problem
        return Pieces.of_record(np.concatenate(parts), len(outputs))

    def events(self) -> Events:
        """Return the changes of set-valued elements so far."""
        return Events(*self.stepper.events, self.mna.pairs)

    def take_over(self, other: IslandRunner, row: Floats) -> None:
        """Go on in place of another runner of the same island, whose rows have been shown.

        The row after them, (1, columns), is the next one.
        """
        self.between, self._held = other.between, row

    def advance(self, rows: int, into: Floats | None = None) -> Floats:
        """Return the next rows, fewer than asked for if that takes too long."""
        if self._held is not None:
            block, self._held = self._held, None
            if into is None:
                return block
            into[:1] = block
            return into[:1]
        try:
            block, done = self.stepper.advance(rows, BUDGET, into)
            if self.stepper.waiting > self._wait:
                self.hand_over()
            if done and self._by_points and self._planned < self.analysis.row_count:
                self._plan_more()
            return self._followed_up_to(block)
        except UnsolvedStep as problem:
            raise self._stopped(self.stepper.pending, problem) from problem

    def advance_points(self, rows: int) -> tuple[Floats, bool]:
        """Return the next rows at all points, and whether they are the last."""
        try:
            block, done = self.stepper.advance(rows, BUDGET)
            return self._followed_up_to(self._with_turns(block, done)), done
        except UnsolvedStep as problem:
            block = self._with_turns(self.stepper.pending, True)
            raise self._stopped(block, problem) from problem

    def _stopped(self, block: Floats, problem: UnsolvedStep) -> Stopped:
        """Return the end of a run; without a contradiction the mode may say why."""
        if problem.certificate is None:
            try:
                block = self._followed_up_to(block)
            except Stopped as high:
                return high
        return Stopped(block, problem)

    def _followed_up_to(self, block: Floats) -> Floats:
        """Return the next rows; stop at a mode that steps with error control cannot judge."""
        if isinstance(self.stepper, SdirkStepper) and (high := self.stepper.above_two()):
            self._high = high
            rows = block[: int(np.searchsorted(block[:, 0], high[0], side="right"))]
            raise Stopped(rows, HighIndex(high[0], np.nan, None))
        return block

    def _with_turns(self, rows: Floats, done: bool) -> Floats:
        """Return the rows of an engine, and at extremes, up to the point that it has reached."""
        self.hand_over()
        reached = np.inf if done else self.stepper.time
        if self._early and reached <= self._early[0][0, 0]:
            self._early.append(rows.copy())
            return rows[:0]
        rows = np.concatenate([*self._early, rows])
        known = int(np.searchsorted(rows[:, 0], reached))
        rows, late = rows[:known], rows[known:].copy()
        self._early = [late] if late.size else []
        count = int(np.searchsorted(self._turns[:, 0], reached))
        turns, self._turns = self._turns[:count], self._turns[count:]
        if not count:
            return rows
        return np.insert(rows, np.searchsorted(rows[:, 0], turns[:, 0]), turns, axis=0)

    def failure(self, problem: UnsolvedStep) -> NumericalError:
        """Return the error to raise for a step that was not solved.

        Where a path was followed, solving point by point shows whether its step was too long, or
        the path ends.
        """
        if self._high is not None and isinstance(problem, HighIndex):
            return high_index(self.circuit, self.mna, *self._high)
        if self.method not in PATH_METHODS:
            return named_failure(self.circuit, self.mna, problem)
        settings = replace(self.settings, method="auto", step=None)
        apart = IslandRunner(
            self.circuit, self.number, self.island, [], self.analysis, settings, *self._conditions
        )
        try:
            apart.start()
            while apart.stepper.time < _BEYOND * problem.time and apart.advance(_POINTS).shape[0]:
                pass
        except Stopped as stopped:
            return named_failure(self.circuit, self.mna, stopped.problem)
        return lost_path(self.method, problem)

    def report(self, hidden: int) -> IslandRun:
        """Return how the island was solved; so many jumps are not reported, and do not count."""
        self.hand_over()
        system = self.mna.system
        moreau = self.method == "moreau"
        stats = dict(self.stepper.statistics)
        if "jumps" in stats:
            stats["jumps"] -= hidden
        if self.method == "modewise" and stats["fixed_steps"] > _FEW:
            why = self.stepper.trouble if isinstance(self.stepper, ModewiseStepper) else None
            reason = f"a mode could not be reduced: {why}" if why else "events accumulated"
            self.note = f"implicit steps where {reason}"
            if stats["accumulation"]:
                self.note = "events are too frequent to be located one by one: implicit steps"
        if self.inputs:
            self.note = "; ".join(filter(None, [driven_by(self.inputs), self.note]))
        return IslandRun(
            self.number + 1,
            self.island.problem_class.name,
            self.island.reason,
            self.method,
            system.n,
            system.m,
            self.settings.theta if moreau else None,
            self.step if moreau or self.method == "sdirk" else None,
            stats,
            "; ".join(filter(None, (self.note, self._told()))),
            self.settings.reltol if self.method == "sdirk" else None,
            self.judge.later() if self.judge is not None else None,
            sentence(self.circuit, self.island, self.mna, self.method, self.note, self.analysis),
        )
