r"""Variational inequalities over curved sets, or of Python functions: Newton on the natural map.

u solves the VI exactly if ``u = P_K(u - g(u))`` with the projection P_K onto K.  The natural map
``r(u) = u - P_K(u - g(u))`` is semismooth; Newton steps with an element of its generalised Jacobian
are shortened until the residual decreases, and where they do not help an extragradient step is
taken, which tends to a solution for monotone Lipschitz continuous g.

References: F. Facchinei, J.-S. Pang, *Finite-Dimensional Variational Inequalities* (2003), sections
1.5, 7.5, 12.1; T. Roubal (2015), section 2.1.1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..equations.point import Point
from ..terms.errors import unsolved, wrong
from ..terms.sets import Cone, SecondOrderCone, Set

if TYPE_CHECKING:
    from .vi import VI

Floats = npt.NDArray[np.float64]
Map = Callable[[Floats], Floats]

_MOST = 400
#: of a natural residual: a hundred times the rounding of its terms
_SOLVED = 1e-14


def solve_by_projection(problem: VI, start: dict[str, float], at: float) -> Point:
    """Return a solution of a VI whose K is a product of intervals and second-order cones.

    Raises
    ------
    UsageError
        NS6005 for a polyhedron, whose projection is a problem of its own, or set-valued terms.
    NumericalError
        NS6020 if none was found.
    """
    names = [u.name for u in problem.unknowns]
    if any(part.atoms for part in problem.g):
        raise wrong(
            "NS6005", "set-valued terms cannot be combined with a curved set", "write them as sets"
        )
    blocks = []
    for variables, K in problem.sets:
        if not isinstance(K, Cone | SecondOrderCone):
            raise wrong("NS6005", "a polyhedron cannot be combined with a curved set or a function",
                        "write g as Expr, or K as intervals")  # fmt: skip
        index = [names.index(u.name) for u in variables]
        groups = [index] if isinstance(K, SecondOrderCone) else [[k] for k in index]
        blocks += [(np.array(group), K) for group in groups]
    u = np.array([start.get(name, 0.0) for name in names])
    u, residual = newton(problem.function(at), problem.slope(at), blocks, u)
    values = dict(zip(names, map(float, u), strict=True))
    return Point({**values, "time": at}, {}, residual)


Blocks = Sequence[tuple[npt.NDArray[np.int64], Set]]


def project(blocks: Blocks, u: Floats) -> Floats:
    """Return the nearest point of a product of intervals and cones, shape (m,)."""
    out = u.copy()
    for index, K in blocks:
        if isinstance(K, Cone):
            out[index] = np.clip(u[index], K.low, K.high)
        elif isinstance(K, SecondOrderCone):
            out[index] = K.project(u[index])
    return out


def _slope(blocks: Blocks, u: Floats) -> Floats:
    out = np.eye(u.size)
    for index, K in blocks:
        if isinstance(K, Cone):
            for k in index:
                out[k, k] = float(K.low < u[k] < K.high)
        elif isinstance(K, SecondOrderCone):
            out[np.ix_(index, index)] = K.slope(u[index])
    return out


def newton(g: Map, jacobian: Map, blocks: Blocks, u: Floats) -> tuple[Floats, float]:
    """Return a solution of the VI, and its natural residual relative to its terms.

    Parameters
    ----------
    g, jacobian : callable
        Function and derivative of u, shapes (m,) and (m, m).
    blocks : sequence of (indices, set)
    u : ndarray, shape (m,)
        Where to begin.

    Raises
    ------
    NumericalError
        NS6020 if the residual does not become small.
    """
    u = project(blocks, u)
    step = 1.0
    best, best_residual = u, np.inf
    for _ in range(_MOST):
        value = g(u)
        r = u - project(blocks, u - value)
        size = float(np.max(np.abs(u), initial=0.0)) + float(np.max(np.abs(value), initial=0.0))
        relative = float(np.max(np.abs(r), initial=0.0)) / max(size, 1.0)
        if relative < best_residual:
            best, best_residual = u, relative
        if relative <= _SOLVED:
            break
        merit = float(r @ r)
        S = _slope(blocks, u - value)
        V = np.eye(u.size) - S @ (np.eye(u.size) - jacobian(u))
        moved = False
        try:
            direction = np.linalg.solve(V, -r)
        except np.linalg.LinAlgError:
            direction = np.full(u.size, np.nan)
        if np.all(np.isfinite(direction)):
            length = 1.0
            for _ in range(30):
                trial = u + length * direction
                new = trial - project(blocks, trial - g(trial))
                if float(new @ new) < (1.0 - 1e-4 * length) * merit:
                    u, moved = trial, True
                    break
                length *= 0.5
        if moved:
            continue
        if relative <= 1e-12:
            break
        for _ in range(60):  # extragradient with a step below the inverse Lipschitz constant
            ahead = project(blocks, u - step * value)
            change = float(np.linalg.norm(ahead - u))
            if step * float(np.linalg.norm(g(ahead) - value)) <= 0.7 * change:
                break
            step *= 0.5
        there = g(ahead)
        u = project(blocks, u - step * there)
        if step * float(np.linalg.norm(there - value)) <= 0.1 * change:
            step *= 4.0  # far below what the Lipschitz constant allows
    if best_residual > 1e-9:
        raise unsolved(
            f"no solution was found (natural residual {best_residual:.2g})",
            "give a starting point near the solution; a monotone g has one",
            residual=best_residual,
        )
    return best, best_residual
