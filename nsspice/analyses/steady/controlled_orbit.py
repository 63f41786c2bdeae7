"""Periodic steady state with digital controllers: circuit, held values and controllers together.

One period maps the charges and fluxes of all islands, the numbers that controllers remember, and
what waits in converters and registers.  Newton's method with differences finds what it leaves as
it is; between its steps the derivative is updated.

References: C. G. Broyden, "A class of methods for solving nonlinear simultaneous equations", Math.
Comp. 19 (1965) 577, doi:10.1090/S0025-5718-1965-0198670-6.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, StepError
from ...problems.descriptor import DescriptorSystem
from ...solvers.orbit import NoOrbit
from ...solvers.stepped_map import finer
from ..request.cards import Tran
from ..request.controller import Controller
from ..request.period import common, is_multiple
from ..request.periodic_sources import period_of
from ..request.recorder import Recorder
from ..request.request import Request
from ..request.restart_state import Beginning
from ..request.settings import Settings
from ..results.periodic import Periodic
from ..signals.curve import Floats
from ..transient.controlled import advance_a_period, started
from ..transient.island_runner import IslandRunner
from ..transient.memory import Memory
from ..transient.outcomes import Stopped
from ..transient.schedule import Schedule

_SETTLE = 8  # periods before the first step of Newton's method
_MORE = (16, 64, 256)
_STEPS = 16
#: times the tolerance: what is as near as rounding and errors of steps let it come
_NEAR = 100.0
_HALVINGS = 5
#: change over a period that is rounding of the exact engine
_CLOSED = 1e-12
#: as in the run that shows the orbit: a start moves what does not fit by a step
_STEPS_IN_PERIOD = 50.0
#: part of a store's own value at 1 V or 1 A that counts as its size at least
_LEAST = 0.1
#: reduction of the residual by a step below which the derivative serves again
_SLOW = 0.1


@dataclass(frozen=True, slots=True)
class Whole:
    """Circuit and controllers at the begin of a period.

    Parameters
    ----------
    islands : list of Beginning or None
        None of what stores nothing.
    memory : Memory
    """

    islands: list[Beginning | None]
    memory: Memory

    @property
    def numbers(self) -> Floats:
        """All that may change continuously."""
        charges = [island.charges for island in self.islands if island is not None]
        return np.concatenate([*charges, self.memory.numbers])

    def moved(self, numbers: Floats) -> Whole:
        """Return the same with other numbers."""
        islands: list[Beginning | None] = []
        for island in self.islands:
            if island is None:
                islands.append(None)
                continue
            count = island.charges.size
            islands.append(replace(island, charges=numbers[:count]))
            numbers = numbers[count:]
        return Whole(islands, self.memory.moved(numbers))


@dataclass(frozen=True, slots=True)
class ControlledOrbit:
    """A periodic steady state with controllers.

    Parameters
    ----------
    begin : Whole
    controllers : tuple of Controller
        With offsets within the period.
    settings : Settings
        Of the run that shows it.
    periodic : Periodic
    """

    begin: Whole
    controllers: tuple[Controller, ...]
    settings: Settings
    periodic: Periodic


def common_of(
    circuit: Circuit, controllers: Sequence[Controller], asked: float | None, request: Request
) -> float | None:
    """Return the common period of sources and controllers [s], or that which is asked for.

    None if there is none.
    """
    step = None
    periods = [c.period for c in controllers]
    for controller in controllers:
        periods += [w.period for w in controller.writes if not isinstance(w, str)]
    for island in circuit.islands:
        mna = island.assemble(request.temperature, request.values, tstep=step, tstop=asked)
        periods += [p for p in map(period_of, mna.system.waveforms) if p is not None]
    found = common(periods)
    if asked is not None:
        return asked if all(is_multiple(asked, p) for p in periods) else None
    return None if found is None or math.isnan(found) else found


class _Map:
    """The map of circuit and controllers over a period."""

    def __init__(
        self,
        circuit: Circuit,
        controllers: tuple[Controller, ...],
        period: float,
        settings: Settings,
        request: Request,
    ) -> None:
        self.circuit, self.period = circuit, period
        self.controllers, self.settings, self.request = controllers, settings, request
        self.periods = 0
        self.stepped = False
        reads = Schedule.of(circuit, controllers, period).reads
        self._recorder = Recorder(circuit, list(reads))
        #: what stores hold at 1 V or 1 A
        self.units = np.zeros(0)

    def __call__(self, begin: Whole | None) -> Whole:
        """Return the end of a period, whose begin is that of a run if it is None."""
        self.periods += 1
        # the run continues after the period: it has to wait at its end
        longest = self.period / _STEPS_IN_PERIOD
        analysis = Tran(4.0 * self.period, 4.0 * self.period, max_step=longest, uic=True)
        memory = None if begin is None else begin.memory
        schedule = Schedule.of(
            self.circuit, self.controllers, analysis.stop, memory, halt=self.period
        )
        beginnings = None if begin is None else begin.islands

        def prepare() -> list[IslandRunner]:
            return [
                IslandRunner(
                    self.circuit,
                    k,
                    island,
                    self._recorder.local[k],
                    analysis,
                    self.settings,
                    self.request.temperature,
                    schedule.values(self.request),
                    beginning=None if beginnings is None else beginnings[k],
                    periodic_sources=True,
                    clock=schedule.sources.clock,
                    whole=True,
                )
                for k, island in enumerate(self.circuit.islands)
            ]

        runners = started(schedule, prepare, self._recorder)
        try:
            remembered = advance_a_period(runners, schedule, self._recorder, self.period)
        except Stopped as stopped:
            failed = next(r for r in runners if not r.stepper.waits)
            raise failed.failure(stopped.problem) from stopped.problem
        stores = [not runner.mna.system.static for runner in runners]
        storing = [runner for runner, stored in zip(runners, stores, strict=True) if stored]
        self.stepped = any(runner.method != "modewise" for runner in storing)
        sizes = [_sizes(runner.mna.system) for runner in storing]
        self.units = np.concatenate([*sizes, np.ones(remembered.numbers.size)])
        ends = [r.stored() if s else None for r, s in zip(runners, stores, strict=True)]
        return Whole(ends, remembered)


def _sizes(system: DescriptorSystem) -> Floats:
    """Return what each row stores at 1 V or 1 A, or at functions of 1: zero if nothing."""
    sizes = np.zeros(system.n)
    np.add.at(sizes, system.E.indices, np.abs(system.E.data))
    if system.smooth is not None:
        np.add.at(sizes, system.smooth.Q.indices, np.abs(system.smooth.Q.data))
    return sizes


def find_controlled_orbit(
    circuit: Circuit,
    controllers: tuple[Controller, ...],
    period: float,
    settings: Settings,
    request: Request,
    settle: float = 0.0,
) -> ControlledOrbit:
    """Find the periodic steady state of a circuit with controllers.

    Raises
    ------
    NumericalError
        NS3062 if none was found.
    """
    within = tuple(replace(c, offset=math.fmod(c.offset, c.period)) for c in controllers)
    step_map = _Map(circuit, within, period, settings, request)
    whole = step_map(None)
    if step_map.stepped:
        settings = replace(settings, reltol=finer(settings.reltol))
        step_map = _Map(circuit, within, period, settings, request)
        whole = step_map(None)
    least = max(_SETTLE, math.ceil(settle / period))
    failed = 0.0
    for more in (least, *_MORE):
        search = _Search(step_map, whole, more)
        try:
            found = search.newton()
        except NoOrbit as problem:
            failed, whole = problem.residual, search.begin
            continue
        multipliers, error = search.multipliers(found)
        periodic = Periodic(
            period,
            tuple(complex(m) for m in multipliers),
            search.steps,
            step_map.periods,
            search.residual,
            (),
            error,
        )
        return ControlledOrbit(found, within, settings, periodic)
    message = "no periodic steady state was found: over the last period circuit and controllers "
    message += f"changed by {failed:.1e} of their size"
    hint = "a function that remembers more than its property `state` says, or converters and "
    hint += "counters with few steps, may have none; simulate with .tran"
    raise StepError(Diagnostic("NS3062", message, hint=hint), time=0.0, residual=failed)


class _Search:
    """Newton's method from where some periods lead."""

    def __init__(self, step_map: _Map, begin: Whole, settle: int) -> None:
        self.map, self.begin = step_map, begin
        largest = np.abs(begin.numbers)
        for _ in range(settle):
            self.begin = step_map(self.begin)
            numbers = np.abs(self.begin.numbers)
            largest = np.maximum(largest, numbers) if numbers.size == largest.size else numbers
        self.scale = np.maximum(largest, _LEAST * step_map.units)
        #: rows of equations that store nothing have no charge that could be another one
        self.free = np.flatnonzero(step_map.units)
        self.scale[step_map.units == 0.0] = 1.0
        self.tolerance = 4.0 * step_map.settings.reltol if step_map.stepped else _CLOSED
        self.steps, self.residual = 0, math.inf

    def _change(self, begin: Whole) -> tuple[Floats, Whole]:
        end = self.map(begin)
        if end.memory.shape != begin.memory.shape:
            raise NoOrbit("search", math.inf)
        change = (end.numbers - begin.numbers) / self.scale
        return change[self.free], end

    def _moved(self, begin: Whole, step: Floats) -> Whole:
        numbers = begin.numbers
        numbers[self.free] += step * self.scale[self.free]
        return begin.moved(numbers)

    def _derivative(self, begin: Whole, change: Floats, part: float) -> Floats:
        """Return the derivative of the map in scaled free numbers, (n, n)."""
        at, kept, columns = begin.numbers, begin.numbers, []
        for j in self.free.tolist():
            at[j] += part * self.scale[j]
            there, _ = self._change(begin.moved(at))
            at[j] = kept[j]
            columns.append((there - change) / part)
        count = self.free.size
        return np.array(columns).T.reshape(count, count) + np.eye(count)

    def newton(self) -> Whole:
        """Return what a period leaves as it is.

        Raises
        ------
        NoOrbit
        """
        begin = self.begin
        change, end = self._change(begin)
        self.residual = now = float(np.abs(change).max(initial=0.0))
        derivative: Floats | None = None
        for _ in range(_STEPS):
            if now <= self.tolerance:
                return self._with_gates(begin, end)
            if derivative is None:
                begin = self._with_gates(begin, end)
                derivative = self._derivative(begin, change, math.sqrt(self.tolerance))
            matrix = np.eye(change.size) - derivative
            step = np.asarray(np.linalg.lstsq(matrix, change, rcond=self.tolerance)[0], np.float64)
            self.steps += 1
            share, before = 1.0, now
            for _ in range(_HALVINGS):
                trial = self._moved(begin, share * step)
                after, ahead = self._change(trial)
                if np.abs(after).max() < now:
                    break
                share *= 0.25
            else:
                trial = self._with_gates(end, end)  # where the run itself leads
                after, ahead = self._change(trial)
                derivative = None
            if derivative is not None:
                made = share * step
                wrong = after - change + matrix @ made
                derivative = derivative + np.outer(wrong, made) / (made @ made)
            begin, change, end = trial, after, ahead
            self.residual = now = float(np.abs(change).max(initial=0.0))
            if now > _SLOW * before:
                derivative = None
        self.begin = begin
        if now <= _NEAR * self.tolerance:
            return self._with_gates(begin, end)
        raise NoOrbit("search", now)

    def _with_gates(self, begin: Whole, end: Whole) -> Whole:
        """Return numbers with the states of switches at the end of the period before."""
        islands = [
            None if a is None or b is None else replace(b, charges=a.charges)
            for a, b in zip(begin.islands, end.islands, strict=True)
        ]
        return Whole(islands, begin.memory)

    def multipliers(self, begin: Whole) -> tuple[Floats, float]:
        """Return the Floquet multipliers above their error, the largest first, and the error."""
        part = math.sqrt(self.tolerance)
        change, _ = self._change(begin)
        values = np.linalg.eigvals(self._derivative(begin, change, part))
        values = values[np.argsort(-np.abs(values), kind="stable")]
        error = 10.0 * part
        return values[np.abs(values) > error], error
