"""Periodic orbits of a system that the mode-wise engine integrates, by Newton's method.

With :math:`P(a)` the energy coordinates after one period from :math:`a`, and the derivative
:math:`\\Phi = \\partial P / \\partial a` in closed form across all switchings (saltation matrices),
each step solves

.. math::

    (I - \\Phi)\\, \\delta = P(a) - a .

Where the switching instants are fixed by sources, one step is exact.  Else the step is damped until
the residual falls; where nothing helps a period is run instead, which leads to a stable orbit.  If
a trigger ends the period, the end is that of the trigger's event, and the length of the period
needs no equation of its own.

References: T. J. Aprille, T. N. Trick, "Steady-state analysis of nonlinear circuits with periodic
inputs", Proc. IEEE 60 (1972) 108, doi:10.1109/PROC.1972.8563; R. I. Leine, H. Nijmeijer, Dynamics
and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), section 7.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .. import _core
from ..problems.csc import Csc, Floats
from ..problems.descriptor import DescriptorSystem, Functional, Switch
from .compiled import compiled
from .modewise import NotModewise, refusal
from .stepper import UnsolvedStep, restless

Complexes = npt.NDArray[np.complex128]

_EPS = float(np.finfo(float).eps)
PERIODS = 8  # run before the first step of Newton's method
_STEPS = 16  # of Newton's method, then more periods are run
_MORE = (16, 64, 256, 1024)  # before it is tried again
_DRIFTS = 8  # periods after which what drifts is taken to drift for ever
_HALVINGS = 6  # of one step
_LEAPS = 3  # of one search
_FAR = 3.0  # a step of so many times what is stored leads nowhere
_ENOUGH = 1e-13  # relative step after which nothing changes but rounding
_FIRST_SEARCH, _LAST_SEARCH = 1e-9, 1e4  # time within which a trigger is looked for [s]


class NoDerivative(Exception):
    """The end of a run is not a differentiable function of its beginning.

    Parameters
    ----------
    kind : str
        ``grazing``: a guard touches zero without crossing it; ``together``: several switchings at
        one instant, whose order a perturbation decides; ``unproved``: implicit steps were needed.
    time : float
        [s]
    pairs : tuple of int
        Whose guards take part.
    """

    def __init__(self, kind: str, time: float, pairs: Sequence[int] = ()) -> None:
        super().__init__(kind)
        self.kind, self.time, self.pairs = kind, time, tuple(pairs)


class NoOrbit(Exception):
    """No periodic orbit was found.

    Parameters
    ----------
    kind : str
        ``drift``: something grows by the same amount in each period; ``search``: Newton's method
        and running on did not end; ``trigger``: no rising crossing of the trigger.
    residual : float
        Relative change over the last period.
    direction : ndarray, shape (n,), or None
        Charges and fluxes that drift, per period.
    """

    def __init__(self, kind: str, residual: float, direction: Floats | None = None) -> None:
        super().__init__(kind)
        self.kind, self.residual, self.direction = kind, residual, direction


@dataclass(frozen=True, slots=True)
class State:
    """Where a run begins.

    Parameters
    ----------
    energy : ndarray, shape (r,)
        Energy coordinates: half their square is the stored energy [J].
    gates : list of bool
        States of the switches.
    """

    energy: Floats
    gates: list[bool]


@dataclass(frozen=True, slots=True)
class Found:
    """A periodic orbit.

    Parameters
    ----------
    state : State
    charges : ndarray, shape (n,)
        Charges [C] and fluxes [V s] at its beginning.
    period : float
        [s]
    multipliers : ndarray of complex
        Floquet multipliers, the largest first; that of the free phase of a triggered orbit is left
        out.
    steps, periods : int
        Steps of Newton's method, and periods run in all.
    residual : float
        Change over the period, relative to the largest energy coordinates.
    free : ndarray, shape (k, n)
        Charges and fluxes that no law pulls back (multiplier 1): their values are those of the
        start.
    tolerance : float
        To which multipliers are known where steps with error control were taken, 0 if to rounding.
    """

    state: State
    charges: Floats
    period: float
    multipliers: Complexes
    steps: int
    periods: int
    residual: float
    free: Floats
    tolerance: float = 0.0


def with_trigger(system: DescriptorSystem, control: Functional, level: float) -> DescriptorSystem:
    """Return the system with a switch more, which only watches a signal rise through a level.

    Parameters
    ----------
    system : DescriptorSystem
    control : Functional
        A combination of unknowns.
    level : float
        [V or A]
    """
    n, m = system.n, system.m

    def grown(matrix: Csc, shape: tuple[int, int]) -> Csc:
        return Csc.from_triplets(shape, matrix.indices, matrix.columns, matrix.data)

    D = Csc.from_triplets(
        (m + 1, m + 1),
        np.append(system.D.indices, m),
        np.append(system.D.columns, m),
        np.append(system.D.data, 1.0),
    )
    watching = Switch(m, control.z, level, level)
    return replace(
        system,
        A=grown(system.A, (n, m + 1)),
        B=grown(system.B, (m + 1, n)),
        D=D,
        q=np.append(system.q, 0.0),
        switches=(*system.switches, watching),
    )


class PeriodMap:
    """The map of a state to that after one period, with its derivative.

    Parameters
    ----------
    system : DescriptorSystem
        Of linear elements and pairs; sources repeat with the period.
    period : float or None
        [s]; None if the last switch is a trigger (:func:`with_trigger`).
    outputs : sequence of Functional
        For responses and Fourier coefficients.
    stimuli : sequence of int
        Sources that may be perturbed.
    offsets : sequence of (int, int, float)
        Sources in the slacks of pairs, and in rows after these in the controls of switches that are
        below their thresholds, then of those above: row, source, factor.

    Raises
    ------
    NotModewise
        If the system cannot be treated.
    """

    def __init__(
        self,
        system: DescriptorSystem,
        period: float | None,
        outputs: Sequence[Functional] = (),
        stimuli: Sequence[int] = (),
        offsets: Sequence[tuple[int, int, float]] = (),
    ) -> None:
        reason = refusal(system)
        if reason is not None:
            raise NotModewise(reason)
        self.system, self.period = system, period
        self.periods = 0
        self._trigger = None if period is not None else len(system.switches) - 1
        self._limit = _FIRST_SEARCH
        try:
            self.core = _core.Orbit(
                compiled(system),
                [(f.z, f.lam, f.dz, f.u) for f in outputs],
                list(stimuli),
                list(offsets),
            )
        except ValueError as error:
            raise NotModewise(str(error)) from error

    @property
    def triggered(self) -> bool:
        """True if a trigger ends the period."""
        return self._trigger is not None

    def run(self, start: State) -> State:
        """Return the state one period later.

        Raises
        ------
        UnsolvedStep
            If the laws have no solution.
        NoDerivative
            If the run needed implicit steps.
        NoOrbit
            If the trigger does not come.
        """
        self.periods += 1
        limit = self.period if self.period is not None else self._limit
        while True:
            result = self.core.run(start.energy, start.gates, limit, self._trigger)
            if "passed" not in result:
                if result["restless"] is not None:
                    raise restless(result)
                raise UnsolvedStep(result["time"], result["residual"], None)
            passed = result["passed"]
            if passed in ("unproved", "many"):
                raise NoDerivative(passed, self.core.period())
            if self._trigger is None or passed == "trigger":
                break
            limit *= 10.0
            if limit > _LAST_SEARCH:
                raise NoOrbit("trigger", 0.0)
        self._limit = limit
        return State(self.core.end(), self.core.gates())

    def settled(self, start: State, time: float) -> State:
        """Return the state after running for a time [s], regardless of the trigger."""
        result = self.core.run(start.energy, start.gates, time, None)
        if "passed" not in result:
            raise UnsolvedStep(result["time"], result["residual"], None)
        if result["passed"] != "stop":
            raise NoDerivative(result["passed"], self.core.period())
        return State(self.core.end(), self.core.gates())

    def derivative(self) -> Floats:
        """Return the derivative of the last run's end by its beginning, shape (r, r).

        Raises
        ------
        NoDerivative
        """
        found = self.core.differentiate()
        if found is not None:
            raise NoDerivative(*found)
        r = self.core.states()
        matrix: Floats = self.core.derivative(self.triggered).reshape(r, r)
        return matrix

    def multipliers(self) -> Complexes:
        """Return the eigenvalues of the monodromy matrix of the last run, the largest first."""
        found = self.core.multipliers()
        if found is None:
            raise NoDerivative("unproved", 0.0)
        values = found[::2] + 1j * found[1::2]
        order = np.argsort(-np.abs(values), kind="stable")
        result: Complexes = values[order]
        return result


def _solve(matrix: Floats, rhs: Floats, noise: float) -> tuple[Floats, Floats, Floats, float]:
    """Return the least solution, directions without one, and the least other singular value."""
    u, s, vt = np.linalg.svd(matrix)
    dead = s <= noise * max(float(s.max(initial=0.0)), 1.0)
    inverse = np.where(dead, 0.0, 1.0 / np.where(dead, 1.0, s))
    least = float(s[~dead].min(initial=1.0))
    return vt.T @ (inverse * (u.T @ rhs)), u.T[dead], vt[dead], least


def find_orbit(period_map: PeriodMap, start: State, settle: int = PERIODS) -> Found:
    """Find a periodic orbit near the run from a state.

    Parameters
    ----------
    period_map : PeriodMap
    start : State
    settle : int
        Periods run before the first step of Newton's method.

    Raises
    ------
    NoOrbit
        If there is none, or none was found.
    NoDerivative
        If the derivative is needed where there is none.
    UnsolvedStep
        If a run has no solution.
    """
    state = start
    if period_map.triggered:
        state = period_map.run(state)  # to the first crossing
    steps, failed = 0, NoOrbit("search", 0.0)
    for more in (settle, *_MORE):
        for _ in range(more):
            state = period_map.run(state)
        try:
            return _newton(period_map, state, steps)
        except NoOrbit as problem:
            if problem.kind == "drift":
                raise
            failed = problem
            steps += _STEPS
    raise failed


def _newton(period_map: PeriodMap, state: State, before: int) -> Found:
    """Return the orbit that Newton's method finds from a state, after so many steps before."""
    core, r = period_map.core, period_map.core.states()
    end = period_map.run(state)
    drifting = leaps = 0
    for step in range(before + 1, before + _STEPS + 1):
        scale = float(np.linalg.norm(core.sizes()))
        defect = end.energy - state.energy
        size = float(np.linalg.norm(defect))
        if scale == 0.0:  # nothing is stored, or all is at rest
            if r:
                period_map.derivative()
            return _found(period_map, state, step, 0.0, np.zeros((0, r)))
        derivative = period_map.derivative()
        # each of its entries is a sum of r products for each segment
        noise = 8.0 * _EPS * max(r, 1) * max(core.segments(), 1)
        delta, left, right, least = _solve(np.eye(r) - derivative, defect, noise)
        drift = left.T @ (left @ defect)
        drifts = bool(np.linalg.norm(drift) > 1e3 * noise * scale)
        if leaps < _LEAPS and (drifts or np.linalg.norm(delta) > _FAR * scale):
            way, farthest = (right.T @ (right @ drift), math.inf) if drifts else (delta, 1.0)
            found = _leap(period_map, State(state.energy, end.gates), way, farthest)
            if found is not None:
                leaps += 1
                state, end = found
                continue
        if drifts:
            # a period without the event that pulls back what drifts may be followed by one with it
            drifting += 1
            if drifting == _DRIFTS:
                raise NoOrbit("drift", size / scale, core.charges_of(drift))
            state, end = end, period_map.run(end)
            continue
        drifting = 0
        state, end = _advance(period_map, state, end, delta, size, drift)
        left_over = float(np.linalg.norm(end.energy - state.energy - drift))
        # what is left is rounding, or makes no digit that counts even in the slowest direction
        if left_over <= max(_ENOUGH * least, noise) * scale:
            period_map.derivative()
            return _found(period_map, state, step, left_over / scale, right)
    raise NoOrbit("search", size / scale)


