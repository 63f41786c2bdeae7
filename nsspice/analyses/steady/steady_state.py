"""Periodic steady state: the orbit of each island, and one period of waveforms on it."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ...circuit import Circuit, Island, MnaSystem
from ...errors import Diagnostic, Span, UsageError
from ...netlist.deck import PssCard
from ...problems.descriptor import DescriptorSystem
from ...solvers.modewise import ModewiseStepper, NotModewise
from ...solvers.orbit import (
    PERIODS,
    Found,
    NoDerivative,
    NoOrbit,
    PeriodMap,
    State,
    find_orbit,
    with_trigger,
)
from ...solvers.sdirk import Accuracy
from ...solvers.shooting import find_stepped_orbit
from ...solvers.stepped_map import StepMap, finer
from ...solvers.stepper import UnsolvedStep
from ..averages.integrals import Course, Integrals
from ..certificate.failure import named_failure
from ..request.arguments import finite, instant_of
from ..request.cards import Tran
from ..request.load import need_circuit
from ..request.measured_signals import Watched
from ..request.period import common, is_multiple
from ..request.periodic_sources import common_period, continued, period_of
from ..request.request import Neighbour, Request, named_controllers
from ..request.restart_state import Beginning, with_waveforms
from ..request.sampled import refuse_delays, refuse_sampled
from ..request.settings import Settings
from ..request.values import checked_values
from ..results.periodic import Periodic
from ..solution.refusal import check_on_failure, judge
from ..solution.solution import Solution
from ..transient.transient import run_tran
from .steady_failure import no_closed_form, no_derivative, no_orbit, no_period, stored_names

if TYPE_CHECKING:
    from ..request.controller import Controller

_MULTIPLIERS = 64  # kept in a report


@dataclass(frozen=True, slots=True)
class Pss:
    """What is asked for.

    Parameters
    ----------
    period : float or None
        [s]; None if the sources or a trigger decide about it.
    trigger : str or None
        Signal whose rise through ``level`` begins each period.
    level : float
        [V or A]
    settle : float
        Time that is run before Newton's method begins [s].
    row_step : float or None
        Distance of the output rows [s]; a thousandth of the period if left out.
    span : Span or None
        Of the card.
    """

    period: float | None = None
    trigger: str | None = None
    level: float = 0.0
    settle: float = 0.0
    row_step: float | None = None
    span: Span | None = None

    @classmethod
    def from_card(cls, card: PssCard) -> Pss:
        """Return the analysis of a card."""
        return cls(card.period, card.trigger, card.level, card.tstab, card.tstep, card.span)


@dataclass(frozen=True, slots=True)
class Orbit:
    """The periodic orbit of one island.

    Parameters
    ----------
    mna : MnaSystem
        With its sources continued into the past.
    system : DescriptorSystem
        What was solved: that of the island, with the trigger's switch if it has one.
    found : Found
    accuracy : Accuracy
        Of a run of the deck by steps.
    """

    mna: MnaSystem
    system: DescriptorSystem
    found: Found
    accuracy: Accuracy

    @property
    def stepped(self) -> bool:
        """True if it was found by steps with error control, which have no closed form."""
        return self.found.tolerance > 0.0

    @property
    def beginning(self) -> Beginning:
        """The state in which a period begins."""
        gates = self.found.state.gates[: len(self.mna.system.switches)]
        energy = 0.5 * float(self.found.state.energy @ self.found.state.energy)
        return Beginning(self.found.charges, gates, energy)


def pss(
    circuit: Circuit,
    period: float | None = None,
    *,
    trigger: str | None = None,
    level: float = 0.0,
    settle: float = 0.0,
    row_step: float | None = None,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
    all_points: bool = False,
    controllers: Sequence[Controller] = (),
    on_failure: str = "raise",
) -> Solution:
    """Find the periodic steady state and return one period of it.

    Parameters
    ----------
    circuit : Circuit
        From :func:`nsspice.read`.
    period : float, optional
        [s]; by default that of the deck's ``.pss`` card, otherwise the common period of the
        sources.
    trigger : str, optional
        Signal whose rise through ``level`` [V or A] starts each period, in self-oscillating
        circuits.
    level : float
    settle : float
        Time to run from the initial values before Newton's method starts [s].
    row_step : float, optional
        Row spacing [s]; a thousandth of the period by default.
    signals, extra, temperature, values, all_points, controllers, on_failure
        As for :func:`nsspice.tran`.  What a controller remembers is part of the steady state: its
        function shows it as ``state``, a list of numbers.

    Returns
    -------
    Solution
        Rows from 0 to the period; ``periodic`` holds period, multipliers and verdict.

    Raises
    ------
    NumericalError
        If no periodic orbit was found; the message says why.
    CertificateError
        NS3003 if the certificate fails, unless ``on_failure`` says otherwise.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''chopped RC
    ... V1 a 0 PULSE(0 1 0 0 0 5u 10u)
    ... R1 a b 1k
    ... C1 b 0 10n
    ... ''')
    >>> sol = nsspice.pss(circuit)
    >>> sol.periodic.period, sol.periodic.verdict
    (1e-05, 'stable')
    >>> abs(float(sol["v(b)"][0]) - 1 / (1 + 2.718281828459045**0.5)) < 1e-15
    True
    """
    need_circuit(circuit)
    check_on_failure(on_failure)
    if period is not None:
        instant_of(period, "a period", above_zero=True)
    instant_of(settle, "the time to settle")
    if not finite(level):
        hint = "give a finite number"
        raise UsageError(Diagnostic("NS4005", f"the level cannot be {level!r}", hint=hint))
    card = next((c for c in circuit.deck.analyses if isinstance(c, PssCard)), None)
    analysis = Pss(period, trigger, level, settle, row_step)
    if card is not None and period is None and trigger is None:
        asked = Pss.from_card(card)
        analysis = replace(
            asked, row_step=row_step or asked.row_step, settle=settle or asked.settle
        )
    request = Request(
        signals=signals,
        extra=extra,
        all_points=all_points,
        temperature=temperature,
        values=checked_values(circuit, values),
        controllers=named_controllers(circuit, controllers),
    )
    solution = run_pss(circuit, analysis, request)
    judge([solution], on_failure)
    return solution


def run_pss(circuit: Circuit, analysis: Pss, request: Request) -> Solution:
    """Run one analysis of the periodic steady state; see :func:`pss`."""
    refuse_delays(circuit.deck, ".pss")
    controllers = request.all_controllers(circuit)
    if controllers:
        return _controlled(circuit, analysis, request, controllers)
    begin = clock.perf_counter()
    period, orbits = find_orbits(circuit, analysis, request)
    # orbits are found by methods of their own, and shown by them
    settings = replace(Settings.of(circuit.deck, "auto"), theta=1.0, step=None, stepped=False)
    if any(o is not None and o.stepped for o in orbits):
        settings = replace(settings, reltol=finer(settings.reltol))  # so that the period closes
    cycle = Tran(period, analysis.row_step)
    solution = run_tran(
        circuit,
        cycle,
        settings,
        replace(request, keep=True, progress=None),
        # a run of its own for peaks and crossings would cost as much again
        watched=Watched.of(circuit, cycle, kind="pss", every=request.record)
        if request.extra
        else None,
        beginnings=[None if o is None else o.beginning for o in orbits],
        periodic_sources=True,
    )
    solution.analysis = "pss"
    solution.periodic = report(period, orbits)
    solution.wall_time = clock.perf_counter() - begin
    if solution.periodic.free:
        solution.warnings.append(_free(analysis, solution.periodic))
    if any(o is not None and o.stepped for o in orbits):
        return solution  # measures take the recorded steps

    def course_of(home: int) -> Course:
        orbit = orbits[home]
        if orbit is None:
            orbit = static_orbit(circuit, home, analysis, period, request)
        triggered = len(orbit.system.switches) > len(orbit.mna.system.switches)
        return Course(orbit.mna, orbit.system, orbit.found.state, None if triggered else period)

    given = request.temperature
    ambient = circuit.deck.temperature if given is None else given
    solution.integrals = Integrals(circuit, course_of, (0.0, period), True, ambient)
    return solution


def _controlled(
    circuit: Circuit, analysis: Pss, request: Request, controllers: tuple[Controller, ...]
) -> Solution:
    """Run one analysis of the periodic steady state with controllers."""
    from .controlled_orbit import common_of, find_controlled_orbit

    begin = clock.perf_counter()
    if analysis.trigger is not None:
        message = "controllers are called at instants of their own: no trigger begins a period"
        raise UsageError(Diagnostic("NS4005", message, analysis.span, "remove the trigger"))
    period = common_of(circuit, controllers, analysis.period, request)
    if period is None:
        raise no_period(analysis.span, True)
    settings = replace(Settings.of(circuit.deck, "auto"), theta=1.0, step=None, stepped=False)
    orbit = find_controlled_orbit(circuit, controllers, period, settings, request, analysis.settle)
    solution = run_tran(
        circuit,
        Tran(period, analysis.row_step),
        orbit.settings,
        replace(request, keep=True, progress=None),
        beginnings=orbit.begin.islands,
        periodic_sources=True,
        controllers=orbit.controllers,
        memory=orbit.begin.memory,
    )
    solution.analysis, solution.periodic = "pss", orbit.periodic
    solution.wall_time = clock.perf_counter() - begin
    return solution


def find_orbits(
    circuit: Circuit, analysis: Pss, request: Request
) -> tuple[float, list[Orbit | None]]:
    """Return the period [s] and the orbit of each island, None for those that store nothing."""
    refuse_sampled(circuit.deck, "a steady state of sources alone")
    guess, neighbour = analysis.period or 0.0, request.neighbour
    islands = [assembled(island, analysis, guess, request) for island in circuit.islands]
    orbits: dict[int, Orbit] = {}
    if analysis.trigger is None:
        period = _period(analysis, islands)
    else:
        home, local = _trigger(circuit, analysis)
        if any(period_of(w) is not None for mna in islands for w in mna.system.waveforms):
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    "the sources are periodic, so a trigger cannot determine the period",
                    analysis.span,
                    "remove the trigger",
                )
            )
        orbits[home] = orbit_of(circuit, home, islands[home], None, analysis, local, neighbour)
        period = orbits[home].found.period
    for k, mna in enumerate(islands):
        if k not in orbits and not mna.system.static:
            orbits[k] = orbit_of(circuit, k, mna, period, analysis, None, neighbour)
    return period, [orbits.get(k) for k in range(len(islands))]


def static_orbit(
    circuit: Circuit,
    home: int,
    analysis: Pss,
    period: float,
    request: Request,
) -> Orbit:
    """Return an island that stores nothing as an orbit without states."""
    mna = assembled(circuit.islands[home], analysis, period, request)
    return orbit_of(circuit, home, mna, period, analysis, None, None)


def assembled(island: Island, analysis: Pss, period: float, request: Request) -> MnaSystem:
    """Return an island with its sources continued into the past."""
    step = analysis.row_step or (period / 1000.0 or None)
    mna = island.assemble(request.temperature, request.values, tstep=step, tstop=period or None)
    return with_waveforms(mna, [continued(w) for w in mna.system.waveforms])


def _period(analysis: Pss, islands: Sequence[MnaSystem]) -> float:
    """Return the period that is asked for, or that of the sources."""
    waveforms = [w for mna in islands for w in mna.system.waveforms]
    of_sources = common_period(waveforms)
    asked = analysis.period
    if asked is None:
        if of_sources is None or math.isnan(of_sources):
            raise no_period(analysis.span, of_sources is not None)
        return of_sources
    if of_sources is None and not any(mna.system.timed for mna in islands):
        raise no_period(analysis.span, False)
    wrong = [p for p in map(period_of, waveforms) if p is not None and not is_multiple(asked, p)]
    if wrong:
        period = common(wrong) or wrong[0]
        raise UsageError(
            Diagnostic(
                "NS4005",
                f"a period of {asked:g} s is not a multiple of {period:g} s, after which a source "
                "repeats",
                analysis.span,
                "remove the period, or correct the source",
            )
        )
    return asked


def _trigger(circuit: Circuit, analysis: Pss) -> tuple[int, str]:
    """Return island and name of the trigger's signal."""
    assert analysis.trigger is not None
    parts = circuit.parts(analysis.trigger)
    if len({home for home, _, _ in parts}) != 1 or len(parts) != 1:
        raise UsageError(
            Diagnostic(
                "NS4005",
                f"the trigger {analysis.trigger} is not a signal of a single island",
                analysis.span,
                "use the voltage of one node, or the current of an inductor or source",
            )
        )
    home, local, _ = parts[0]
    return home, local


def orbit_of(
    circuit: Circuit,
    number: int,
    mna: MnaSystem,
    period: float | None,
    analysis: Pss,
    trigger: str | None,
    neighbour: Neighbour | None,
) -> Orbit:
    """Return the orbit of one island."""
    system = mna.system
    if trigger is not None:
        control = mna.functional(trigger)
        if control.lam or control.dz or control.u or control.f or control.df:
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    f"the trigger {analysis.trigger} is not an unknown of the equations",
                    analysis.span,
                    "use the voltage of a node, or the current of an inductor or source",
                )
            )
        system = with_trigger(system, control, analysis.level)
    try:
        found = _search(circuit, number, mna, system, period, analysis, neighbour)
    except UnsolvedStep as problem:
        raise named_failure(circuit, mna, problem, starting=problem.time == 0.0, given=True) from (
            problem
        )
    except NoDerivative as problem:
        raise no_derivative(problem, mna, analysis.span) from problem
    except NoOrbit as problem:
        raise no_orbit(problem, mna, analysis.span, analysis.trigger) from problem
    if neighbour is not None:
        neighbour.states[number] = State(found.state.energy, found.state.gates)
    return Orbit(mna, system, found, _accuracy(circuit))


def _search(
    circuit: Circuit,
    number: int,
    mna: MnaSystem,
    system: DescriptorSystem,
    period: float | None,
    analysis: Pss,
    neighbour: Neighbour | None,
) -> Found:
    known = None if neighbour is None else neighbour.states.get(number)
    try:
        period_map = PeriodMap(system, period)
    except NotModewise as problem:
        if system.static:
            raise no_closed_form(number, str(problem), analysis.span) from problem
        return _stepped(circuit, mna, system, period, analysis, known)
    if known is not None and known.energy.size == period_map.core.states():
        try:
            return find_orbit(period_map, known, 0)
        except (NoOrbit, NoDerivative, UnsolvedStep):
            period_map = PeriodMap(system, period)
    charges, _ = mna.initial_state(_initial_voltages(circuit, mna))
    gates = ModewiseStepper(system, ()).gates_at_start(charges, 1e-6 * (period or 1e-3))
    settle = PERIODS
    if period is not None and analysis.settle > 0.0:
        settle = max(settle, math.ceil(analysis.settle / period))
    start = State(period_map.core.energy_of(charges), gates)
    if period is None and analysis.settle > 0.0:
        start = period_map.settled(start, analysis.settle)
    return find_orbit(period_map, start, settle)


def _stepped(
    circuit: Circuit,
    mna: MnaSystem,
    system: DescriptorSystem,
    period: float | None,
    analysis: Pss,
    known: State | None,
) -> Found:
    """Return the orbit that steps with error control find."""
    accuracy = _accuracy(circuit)
    step_map = StepMap(system, period, accuracy)
    if known is not None and known.energy.size == system.n:
        try:
            return find_stepped_orbit(step_map, known, 0)
        except (NoOrbit, UnsolvedStep):
            step_map = StepMap(system, period, accuracy)
    charges, _ = mna.initial_state(_initial_voltages(circuit, mna))
    start = State(charges, [s.closed != s.inverted for s in system.switches])
    settle = PERIODS
    if analysis.settle > 0.0 and period is not None:
        settle = max(settle, math.ceil(analysis.settle / period))
    elif analysis.settle > 0.0:
        start = step_map.settled(start, analysis.settle)
    return find_stepped_orbit(step_map, start, settle)


def _accuracy(circuit: Circuit) -> Accuracy:
    settings = Settings.of(circuit.deck, "auto")
    return Accuracy(settings.reltol, settings.vntol, settings.abstol)


def _initial_voltages(circuit: Circuit, mna: MnaSystem) -> dict[str, float]:
    from ..static.initial import given_voltages

    return {node: value for node, (value, _) in given_voltages(circuit.deck.initial, mna).items()}


def report(period: float, orbits: Sequence[Orbit | None]) -> Periodic:
    """Return what is known about the orbits of all islands together."""
    there = [o for o in orbits if o is not None]
    multipliers = [complex(m) for o in there for m in o.found.multipliers]
    free = [name for o in there for row in o.found.free for name in stored_names(o.mna, row)]
    return Periodic(
        period,
        tuple(sorted(multipliers, key=abs, reverse=True)[:_MULTIPLIERS]),
        max((o.found.steps for o in there), default=0),
        sum(o.found.periods for o in there),
        max((o.found.residual for o in there), default=0.0),
        tuple(dict.fromkeys(free)),
        max((o.found.tolerance for o in there), default=0.0) or 1e-9,
    )


def _free(analysis: Pss, periodic: Periodic) -> Diagnostic:
    names = ", ".join(periodic.free)
    return Diagnostic(
        "NS3061",
        f"nothing restores a charge or flux of {names} (multiplier 1): the orbit is one of many, "
        f"the one reached from the initial values",
        analysis.span,
        "put a resistance in its path to make it unique, or choose another with IC= and .ic",
        severity="warning",
    )
