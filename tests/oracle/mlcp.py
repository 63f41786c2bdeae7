"""A slow, trustworthy solver of mixed linear complementarity problems.

Ways in this order: active sets from the previous mode, enumeration of all modes for few pairs, the
proximal point iteration, a mixed-integer program.  Whatever found it, a point is returned only if
its residual is small; linear solves are refined with residuals in extended precision.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize

from .residual import Bools, Floats, Mlcp, feasible, least_violation, residual

ACCEPT = 1e-11
ENUMERATE_UP_TO = 10


class OracleInfeasible(Exception):
    """The linear part of the problem has no point."""


class OracleStuck(Exception):
    """No way led to a solution although the problem is feasible."""


@dataclass(frozen=True)
class Point:
    """A solution: unknowns, multipliers, slacks and the set of pairs with w = 0."""

    z: Floats
    lam: Floats
    w: Floats
    active: Bools


def solve(p: Mlcp, z0: Floats | None = None, lam0: Floats | None = None) -> Point:
    """Return a solution near (z0, lam0); raise OracleInfeasible or OracleStuck."""
    z0 = np.zeros(p.n) if z0 is None else z0
    lam0 = np.zeros(p.m) if lam0 is None else lam0
    guess = _fix(p, lam0 > p.slack(z0, lam0))
    best = _newton(p, guess, z0, lam0)
    if best is None:
        free = np.count_nonzero(~p.switch)
        best = _by_force(p, guess, z0, lam0) if free <= ENUMERATE_UP_TO else None
    if best is None:
        best = _proximal(p, z0, lam0)
    if best is None:
        if not feasible(p):
            raise OracleInfeasible
        best = _integer(p)
    if best is None:
        raise OracleStuck(f"{p.n} unknowns, {p.m} pairs")
    # far out, a direction that never arrives looks like a solution: relative residuals vanish there
    size = max(np.abs(best.z).max(initial=0.0), np.abs(best.lam).max(initial=0.0))
    data = max(np.abs(p.b).max(initial=0.0), np.abs(p.q).max(initial=0.0))
    if size > 1e6 * data and least_violation(p) > 1e-9:
        raise OracleInfeasible
    return best


def mode_point(p: Mlcp, active: Bools, z0: Floats, lam0: Floats) -> tuple[Floats, Floats]:
    """Return the point of one mode (w = 0 on ``active``, l = 0 elsewhere) nearest to (z0, lam0)."""
    on = np.flatnonzero(active)
    matrix = np.block([[p.K, p.A[:, on]], [p.B[on], -p.D[np.ix_(on, on)]]])
    rhs = np.concatenate([p.b, p.q[on]])
    x = np.concatenate([z0, lam0[on]])
    if rhs.size:
        x = _solve_near(matrix, rhs, x)
    lam = np.zeros(p.m)
    lam[on] = x[p.n :]
    return x[: p.n], lam


def _solve_near(matrix: Floats, rhs: Floats, x: Floats) -> Floats:
    """Solve by LU, or by least-norm corrections where singular; residuals in long double."""
    rows, cols = _equilibrate(matrix)
    scaled = rows[:, None] * matrix * cols[None, :]
    values = np.linalg.svd(scaled, compute_uv=False)
    regular = values[-1] > 1e-13 * values[0]
    lu = scipy.linalg.lu_factor(scaled) if regular else None
    pinv = None if regular else np.linalg.pinv(scaled, rcond=1e-12)
    wide, target = matrix.astype(np.longdouble), rhs.astype(np.longdouble)
    y = x.astype(np.longdouble)
    for _ in range(4):
        gap = rows * np.asarray(target - wide @ y, dtype=float)
        step = scipy.linalg.lu_solve(lu, gap) if lu is not None else pinv @ gap
        y = y + cols * step
        if not np.all(np.isfinite(y)):
            break
    return np.asarray(y, dtype=float)


def _equilibrate(matrix: Floats) -> tuple[Floats, Floats]:
    """Return powers of two for rows and columns that bring their largest entries near one."""
    a = np.abs(matrix)
    r, c = np.ones(a.shape[0]), np.ones(a.shape[1])
    for _ in range(10):
        s = r[:, None] * a * c[None, :]
        top = s.max(axis=1, initial=0.0)
        side = s.max(axis=0, initial=0.0)
        r = r / np.sqrt(np.where(top > 0, top, 1.0))
        c = c / np.sqrt(np.where(side > 0, side, 1.0))
    return np.exp2(np.round(np.log2(r))), np.exp2(np.round(np.log2(c)))


def _fix(p: Mlcp, active: Bools) -> Bools:
    """Return the mode with the switches put where their law holds them."""
    return np.where(p.switch, p.closed, active)


def _accept(p: Mlcp, active: Bools, z: Floats, lam: Floats) -> Point | None:
    if residual(p, z, lam) > ACCEPT:
        return None
    return Point(z, lam, p.slack(z, lam), active)


def _newton(p: Mlcp, active: Bools, z0: Floats, lam0: Floats) -> Point | None:
    """Active-set iteration; gives up when a mode returns."""
    seen: set[bytes] = set()
    while active.tobytes() not in seen and len(seen) < 60:
        seen.add(active.tobytes())
        z, lam = mode_point(p, active, z0, lam0)
        w = p.slack(z, lam)
        tol_l = 1e-13 * np.abs(lam).max(initial=0.0)
        tol_w = 1e-13 * (np.abs(p.B) @ np.abs(z) + np.abs(p.q)).max(initial=0.0)
        new = _fix(p, np.where(active, lam > -tol_l, w < -tol_w))
        if np.array_equal(new, active):
            return _accept(p, active, z, lam)
        active = new
    return None


def _by_force(p: Mlcp, guess: Bools, z0: Floats, lam0: Floats) -> Point | None:
    """Try every mode, those nearest to the guess first."""
    free = np.flatnonzero(~p.switch)
    for count in range(free.size + 1):
        for flips in itertools.combinations(free, count):
            active = guess.copy()
            active[list(flips)] ^= True
            z, lam = mode_point(p, active, z0, lam0)
            found = _accept(p, active, z, lam)
            if found is not None:
                return found
    return None


def _proximal(p: Mlcp, z0: Floats, lam0: Floats) -> Point | None:
    """Proximal point iteration with active-set inner solves and polishing in the mode found."""
    rows, _ = _equilibrate(np.block([[p.K, p.A], [p.B, p.D]]))
    dz, dl = rows[: p.n], rows[p.n :]  # one factor for rows and columns keeps the problem monotone
    z, lam = z0.copy(), lam0.copy()
    # each round moves at most (violation / mu): the later settings go far, the first stay near
    for mu, rounds in ((1e-6, 12), (1e-8, 12), (1e-10, 25), (1e-3, 200)):
        for _ in range(rounds):
            inner = Mlcp(
                p.K + mu * np.diag(dz**-2.0),
                p.A,
                p.B,
                p.D + mu * np.diag(dl**-2.0),
                p.b + mu * z / dz**2,
                p.q - mu * lam / dl**2,
                p.voltage_row,
                p.switch,
                p.closed,
            )
            z, lam = _definite(inner, _fix(p, lam > inner.slack(z, lam)), z, lam)
            polished = mode_point(p, _fix(p, lam > inner.slack(z, lam)), z, lam)
            found = _accept(p, _fix(p, polished[1] > p.slack(*polished)), *polished)
            if found is not None:
                return found
    return None


def _definite(p: Mlcp, active: Bools, z: Floats, lam: Floats) -> tuple[Floats, Floats]:
    """Solve a positive definite problem: whole flips first, then Murty's one at a time."""
    for turn in range(20 + 50 * p.m):
        z, lam = mode_point(p, active, z, lam)
        w = p.slack(z, lam)
        wrong = ~p.switch & np.where(active, lam < 0, w < 0)
        if not wrong.any():
            break
        active = active.copy()
        # flipping only the last wrong pair never cycles for a P-matrix
        active[wrong if turn < 20 else np.flatnonzero(wrong)[-1]] ^= True
    return z, lam


