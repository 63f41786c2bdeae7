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
from ..problems.descriptor import DescriptorSystem
from ..problems.generalized import GeneralizedEquation
from ..problems.regularity import strong_regularity
from .certificate import infeasibility
from .compiled import core_matrix, core_smooth
from .implicit import freed
from .moreau import function_slopes, function_values
from .stepper import UnsolvedStep

#: p(t) as a function of a time, or its values row by row
Data = Callable[[float], npt.ArrayLike] | npt.ArrayLike


class NoValue(UnsolvedStep):
    """A function has no finite value where the search starts: a pole, or outside of its domain.

    Parameters
    ----------
    time : float
    functions : tuple of int
        Which ones.
    point : ndarray, shape (n,)
        Where.
    """

    def __init__(self, time: float, functions: tuple[int, ...], point: Floats) -> None:
        super().__init__(time, float("nan"), None, point=point)
        self.functions = functions
        names = ", ".join(map(str, functions))
        several = "s" * (len(functions) > 1)
        self.args = (
            f"component{several} {names} of g: no finite value at z = {point.tolist()}, where the "
            f"search for a solution at {time!r} starts; pass another start",
        )


class RegularityLost(UnsolvedStep):
    """A followed path has been lost: the equations do not hold at its next point.

    Parameters
    ----------
    time : float
        The first point of the grid that is off.
    residual : float
        Relative residual there.
    unknown : int
        The unknown that the data move most at the last good point.
    modulus : float
        By how much, per unit of p.
    path : Path
        What was followed up to there.
    """

    def __init__(
        self, time: float, residual: float, unknown: int, modulus: float, path: Path
    ) -> None:
        super().__init__(time, residual, None)
        self.unknown, self.modulus, self.path = unknown, modulus, path
        after = f" after {float(path.t[-1])!r}" if path.t.size else ""
        sensitive = f"; z[{unknown}] moves by {modulus:.3g} per unit of p there" if after else ""
        self.args = (
            f"the path of solutions is lost{after}{sensitive}; at {time!r} the equations are off "
            f"by {residual:.2g} of their terms: use a smaller step, or end the path earlier",
        )


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
        If a point has no solution (then with a proof), or none was found; :class:`NoValue` if g has
        no finite value where the search starts.
    ValueError
        If data are not finite.

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
    if not np.all(np.isfinite(times)):
        raise ValueError("the points are not finite")
    system = problem.system()
    smooth = system.smooth
    assert smooth is not None  # equations without functions have a tape that is empty
    options = dict(tracking or {})
    begin = None
    if start is not None:
        begin = _start(problem, np.asarray(start, dtype=np.float64))
    table = rows(problem, times, p, problem.offsets())
    out = _core.solve_path(
        core_matrix(system.G),
        core_matrix(system.A),
        core_matrix(system.B),
        core_matrix(system.D),
        system.q,
        system.row_kind,
        core_smooth(smooth),
        times,
        table,
        options.get("rates"),
        options.get("errors"),
        tracking is not None,
        bool(options.get("by_rate", False)),
        options.get("correctors"),
        begin,
    )
    reached = out["reached"]
    z = out["z"].reshape(reached, system.n)[:, : problem.n]
    path = Path(times[:reached], np.ascontiguousarray(z), out["residuals"], out["linearised"])
    if reached == times.size:
        return path
    when, residual = float(times[reached]), float(out["failed"])
    if tracking is not None and (reached or begin is not None):
        unknown, modulus = _sensitivity(problem, system, path, out["l"])
        raise RegularityLost(when, residual, unknown, modulus, path)
    begun = z[-1] if reached else np.zeros(problem.n) if begin is None else begin[0][: problem.n]
    values = function_values(problem.g, begun[None], np.zeros((1, 0)), np.array([when]))[0]
    wrong = tuple(int(k) for k in np.flatnonzero(~np.isfinite(values)))
    if wrong:
        raise NoValue(when, wrong, begun)
    right = table[reached]
    matrix, A, B, rhs = freed(system.G, system.A, system.B, right, smooth)
    proof = infeasibility(matrix, A, B, system.D, rhs, system.q, np.zeros(system.m, np.uint8))
    raise UnsolvedStep(when, residual, proof)


def _sensitivity(
    problem: GeneralizedEquation, system: DescriptorSystem, path: Path, multipliers: Floats
) -> tuple[int, float]:
    """Return which unknown the data move most at the last point of a path, and by how much."""
    if not path.t.size:
        return 0, float("nan")
    lam = np.asarray(multipliers).reshape(path.t.size, system.m)[-1]
    full = np.zeros(system.n)
    full[: problem.n] = path.z[-1]
    slopes = function_slopes(problem.g, path.z[-1:], np.zeros((1, 0)), path.t[-1:])
    wide = np.zeros((1, problem.n, system.n))
    wide[:, :, : problem.n] = slopes
    found = strong_regularity(system, wide, full, lam)
    return max(found.unknown, 0), found.modulus


def rows(problem: GeneralizedEquation, times: Floats, p: Data, offsets: Floats) -> Floats:
    """Return the right-hand sides at some times, shape (k, size)."""
    values = np.array([p(float(s)) for s in times]) if callable(p) else np.asarray(p)
    table = np.asarray(values, dtype=np.float64).reshape(times.size, problem.n)
    if not np.all(np.isfinite(table)):
        k, j = (int(i) for i in np.argwhere(~np.isfinite(table))[0])
        raise ValueError(f"component {j} of the data at {float(times[k])!r} is {table[k, j]}")
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
