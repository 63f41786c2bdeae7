"""Proofs that a mode solves a complementarity problem, exact and of bounded cost.

Linear programs judge feasibility by tolerances; where amperes meet an inductance over a short step
they have called problems infeasible that have a solution, and one kept a simplex method busy for
minutes.  A proof needs no tolerance: the numbers of the problem are rationals, and so is the
solution of a regular mode.

It is found by iterative refinement.  With a floating-point inverse ``R`` of the matrix ``M``, the
error of a point is at most ``|R r| / (1 - |I - R M|)``, the residual ``r`` being computed in
integers; every round brings new digits and a new bound (S. M. Rump, Acta Numerica 19 (2010)
287-449, section 10).  A number whose sign is still open is zero if it is smaller than one over
Hadamard's bound of the determinant of an integer matrix, by Cramer's rule.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable

import numpy as np

from .residual import Bools, Floats, Mlcp

#: pairs up to which every mode is tried
ENUMERATE_UP_TO = 6
#: new bits of the point in each round, a few less than the inverse can give
BITS = 48
#: an inverse whose product with the matrix misses one by more than this proves nothing
DEFECT = 0.1
#: rounds after which a sign stays open
ROUNDS = 1000


def provably_solvable(p: Mlcp, active: Bools) -> bool:
    """Return whether the given mode, or any other if there are few, is proved to be a solution."""
    if proved(p, active):
        return True
    if p.m > ENUMERATE_UP_TO:
        return False
    return any(proved(p, mode) for mode in itertools.product((False, True), repeat=p.m))


def proved(p: Mlcp, active: Iterable[bool]) -> bool:
    """Return whether a regular mode is proved to satisfy all laws.

    False says little: the mode may be no solution, or singular, or too close to that.
    """
    mode = np.where(p.switch, p.closed, np.fromiter(active, bool, p.m))
    # unknowns: z, then the multiplier of each active pair and the slack of each other
    matrix = np.block(
        [[p.K, np.where(mode, p.A, 0.0)], [p.B, np.where(mode, -p.D, np.eye(p.m))]],
    )
    signed = np.append(np.zeros(p.n, dtype=bool), ~p.switch)
    return solution_is_nonnegative(matrix, np.concatenate([p.b, p.q]), signed)


def solution_is_nonnegative(matrix: Floats, rhs: Floats, signed: Bools) -> bool:
    """Return whether the system is proved to be regular and the signed unknowns to be >= 0."""
    if not (np.isfinite(matrix).all() and np.isfinite(rhs).all()):
        return False
    even = _evened_out(matrix, rhs)
    if even is None:
        return False
    matrix, rhs = even
    inverse, defect = _inverse(matrix)
    if defect > DEFECT:
        return False
    rows, target, scale = _integers(matrix, rhs)
    # a nonzero unknown is a quotient of integers, and no larger than its divisor's inverse
    smallest = -sum(1 + sum(v * v for _, v in row).bit_length() // 2 for row in rows)
    wanted = np.flatnonzero(signed).tolist()
    y, shift = [0] * len(rows), 0  # the point is y / 2**shift
    for _ in range(ROUNDS):
        left = [
            (r << shift) - sum(v * y[j] for j, v in row)
            for r, row in zip(target, rows, strict=True)
        ]
        if not any(left):
            return all(y[j] >= 0 for j in wanted)
        # the residual in the units of the matrix is part * 2**unit
        logs = [v.bit_length() - s - shift if v else None for v, s in zip(left, scale, strict=True)]
        unit = max(e for e in logs if e is not None)
        part = np.array(
            [_shifted(v, -s - shift - unit) for v, s in zip(left, scale, strict=True)],
        )
        step = inverse @ part
        rounding = 4 * len(rows) * np.finfo(float).eps
        bound = np.abs(step) + rounding * (np.abs(inverse) @ np.abs(part))
        bound = bound + bound.max() * defect / (1.0 - defect)
        waiting = False
        for j in wanted:
            error = math.frexp(max(bound[j], 1e-300))[1] + unit  # log2, rounded up
            size = y[j].bit_length() - shift if y[j] else -math.inf
            if size - 1 > error:
                if y[j] < 0:
                    return False
            elif max(size, error) + 1 >= smallest:
                waiting = True
        if not waiting:
            return True
        finer = max(shift, BITS - unit)
        y = [
            (v << finer - shift) + (round(d * 2.0**BITS) << unit + finer - BITS)
            for v, d in zip(y, step.tolist(), strict=True)
        ]
        shift = finer
    return False


def _shifted(value: int, power: int) -> float:
    """Return ``value * 2**power``; the integer may be larger than any float."""
    excess = max(0, abs(value).bit_length() - 64)
    return math.ldexp(value >> excess, power + excess)


def _evened_out(matrix: Floats, rhs: Floats) -> tuple[Floats, Floats] | None:
    """Return the system with rows and columns multiplied by powers of two; None if not exactly."""
    rows, columns = np.zeros(len(rhs), dtype=int), np.zeros(len(rhs), dtype=int)
    for _ in range(5):
        for power, axis in ((rows, 1), (columns, 0)):
            size = np.ldexp(np.abs(matrix), rows[:, None] + columns).max(axis=axis, initial=0.0)
            power -= np.frexp(np.where(size > 0, size, 1.0))[1]
    even, target = np.ldexp(matrix, rows[:, None] + columns), np.ldexp(rhs, rows)
    same = np.array_equal(np.ldexp(even, -(rows[:, None] + columns)), matrix)
    return (even, target) if same and np.array_equal(np.ldexp(target, -rows), rhs) else None


def _inverse(matrix: Floats) -> tuple[Floats, float]:
    """Return an inverse R and a bound of the largest row sum of I - R M."""
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return matrix, math.inf
    size = matrix.shape[0]
    product = np.abs(np.eye(size) - inverse @ matrix)
    product += 2 * (size + 1) * np.finfo(float).eps * (np.abs(inverse) @ np.abs(matrix))
    bound = float(product.sum(axis=1).max(initial=0.0)) * (1.0 + 1e-9)
    return inverse, bound if math.isfinite(bound) else math.inf


def _integers(
    matrix: Floats, rhs: Floats
) -> tuple[list[list[tuple[int, int]]], list[int], list[int]]:
    """Return sparse rows and a right-hand side of integers, row i multiplied by 2**scale[i]."""
    rows, target, scale = [], [], []
    for row, r in zip(matrix, rhs, strict=True):
        entries = [(j, *row[j].item().as_integer_ratio()) for j in np.flatnonzero(row).tolist()]
        top, bottom = r.item().as_integer_ratio()
        common = max([bottom, *(b for _, _, b in entries)])  # all are powers of two
        rows.append([(j, a * (common // b)) for j, a, b in entries])
        target.append(top * (common // bottom))
        scale.append(common.bit_length() - 1)
    return rows, target, scale