def _integer(p: Mlcp) -> Point | None:
    """Find the mode by a mixed-integer program with growing bounds, then solve in that mode."""
    n, m = p.n, p.m
    for big in (1e2, 1e4, 1e6):
        top = big * max(np.abs(p.b).max(initial=0.0), np.abs(p.q).max(initial=0.0), 1.0)
        size = n + 2 * m
        eye = np.eye(m)
        equal = np.block([[p.K, p.A, np.zeros((n, m))], [p.B, -p.D, np.zeros((m, m))]])
        low = np.concatenate([p.b, np.full(m, -np.inf)])
        high = np.concatenate([p.b, p.q])
        # l <= top * d   and   w = q - B z + D l <= top * (1 - d)
        upper = np.block(
            [
                [np.zeros((m, n)), eye, -top * eye],
                [-p.B, p.D, top * eye],
            ]
        )
        limit = np.concatenate([np.zeros(m), top - p.q])
        lower_l = np.where(p.switch, -np.inf, 0.0)
        result = scipy.optimize.milp(
            np.zeros(size),
            integrality=np.concatenate([np.zeros(n + m), np.ones(m)]),
            bounds=scipy.optimize.Bounds(
                np.concatenate([np.full(n, -np.inf), lower_l, np.where(p.switch, p.closed, 0.0)]),
                np.concatenate([np.full(n + m, np.inf), np.where(p.switch, p.closed, 1.0)]),
            ),
            constraints=[
                scipy.optimize.LinearConstraint(equal, low, high),
                scipy.optimize.LinearConstraint(upper, -np.inf, limit),
            ],
            options={"time_limit": 20.0},
        )
        if result.x is None:
            continue
        active = _fix(p, result.x[n + m :] > 0.5)
        z, lam = mode_point(p, active, result.x[:n], result.x[n : n + m])
        found = _accept(p, active, z, lam)
        if found is not None:
            return found
    return None
