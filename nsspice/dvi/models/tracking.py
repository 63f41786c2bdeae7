"""Euler-Newton path following of a variational inequality, and where regularity is lost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...problems.regularity import index_sets, inverses
from ...solvers.moreau import function_slopes
from ..equations.static import Static
from ..terms.errors import RegularityLost, unsolved, wrong
from ..terms.expression import Expr, as_vector
from ..terms.setvalued import SetValued

if TYPE_CHECKING:
    from .vi import VI

Floats = npt.NDArray[np.float64]

#: relative residuals below this need no closer look
_FINE = 1e-9
#: where so large a part of the terms is left a point is not a solution
_ROUGH = 0.1
#: a Newton step shorter by this factor than the one before converges superlinearly
_SHRINK = 0.1
#: the search for the end of a path halves its step so often
_HALVINGS = 40
_SEARCH = 600
#: beyond this modulus rounding of the data moves the unknown by more than its sixth digit
_STEEP = 1e-6 / 2.0**-53
#: points of a path whose matrices are looked at together
_BLOCK = 512


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Solutions along the time.

    Parameters
    ----------
    times : ndarray, shape (k,)
        Grid [s].
    values : dict of str to ndarray, shape (k,)
        Unknowns and set values by name.
    residuals : ndarray, shape (k,)
        How well the problem holds at each point, relative to its terms.
    linearised : int
        Linearised problems solved in all.
    """

    times: Floats
    values: dict[str, Floats]
    residuals: Floats
    linearised: int

    def __getitem__(self, key: Any) -> Floats:
        """Return an unknown, an expression, or a vector of them, shape (k,) or (m, k)."""
        if isinstance(key, str):
            return self.values[key]
        if isinstance(key, Expr):
            return np.asarray(key.value({**self.values, "time": self.times}), dtype=np.float64)
        return np.array([self[item] for item in as_vector(key)])

    def at(self, key: Any, t: float) -> Any:
        """Return an unknown between grid points, linearly: an error O(h)."""
        found = self[key]
        if found.ndim == 1:
            return float(np.interp(t, self.times, found))
        return np.array([np.interp(t, self.times, row) for row in found])


def track(
    problem: VI,
    times: npt.ArrayLike,
    predictor: str,
    correctors: int | None,
    start: Any,
    errors: npt.ArrayLike | None,
) -> Track:
    """Follow a path; see :meth:`nsspice.dvi.VI.track`."""
    grid = np.ascontiguousarray(times, dtype=np.float64)
    if grid.ndim != 1 or grid.size < 1 or not np.all(np.diff(grid) > 0.0):
        raise wrong("NS6004", "the times of a path must increase", "as np.linspace(0, 1, 101)")
    if predictor not in ("data", "rate"):
        raise wrong("NS6004", f"there is no predictor {predictor!r}", "choose data or rate")
    if correctors is not None and not (isinstance(correctors, int) and correctors >= 0):
        raise wrong("NS6004", f"{correctors!r} correctors", "give 0 or more")
    if problem.curved:
        raise wrong(
            "NS6005", "paths over curved sets or of Python functions cannot be followed", ""
        )
    static = Static(problem.assembly)
    if start is None:
        z, lam, _ = static.solve(None, float(grid[0]))
        begin = z, lam
    else:
        begin = _first(problem, static, problem._start(start))
    tracking = (predictor == "rate", correctors)
    out = _follow(static, grid, begin, tracking, _spread(static, problem, errors, grid.size))
    z, lam, residuals = out
    last = _first_failure(static, grid, z, lam, residuals)
    if last is not None:
        raise _lost(static, grid, z[last - 1], lam[last - 1], last, tracking)
    _check_regular(static, grid, z, lam)
    values = {
        name: static.assembly.read(name, z, lam)
        for name in static.assembly.places
        if "#" not in name
    }
    per_step = 1 + (1 if correctors is None else correctors)
    return Track(grid, values, residuals, per_step * (grid.size - 1))


