"""Periodic orbits of systems with smooth elements, by Newton-Krylov shooting on controlled steps.

The map :math:`P` of the stored charges and fluxes over one period is computed by steps of order 4
with error control, much finer than a run's.  In coordinates :math:`y` in which all stores count by
their energy, every step of Newton's method solves

.. math::

    (I - \\Phi)\\, \\delta = P(y) - y, \\qquad
    \\Phi v \\approx \\frac{P(y + \\epsilon v) - P(y)}{\\epsilon},

in a space of few directions: those in which the residual lies and their images.  What parasitics
store is forgotten within a period (:math:`\\Phi v \\approx 0`), so that the space grows to about
the number of slow stores, and it serves for later steps too.  The differences go across switchings,
jumps and located events, of any kind.

References: R. Telichevesky, K. S. Kundert, J. K. White, "Efficient steady-state analysis based on
matrix-free Krylov-subspace methods", Proc. 32nd DAC (1995) 480, doi:10.1145/217474.217574; T. J.
Aprille, T. N. Trick, Proc. IEEE 60 (1972) 108, doi:10.1109/PROC.1972.8563.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..problems.csc import Floats
from ..problems.descriptor import DescriptorSystem, Functional
from .intervals import Intervals, joined
from .moreau import function_slopes
from .orbit import Complexes, Found, NoOrbit, State
from .sdirk import Accuracy, SdirkStepper
from .stepper import UnsolvedStep

#: how much finer steps are than those of a run: (I - Phi)^-1 enlarges their errors by the time
#: constants in periods
FINER = 1e-3
_CLOSE = 0.1  # last step of Newton's method in units of a run's tolerance
_LONGEST = 50  # steps in a period at least
_SOLVED = 0.01  # part of the residual that may be left by the linear equations
_SPACE = 24  # directions at most
_STEPS = 12  # of Newton's method, then more periods are run
_MORE = (16, 64, 256, 1024)
_STEADY = 1e-2  # relative change of the residual over 64 periods below which it is a drift
_SLOWER = 0.3  # reduction of the residual by a step below which old directions serve again
_HALVINGS = 5
_LEAPS = 3  # of one search
_LAST = 8  # periods whose ends are extrapolated
_CYCLES = 3  # of extrapolation
_LEAST = 0.1  # part of the largest voltage or current that is taken for the size of another one
_FARTHEST = 100.0  # times what the settling periods have reached, where an orbit is looked for
_NOISE = 4.0  # residual in units of the error of a step, below which it is noise
_EARLY = 0.2  # part of a period within which no crossing of the trigger ends one
_FIRST_SEARCH, _LAST_SEARCH = 1e-9, 1e4  # [s]
_CROSSINGS = 3  # before a period is known
_WIDER = 4.0  # differences that show errors
#: multipliers below this are not distinguished from zero
UNSEEN = 1e-4


def finer(reltol: float) -> float:
    """Return the error of one step where a period has to close.

    Examples
    --------
    >>> round(finer(1e-5), 12)
    1e-08
    """
    # some hundred units of rounding are the least that a step can be asked for
    return max(min(reltol, 1e-4) * FINER, 1e-13)


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

    def recorded(self, start: State, period: float, longest: float) -> Intervals:
        """Return all steps of one period [s], none of them longer than ``longest`` [s].

        Raises
        ------
        UnsolvedStep
            If the equations have no solution.
        """
        stepper = self._stepper(start, self.fine, period, longest)
        parts, done = [], False
        while not done:
            _, done = stepper.advance(64)
            parts.append(Intervals.of(stepper.take_intervals()))
        return joined(parts)

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


class _Space:
    """Directions, and what a period makes of them."""

    def __init__(self, size: int) -> None:
        self.V, self.W = np.zeros((size, 0)), np.zeros((size, 0))

    def split(self, residual: Floats) -> tuple[Floats, Floats]:
        """Return coefficients that solve ``(I - Phi) V c = residual`` at best, and what is left."""
        if not self.V.shape[1]:
            return np.zeros(0), residual
        matrix = self.V - self.W
        # what the errors of differences hide from (I - Phi) is left to the periods run
        c: Floats = np.linalg.lstsq(matrix, residual, rcond=UNSEEN)[0].astype(np.float64)
        return c, residual - matrix @ c

    def outside(self, v: Floats) -> Floats | None:
        """Return the unit vector of a part outside, None if there is none but rounding."""
        rest = v.copy()
        for _ in range(2):
            rest -= self.V @ (self.V.T @ rest)
        size = float(np.linalg.norm(rest))
        return rest / size if size > 1e-8 * float(np.linalg.norm(v)) else None

    def add(self, v: Floats, image: Floats) -> None:
        """Add a direction and its image."""
        self.V, self.W = np.column_stack([self.V, v]), np.column_stack([self.W, image])


class _Search:
    """Newton's method in the scaled charges, which count by their energy or each by its size."""

    def __init__(self, step_map: StepMap, state: State, by_energy: bool) -> None:
        self.map, self.gates = step_map, state.gates
        own, largest = step_map.stores()
        self.rows = np.flatnonzero(own)
        charges = own[self.rows] * largest[self.rows]
        #: coordinates of each store at its largest
        self.parts = np.ones(self.rows.size)
        if by_energy and self.rows.size:
            roots = np.sqrt(charges * largest[self.rows])
            self.parts = roots / float(np.linalg.norm(roots))
        self.scale = charges / self.parts
        self.steps = 0
        #: relative residual, and size of the step that would be next
        self.residual, self.error = 0.0, 0.0

    def y(self, state: State) -> Floats:
        """Return coordinates of a state, shape (r,)."""
        return np.asarray(state.energy[self.rows] / self.scale)

    def state(self, y: Floats) -> State:
        """Return the state of coordinates."""
        charges = np.zeros(self.map.system.n)
        charges[self.rows] = y * self.scale
        return State(charges, self.gates)

    def image(self, y: Floats) -> Floats:
        """Return P(y)."""
        end = self.map.run(self.state(y))
        self.gates = end.gates
        return self.y(end)

    def difference(self, y: Floats, end: Floats, v: Floats, part: float) -> Floats:
        """Return Phi v by a difference, of both sides if there is no ``end``.

        No store is moved by more than a ``part`` of its size.
        """
        gates = self.gates
        epsilon = part / float(np.max(np.abs(v) / self.parts))
        ahead = self.image(y + epsilon * v)
        self.gates = gates
        if end.size:
            return (ahead - end) / epsilon
        behind = self.image(y - epsilon * v)
        self.gates = gates
        return (ahead - behind) / (2.0 * epsilon)

    def newton(self, y: Floats) -> Floats:
        """Return an orbit's coordinates.

        Raises
        ------
        NoOrbit
        """
        tolerance = self.map.fine.reltol
        close = _CLOSE * min(self.map.accuracy.reltol, 1e-4)
        end, space, before = self.image(y), _Space(y.size), math.inf
        farthest, leaps = _FARTHEST * self.size(y, end), 0
        for _ in range(_STEPS):
            residual = end - y
            now, size = float(np.linalg.norm(residual)), self.size(y, end)
            if size > farthest:
                break  # next to it all that a period does is small
            quiet = now <= _NOISE * tolerance * size
            c, rest = space.split(residual)
            while np.linalg.norm(rest) > max(_SOLVED * now, 0.5 * tolerance * size):
                v = space.outside(rest)
                if v is None or space.V.shape[1] >= min(_SPACE, y.size):
                    break
                # half the digits of a run: curvature and errors of steps take the same part
                space.add(v, self.difference(y, end, v, math.sqrt(tolerance)))
                c, rest = space.split(residual)
            # what is left lies where a period forgets
            step = space.V @ c + rest
            self.residual, self.error = now / size, float(np.linalg.norm(step)) / size
            if quiet and (self.error <= close or now > 0.5 * before):
                return y
            self.steps += 1
            before = now
            y, end, after = self._damped(y, end, step, now, quiet)
            if math.isinf(after) and leaps < _LEAPS:
                # a period changes this state by the same amount again and again
                leaps += 1
                y = self._leap(y)
                end = self.image(y)
            if after > _SLOWER * now:
                space = _Space(y.size)
        raise NoOrbit("search", self.residual)

    def even(self, y: Floats) -> bool:
        """Return whether each store is as near to the orbit, for its own size, as a run would be.

        The changes over two periods show how fast each one still moves there.
        """
        first = self.image(y)
        change, then = first - y, self.image(first) - first
        noise = _NOISE * self.map.fine.reltol * self.parts
        slow = np.abs(change) > noise
        rest = np.maximum(1.0 - np.abs(then[slow] / change[slow]), UNSEEN)
        distance = np.abs(change[slow]) / rest / self.parts[slow]
        return bool(distance.max(initial=0.0) <= _NOISE * self.map.accuracy.reltol)

    def _leap(self, y: Floats) -> Floats:
        """Return a point at which a switch acts that was open, or closed, all the period.

        A controller's integrator winds up meanwhile by the same amount in each period: two of them
        show when the switch acts, and half the swing of its control later it does so in the middle.
        """
        if self.map.triggered:
            return y
        gates = self.gates
        first, distance, _ = self.map.margins(self.state(y))
        self.gates = first.gates
        second, then, swing = self.map.margins(first)
        with np.errstate(divide="ignore", invalid="ignore"):
            periods = (then + 0.5 * swing) / (distance - then)
        periods = periods[np.isfinite(periods) & (periods > 1.0)]
        if not periods.size:
            self.gates = gates
            return y
        self.gates = second.gates
        start, drift = self.y(second), self.y(second) - self.y(first)
        return np.asarray(start + float(periods.min()) * drift)

    def _damped(
        self, y: Floats, end: Floats, step: Floats, now: float, quiet: bool
    ) -> tuple[Floats, Floats, float]:
        """Return a point along a step from which a period changes less, and what it leads to."""
        share = 1.0
        for _ in range(_HALVINGS):
            trial = y + share * step
            try:
                after = self.image(trial)
            except (UnsolvedStep, NoOrbit):
                share *= 0.25
                continue
            left = float(np.linalg.norm(after - trial))
            if quiet or left <= (1.0 - 0.1 * share) * now:
                return trial, after, left
            share *= 0.25
        return end, self.image(end), math.inf  # no descent: where the run itself leads

    def size(self, *points: Floats) -> float:
        """Return the size of coordinates, at least that of all stores at their largest."""
        return max(1.0, *(float(np.linalg.norm(p)) for p in points))

    def multipliers(self, y: Floats) -> tuple[Complexes, Floats, float]:
        """Return the Floquet multipliers above their error, directions of those at 1, the error.

        By Arnoldi's method from a direction in which all stores take part.
        """
        part = math.sqrt(self.map.fine.reltol)
        own, none = _Space(y.size), np.zeros(0)
        v = own.outside(self._stored(np.cos(1.0 + np.arange(self.map.system.n))))
        while v is not None and own.V.shape[1] < min(_SPACE, y.size):
            image = self.difference(y, none, v, part)
            own.add(v, image)
            rest = image - own.V @ (own.V.T @ image)
            v = own.outside(rest) if np.linalg.norm(rest) > UNSEEN else None
        if not own.V.shape[1]:
            return np.zeros(0, complex), np.zeros((0, y.size)), UNSEEN
        values, vectors = np.linalg.eig(own.V.T @ own.W)
        order = np.argsort(-np.abs(values), kind="stable")
        values, vectors = values[order].astype(np.complex128), vectors[:, order]
        # in the direction of the largest one a wider difference shows how much differences err
        own_direction = np.real(vectors[:, 0])
        size = float(np.linalg.norm(own_direction))
        v = own.V @ own_direction / size
        wide = self.difference(y, none, v, _WIDER * part)
        error = float(np.linalg.norm(wide - own.W @ own_direction / size))
        error = max(UNSEEN, error)
        free = np.real(own.V @ vectors[:, np.abs(values - 1.0) <= error]).T
        return values[np.abs(values) > error], free, error

    def _stored(self, factors: Floats) -> Floats:
        """Return coordinates of what unknowns store that differ by parts of their sizes (n,)."""
        change = factors * self.map.largest
        return np.asarray(self.map.stored(change)[self.rows] / self.scale)


