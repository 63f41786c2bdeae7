"""The judge's proofs against elimination in rational numbers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from oracle.exact import solution_is_nonnegative


def solution(matrix, rhs):
    """Return the solution of a regular system by elimination, None if it is singular."""
    rows = [[Fraction(v) for v in (*row, b)] for row, b in zip(matrix, rhs, strict=True)]
    size = len(rows)
    for c in range(size):
        pivot = max(range(c, size), key=lambda i: abs(rows[i][c]))
        if rows[pivot][c] == 0:
            return None
        rows[c], rows[pivot] = rows[pivot], rows[c]
        for i in range(size):
            if i != c and (factor := rows[i][c] / rows[c][c]):
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[c], strict=True)]
    return [rows[i][size] / rows[i][i] for i in range(size)]


def drawn(kind, rng):
    """Return a random system: integers with zeros in the solution, plain, or badly scaled."""
    n = int(rng.integers(1, 8))
    if kind == "integers":
        matrix = rng.integers(-2, 3, (n, n)) * 10.0 ** rng.integers(-6, 7, (n, 1))
        return matrix, matrix @ rng.integers(0, 2, n)
    if kind == "plain":
        matrix = rng.normal(size=(n, n))
        return matrix, matrix @ np.abs(rng.normal(size=n))
    matrix = rng.normal(size=(n, n)) * 10.0 ** rng.integers(-12, 7, (n, n))
    matrix[rng.random((n, n)) < 0.5] = 0.0
    return matrix, rng.normal(size=n) * (rng.random(n) < 0.5)


@pytest.mark.parametrize("kind", ["integers", "plain", "wild"])
def test_proofs_are_sound_and_found(kind):
    rng = np.random.default_rng(1)
    right = found = 0
    for _ in range(400):
        matrix, rhs = drawn(kind, rng)
        exact = solution(matrix, rhs)
        truth = exact is not None and min(exact) >= 0
        proof = solution_is_nonnegative(matrix, rhs, np.ones(len(rhs), dtype=bool))
        assert truth or not proof
        right += truth
        found += proof
    assert right > 20
    assert found >= 0.99 * right


def test_a_sign_below_all_rounding_is_seen():
    """z = 1 - x + 2**-200 y with x = 1: floats see nothing of y."""
    tiny = 2.0**-200
    matrix = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, -tiny, 1.0]])
    signed = np.array([False, False, True])
    assert solution_is_nonnegative(matrix, np.array([1.0, 1.0, 1.0]), signed)
    assert solution_is_nonnegative(matrix, np.array([1.0, 0.0, 1.0]), signed)
    assert not solution_is_nonnegative(matrix, np.array([1.0, -1.0, 1.0]), signed)
