"""The map of what is stored to what is stored one period later, by steps with error control."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..problems.csc import Floats
from ..problems.descriptor import DescriptorSystem, Functional
from .intervals import Intervals, joined
from .moreau import function_slopes
from .orbit import NoOrbit, State
from .sdirk import Accuracy, SdirkStepper

#: how much finer steps are than those of a run: (I - Phi)^-1 enlarges their errors by the time
#: constants in periods
FINER = 1e-3
_LONGEST = 50  # steps in a period at least
_LEAST = 0.1  # part of the largest voltage or current that is taken for the size of another one
_EARLY = 0.2  # part of a period within which no crossing of the trigger ends one
_FIRST_SEARCH, _LAST_SEARCH = 1e-9, 1e4  # [s]
_CROSSINGS = 3  # before a period is known


def finer(reltol: float) -> float:
    """Return the error of one step where a period has to close.

    Examples
    --------
    >>> round(finer(1e-5), 12)
    1e-08
    """
    # some hundred units of rounding are the least that a step can be asked for
    return max(min(reltol, 1e-4) * FINER, 1e-13)


@dataclass(frozen=True, slots=True)
class Period:
    """One period by steps.

    Parameters
    ----------
    begin, end : State
    steps : Intervals
    events : tuple of (int, bool)
        Pairs that turned on or off, in order.
    """

    begin: State
    end: State
    steps: Intervals
    events: tuple[tuple[int, bool], ...]

    def alike(self, other: Period) -> bool:
        """Return whether the same pairs turn in the same order, to the same states of switches."""
        return self.events == other.events and list(self.end.gates) == list(other.end.gates)


class StepMap:
    """The map of stored charges to those after one period, by controlled steps.

    Parameters
    ----------
    system : DescriptorSystem
        Sources repeat with the period.
    period : float or None
        [s]; None if the last switch is a trigger (:func:`~nsspice.solvers.orbit.with_trigger`).
    accuracy : Accuracy
        Of a run; the map is ``FINER``.
    """

    def __init__(self, system: DescriptorSystem, period: float | None, accuracy: Accuracy) -> None:
        self.system, self.period = system, period
        self.accuracy = accuracy
        self.fine = replace(
            accuracy,
            reltol=finer(accuracy.reltol),
            vntol=accuracy.vntol * FINER,
            abstol=accuracy.abstol * FINER,
        )
        self.triggered = period is None
        #: of the last run [s]
        self.length = period or 0.0
        self.periods = 0
        #: unknowns at the end of the last run
        self.point = np.zeros(system.n)
        #: the largest unknowns of the settling periods
        self.largest = np.zeros(system.n)
        count = 0 if system.smooth is None else system.smooth.tape.outputs.size
        self._outputs = [
            *(Functional(z=((j, 1.0),)) for j in range(system.n)),
            *(Functional(f=((k, 1.0),)) for k in range(count)),
        ]
        self._with: dict[tuple[bool, ...], DescriptorSystem] = {}

    def _stepper(
        self, start: State, accuracy: Accuracy, stop: float, record: float = 0.0
    ) -> SdirkStepper:
        """Return a stepper at the begin of a run to ``stop``."""
        key = tuple(start.gates)
        system = self._with.get(key)
        if system is None:
            pairs = zip(self.system.switches, key, strict=True)
            closed = [replace(s, closed=gate != s.inverted) for s, gate in pairs]
            system = self._with[key] = replace(self.system, switches=tuple(closed))
        stepper = SdirkStepper(system, self._outputs, accuracy)
        longest = min(stop, self.length or stop) / _LONGEST
        if record:
            longest = min(longest, record)
            stepper.record_all()
        # a settling run shows how large unknowns become
        rows = stop if accuracy is self.fine else longest
        stepper.plan(0.0, stop, longest, 0.0, rows)
        stepper.start_charges(0.0, start.energy, longest)
        return stepper

    def _state(self, row: Floats, stepper: SdirkStepper) -> State:
        """Return the state at an output point."""
        n, smooth = self.system.n, self.system.smooth
        self.point = row[1 : 1 + n].copy()
        charges = self.system.E.dot(self.point)
        if smooth is not None:
            charges = charges + smooth.Q.dot(row[1 + n :])
        return State(charges, list(stepper.gates))

    def _see(self, rows: Floats) -> None:
        unknowns = np.abs(rows[:, 1 : 1 + self.system.n])
        self.largest = np.maximum(self.largest, unknowns.max(axis=0, initial=0.0))

    def stored(self, change: Floats) -> Floats:
        """Return what a change of the unknowns (n,) at ``point`` stores more, to first order."""
        found: Floats = self.system.E.dot(change)
        smooth = self.system.smooth
        if smooth is not None and smooth.Q.data.size:
            found = found + smooth.Q.dot(self._slopes() @ change)
        return found

    def _slopes(self) -> Floats:
        assert self.system.smooth is not None
        u = np.zeros((1, len(self.system.waveforms)))
        tape = self.system.smooth.tape
        slopes: Floats = function_slopes(tape, self.point[np.newaxis], u, np.zeros(1))[0]
        return slopes

    def stores(self) -> tuple[Floats, Floats]:
        """Return what each row stores per unit of its unknown, and the sizes of the unknowns.

        What is small all the time has a part of the largest voltage or current as its size.
        """
        smooth = self.system.smooth
        own = np.abs(self.system.E.diagonal())
        if smooth is not None and smooth.Q.data.size:
            slopes, Q = self._slopes(), smooth.Q
            np.add.at(own, Q.indices, np.abs(Q.data * slopes[Q.columns, Q.indices]))
        size = self.largest.copy()
        for kind in (0, 1):
            alike = self.system.row_kind == kind
            size[alike] = np.maximum(size[alike], _LEAST * size[alike].max(initial=0.0))
        return own, np.where(size > 0.0, size, 1.0)

    def run(self, start: State, periods: int = 1, fine: bool = True) -> State:
        """Return the state some periods later.

        Raises
        ------
        UnsolvedStep
            If the laws have no solution.
        NoOrbit
            If the trigger does not come.
        """
        self.periods += periods
        accuracy = self.fine if fine else self.accuracy
        if self.triggered:
            return self._to_trigger(start, periods, accuracy)
        assert self.period is not None
        return self._finish(self._stepper(start, accuracy, periods * self.period))

    def recorded(self, start: State, period: float, longest: float) -> Period:
        """Run one period [s] by steps none of which is longer than ``longest`` [s].

        Raises
        ------
        UnsolvedStep
            If the equations have no solution.
        """
        self.periods += 1
        stepper = self._stepper(start, self.fine, period, longest)
        parts, done = [], False
        while not done:
            rows, done = stepper.advance(64)
            parts.append(Intervals.of(stepper.take_intervals()))
        _, pairs, on = stepper.events
        events = tuple(zip(pairs.tolist(), on.tolist(), strict=True))
        return Period(start, self._state(rows[-1], stepper), joined(parts), events)

    def margins(self, start: State) -> tuple[State, Floats, Floats]:
        """Return the state a period later, and how far each switch is from acting meanwhile.

        Distances of the controls from the threshold at the nearest, ``nan`` for switches that act,
        and how far the controls swing, shape (switches,) each.
        """
        self.periods += 1
        assert self.period is not None
        stepper = self._stepper(start, self.accuracy, self.period)
        tables, done = [], False
        while not done:
            rows, done = stepper.advance(64)
            tables.append(rows[:, 1 : 1 + self.system.n].copy())
        z = np.vstack(tables)
        pairs = set(stepper.events[1].tolist())
        found = []
        for switch, above in zip(self.system.switches, stepper.gates, strict=True):
            control = sum(factor * z[:, j] for j, factor in switch.control) + np.zeros(len(z))
            low, high = float(control.min()), float(control.max())
            distance = low - switch.off_below if above else switch.on_above - high
            found.append((math.nan if switch.pair in pairs else distance, high - low))
        distances, swings = np.array(found).reshape(-1, 2).T
        return self._state(rows[-1], stepper), distances, swings

    def settled(self, start: State, time: float) -> State:
        """Return the state after running for a time [s], regardless of the trigger."""
        return self._finish(self._stepper(start, self.accuracy, time))

    def _finish(self, stepper: SdirkStepper) -> State:
        while True:
            rows, done = stepper.advance(64)
            if stepper.accuracy is not self.fine:
                self._see(rows)
            if done:
                return self._state(rows[-1], stepper)

    def _to_trigger(self, start: State, periods: int, accuracy: Accuracy) -> State:
        """Run until the trigger has come so often that the last two show the period."""
        known, wanted = self.length, periods if self.length else periods + _CROSSINGS
        limit = 4.0 * (periods + 1) * known if known else _FIRST_SEARCH
        while limit <= _LAST_SEARCH:
            found = self._until(start, wanted, limit, accuracy)
            if found is not None:
                return found
            limit *= 10.0
        raise NoOrbit("trigger", 0.0)

    def _until(self, start: State, wanted: int, limit: float, accuracy: Accuracy) -> State | None:
        """Return the state at a crossing of the trigger; None if it does not come in time."""
        stepper = self._stepper(start, accuracy, limit)
        stepper.show_all_points(0.0)
        pair = self.system.switches[-1].pair
        last, count, seen, done = 0.0, 0, 0, False
        while not done:
            rows, done = stepper.advance(1)
            if stepper.accuracy is not self.fine:
                self._see(rows)
            times, pairs, on = stepper.events
            fresh = np.arange(seen, times.size)
            seen = times.size
            hits = times[fresh][(pairs[fresh] == pair) & on[fresh]]
            if not hits.size or hits[-1] - last <= _EARLY * self.length:
                continue
            length, last = float(hits[-1]) - last, float(hits[-1])
            count += 1
            if count == wanted:
                self.length = length
                return self._state(rows[-1], stepper)
        return None