def _extrapolated(step_map: StepMap, state: State, periods: int) -> State:
    """Return a state after some periods, or what these tend to.

    Reduced rank extrapolation: of the combinations of the last states whose factors sum up to 1
    that which changes least over a period; it is kept where a period changes it by less than half.

    References: A. Sidi, Vector Extrapolation Methods with Applications (SIAM, 2017), chapter 1.
    """
    if periods > _LAST:
        state = step_map.run(state, periods - _LAST, fine=False)
    for _ in range(_CYCLES):
        states = [state]
        for _ in range(min(periods, _LAST)):
            states.append(step_map.run(states[-1], 1, fine=False))
        state = states[-1]
        charges = np.array([s.energy for s in states]).T
        size = np.abs(charges).max(axis=1)
        size = np.where(size > 0.0, size, 1.0)
        points = charges / size[:, np.newaxis]
        changes = np.diff(points, axis=1)
        parts = np.linalg.lstsq(np.diff(changes, axis=1), -changes[:, 0], rcond=UNSEEN)[0]
        ahead = points[:, 0] + changes[:, :-1] @ parts
        if not np.abs(ahead).max(initial=0.0) < _FARTHEST:
            break
        trial = State(ahead * size, state.gates)
        try:
            after = step_map.run(trial, 1, fine=False)
        except (UnsolvedStep, NoOrbit):
            break
        change = float(np.linalg.norm((after.energy - trial.energy) / size))
        if not change < 0.5 * np.linalg.norm(changes[:, -1]):
            break
        state = after
        if change < step_map.accuracy.reltol:
            break
    return state


