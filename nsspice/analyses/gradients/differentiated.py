"""Derivatives of measures by any number of parameters: one run, and one pass backwards for each.

The run is that of the exact engine, recorded segment by segment, and the pass is in the core
(:meth:`nsspice._core.Orbit.gradient`); or it is one by steps (:mod:`.stepped`).  It costs the same
for one parameter or a hundred.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...errors import NsspiceError
from ...netlist.deck import TranCard
from ...problems.tape import Tape
from ...solvers.modewise import NotModewise, refusal
from ...solvers.orbit import NoDerivative, PeriodMap, State
from ...solvers.stepped_map import finer
from ...solvers.stepper import UnsolvedStep
from ..averages.integrable_run import integrals_of
from ..averages.integrals import Integrals
from ..request.cards import Tran
from ..request.method import choose, choose_static
from ..request.periodic_sources import continued
from ..request.request import Request
from ..request.restart_state import with_waveforms
from ..signals.curve import Floats
from ..solution.solution import Solution
from ..transient.blocks import split
from ..transient.transient import Rerun
from .beginning import Beginning
from .drivers import Driven, driven
from .functional import Functional, Linearised
from .goals import goal_of
from .instants import moved_instants
from .refusals import at_a_tie, no_derivative, unbounded, undone
from .sources import NotDifferentiable, edges, period_by
from .stepped import Course, SteppedRun
from .stepped_goals import Aims
from .traced import Traced, traced
from .variation import Decks, Parameter, apart, of_cards, of_island, with_value

#: relative difference of derivatives that are not those of one extreme
_TIE = 1e-6
#: of a run: what is added to it
_BEYOND = 2.0**-30
#: tolerance of a run whose steps close a free period
_CLOSED = 1e-8


class Differentiated:
    """A solution with the derivatives of its measures.

    Parameters
    ----------
    circuit : Circuit
    solution : Solution
        Of a transient or a periodic steady state of it, with its measures.
    integrals : Integrals or None
        Of the same run; None if steps have found it.
    analysis : Tran or None
        None of a periodic steady state.
    request : Request
        With its conditions.
    trigger : str or None
        Signal that ends a free period.
    """

    def __init__(
        self,
        circuit: Circuit,
        solution: Solution,
        integrals: Integrals | None,
        analysis: Tran | None,
        request: Request,
        trigger: str | None = None,
    ) -> None:
        self._circuit, self._solution, self._integrals = circuit, solution, integrals
        self._analysis, self._request, self._trigger = analysis, request, trigger
        self._linear = Linearised(circuit, solution)
        self._traced: Traced | None = None

    def derivatives(
        self, measures: Sequence[str], parameters: Sequence[Parameter], decks: Decks
    ) -> Floats:
        """Return the derivatives of measures by parameters, shape (measures, parameters).

        Raises
        ------
        UsageError
            NS4041, NS4042 where there is none, or none is known.
        NumericalError
            NS3068 if a switching has none, with its instant.
        """
        functionals = [self._linear[name] for name in measures]
        ties = [tie for tie in self._linear.ties if tie.measure in measures]
        functionals += [tie.functional for tie in ties]
        found = np.zeros((len(functionals), len(parameters)))
        self._traced = traced(decks.circuit, parameters)
        cards = self._of_cards(decks, parameters)
        names = list(dict.fromkeys(n for f in functionals for n in f.signals()))
        parts = {name: self._circuit.parts(name) for name in names}
        for home in sorted({h for terms in parts.values() for h, _, _ in terms}):
            local = {
                name: [(part, f) for h, part, f in terms if h == home]
                for name, terms in parts.items()
            }
            found += self._of_island(home, local, functionals, parameters, decks, cards)
        for j, numbers in enumerate(cards):
            for k, functional in enumerate(functionals):
                for key, slope in functional.numbers.items():
                    found[k, j] += slope * numbers[key] if key in numbers else 0.0
        if np.isnan(found).any():
            k, j = np.argwhere(np.isnan(found))[0]
            name = [*measures, *(tie.measure for tie in ties)][k]
            raise undone(f"{name} has no derivative by it", parameters[j].target.name)
        for tie, other in zip(ties, found[len(measures) :], strict=True):
            row = found[measures.index(tie.measure)]
            sizes = np.abs(np.array([p.value or 1.0 for p in parameters]))
            if np.abs((row - other) * sizes).max(initial=0.0) > _TIE * np.abs(row * sizes).max(
                initial=0.0
            ):
                raise at_a_tie(tie.measure, tie.times)
        return found[: len(measures)]

    def _of_cards(self, decks: Decks, parameters: Sequence[Parameter]) -> list[dict[Any, float]]:
        """Return the derivatives of the numbers on measures by each parameter."""
        analysis = self._solution.analysis
        if self._traced is not None:
            try:
                return self._traced.of_cards(analysis)
            except ArithmeticError:
                self._traced = None  # a function without a traced derivative
        return [of_cards(decks, p, analysis) for p in parameters]

    def _changes(
        self,
        decks: Decks,
        parameters: Sequence[Parameter],
        home: int,
        mna: MnaSystem,
        names: Sequence[str],
    ) -> list[dict[Any, float]]:
        """Return the derivatives of an island's numbers by each parameter."""
        periodic = self._analysis is None
        if self._traced is not None and np.array_equal(mna.system.storage.data, mna.system.E.data):
            try:
                return self._traced.of_island(home, mna, names, periodic, not periodic)
            except (ArithmeticError, IndexError, NsspiceError):
                pass  # differences know, or say why not
        changed = _continued if periodic else _as_it_is
        island_of = self._circuit.element_island
        return [
            of_island(decks, p, home, mna, names, changed)
            if p.target.kind != "element" or island_of[p.target.name] == home
            else {}
            for p in parameters
        ]

    def _of_island(
        self,
        home: int,
        local: Mapping[str, Sequence[tuple[str, float]]],
        functionals: Sequence[Functional],
        parameters: Sequence[Parameter],
        decks: Decks,
        cards: Sequence[dict[Any, float]],
    ) -> Floats:
        if self._integrals is None or self._by_steps(home):
            return self._stepped(home, local, functionals, parameters, decks, cards)
        course = self._integrals.course(home)
        periodic = self._analysis is None
        if course.stop is None:
            raise undone("circuits with a free period are not differentiated", "trigger=")
        names = list(dict.fromkeys(part for terms in local.values() for part, _ in terms))
        changed = _continued if periodic else _as_it_is
        mna = changed(apart(self._circuit, home, course.mna, course.mna.layout.conditions))
        changes = self._changes(decks, parameters, home, mna, names)
        beginning = None
        if self._analysis is not None:
            beginning = Beginning(self._circuit, mna, self._analysis)
        # the segment that begins at the end shows what would be different beyond it
        stop = course.stop if periodic else course.stop * (1.0 + _BEYOND)
        try:
            acting = driven(mna, names, changes, stop)
            periods = np.zeros(len(parameters))
            if periodic:
                periods += [period_by(mna.system.waveforms, change, stop) for change in changes]
            for numbers, slope in zip(cards, periods.tolist(), strict=True):
                if slope:
                    numbers["stop",] = slope
            core = self._run(course.state, mna, acting, stop).core
            events = np.array([event[0] for event in core.commutations(periodic)])
            rows = []
            for functional in functionals:
                goal = goal_of(functional, local, names, events, stop)
                result = core.gradient(acting.drivers, periodic, **goal)
                if result is None:
                    raise unbounded()
                by_drivers, charges, instants, by_period = result
                row = by_period * periods
                np.add.at(row, np.array(acting.owners, dtype=np.intp), by_drivers)
                if beginning is not None:
                    row += beginning.derivatives(charges, changes)
                row += moved_instants(mna.system.waveforms, changes, instants, stop, periodic)
                rows.append(row)
        except NotDifferentiable as why:
            raise undone(str(why), "a source") from None
        return np.array(rows)

    def _by_steps(self, home: int) -> bool:
        """Return whether an island is run by steps with error control."""
        assert self._integrals is not None
        if self._analysis is None:
            return False
        if self._integrals.driven:
            return True  # blocks of one island, which is run as a whole
        island = self._circuit.islands[home]
        system = self._assembled(home, self._analysis).system
        settings = self._request.settings(self._circuit.deck)
        if system.static:
            name = choose_static(system, settings).name
        else:
            name = choose(island.problem_class, system, settings).name
        if name == "moreau":
            raise undone("steps of fixed length are not differentiated", f"island {home + 1}")
        return name != "modewise" or refusal(system) is not None

    def _assembled(self, home: int, analysis: Tran) -> MnaSystem:
        return self._circuit.islands[home].assemble(
            self._request.temperature,
            self._request.values,
            tstep=analysis.row_distance,
            tstop=analysis.stop,
        )

    def _stepped(
        self,
        home: int,
        local: Mapping[str, Sequence[tuple[str, float]]],
        functionals: Sequence[Functional],
        parameters: Sequence[Parameter],
        decks: Decks,
        cards: Sequence[dict[Any, float]],
    ) -> Floats:
        """Return the same of an island that is run by steps."""
        again = self._solution.again
        if not isinstance(again, Rerun):
            raise undone("it cannot be run once more", "the run")
        periodic = self._analysis is None
        beginning = again.beginnings[home] if again.beginnings else None
        settings, trigger = again.settings, None
        changed = _continued if periodic else _as_it_is
        mna = self._assembled(home, again.analysis)
        if self._trigger is not None:
            ((where, local_name, _),) = self._circuit.parts(self._trigger)
            if where != home:
                raise undone("another part of the circuit ends the period", "trigger=")
            # steps do not know the period as exactly as they found it
            settings = replace(settings, reltol=min(settings.reltol, finer(_CLOSED)))
            trigger = mna.functional(local_name)
        course = Course(again.analysis, settings, beginning, periodic, trigger)
        mna = changed(apart(self._circuit, home, mna, mna.layout.conditions))
        names = list(dict.fromkeys(part for terms in local.values() for part, _ in terms))
        changes = self._changes(decks, parameters, home, mna, names)
        stop = course.analysis.stop
        instants = np.array([event.time for event in self._solution.events])
        sides = np.array([t for w in mna.system.waveforms for e in edges(w, stop) for t in e.times])
        near = np.concatenate([instants, sides])

        def tape_at(parameter: Parameter, value: float) -> Tape:
            smooth = with_value(decks, parameter, value, home, mna, changed)[1].system.smooth
            assert smooth is not None
            return smooth.tape

        try:
            aims = Aims([goal_of(f, local, names, near, stop) for f in functionals], stop)
            acting = driven(mna, names, changes, stop)
            periods = np.array([numbers.get(("level",), 0.0) for numbers in cards])
            if periodic and trigger is None:
                periods += [period_by(mna.system.waveforms, change, stop) for change in changes]
            run = SteppedRun(self._circuit, mna, course, acting, names, aims.marks())
            found = run.derivatives(aims, changes, periods, parameters, tape_at)
            if trigger is not None:
                found, periods = found[:-1], found[-1]
            for numbers, slope in zip(cards, periods.tolist(), strict=True):
                if slope:
                    numbers["stop",] = slope
            return found
        except NotDifferentiable as why:
            raise undone(str(why), "a source") from None
        except NoDerivative as problem:
            raise no_derivative(problem, mna) from problem
        except UnsolvedStep as problem:
            raise undone(f"repeated with shorter steps, {problem}", "the run") from problem

    def _run(self, state: State, mna: MnaSystem, acting: Driven, stop: float) -> PeriodMap:
        try:
            period_map = PeriodMap(
                acting.system, stop, acting.outputs, acting.stimuli, acting.offsets
            )
            period_map.run(state)
            period_map.derivative()
        except NotModewise as reason:
            raise undone(f"the run has no closed form: {reason}", "the run") from reason
        except NoDerivative as problem:
            raise no_derivative(problem, mna) from problem
        return period_map


