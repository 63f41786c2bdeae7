r"""Reduction of a differential variational inequality to an ordinary differential equation.

Where ``SOL(K, g(t, x, .))`` is one point u(t, x), Lipschitz in x, the DVI is ``x' = f(t, x, u(t,
x))``.  Where it has several points but a start picks one, and the solution there is regular, the
selection through that point is followed as long as it is regular.

Source: T. Roubal (2015), sections 2.2.1 and 2.2.2.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...analyses.certificate.certificate import Certificate
from ...analyses.signals.events import Events
from ...analyses.solution.solution import IslandRun, Solution
from ...errors import NumericalError
from ...netlist.expressions.node import var
from ...problems.matrices import is_p_matrix
from ...problems.regularity import inverses
from ..equations.assembly import Model, Pair, Row, assemble
from ..equations.newton import NotNear, StepProblem
from ..runs.scheme import put
from ..terms.errors import RegularityLost, wrong
from ..terms.expression import Expr

if TYPE_CHECKING:
    from .dvi import DVI

Floats = npt.NDArray[np.float64]

#: a selection that is followed in steps below this part of the way has ended
_SHORTEST = 2.0**-20
_HALF = 0.5
#: tolerances of a step that it may miss its integral by: its interpolant is of order 7
_GRANTED, _FINEST = 1e3, 2.5e-14
#: instants inside each step at which the rates are evaluated once more for the certificate: a rule
#: of degree 13, next to a method of order 8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(7)


class Reduced:
    """The ordinary differential equation ``x' = h(t, x)`` of a DVI.

    Call it with a time and the states; ``run`` integrates it.

    Parameters
    ----------
    problem : DVI
    guess : mapping of str to float
        Values of other unknowns at the start, which pick a selection.

    Examples
    --------
    >>> from nsspice.dvi import DVI, complementarity, multiplier, states
    >>> x, v = states("x", "v")
    >>> n = multiplier("n")
    >>> soft = DVI({x: v, v: n - 9.81}, [complementarity(n, x + n/1e4)], start={x: 1, v: 0})
    >>> soft.to_ode()(0.0, [-0.001, 0.0]).round(9).tolist()
    [0.0, 0.19]
    """

    def __init__(self, problem: DVI, guess: Mapping[str, float] | None = None) -> None:
        closed = problem.model.close()
        self.problem = problem
        self.states = [row.name for row in closed.rows if row.state]
        old = {name: var(f"{name}#old") for name in self.states}
        rows = [Row(r.name, Expr(put(r.right.node, old))) for r in closed.rows if not r.state]
        pairs = [
            Pair(p.name, Expr(put(p.slack.node, old)), p.enters, p.multiplier) for p in closed.pairs
        ]
        given = tuple(f"{name}#old" for name in self.states)
        self._rates = [row.right for row in closed.rows if row.state]
        self._problem = StepProblem(assemble(Model(rows, pairs, {}, given)))
        self._guess = dict(guess or {})
        self.begin()

    def begin(self) -> None:
        """Return to the selection through the guess."""
        assembly = self._problem.assembly
        z = np.array([self._guess.get(name, 0.0) for name in assembly.columns])
        self._problem.point = z, np.zeros(assembly.system.m)
        self._problem.near = False
        self._last: tuple[float, Floats] | None = None
        self._found: dict[str, float] = {}
        x = np.array([self.problem.start[name] for name in self.states])
        self.unknowns(self.problem.at, x)
        self._problem.near = bool(self._guess)
        self._matrix = self._problem.matrix()

    def unknowns(self, t: float, x: npt.ArrayLike) -> dict[str, float]:
        """Return the multipliers and algebraic unknowns u(t, x) by name.

        They are followed along a straight line from where they were found last.

        Raises
        ------
        RegularityLost
            NS6021 if the selection ends on the way.
        """
        given = np.asarray(x, dtype=float)
        if self._last is None:
            self._found = self._at(t, given)
            self._last = t, given
        elif self._last[0] != t or not np.array_equal(self._last[1], given):
            self._follow(t, given)
        return self._found

    def _at(self, t: float, x: Floats) -> dict[str, float]:
        values = dict(zip(self.states, x.tolist(), strict=True))
        return self._problem.solve(values, t, t)

    def _follow(self, t: float, x: Floats) -> None:
        """Go to a point in steps so short that no other solution is met.

        Without smooth terms a solution is found as it is: where it is the only one in its modes
        there is nothing to follow.
        """
        assert self._last is not None
        t0, x0 = self._last
        begin = self._problem.point, self._last, self._found
        done, share, before = 0.0, 1.0, self._matrix
        while done < 1.0:
            end = min(1.0, done + share)
            middle = x if end == 1.0 else x0 + end * (x - x0)
            time = t if end == 1.0 else t0 + end * (t - t0)
            kept = self._problem.point
            try:
                found = self._at(time, middle)
                matrix = self._beside(before)
                self._found, before = found, matrix
            except (NotNear, NumericalError):
                self._problem.point = kept
                if not self._problem.near:
                    raise
                share *= 0.5
                if share < _SHORTEST:
                    # back from where rounding chooses between solutions
                    self._problem.point, self._last, self._found = begin
                    raise RegularityLost(time, self.states[0], np.inf) from None
                continue
            self._last, done = (time, middle), end
            share *= 2.0
        self._matrix = before

    def _beside(self, before: Floats) -> Floats:
        """Return the matrix of the linearised equations, which is near to that of the last point.

        Between matrices whose quotient is within 1/2 of 1 there is no singular one: the solutions
        belong to one branch.

        Raises
        ------
        NotNear
            If it is not.
        """
        matrix = self._problem.matrix()
        if not self._problem.near:
            return matrix
        try:
            quotient = np.linalg.solve(before, matrix)
        except np.linalg.LinAlgError:
            raise NotNear from None
        if not np.linalg.norm(quotient - np.eye(len(matrix)), 2) <= _HALF:
            raise NotNear
        return matrix

    def __call__(self, t: float, x: npt.ArrayLike) -> Floats:
        """Return the rates of the states, shape (n,)."""
        values = dict(zip(self.states, np.asarray(x, dtype=float).tolist(), strict=True))
        values.update(self.unknowns(t, x))
        values["time"] = t
        return np.array([float(rate.value(values)) for rate in self._rates])

    def switches(self, t: float, x: Floats) -> Floats:
        """Return ``lam - w`` of each pair, which changes its sign where the pair switches."""
        self.unknowns(t, x)
        system = self._problem.assembly.system
        z, lam = self._problem.point
        return np.asarray(lam - (system.q - system.B.dot(z) + system.D.dot(lam)))

    def regular(self) -> tuple[bool, str]:
        """Return whether the unknowns are locally one function of the states at the last point."""
        system = self._problem.assembly.system
        K = system.G.dense()
        z = self._problem.point[0]
        if system.smooth is not None:
            K = K + system.smooth.F.dense() @ self._problem.jacobian(z)
        inverse = inverses(K[None])
        if inverse is None:
            return False, "the algebraic equations are singular"
        M = system.D.dense() + system.B.dense() @ inverse[0] @ system.A.dense()
        if not is_p_matrix(M):
            names = ", ".join(self._problem.assembly.pairs)
            return False, f"the matrix of the pairs {names} is not a P-matrix"
        return True, ""

    def run(self, stop: float, *, rows: int = 1000, reltol: float = 2.5e-14) -> Solution:
        """Integrate by the method of Dormand and Prince of order 8, pair by pair.

        Parameters
        ----------
        stop : float
            Length of the run [s].
        rows : int
            Intervals between output rows.
        reltol : float
            Relative tolerance; switches of pairs are located, and the run is restarted there.

        Raises
        ------
        RegularityLost
            NS6021 where a selection ends.
        """
        from scipy.integrate import solve_ivp

        begun = clock.perf_counter()
        problem = self.problem
        self.begin()
        begin, end = problem.at, problem.at + stop
        grid = np.linspace(begin, end, rows + 1)
        x = np.array([problem.start[name] for name in self.states])
        scale = np.maximum(np.abs(x), 1e-3 * max(1e-300, float(np.max(np.abs(x), initial=1.0))))
        table = np.zeros((rows + 1, x.size))
        table[0] = x
        t, filled, calls = begin, 1, 0
        times, numbers, on = [], [], []
        m = self._problem.assembly.system.m

        def event(k: int) -> Any:
            def distance(s: float, y: Floats) -> float:
                return float(self.switches(s, y)[k])

            distance.terminal = True  # type: ignore[attr-defined]
            return distance

        def rate(s: float, y: Floats) -> Floats:
            try:
                return self(s, y) if np.all(np.isfinite(y)) else np.full(y.size, np.nan)
            except RegularityLost:  # on trial: a shorter step may keep away from there
                return np.full(y.size, np.nan)

        events = [event(k) for k in range(m)]
        self(t, x)  # what has no rates at the start raises here
        defect = 0.0
        while t < end:
            got = solve_ivp(
                rate, (t, end), x, method="DOP853", rtol=reltol, atol=reltol * scale,
                events=events, dense_output=True,
            )  # fmt: skip
            calls += int(got.nfev)
            defect = max(defect, self._defect(got.t, got.sol, got.y, rate))
            if got.status < 0:
                raise RegularityLost(float(got.t[-1]), self.states[0], np.inf)
            last = float(got.t[-1])
            here = grid[filled : int(np.searchsorted(grid, last, side="right"))]
            if here.size:
                table[filled : filled + here.size] = got.sol(here).T
                filled += here.size
            scale = np.maximum(scale, np.max(np.abs(got.y), axis=1))
            x, t = got.y[:, -1].copy(), last
            for k, found in enumerate(got.t_events or []):
                if len(found) and t < end:
                    times.append(t)
                    numbers.append(k)
                    on.append(bool(self._rises(k, t, x)))
            if t < end:
                # one short step over the switch, where its distance is zero
                h = 16.0 * 2.0**-52 * max(abs(t), stop)
                x, t = x + h * self(t, x), t + h
        others = self._table(grid, table)
        signals = {name: table[:, k] for k, name in enumerate(self.states)}
        signals.update({n: v for n, v in others.items() if "#" not in n})
        kind, reason = problem.problem_class
        return Solution(
            "tran",
            problem.name,
            "time",
            grid,
            signals,
            events=Events(
                np.array(times),
                np.array(numbers, dtype=np.uint64),
                np.array(on, dtype=bool),
                self._problem.assembly.pairs,
            ),
            islands=[
                IslandRun(
                    1,
                    kind,
                    reason,
                    "dop853",
                    x.size,
                    m,
                    None,
                    None,
                    {"evaluations": calls, "events": len(times)},
                    "reduced to an ordinary differential equation",
                    reltol,
                )
            ],
            certificate=Certificate(
                self._problem.residual,
                self._problem.residual,
                calls,
                late=defect / (_GRANTED * max(reltol, _FINEST)),
            ),
            wall_time=clock.perf_counter() - begun,
        )

    def _defect(
        self, times: Floats, inside: Any, states: Floats, rate: Callable[[float, Floats], Floats]
    ) -> float:
        """Return how far steps miss the integrals of their rates, as a part of what they add up.

        The rates are evaluated at other instants than those of the method, the unknowns followed
        to them again.
        """
        worst = 0.0
        if len(times) < 2:
            return worst
        for k, (a, b) in enumerate(pairwise(times.tolist())):
            at = 0.5 * (a + b) + 0.5 * (b - a) * _NODES
            rates = np.array([rate(s, inside(s)) for s in at.tolist()])
            total = 0.5 * (b - a) * (_WEIGHTS @ rates)
            size = np.abs(states[:, k]) + 0.5 * (b - a) * (_WEIGHTS @ np.abs(rates))
            missed = np.abs(states[:, k + 1] - states[:, k] - total)
            worst = max(worst, float(np.max(missed) / max(float(np.max(size)), 1e-300)))
        return worst

    def _rises(self, k: int, t: float, x: Floats) -> bool:
        h = 1e-9 * max(abs(t), 1.0)
        return bool(self.switches(t + h, x + h * self(t, x))[k] > 0.0)

    def _table(self, grid: Floats, table: Floats) -> dict[str, Floats]:
        self.begin()
        found = [self.unknowns(float(t), x) for t, x in zip(grid, table, strict=True)]
        return {name: np.array([row[name] for row in found]) for name in found[0]}


def reduce(problem: DVI) -> Reduced:
    """Return the ordinary differential equation of a DVI.

    Raises
    ------
    UsageError
        NS6005 if its algebraic part has no unique solution that moves continuously with the states.
    """
    out = Reduced(problem, problem.guess)
    x = np.array([problem.start[name] for name in out.states])
    out.unknowns(problem.at, x)
    fine, why = out.regular()
    if not fine:
        raise wrong(
            "NS6005",
            f"the problem does not reduce to an ordinary differential equation: {why}",
            "run() solves it as a differential inclusion",
        )
    return out