def find_stepped_orbit(step_map: StepMap, start: State, settle: int) -> Found:
    """Find a periodic orbit near the run from a state.

    Parameters
    ----------
    step_map : StepMap
    start : State
        Its ``energy`` holds charges and fluxes (n,), as that of the orbit found.
    settle : int
        Periods run before the first step of Newton's method.

    Raises
    ------
    NoOrbit
        If there is none, or none was found.
    UnsolvedStep
        If a run has no solution.
    """
    state, failed, steps = start, NoOrbit("search", 0.0), 0
    drift: State | None = None
    for more in (settle, *_MORE):
        if more and not step_map.triggered:
            state = _extrapolated(step_map, state, more)
        elif more:
            state = step_map.run(state, more, fine=False)
        elif step_map.triggered or not step_map.point.any():
            step_map.run(state, 1, fine=False)
        for by_energy in (True, False):
            search = _Search(step_map, state, by_energy)
            search.steps = steps
            try:
                y = search.newton(search.y(state))
                if not by_energy or search.even(y):
                    break
                # a controller's capacitor that stores next to nothing may still be on its way
                state, steps = search.state(y), search.steps
            except NoOrbit as problem:
                failed, steps = problem, search.steps
        else:
            y = search.y(state)
            step = search.image(y) - y
            if drift is not None:
                moved = float(np.linalg.norm(step - search.y(drift)))
                if moved <= _STEADY * float(np.linalg.norm(step)):
                    direction = search.state(step).energy
                    raise NoOrbit("drift", failed.residual, direction)
            drift = search.state(step) if more >= _MORE[0] else None
            continue
        length, found = step_map.length, search.state(y)
        multipliers, free, error = search.multipliers(y)
        return Found(
            found,
            found.energy,
            length,
            multipliers,
            search.steps,
            step_map.periods,
            search.residual,
            np.array([search.state(row).energy for row in free]).reshape(-1, step_map.system.n),
            error,
        )
    raise failed
