"""The componentwise residual by which a solved step is judged, and the feasibility linear program.

Rows: ``|K z + A l - b|`` against the sum of the absolute terms of that row, with a floor of 1e-6 of
the largest such sum among rows of the same kind (current rows, voltage rows); the floor of voltage
rows is also at least 1e-6 of the largest node voltage.  Complementarity: ``min(l/Is, w/Vs)`` with
current and voltage scales taken from the rows and nodes the pairs touch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


class Undecided(Exception):
    """The linear program is too close to the border, or too badly scaled, for a verdict."""


@dataclass(frozen=True)
class Mlcp:
    """One mixed linear complementarity problem, dense.

    ``K z + A l = b``, ``w = q - B z + D l``, ``0 <= l`` complementary to ``w >= 0``; pairs with
    ``switch`` set are equalities instead: ``w = 0`` where ``closed``, ``l = 0`` elsewhere.
    ``voltage_row`` marks branch rows (KVL), the others are current rows (KCL).
    """

    K: Floats
    A: Floats
    B: Floats
    D: Floats
    b: Floats
    q: Floats
    voltage_row: Bools
    switch: Bools
    closed: Bools

    @property
    def n(self) -> int:
        """Number of unknowns z."""
        return int(self.K.shape[0])

    @property
    def m(self) -> int:
        """Number of pairs."""
        return int(self.q.size)

    def slack(self, z: Floats, lam: Floats) -> Floats:
        """Return w."""
        return self.q - self.B @ z + self.D @ lam


def residual(p: Mlcp, z: Floats, lam: Floats, volts_before: float = 0.0) -> float:
    """Return the larger of the row residual and the complementarity residual.

    Charges keep the rounding of the largest voltage before, and slacks too where nothing moves it:
    a capacitor that was at 360 V once may bear 1e-18 V backward for ever.
    """
    if not (np.all(np.isfinite(z)) and np.all(np.isfinite(lam))):
        return float("inf")
    if p.n == 0 and p.m == 0:
        return 0.0
    current = ~p.voltage_row
    # unknowns 0.. that belong to current rows are node voltages: rows and unknowns share an order
    volts = float(np.abs(z[current]).max(initial=0.0))
    scale = np.abs(p.K) @ np.abs(z) + np.abs(p.A) @ np.abs(lam) + np.abs(p.b)
    error = np.abs(p.K @ z + p.A @ lam - p.b)
    worst = 0.0
    for kind, extra in ((current, 0.0), (p.voltage_row, volts)):
        if kind.any():
            floor = 1e-6 * max(float(scale[kind].max()), extra)
            worst = max(worst, _ratio(error[kind], np.maximum(scale[kind], floor)))
    if p.m == 0:
        return worst
    w = p.slack(z, lam)
    touched = current & (np.abs(p.A).sum(axis=1) > 0)
    amps = max(np.abs(lam).max(initial=0.0), scale[touched].max(initial=0.0))
    size = np.abs(p.B) @ np.abs(z) + np.abs(p.D) @ np.abs(lam) + np.abs(p.q)
    volt = max(size.max(initial=0.0), scale[p.voltage_row].max(initial=0.0), volts)
    li = lam / amps if amps > 0 else lam
    w = np.where(np.abs(w) <= 4.0 * np.finfo(float).eps * volts_before, np.maximum(w, 0.0), w)
    wi = w / volt if volt > 0 else w
    gap = np.minimum(li, wi)
    gap = np.where(p.switch, np.where(p.closed, wi, li), gap)
    return max(worst, float(np.abs(gap).max()))


def _ratio(error: Floats, scale: Floats) -> float:
    """Return the largest error/scale, 0/0 counting as 0."""
    safe = np.where(scale > 0, scale, 1.0)
    return float((error / safe).max(initial=0.0))


def feasible(p: Mlcp, rows: Bools | None = None, pairs: Bools | None = None) -> bool:
    """Return whether the linear part of the problem has a point, by HiGHS.

    A monotone problem is solvable exactly if it is feasible.  The linear program asks for the least
    violation t of all conditions (brought to unit size), so that it always has an optimum; a
    violation between 1e-9 and 1e-7 counts as undecided.

    Parameters
    ----------
    rows, pairs : ndarray of bool, optional
        Keep only these equations and these slack conditions; the signs of all l are kept.  A subset
        that is already infeasible proves that its elements are in conflict.

    Raises
    ------
    Undecided
    """
    violation = least_violation(p, rows, pairs)
    if 1e-9 < violation < 1e-7:
        raise Undecided(f"least violation {violation:.3g}")
    return violation <= 1e-9


def least_violation(p: Mlcp, rows: Bools | None = None, pairs: Bools | None = None) -> float:
    """Return the smallest possible largest violation of the linear conditions, sizes made one.

    What is small beside what depends on the units.  In evened-out ones, an ampere beside ``L/h`` =
    3e7 Ohm may count as 1e-7 of a volt and a network may seem to be in conflict by that much: such
    a verdict is heard a second time in volts and amperes, and the milder one counts.
    """
    violation = np.inf
    for columns in (_column_scales(p), np.ones(p.n + p.m)):
        violation = min(violation, _violation(p, columns, rows, pairs))
        if violation <= CLEAR:
            break
    return violation


def _violation(p: Mlcp, columns: Floats, rows: Bools | None, pairs: Bools | None) -> float:
    """Return the least violation with the unknowns in these units."""
    rows = np.ones(p.n, dtype=bool) if rows is None else rows
    pairs = np.ones(p.m, dtype=bool) if pairs is None else pairs
    gap = np.hstack([p.B, -p.D])
    shut, upper = p.switch & p.closed & pairs, ~p.switch & pairs
    equal = np.vstack([np.hstack([p.K, p.A])[rows], gap[shut]]) * columns
    target = np.concatenate([p.b[rows], p.q[shut]])
    above, limit = gap[upper] * columns, p.q[upper]
    equal, target = _unit_rows(equal, target)
    above, limit = _unit_rows(above, limit)
    level = max(np.abs(target).max(initial=0.0), np.abs(limit).max(initial=0.0))
    if level == 0.0:
        return 0.0
    matrix = np.vstack([equal, -equal, above])
    rhs = np.concatenate([target, -target, limit]) / level
    low = np.full(p.n + p.m, -np.inf)
    high = np.full(p.n + p.m, np.inf)
    low[p.n :] = np.where(p.switch & p.closed, -np.inf, 0.0)
    high[p.n :] = np.where(p.switch & ~p.closed, 0.0, np.inf)
    return _least(matrix, rhs, low, high)


#: a violation below this is none, and rounds of refinement granted to get there
CLEAR = 1e-9
ROUNDS = 8
#: after which a method of HiGHS gives up; most programs take milliseconds, some cycle for ever
SECONDS = 10.0


def _least(matrix: Floats, rhs: Floats, low: Floats, high: Floats) -> float:
    """Return the least t with ``matrix x - t <= rhs`` and low <= x <= high.

    HiGHS solves to absolute tolerances.  So t is computed from x itself, and as long as it is not
    clear the correction of x is found by the same program with what is left scaled to unit size:
    iterative refinement of linear programs (Gleixner, Steffy, Wolter 2016).
    """
    x = np.zeros(matrix.shape[1])
    size = 1.0
    for _ in range(ROUNDS):
        step, least = _solve(matrix, (rhs - matrix @ x) / size, (low - x) / size, (high - x) / size)
        new = np.clip(x + size * step, low, high)
        reached = float((matrix @ new - rhs).max(initial=0.0))
        if reached <= CLEAR:
            return reached
        if least is None:
            raise Undecided(f"HiGHS gave no verdict; the best point violates by {reached:.3g}")
        if least > 0.5 or reached > 0.5 * size:  # no correction helps
            return size * least
        x, size = new, reached
    raise Undecided(f"still improving after {ROUNDS} rounds: {size:.3g}")


def _solve(matrix: Floats, rhs: Floats, low: Floats, high: Floats) -> tuple[Floats, float | None]:
    """Return the best x that HiGHS finds and the least t, None unless proved to be optimal."""
    # scipy stays out of module level: importing the oracle is cheap where no LP is needed
    from scipy.optimize import linprog

    cost = np.zeros(matrix.shape[1] + 1)
    cost[-1] = 1.0
    bounds = np.column_stack([np.append(low, 0.0), np.append(high, np.inf)])
    best = np.zeros(matrix.shape[1])
    # the interior point method judges what the simplex method leaves open
    for method in ("highs-ds", "highs-ipm"):
        result = linprog(
            cost,
            A_ub=np.hstack([matrix, -np.ones((matrix.shape[0], 1))]),
            b_ub=rhs,
            bounds=bounds,
            method=method,
            options={
                "primal_feasibility_tolerance": 1e-10,
                "dual_feasibility_tolerance": 1e-10,
                "time_limit": SECONDS,
            },
        )
        if result.status == 0:
            return result.x[:-1], float(result.fun)
        if result.x is not None:
            best = result.x[:-1]
    return best, None


def _unit_rows(matrix: Floats, rhs: Floats) -> tuple[Floats, Floats]:
    """Return the rows divided by their largest entry."""
    size = np.abs(matrix).max(axis=1, initial=0.0)
    size = np.where(size > 0, size, 1.0)
    return matrix / size[:, None], rhs / size


def _column_scales(p: Mlcp) -> Floats:
    """Return powers of two that even out the columns of z and l for the linear program."""
    matrix = np.abs(np.vstack([np.hstack([p.K, p.A]), np.hstack([p.B, p.D])]))
    d = np.ones(p.n + p.m)
    for _ in range(8):  # Ruiz: rows and columns share the factor, as the matrix is nearly skew
        size = (d[:, None] * matrix * d[None, :]).max(axis=1, initial=0.0)
        d = d / np.sqrt(np.where(size > 0, size, 1.0))
    return np.asarray(np.exp2(np.round(np.log2(d))))
