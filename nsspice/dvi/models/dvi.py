"""Differential variational inequalities: rates, conditions, start; runs and verdicts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..equations.assembly import Assembly, Model, Row, assemble
from ..runs.engines import Plan
from ..runs.impacts import Impacts, check_start
from ..runs.scheme import Scheme
from ..runs.trajectory import Task, check_run, simulate, step_through
from ..terms.errors import wrong
from ..terms.expression import Expr, as_vector
from .refused import check_index, check_kept, check_path, check_times

if TYPE_CHECKING:
    from ...analyses.solution.solution import Solution
    from .verdicts import Verdicts

Floats = npt.NDArray[np.float64]


class DVI:
    r"""A differential variational inequality with initial values.

    .. math::

        \dot x = f(t, x, u), \qquad u \in \mathrm{SOL}(K, g(t, x, \cdot)), \qquad x(a) = x_a

    Parameters
    ----------
    rates : mapping of states to expressions
        ``{x: v, v: -x}``; a vector of states takes an array.  Set-valued terms are written with
        :func:`Sgn`.
    conditions : sequence
        What determines the multipliers: :func:`complementarity`, :func:`contact`,
        :func:`equation`, or a :class:`VI` in which states are parameters.
    start : mapping of states to numbers
        x_a.  An initial value for an unknown without a rate picks one of several selections.
    at : float
        Instant a of the start [s].
    name : str
        Title of its solutions.

    Raises
    ------
    UsageError
        NS6001 if a variable has no equation or two, or a state has no initial value.

    Source: J.-S. Pang, D. E. Stewart, *Differential variational inequalities*, Math. Program. 113
    (2008); T. Roubal (2015), (1.4) to (1.6).

    Examples
    --------
    A block on a spring with dry friction sticks after some half periods:

    >>> from nsspice.dvi import DVI, Sgn, states
    >>> x, v = states("x", "v")
    >>> block = DVI({x: v, v: -x - Sgn(v)}, start={x: -2, v: 6})
    >>> sol = block.run(20)
    >>> round(float(sol["x"][-1]), 12)
    0.917237469702
    """

    kind = "DVI"

    def __init__(
        self,
        rates: Mapping[Any, Any],
        conditions: Sequence[Any] = (),
        *,
        start: Mapping[Any, Any],
        at: float = 0.0,
        name: str = "",
    ) -> None:
        self.model = Model()
        self.conditions = tuple(conditions)
        self.name, self.at = name, float(at)
        for state, right in flattened(rates, "the rate"):
            self.model.rows.append(Row(state.name, right, state=True))
        for condition in self.conditions:
            condition.write(self.model)
        self.start: dict[str, float] = {}
        for state, value in flattened(start, "the start"):
            number = value.value({"time": self.at})
            self.start[state.name] = float(number)
        states = [row.name for row in self.model.rows if row.state]
        for state_name in states:
            if state_name not in self.start:
                raise wrong(
                    "NS6001", f"the state {state_name} has no initial value", "add it to start="
                )
        #: starts of unknowns without rates, which pick one of several selections
        self.guess = {k: v for k, v in self.start.items() if k not in states}
        self.start = {k: v for k, v in self.start.items() if k in states}
        #: arrays of the whole problem, with the names of everything in them
        self.assembly: Assembly = assemble(self.model, self.at)
        for given in self.guess:
            if given not in self.assembly.places:
                raise wrong(
                    "NS6001", f"{given} has an initial value but no equation", "add its rate"
                )

    @property
    def states(self) -> list[str]:
        """Names of the states."""
        return self.assembly.states

    @property
    def signals(self) -> list[str]:
        """Names of the signals of a solution: states, then multipliers and set values."""
        hidden = ("#copy", "#slack")
        rest = [n for n in self.assembly.places if not n.endswith(hidden) and n not in self.states]
        return [*self.states, *rest]

    @property
    def problem_class(self) -> tuple[str, str]:
        """Class of the problem, and why it is of that class."""
        system = self.assembly.system
        pairs = f"{system.m} complementarity pairs" if system.m else "no set-valued terms"
        if system.smooth is not None:
            return ("DNCP" if system.m else "ODE"), f"{pairs}, smooth nonlinear terms"
        return ("DLCP" if system.m else "LINEAR_DAE"), f"{pairs}, all other terms linear"

    def run(
        self,
        stop: float,
        *,
        method: str = "auto",
        theta: float = 1.0,
        step: float | None = None,
        variant: int = 1,
        rows: int = 1000,
        reltol: float = 1e-10,
        theta_on: str = "states",
        time: str = "average",
        coefficients: str = "average",
    ) -> Solution:
        """Return the trajectory over a length of time.

        Parameters
        ----------
        stop : float
            Length of the run [s].
        method : str
            ``auto``: ``modewise`` (exact between events) for a linear problem, otherwise ``sdirk``
            (error control, events located); ``moreau``: the time-stepping schemes of the thesis.
        theta : float
            Weight of the new state, 1 implicit to 0 explicit (the thesis writes 1 - theta); means
            ``moreau``.
        step : float, optional
            Step of ``moreau`` [s], the longest one of ``sdirk``.
        variant : int
            Of (3.5): 1 holds the inequality at the new state, 2 at the old one (with a warning).
        rows : int
            Intervals between output rows; ``moreau`` has a row at each step.
        reltol : float
            Error of one step of ``sdirk``.
        theta_on : str
            What theta acts on besides the states in f: ``states``: nothing else, ``multipliers``:
            also the multipliers (the midpoint of both), ``slacks``: also the states in g.
        time : str
            Instant of f in a step: ``average``, or ``new`` as the thesis prints it.
        coefficients : str
            ``old`` evaluates the coefficients of multipliers at the old state: (3.8).

        Returns
        -------
        Solution
            As for circuits: ``sol["x"]``, ``sol.time``, ``sol.events``, ``sol.impulses``,
            ``sol.certificate``, ``sol.plot()``, ``sol.to_csv()``.

        Raises
        ------
        UsageError
            NS6004 for an option that does not exist, or a method that cannot handle the problem.
        NumericalError
            NS6020 if there is no solution.
        """
        check_run(stop, rows, step)
        check_start(self.model, self.start, self.at)
        check_index(self.model)
        check_times(self.model, self.at, self.at + stop)
        solution = self._solved(
            stop, Scheme(theta, variant, theta_on, time, coefficients), method, step, rows, reltol
        )
        # a jump at the start may have any size
        jumped = any(impulse.time <= self.at for impulse in solution.impulses)
        signals = {name: solution[name] for name in self.signals}
        check_kept(self.start, solution.time, signals, jumped)
        check_path(self.model, solution.time, signals)
        return solution

    def _solved(
        self,
        stop: float,
        scheme: Scheme,
        method: str,
        step: float | None,
        rows: int,
        reltol: float,
    ) -> Solution:
        """Return the solution of the engine that is asked for."""
        theta = scheme.theta
        if self.guess and method == "auto" and step is None and theta == 1.0:
            solution: Solution = self.to_ode().run(stop, rows=rows, reltol=max(reltol, 2.5e-14))
            return solution
        if self.guess and method not in ("auto", "moreau"):
            names = ", ".join(self.guess)
            raise wrong(
                "NS6004",
                f"method={method!r} does not follow the selection that the start of {names} picks",
                "method='auto' follows it as long as it is regular",
            )
        kind, reason = self.problem_class
        task = Task(
            self.model, self.start, self.signals, kind, reason, self.name, self.at, self.guess
        )
        impacts = Impacts.of(self.model, self.conditions, float(stop))
        plan = Plan(float(stop), stop / rows, method, theta, step, reltol)
        if method in ("auto", "moreau") and not (scheme.plain and method == "auto"):
            if impacts.bounce:
                raise wrong(
                    "NS6005",
                    "fixed steps have no impact law with restitution",
                    "use method='auto' without theta, which locates impacts",
                )
            return step_through(task, scheme, float(stop), step or stop / rows)
        return simulate(task, plan, impacts)

    def matrices(self) -> dict[str, Any]:
        """Return the matrices of the linear part, by letter, and the names of rows and columns.

        ``x' = A x + B u + p``, ``y = C x + D u + q`` for multipliers u and their slacks y; smooth
        terms and sources are omitted.

        Raises
        ------
        UsageError
            NS6005 if there are unknowns other than states and multipliers.

        Examples
        --------
        >>> from nsspice.dvi import DVI, complementarity, multiplier, states
        >>> x, u = states("x"), multiplier("u")
        >>> DVI({x: -x + u}, [complementarity(u, 2.0*x + u)], start={x: 1.0}).matrices()["D"]
        array([[1.]])
        """
        system = self.assembly.system
        n, inner = len(self.states), system.n - len(self.states)
        G, A = system.G.dense(), system.A.dense()
        B, D = system.B.dense(), system.D.dense()
        E = system.E.dense()[:n, :n]
        rate, force = -G[:n], -A[:n]
        if inner:
            # unknowns without rates follow from their rows where those are regular
            square, side = G[n:, n:], np.hstack([G[n:, :n], A[n:]])
            if np.linalg.matrix_rank(square) < inner:
                raise wrong(
                    "NS6005",
                    "unknowns without rates do not follow from states and multipliers",
                    "look at .assembly.system, the descriptor form",
                )
            follow = -np.linalg.solve(square, side)
            state, pair = follow[:, :n], follow[:, n:]
            rate, force = rate[:, :n] + rate[:, n:] @ state, force + rate[:, n:] @ pair
            B, D = B[:, :n] + B[:, n:] @ state, D - B[:, n:] @ pair
        else:
            rate = rate[:, :n]
        return {
            "A": np.linalg.solve(E, rate),
            "B": np.linalg.solve(E, force),
            "C": -B[:, :n],
            "D": D,
            "q": system.q.copy(),
            "states": list(self.states),
            "multipliers": list(self.assembly.pairs),
        }

    def verdict(self, region: Mapping[Any, tuple[float, float]] | None = None) -> Verdicts:
        """Return what the theorems say: existence, uniqueness, and each theorem by its number.

        Parameters
        ----------
        region : mapping of states to (float, float), optional
            Bounds of states: the statements are then about trajectories while they stay within.
            Functions that are Lipschitz only on bounded sets need one.

        Returns
        -------
        Verdicts
            By name; each holds, fails with the hypothesis that fails, or is not decided.

        Examples
        --------
        >>> from nsspice.dvi import DVI, Sgn, states
        >>> v = states("v")
        >>> friction = DVI({v: -9.81 * Sgn(v)}, start={v: -66})
        >>> bool(friction.verdict()["Theorem 2.3.3"])
        True
        """
        from .verdicts import of_dvi

        bounds = {state.name: ends for state, ends in (region or {}).items()}
        return of_dvi(self, bounds or None)

    def to_ode(self) -> Any:
        """Return the ordinary differential equation that the problem reduces to.

        Returns
        -------
        Reduced
            Callable ``h(t, x)``; see :class:`nsspice.dvi.models.reduction.Reduced`.
        """
        from .reduction import reduce

        return reduce(self)

    def __repr__(self) -> str:
        kind, reason = self.problem_class
        return f"<{type(self).__name__}: {kind}, states {', '.join(self.states)}; {reason}>"


def combined(
    terms: Iterable[tuple[Floats, Sequence[Expr]]], constant: Sequence[Expr]
) -> list[Expr]:
    """Return ``sum M x + constant`` row by row, without the zeros of the matrices."""
    out = list(constant)
    for M, x in terms:
        for i, j in zip(*np.nonzero(M), strict=True):
            out[i] = out[i] + float(M[i, j]) * x[j]
    return out


def flattened(values: Mapping[Any, Any], what: str) -> list[tuple[Expr, Expr]]:
    """Return variables with their expressions, vectors component by component.

    Raises
    ------
    UsageError
        NS6003 if the lengths differ.
    """
    found = []
    for key, value in values.items():
        left, right = as_vector(key), as_vector(value)
        if len(right) == 1 and len(left) > 1:
            right = right * len(left)
        if len(left) != len(right):
            raise wrong(
                "NS6003",
                f"{what} of {left[0].name} has {len(right)} components for {len(left)}",
                "",
            )
        found += list(zip(left, right, strict=True))
    return found