def _follow(
    static: Static,
    grid: Floats,
    begin: tuple[Floats, Floats],
    tracking: tuple[bool, int | None],
    errors: Floats | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Return unknowns, multipliers and residuals of the points that were reached."""
    assembly = static.assembly
    rates = assembly.data(grid, rates=True) if tracking[0] else None
    out = static.core(
        grid, assembly.data(grid), begin=begin, tracking=tracking, rates=rates, errors=errors
    )
    k = out["reached"]
    n, m = static.system.n, static.system.m
    return out["z"].reshape(k, n), out["l"].reshape(k, m), np.asarray(out["residuals"])


def _first(problem: VI, static: Static, start: dict[str, float]) -> tuple[Floats, Floats]:
    """Return a given first point, with values of signs that fit it."""
    z, lam = static.begin(start)
    atoms: dict[str, SetValued] = {}
    for part in problem.g:
        atoms.update(part.atoms)
    places = {name: k for k, name in enumerate(static.assembly.columns)}
    pairs = {name: k for k, name in enumerate(static.assembly.pairs)}
    for name, atom in atoms.items():
        x = float(atom.argument.value({**start, "time": 0.0}))
        z[places[name]] = atom.high if x > 0.0 else atom.low if x < 0.0 else 0.0
        lam[pairs[f"{name}.high"]] = max(x, 0.0)
        lam[pairs[f"{name}.low"]] = max(-x, 0.0)
    return z, lam


def _spread(
    static: Static, problem: VI, errors: npt.ArrayLike | None, points: int
) -> Floats | None:
    if errors is None:
        return None
    m = len(problem.unknowns)
    given = np.asarray(errors, dtype=np.float64).reshape(points - 1, m)
    out = np.zeros((points - 1, static.system.n))
    places = {name: k for k, name in enumerate(static.assembly.rows)}
    for j, u in enumerate(problem.unknowns):
        out[:, places[u.name]] = given[:, j]
    return out


def _first_failure(
    static: Static, grid: Floats, z: Floats, lam: Floats, residuals: Floats
) -> int | None:
    """Return the first point from which Newton's method does not converge, None if all are fine."""
    for k in np.flatnonzero(~(residuals < _FINE)).tolist():
        solved = residuals[k] < _ROUGH and _contracts(static, float(grid[k]), z[k], lam[k])
        if k and not solved:
            return int(k)
    return int(z.shape[0]) if z.shape[0] < grid.size else None


def _check_regular(static: Static, grid: Floats, z: Floats, lam: Floats) -> None:
    """Refuse a path that steps over a loss of regularity, at a point of the grid or between two.

    Newton's method may converge on both sides of it.  On a regular path the linearised equations
    keep their orientation in any mode.

    Raises
    ------
    RegularityLost
        NS6021 at the point, or after it.
    """
    system = static.system
    n, m = system.n, system.m
    full = np.zeros((n + m, n + m))
    full[:n, :n], full[:n, n:] = system.G.dense(), system.A.dense()
    full[n:, :n], full[n:, n:] = -system.B.dense(), system.D.dense()
    slopes = _slopes(static, grid, z)
    on, off = index_sets(system, z, lam)
    sides = np.any(~on & ~off, axis=1)
    before = 0.0
    for first in range(0, grid.size, _BLOCK):
        block = slice(first, first + _BLOCK)
        pieces = np.repeat(full[None], grid[block].size, axis=0)
        if system.smooth is not None:
            pieces[:, :n, :n] += system.smooth.F.dense() @ slopes[block]
        point, pair = np.nonzero(~on[block] & off[block])
        pieces[point, :, n + pair] = np.eye(n + m)[n + pair]
        for k, sign in enumerate(_orientations(pieces).tolist(), first):
            if sides[k]:  # any side of the pairs will do, if one of them has an inverse
                before = sign or before
                continue
            if not sign or before * sign < 0.0:
                time = float(grid[k])
                _, unknown = _modulus(static, z[k], lam[k], time)
                here = time if not sign or k == 0 else float(0.5 * (grid[k - 1] + grid[k]))
                raise RegularityLost(here, unknown, np.inf)
            before = sign


def _orientations(pieces: Floats) -> Floats:
    """Return the signs of the determinants of matrices, 0 for a singular one."""
    if inverses(pieces) is not None:
        return np.asarray(np.linalg.slogdet(pieces)[0])
    if len(pieces) == 1:
        return np.zeros(1)
    return np.concatenate([_orientations(half) for half in np.array_split(pieces, 2)])


def _slopes(static: Static, grid: Floats, z: Floats) -> Floats:
    """Return the derivatives of the smooth functions at all points, shape (k, p, n)."""
    smooth = static.system.smooth
    if smooth is None:
        return np.zeros((len(grid), 0, static.system.n))
    return np.asarray(function_slopes(smooth.tape, z, np.zeros((len(grid), 0)), grid))


def _contracts(static: Static, time: float, z: Floats, lam: Floats) -> bool:
    """Return whether Newton steps from a point become shorter: a regular solution is near."""
    if not np.all(np.isfinite(z)):
        return False
    twice = np.array([time, time])
    one, _, _ = _follow(static, twice, (z, lam), (False, 0))
    two, _, residuals = _follow(static, twice, (z, lam), (False, 1))
    if one.shape[0] < 2 or two.shape[0] < 2:
        return False
    first = float(np.max(np.abs(one[1] - z), initial=0.0))
    second = float(np.max(np.abs(two[1] - one[1]), initial=0.0))
    return residuals[1] < _FINE or second < _SHRINK * first


def _lost(
    static: Static,
    grid: Floats,
    z: Floats,
    lam: Floats,
    failed: int,
    tracking: tuple[bool, int | None],
) -> Exception:
    """Follow the path as near to its end as shorter steps allow, and say where that is."""
    here, h = float(grid[failed - 1]), float(grid[failed] - grid[failed - 1])
    least = h * 2.0**-_HALVINGS
    end = float(grid[failed])
    modulus, unknown = _modulus(static, z, lam, here)
    for _ in range(_SEARCH):
        if h < least or modulus > _STEEP or here + h == here:
            break
        target = min(here + h, end)
        points, many, residuals = _follow(static, np.array([here, target]), (z, lam), tracking)
        if points.shape[0] == 2 and (
            residuals[1] < _FINE
            or (residuals[1] < _ROUGH and _contracts(static, target, points[1], many[1]))
        ):
            here, z, lam = target, points[1], many[1]
            found, name = _modulus(static, z, lam, here)
            if np.isfinite(found):
                modulus, unknown = found, name
            if here == end:
                return unsolved(
                    f"Newton's method fails in the step to t = {end:.9g}; shorter steps succeed",
                    "use a finer grid, or more correctors",
                    time=end,
                )
        else:
            h *= 0.5
    return RegularityLost(here, unknown, modulus)


def _modulus(static: Static, z: Floats, lam: Floats, time: float) -> tuple[float, str]:
    """Return the modulus of regularity, and the unknown that moves most."""
    found = static.regularity(z, lam, time)
    columns = static.assembly.columns
    if found.unknown >= 0:
        return found.modulus, columns[found.unknown]
    moving = int(np.argmax(np.abs(z)))
    return found.modulus, columns[moving]
