"""One island on its way through time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..circuit import Circuit, Island, MnaSystem
from ..errors import Diagnostic, UsageError
from ..problems.descriptor import Functional
from ..solvers.modewise import ModewiseStepper, NotModewise
from ..solvers.moreau import MoreauStepper, UnsolvedStep
from .cards import Tran
from .curve import Floats
from .failure import named_failure
from .impulses import impulses_of
from .initial import start
from .settings import Settings
from .solution import Event, Impulse, IslandRun

BUDGET = 0.05  # [s] longest stretch inside the core: Ctrl-C waits no longer
_POINTS = 1 << 16  # points of a static island planned at once


class IslandRunner:
    """One island on its way through time."""

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
    ) -> None:
        self.circuit, self.number, self.island = circuit, number, island
        self.analysis, self.settings = analysis, settings
        self.mna: MnaSystem = island.assemble(
            temperature, values or {}, tstep=analysis.row_distance, tstop=analysis.stop
        )
        system = self.mna.system
        self.step: float | None = None if system.static else analysis.solver_step(settings.step)
        self.width = len(names)
        self.charges: Floats | None = None
        self._planned = 0
        self.method, self.note = "point by point", ""
        functionals = [self.mna.functional(name) for name in names]
        self.stepper: MoreauStepper | ModewiseStepper = self._stepper(functionals)

    def _stepper(self, functionals: Sequence[Functional]) -> MoreauStepper | ModewiseStepper:
        """Return the solver that the settings and the system call for."""
        system, settings = self.mna.system, self.settings
        if self.step is None:
            return MoreauStepper(system, functionals)
        if settings.method == "modewise":
            try:
                stepper = ModewiseStepper(system, functionals)
            except NotModewise as reason:
                raise _refused(self.number, reason) from reason
            self.method = "modewise"
            return stepper
        self.method = "moreau"
        if settings.theta == 1.0:
            return MoreauStepper(system, functionals)
        from ..circuit.theta import theta_terms

        H, Hs = theta_terms(self.mna, settings.theta)
        return MoreauStepper(system, functionals, H=H, Hs=Hs)

    def start(self) -> None:
        """Find the first state and plan the instants."""
        analysis = self.analysis
        # the plan comes first: it tells the stepper whether switches act on a static circuit
        if self.step is None:
            self._plan_more()
        else:
            self.stepper.plan(0.0, analysis.stop, self.step, analysis.start, analysis.row_distance)
        try:
            self.charges = start(self.circuit, self.mna, self.stepper, analysis, self.step)
        except UnsolvedStep as problem:
            raise named_failure(self.circuit, self.mna, problem, starting=True) from problem

    def _plan_more(self) -> None:
        """Plan the next points of a static island: all at once could be more than memory holds."""
        first, self._planned = self._planned, self._planned + _POINTS
        assert isinstance(self.stepper, MoreauStepper)
        self.stepper.plan_points(self.analysis.rows(first, self._planned))

    def impulses(self) -> list[Impulse]:
        """Return the jumps so far as impulses of elements."""
        if self.step is None:
            return []
        state = self.stepper.state
        # an exact jump takes no time; a stepper's is spread over a part of a step
        step = 0.0 if self.method == "modewise" else self.step
        return impulses_of(self.mna, self.stepper.jumps, step, state, self.charges)

    def events(self) -> list[Event]:
        """Return the changes of set-valued elements so far."""
        pairs = self.mna.pairs
        return [
            Event(time, pairs[pair], "on" if on else "off")
            for time, pair, on in self.stepper.events
        ]

    def advance(self, rows: int) -> Floats:
        """Return the next rows, fewer than asked for if that takes too long."""
        try:
            block, done = self.stepper.advance(rows, BUDGET)
            if (
                done
                and isinstance(self.stepper, MoreauStepper)
                and self.step is None
                and self._planned < self.analysis.row_count
            ):
                self._plan_more()
            return block
        except UnsolvedStep as problem:
            raise Stopped(self.stepper.pending, problem) from problem

    def report(self) -> IslandRun:
        """Return how the island was solved."""
        system = self.mna.system
        moreau = self.method == "moreau"
        return IslandRun(
            self.number + 1,
            self.island.problem_class.name,
            self.island.reason,
            self.method,
            system.n,
            system.m,
            self.settings.theta if moreau else None,
            self.step if moreau else None,
            dict(self.stepper.statistics),
            self.note,
        )


def _refused(number: int, reason: NotModewise) -> UsageError:
    return UsageError(
        Diagnostic(
            "NS4020",
            f"method=modewise cannot treat island {number + 1}: {reason}",
            hint="method=auto chooses a method that can",
        )
    )


class Stopped(Exception):
    """A step failed after some rows."""

    def __init__(self, rows: Floats, problem: UnsolvedStep) -> None:
        super().__init__()
        self.rows, self.problem = rows, problem
