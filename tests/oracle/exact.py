"""Proofs in rational numbers that a mode solves a complementarity problem.

Linear programs judge feasibility by tolerances; where amperes meet an inductance over a short step
they have called problems infeasible that have a solution.  A proof needs no tolerance: the numbers
of the problem are rationals, and so is the solution of a regular mode.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from .residual import Bools, Mlcp

#: pairs up to which every mode is tried
ENUMERATE_UP_TO = 6


def provably_solvable(p: Mlcp, active: Bools) -> bool:
    """Return whether the given mode, or any other if there are few, is proved to be a solution."""
    if _solves(p, active):
        return True
    if p.m > ENUMERATE_UP_TO:
        return False
    return any(_solves(p, mode) for mode in itertools.product((False, True), repeat=p.m))


def _solves(p: Mlcp, active: Iterable[bool]) -> bool:
    """Return whether a regular mode satisfies all laws, exactly."""
    mode = np.where(p.switch, p.closed, np.fromiter(active, bool, p.m))
    on = np.flatnonzero(mode)
    matrix = np.block([[p.K, p.A[:, on]], [p.B[on], -p.D[np.ix_(on, on)]]])
    x = _solution(matrix, np.concatenate([p.b, p.q[on]]))
    if x is None:
        return False
    z, lam = x[: p.n], [Fraction(0)] * p.m
    for k, pair in enumerate(on):
        lam[pair] = x[p.n + k]
    for k in range(p.m):
        w = Fraction(p.q[k]) - _dot(p.B[k], z) + _dot(p.D[k], lam)
        if not p.switch[k] and (lam[k] < 0 or w < 0):
            return False
    return True


def _dot(row: np.ndarray, x: list[Fraction]) -> Fraction:
    return sum((Fraction(row[j]) * x[j] for j in np.flatnonzero(row)), Fraction(0))


def _solution(matrix: np.ndarray, rhs: np.ndarray) -> list[Fraction] | None:
    """Return the solution of a regular system by elimination, None if it is singular."""
    rows = [[Fraction(v) for v in (*row, b)] for row, b in zip(matrix, rhs, strict=True)]
    size = len(rows)
    for c in range(size):
        pivot = max(range(c, size), key=lambda i: abs(rows[i][c]))
        if rows[pivot][c] == 0:
            return None
        rows[c], rows[pivot] = rows[pivot], rows[c]
        for i in range(c + 1, size):
            if factor := rows[i][c] / rows[c][c]:
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[c], strict=True)]
    x = [Fraction(0)] * size
    for c in reversed(range(size)):
        known = sum((rows[c][j] * x[j] for j in range(c + 1, size)), Fraction(0))
        x[c] = (rows[c][size] - known) / rows[c][c]
    return x
