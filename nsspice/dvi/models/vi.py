"""Variational inequalities and generalized equations, static or with the time as a parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...netlist.expressions.node import var
from ..equations.assembly import Assembly, Model, Row, assemble
from ..equations.conditions import members, write_membership
from ..equations.point import Point
from ..equations.static import Static
from ..terms.errors import wrong
from ..terms.expression import Expr, as_vector
from ..terms.sets import Cone, SecondOrderCone, Set
from ..terms.variables import Unknowns

if TYPE_CHECKING:
    from .tracking import Track
    from .verdicts import Verdicts

Floats = npt.NDArray[np.float64]
Within = Mapping[Any, Set]


class VI:
    r"""A variational inequality, or a generalized equation: ``0 in g(u) + F(u) + N_K(u)``.

    .. math::

        \langle g(u), v - u \rangle \ge 0 \quad \text{for all } v \in K, \qquad u \in K

    Parameters
    ----------
    g : Expr or array of Expr, or callable
        One component for each unknown; set-valued terms F by :func:`Sgn`.  A Python function of an
        array (and of the time, if it takes two arguments) is a slow path.
    within : mapping of unknowns to sets
        K as a product; unknowns without a set are free.
    of : unknowns, optional
        The unknowns in the order of the components of g; by default the order of ``within``, then
        that of appearance in g.
    jacobian : callable, optional
        Derivative of a Python function, shape (m, m); finite differences without it.

    Raises
    ------
    UsageError
        NS6003 if there are more components than unknowns, or fewer.

    Source: F. Facchinei, J.-S. Pang, *Finite-Dimensional Variational Inequalities and
    Complementarity Problems* (Springer, 2003); T. Roubal (2015), sections 1.1 and 2.1.

    Examples
    --------
    >>> from nsspice.dvi import VI, Cone, Sgn, asinh, unknowns
    >>> i = unknowns("i")
    >>> diode = VI(asinh(i) + Sgn(i) - 1.5, of=i)  # argsinh resistor and practical diode
    >>> bool(abs(diode.solve()[i] - np.sinh(0.5)) < 1e-14)
    True
    """

    kind = "VI"

    def __init__(
        self,
        g: Any,
        within: Within | None = None,
        *,
        of: Any = None,
        jacobian: Callable[..., Any] | None = None,
    ) -> None:
        self.within = dict(within or {})
        self.sets = members(self.within)
        self._call: Callable[..., Any] | None = None
        self._jacobian = jacobian
        if callable(g) and not isinstance(g, Expr):
            self._call = g
            self.g: list[Expr] = []
            self.unknowns = self._order(of, None)
        else:
            self.g = as_vector(g)
            self.unknowns = self._order(of, self.g)
            if len(self.g) != len(self.unknowns):
                raise wrong(
                    "NS6003",
                    f"g has {len(self.g)} components for {len(self.unknowns)} unknowns: "
                    f"{', '.join(u.name for u in self.unknowns[:6])}",
                    "give one for each; of= names the unknowns",
                )
        self._assembly: Assembly | None = None

    def _order(self, of: Any, g: Sequence[Expr] | None) -> list[Expr]:
        if of is not None:
            return as_vector(of)
        found = [u for variables, _ in self.sets for u in variables]
        names = {u.name for u in found}
        if g is not None:
            atoms = {name: atom for part in g for name, atom in part.atoms.items()}
            for part in (*g, *(atom.argument for atom in atoms.values())):
                for name in sorted(part.names):
                    if name not in names and name != "time" and name not in atoms:
                        names.add(name)
                        found.append(Expr(var(name)))
        return found

    # ------------------------------------------------------------------ as part of a DVI

    def write(self, model: Model) -> None:
        """Add the rows and pairs to a model in which other unknowns are parameters."""
        if self._call is not None:
            raise wrong(
                "NS6005", "a Python function cannot be compiled into a DVI", "write it as Expr"
            )
        rows = {}
        for u, part in zip(self.unknowns, self.g, strict=True):
            rows[u.name] = Row(u.name, -part)
            model.rows.append(rows[u.name])
        for variables, K in self.sets:
            for u in variables:
                if u.name not in rows:
                    raise wrong("NS6001", f"{u.name} has a set but no component of g", "")
            write_membership(model, variables, K, rows)

    @property
    def assembly(self) -> Assembly:
        """The problem as arrays."""
        if self._assembly is None:
            model = Model()
            self.write(model)
            self._assembly = assemble(model)
        return self._assembly

    @property
    def curved(self) -> bool:
        """True if K is not a polyhedron, or g is a Python function."""
        return self._call is not None or any(
            isinstance(K, SecondOrderCone) and len(u) > 2 for u, K in self.sets
        )

    # ------------------------------------------------------------------ solutions

    def solve(self, start: Any = None, *, at: float = 0.0) -> Point:
        """Return a solution.

        Parameters
        ----------
        start : mapping of unknowns to numbers, array or number, optional
            A point near it; 0 otherwise.
        at : float
            The time, if g depends on it [s].

        Raises
        ------
        NumericalError
            NS6020 if none was found.
        """
        if self.curved:
            from .projection import solve_by_projection

            return solve_by_projection(self, self._start(start), at)
        problem = Static(self.assembly)
        z, lam, _ = problem.solve(None if start is None else self._start(start), at)
        return problem.point(z, lam, at)

    def solutions(self, *, at: float = 0.0, start: Any = None) -> list[Point]:
        """Return the solutions: all isolated ones of a linear problem, else those found.

        A linear problem is solved mode by mode; for a nonlinear one, the solutions that Newton's
        method finds from 64 points around the start are returned; there may be more.
        """
        if self.curved:
            return [self.solve(start, at=at)]
        problem = Static(self.assembly)
        if problem.system.smooth is None:
            found = problem.all_linear(at)
        else:
            found = problem.search(at, self._start(start))
        order = [tuple(np.round(z, 9)) for z, _ in found]
        ranked = sorted(range(len(found)), key=lambda k: order[k])
        return [problem.point(*found[k], at) for k in ranked]

    def track(
        self,
        times: npt.ArrayLike,
        *,
        predictor: str = "data",
        correctors: int | None = 1,
        start: Any = None,
        errors: npt.ArrayLike | None = None,
    ) -> Track:
        """Follow the solution over time by Euler-Newton steps.

        Parameters
        ----------
        times : array_like, shape (k,)
            Grid [s].
        predictor : str
            ``data``: g at the new time, (3.4); ``rate``: g at the old time and its rate, (3.2).
        correctors : int, optional
            Newton steps after the predictor; None means 3 if g has kinks, otherwise 1.
        start : optional
            First point, used as it is (an error O(h^4) keeps the order); without it, it is solved
            for.
        errors : array_like, shape (k - 1, m), optional
            Residuals that the predictors may leave; O(h^2) keeps the order.

        Returns
        -------
        Track

        Raises
        ------
        RegularityLost
            NS6021 where the linearised problem loses strong regularity, with time and unknown.

        Source: R. Cibulka, T. Roubal (2017), (21) and (22); T. Roubal (2015), (3.2) and (3.4).
        """
        from .tracking import track

        return track(self, times, predictor, correctors, start, errors)

    def minimise(self, start: Any = None) -> Point:
        """Return the solution as a minimum of a convex function (section 3.2 of the thesis).

        Raises
        ------
        UsageError
            NS6005 if the Jacobian of g is not symmetric positive semidefinite: then g is not the
            gradient of a convex function.
        """
        from .convex import minimise

        return minimise(self, self._start(start))

    def verdict(self) -> Verdicts:
        """Return what is known before solving: existence, uniqueness, monotonicity, P.

        Examples
        --------
        >>> from nsspice.dvi import VI, Cone, unknowns
        >>> q = unknowns("q", 2)
        >>> bool(VI(2.0*q - q.sum(), within={q: Cone(0)}).verdict()["uniqueness"])
        False
        """
        from .verdicts import of_vi

        return of_vi(self)

    def function(self, at: float = 0.0) -> Callable[[Floats], Floats]:
        """Return g as a function of the unknowns, without set-valued terms, shape (m,)."""
        if self._call is not None:
            call = self._call
            timed = _takes_time(call)
            return lambda u: np.atleast_1d(np.asarray(call(u, at) if timed else call(u), float))
        names = [u.name for u in self.unknowns]
        atoms = {name for part in self.g for name in part.atoms}

        def evaluate(u: Floats) -> Floats:
            values = dict(zip(names, map(float, u), strict=True))
            values["time"] = at
            values.update(dict.fromkeys(atoms, 0.0))
            return np.array([float(part.value(values)) for part in self.g])

        return evaluate

    def slope(self, at: float = 0.0) -> Callable[[Floats], Floats]:
        """Return the Jacobian of g as a function, exact for expressions, shape (m, m)."""
        if self._call is not None:
            if self._jacobian is not None:
                given = self._jacobian
                return lambda u: np.atleast_2d(np.asarray(given(u), float))
            g = self.function(at)
            return lambda u: differences(g, u)
        names = [u.name for u in self.unknowns]
        atoms = {name for part in self.g for name in part.atoms}
        exact = [[part.derivative(u) for u in self.unknowns] for part in self.g]

        def evaluate(u: Floats) -> Floats:
            values = dict(zip(names, map(float, u), strict=True))
            values["time"] = at
            values.update(dict.fromkeys(atoms, 0.0))
            return np.array([[float(e.value(values)) for e in row] for row in exact])

        return evaluate

    def _start(self, start: Any) -> dict[str, float]:
        """Return a start by names."""
        if start is None:
            return {}
        if isinstance(start, Point):
            return {u.name: float(start[u]) for u in self.unknowns if u.name in start.values}
        if isinstance(start, Mapping):
            from .dvi import flattened

            return {u.name: float(v.value({})) for u, v in flattened(start, "the start")}
        values = np.ravel(np.asarray(start, dtype=np.float64))
        if values.size == 1:
            values = np.full(len(self.unknowns), values[0])
        if values.size != len(self.unknowns):
            raise wrong(
                "NS6003",
                f"the initial point has {values.size} entries for {len(self.unknowns)}",
                "",
            )
        return {u.name: float(v) for u, v in zip(self.unknowns, values, strict=True)}

    def __repr__(self) -> str:
        names = ", ".join(u.name for u in self.unknowns[:6])
        return f"<{type(self).__name__} of {names}{' ...' if len(self.unknowns) > 6 else ''}>"


class GE(VI):
    """A generalized equation ``0 in g(u) + F(u)``: a VI whose F is written by :func:`Sgn`.

    Examples
    --------
    >>> from nsspice.dvi import GE, Sgn, unknowns
    >>> u = unknowns("u")
    >>> GE(2.0*u + Sgn(u) - 3.0).solve()[u]
    1.0
    """

    kind = "GE"


class NCP(VI):
    """A nonlinear complementarity problem ``0 <= u`` orthogonal to ``g(u) >= 0``.

    Parameters
    ----------
    g : Expr or array of Expr, or callable
    u : unknowns

    Examples
    --------
    >>> from nsspice.dvi import NCP, exp, unknowns
    >>> u = unknowns("u", 2)
    >>> NCP([exp(u[0]) - 2.0, u[1] + 1.0], u).solve()[u].round(12).tolist()
    [0.69314718056, 0.0]
    """

    kind = "NCP"

    def __init__(self, g: Any, u: Any, *, jacobian: Callable[..., Any] | None = None) -> None:
        key = u if isinstance(u, Expr | Unknowns) else np.array(as_vector(u), object).view(Unknowns)
        super().__init__(g, {key: Cone(0.0)}, of=u, jacobian=jacobian)


def differences(g: Callable[[Floats], Floats], u: Floats) -> Floats:
    """Return a Jacobian by central differences; their error is O(eps^(2/3))."""
    size = np.maximum(1.0, np.abs(u)) * np.finfo(float).eps ** (1.0 / 3.0)
    columns = []
    for k in range(u.size):
        ahead, behind = u.copy(), u.copy()
        ahead[k] += size[k]
        behind[k] -= size[k]
        columns.append((g(ahead) - g(behind)) / (ahead[k] - behind[k]))
    return np.column_stack(columns)


def _takes_time(function: Callable[..., Any]) -> bool:
    import inspect

    return len(inspect.signature(function).parameters) > 1
