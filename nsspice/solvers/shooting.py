"""Periodic orbits of systems with smooth elements, by shooting on controlled steps.

The map :math:`P` of the stored charges and fluxes over one period is computed by steps of order 4
with error control, much finer than a run's.  In coordinates :math:`y` in which all stores count by
their energy, every step of Newton's method solves

.. math::

    (I - \\Phi)\\, \\delta = P(y) - y, \\qquad \\Phi = \\frac{\\partial P}{\\partial y},

with the derivative of the computed steps themselves, events and jumps included.  :math:`P` is
smooth as long as the same elements turn in the same order.  A step that leads to another order and
no nearer ends just beyond where the order changes, since the derivative there is that of the other
side (J. Katzenelson, "An algorithm for solving nonlinear resistor networks", Bell Syst. Tech. J. 44
(1965) 1605).

Where the period is not known, or several elements turn at one instant, differences of periods serve
in a space of few directions: those in which the residual lies and their images.  What parasitics
store is forgotten within a period (:math:`\\Phi v \\approx 0`), so that the space grows to about
the number of slow stores, and it serves for later steps too.

References: R. Telichevesky, K. S. Kundert, J. K. White, "Efficient steady-state analysis based on
matrix-free Krylov-subspace methods", Proc. 32nd DAC (1995) 480, doi:10.1145/217474.217574; T. J.
Aprille, T. N. Trick, Proc. IEEE 60 (1972) 108, doi:10.1109/PROC.1972.8563.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..problems.csc import Floats
from .orbit import Complexes, Found, NoDerivative, NoOrbit, State
from .perturbed import monodromy
from .stepped_map import Period, StepMap
from .stepper import UnsolvedStep
from .tangent import Tangent

_CLOSE = 0.1  # last step of Newton's method in units of a run's tolerance
_SOLVED = 0.01  # part of the residual that may be left by the linear equations
_SPACE = 24  # directions at most
_STEPS = 24  # of Newton's method, then more periods are run
_MORE = (16, 64, 256, 1024)
_STEADY = 1e-2  # relative change of the residual over 64 periods below which it is a drift
_SLOWER = 0.3  # reduction of the residual by a step below which old directions serve again
_SHORTER = 0.25  # parts of a step that are tried one after the other
_SHORTEST = _SHORTER**4
_NEARER = 0.9  # part of a residual that a whole step may leave
_LEAPS = 3  # of one search
_BISECTIONS = 7  # between two orders of events
_FINDS = 24  # between always on and always off
_LAST = 8  # periods whose ends are extrapolated
_CYCLES = 3  # of extrapolation
_FARTHEST = 100.0  # times what the settling periods have reached, where an orbit is looked for
_NOISE = 4.0  # residual in units of the error of a step, below which it is noise
_WIDER = 4.0  # differences that show errors
_COARSER = 16.0  # of tolerances, which steps of order 4 meet with half as many
#: multipliers below this are not distinguished from zero
UNSEEN = 1e-4


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
        #: of the last image
        self.period: Period | None = None
        #: where the search has ended
        self.phi: Floats | None = None
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
        """Return P(y); its steps are kept if the period is known."""
        start, period = self.state(y), self.map.period
        if period is None:
            end = self.map.run(start)
        else:
            self.period = self.map.recorded(start, period, period)
            end = self.period.end
        self.gates = end.gates
        return self.y(end)

    def derivative(self) -> Floats | None:
        """Return Phi where the last image began, None if it is not known."""
        if self.period is None:
            return None
        system = self.map.system
        tangent = Tangent(system, self.period.steps, self.period.begin.energy)
        try:
            found = monodromy(tangent)
        except NoDerivative:
            return None
        whole = np.zeros((system.n, system.n))
        whole[np.ix_(tangent.stored, tangent.stored)] = found
        phi: Floats = whole[np.ix_(self.rows, self.rows)] * self.scale / self.scale[:, np.newaxis]
        return phi if np.isfinite(phi).all() else None

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
            phi = self.derivative()
            if phi is None:
                step = self._by_differences(y, end, space)
            else:
                # what the steps do not distinguish from 1 stays
                matrix = np.eye(y.size) - phi
                step = np.linalg.lstsq(matrix, residual, rcond=tolerance)[0].astype(np.float64)
            self.residual, self.error = now / size, float(np.linalg.norm(step)) / size
            if quiet and (self.error <= close or now > 0.5 * before):
                self.phi = phi
                return y
            self.steps += 1
            before = now
            across = None if phi is None or quiet else self._across(y, step, now)
            if across is not None:
                y, end = across
                continue
            # the whole step has been tried where the derivative is known
            longest = 1.0 if phi is None or quiet else _SHORTER
            y, end, after = self._damped(y, end, step, now, quiet, longest)
            if math.isinf(after) and leaps < _LEAPS:
                # a period changes this state by the same amount again and again
                leaps += 1
                y = self._leap(y)
                end = self.image(y)
            if after > _SLOWER * now:
                space = _Space(y.size)
        raise NoOrbit("search", self.residual)

    def _by_differences(self, y: Floats, end: Floats, space: _Space) -> Floats:
        """Return the step of Newton's method by differences along few directions."""
        tolerance, residual = self.map.fine.reltol, end - y
        size = float(np.linalg.norm(residual))
        most = max(_SOLVED * size, 0.5 * tolerance * self.size(y, end))
        c, rest = space.split(residual)
        while np.linalg.norm(rest) > most:
            v = space.outside(rest)
            if v is None or space.V.shape[1] >= min(_SPACE, y.size):
                break
            # half the digits of a run: curvature and errors of steps take the same part
            space.add(v, self.difference(y, end, v, math.sqrt(tolerance)))
            c, rest = space.split(residual)
        # what is left lies where a period forgets
        return np.asarray(space.V @ c + rest)

    def _across(self, y: Floats, step: Floats, now: float) -> tuple[Floats, Floats] | None:
        """Return a point along a step, and its end: just beyond where the order of events changes.

        The whole step if it leads nearer; None if the order stays, or laws have no solution there.
        """
        here, low, high = self.period, 0.0, 1.0
        assert here is not None
        try:
            found, end, there = self._tried(y + step)
            left, alike = float(np.linalg.norm(end - found)), there.alike(here)
            if left <= 0.5 * now or (alike and left <= _NEARER * now):
                return found, end
            if alike:
                return None
            for k in range(_FINDS):
                if k >= _BISECTIONS and (here.events or there.events):
                    break
                middle = 0.5 * (low + high)
                trial, after, period = self._tried(y + middle * step)
                if period.alike(here):
                    low = middle
                else:
                    found, end, there, high = trial, after, period, middle
        except (UnsolvedStep, NoOrbit):
            return None
        self.period, self.gates = there, there.end.gates
        return found, end

    def _tried(self, y: Floats) -> tuple[Floats, Floats, Period]:
        """Return a point, where it leads, and its period."""
        end = self.image(y)
        assert self.period is not None
        return y, end, self.period

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
        self, y: Floats, end: Floats, step: Floats, now: float, quiet: bool, share: float
    ) -> tuple[Floats, Floats, float]:
        """Return a point along a step, of which a ``share`` is the longest part that is tried.

        A period changes it less; where that leads comes with it.
        """
        while share >= _SHORTEST:
            trial = y + share * step
            try:
                after = self.image(trial)
            except (UnsolvedStep, NoOrbit):
                share *= _SHORTER
                continue
            left = float(np.linalg.norm(after - trial))
            if quiet or left <= (1.0 - (1.0 - _NEARER) * share) * now:
                return trial, after, left
            share *= _SHORTER
        return end, self.image(end), math.inf  # no descent: where the run itself leads

    def size(self, *points: Floats) -> float:
        """Return the size of coordinates, at least that of all stores at their largest."""
        return max(1.0, *(float(np.linalg.norm(p)) for p in points))

    def multipliers(self, y: Floats) -> tuple[Complexes, Floats, float]:
        """Return the Floquet multipliers above their error, directions of those at 1, the error.

        By Arnoldi's method from a direction in which all stores take part, where the derivative is
        not known.
        """
        if self.phi is not None and self.period is not None:
            return self._multipliers(self.phi, self._uncertainty(y, self.phi))
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

    def _uncertainty(self, y: Floats, phi: Floats) -> float:
        """Return by how much Phi may be off: steps so much coarser err by so much more."""
        found, fine = None, self.map.fine
        self.map.fine = replace(fine, reltol=_COARSER * fine.reltol)
        try:
            self.image(y)
            found = self.derivative()
        except UnsolvedStep:
            pass  # the finer ones had a solution
        finally:
            self.map.fine = fine
        if found is None:
            return UNSEEN
        return float(np.linalg.norm(found - phi, 2)) / (_COARSER - 1.0)

    def _multipliers(self, phi: Floats, uncertainty: float) -> tuple[Complexes, Floats, float]:
        """Return what :meth:`multipliers` does, of a derivative.

        An error of the matrix counts by the inverse of the cosine between the eigenvectors of
        either side (G. H. Golub, C. F. Van Loan, Matrix Computations (2013), section 7.2.2).
        """
        import scipy.linalg

        values, left, right = scipy.linalg.eig(phi, left=True)
        order = np.argsort(-np.abs(values), kind="stable")
        values, left, right = values[order], left[:, order], right[:, order]
        cosine = np.abs(np.sum(left.conj() * right, axis=0))
        with np.errstate(divide="ignore"):
            errors = max(uncertainty, self.map.fine.reltol) / cosine
        seen = np.abs(values) > np.maximum(errors, UNSEEN)
        free = np.real(right[:, seen & (np.abs(values - 1.0) <= errors)]).T
        return values[seen].astype(np.complex128), free, float(errors[seen].max(initial=UNSEEN))

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