def _as_it_is(mna: MnaSystem) -> MnaSystem:
    return mna


def _continued(mna: MnaSystem) -> MnaSystem:
    return with_waveforms(mna, [continued(w) for w in mna.system.waveforms])


def differentiated(
    circuit: Circuit, solution: Solution, card: Any, values: Mapping[str, float]
) -> Differentiated:
    """Return a solution whose measures can be differentiated.

    Parameters
    ----------
    circuit : Circuit
    solution : Solution
    card : TranCard or PssCard
    values : mapping of str to float
        Of elements, in place of those of the deck.

    Raises
    ------
    UsageError
        NS4041 if it was found by steps of fixed length.
    """
    request = Request(values=values)
    if not isinstance(card, TranCard):
        integrals = solution.integrals if card.trigger is None else None
        return Differentiated(circuit, solution, integrals, None, request, card.trigger)
    if card.orbit:
        raise undone("a transient that begins in the steady state is not differentiated", ".tran")
    settings = request.settings(circuit.deck)
    if settings.method not in ("auto", "modewise", "sdirk"):
        raise undone(f"steps of {settings.method} are not differentiated", ".tran")
    analysis = Tran.from_card(card)
    integrals = None
    if settings.method != "sdirk":
        blocks = split(circuit, settings, analysis, request)
        integrals = solution.integrals or integrals_of(blocks, analysis, request)
    return Differentiated(circuit, solution, integrals, analysis, request)