def _leap(
    period_map: PeriodMap, state: State, way: Floats, farthest: float
) -> tuple[State, State] | None:
    """Return a state where a switch is no longer stuck, and that after a period.

    A switch that is open (or closed) all the time winds up the integrator of its controller, and a
    step of Newton's method in this mode leads nowhere.  Along its direction the state goes to half
    the way between the part at which the switch first acts somewhere in the period, and that at
    which it is stuck the other way.  None if that is not within ``farthest`` times the step.
    """
    core = period_map.core
    margins = [m for m in core.margins(way) if m[1] < farthest]
    if not margins:
        return None
    _, first, last = min(margins, key=lambda m: m[1])
    trial = State(state.energy + 0.5 * (first + min(last, farthest)) * way, state.gates)
    try:
        return trial, period_map.run(trial)
    except (UnsolvedStep, NoDerivative, NoOrbit):
        period_map.run(state)  # its derivative is needed once more
        period_map.derivative()
        return None


def _advance(
    period_map: PeriodMap, state: State, end: State, delta: Floats, size: float, drift: Floats
) -> tuple[State, State]:
    """Return a state along Newton's step from which a period changes less, and that after it."""
    still = float(np.linalg.norm(drift))
    share = 1.0
    for _ in range(_HALVINGS):
        trial = State(state.energy + share * delta, end.gates)
        try:
            after = period_map.run(trial)
        except (UnsolvedStep, NoDerivative, NoOrbit):
            share *= 0.25
            continue
        left = float(np.linalg.norm(after.energy - trial.energy))
        if left <= (1.0 - 0.1 * share) * size + still or left <= _ENOUGH * size:
            return trial, after
        share *= 0.25
    # no descent in this direction: where the run itself leads
    return end, period_map.run(end)


def _found(period_map: PeriodMap, state: State, steps: int, residual: float, free: Floats) -> Found:
    core = period_map.core
    multipliers = period_map.multipliers()
    if period_map.triggered and multipliers.size:
        multipliers = np.delete(multipliers, int(np.argmin(np.abs(multipliers - 1.0))))
    charges = np.array([core.charges_of(row) for row in free]).reshape(-1, period_map.system.n)
    return Found(
        state,
        core.charges_of(state.energy),
        core.period(),
        multipliers,
        steps,
        period_map.periods,
        residual,
        charges,
    )
