"""Generalized equations solved point by point, by the Josephy-Newton method.

References: N. H. Josephy, *Newton's method for generalized equations* (MRC report 1965, 1979);
A. L. Dontchev, R. T. Rockafellar, *Implicit Functions and Solution Mappings* (Springer,
2014), ch. 6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..problems.csc import Floats
from ..problems.generalized import GeneralizedEquation
from .compiled import core_matrix, core_smooth
from .stepper import UnsolvedStep

#: p(t) as a function of a time, or its values row by row
Data = Callable[[float], npt.ArrayLike] | npt.ArrayLike


@dataclass(frozen=True, slots=True)
class Path:
    """Solutions of a generalized equation along a parameter.

    Parameters
    ----------
    t : ndarray, shape (k,)
        Grid points.
    z : ndarray, shape (k, n)
        Solutions there.
    residuals : ndarray, shape (k,)
        How well the equation holds there, relative to its terms.
    linearised : int
        Linearised problems solved in all.

    Examples
    --------
    >>> path = Path(np.array([0.0, 1.0]), np.array([[0.0], [2.0]]), np.zeros(2), 2)
    >>> path.at(0.25).tolist()
    [0.5]
    """

    t: Floats
    z: Floats
    residuals: Floats
    linearised: int

    def at(self, t: float) -> Floats:
        """Return the linear interpolant, whose error between grid points is O(h), shape (n,)."""
        return np.array([np.interp(t, self.t, column) for column in self.z.T])


def solve(
    problem: GeneralizedEquation,
    t: npt.ArrayLike,
    p: Data,
    *,
    start: npt.ArrayLike | None = None,
) -> Path:
    """Solve a generalized equation at each of some points.

    Parameters
    ----------
    problem : GeneralizedEquation
    t : array_like, shape (k,)
        Points; each begins near the solution of the one before.
    p : callable or array_like, shape (k, n)
        ``p(t)``, or its values at the points.
    start : array_like, shape (n,), optional
        A point near the first solution.

    Raises
    ------
    UnsolvedStep
        If a point has no solution, or none was found.

    Examples
    --------
    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.op("asinh", tape.unknown(0)))
    >>> problem = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),))
    >>> path = solve(problem, [0.0], [[1.5]])
    >>> bool(abs(path.z[0, 0] - np.sinh(0.5)) < 1e-14)
    True
    """
    return follow(problem, t, p, start=start, tracking=None)


def follow(
    problem: GeneralizedEquation,
    t: npt.ArrayLike,
    p: Data,
    *,
    start: npt.ArrayLike | None = None,
    tracking: Mapping[str, Any] | None,
) -> Path:
    """Run the compiled solver; see :func:`solve` and :func:`nsspice.solvers.tracker.track`."""
    times = np.ascontiguousarray(t, dtype=np.float64)
    system = problem.system()
    smooth = system.smooth
    assert smooth is not None  # equations without functions have a tape that is empty
    options = dict(tracking or {})
    begin = None
    if start is not None:
        begin = _start(problem, np.asarray(start, dtype=np.float64))
    out = _core.solve_path(
        core_matrix(system.G),
        core_matrix(system.A),
        core_matrix(system.B),
        core_matrix(system.D),
        system.q,
        system.row_kind,
        core_smooth(smooth),
        times,
        rows(problem, times, p, problem.offsets()),
        options.get("rates"),
        options.get("errors"),
        tracking is not None,
        bool(options.get("by_rate", False)),
        options.get("correctors"),
        begin,
    )
    reached = out["reached"]
    z = out["z"].reshape(reached, system.n)[:, : problem.n]
    if reached < times.size:
        raise UnsolvedStep(float(times[reached]), float("nan"), None)
    return Path(times, np.ascontiguousarray(z), out["residuals"], out["linearised"])


def rows(problem: GeneralizedEquation, times: Floats, p: Data, offsets: Floats) -> Floats:
    """Return the right-hand sides at some times, shape (k, size)."""
    values = np.array([p(float(s)) for s in times]) if callable(p) else np.asarray(p)
    table = np.asarray(values, dtype=np.float64).reshape(times.size, problem.n)
    full = np.tile(offsets, (times.size, 1))
    full[:, : problem.n] += table
    return full


def _start(problem: GeneralizedEquation, z: Floats) -> tuple[Floats, Floats]:
    """Return unknowns and multipliers for a given z, with the pairs that its signs suggest."""
    from ..problems.generalized import Cone, Ramp, Sign

    values: list[float] = []
    multipliers: list[float] = []
    for k, piece in problem.pieces:
        if isinstance(piece, Sign):
            x = float(z[k]) - piece.at
            values.append(piece.high if x > 0.0 else piece.low if x < 0.0 else 0.0)
            multipliers += [max(x, 0.0), max(-x, 0.0)]
        elif isinstance(piece, Cone):
            multipliers += [0.0] * (int(np.isfinite(piece.low)) + int(np.isfinite(piece.high)))
        elif isinstance(piece, Ramp):
            multipliers.append(max(float(z[k]) - piece.at, 0.0) * piece.slope)
    return np.concatenate([z, values]), np.array(multipliers)
