"""Classes of matrices against their definitions: enumeration, closed forms, and checked witnesses.

Every verdict that a class fails is checked by its witness alone, without the algorithm.
"""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from nsspice.problems.matrices import (
    is_copositive,
    is_definite,
    is_h_matrix,
    is_m_matrix,
    is_monotone,
    is_p0_matrix,
    is_p_matrix,
)
from nsspice.problems.verdict import Verdict


def cyclic(n, value):
    """Ones on the diagonal and ``value`` right of it, round the corner too."""
    return np.eye(n) + value * np.roll(np.eye(n), 1, axis=1)


def rotation(n, value):
    """Skew couplings of any size beside a unit diagonal: positive definite."""
    upper = value * np.triu(np.ones((n, n)), 1)
    return np.eye(n) + upper - upper.T


def horn():
    """Copositive, but neither semidefinite nor a sum with a nonnegative matrix (Horn)."""
    return np.array([[[1, -1, 1, 1, -1][(j - i) % 5] for j in range(5)] for i in range(5)], float)


#: name: matrix, P, P0, H, M, monotone, strongly monotone, copositive, strictly copositive
TABLE = {
    "empty": (np.zeros((0, 0)), 1, 1, 1, 1, 1, 1, 1, 1),
    "one": (np.eye(1), 1, 1, 1, 1, 1, 1, 1, 1),
    "zero": (np.zeros((2, 2)), 0, 1, 0, 0, 1, 0, 1, 0),
    "negative": (-np.eye(2), 0, 0, 1, 0, 0, 0, 0, 0),
    "skew": (np.array([[0.0, -1.0], [1.0, 0.0]]), 0, 1, 0, 0, 1, 0, 1, 0),
    "swap": (np.array([[0.0, 1.0], [1.0, 0.0]]), 0, 0, 0, 0, 0, 0, 1, 0),
    "ones": (np.ones((3, 3)), 0, 1, 0, 0, 1, 0, 1, 1),
    "triangle": (np.array([[1.0, 9.0], [0.0, 1.0]]), 1, 1, 1, 0, 0, 0, 1, 1),
    "lower": (np.array([[1.0, 0.0], [-9.0, 1.0]]), 1, 1, 1, 1, 0, 0, 0, 0),
    "laplacian": (np.array([[1.0, -1.0], [-1.0, 1.0]]), 0, 1, 0, 0, 1, 0, 1, 0),
    "grounded": (np.array([[2.0, -1.0], [-1.0, 2.0]]), 1, 1, 1, 1, 1, 1, 1, 1),
    "antiphase": (np.array([[1.0, -3.0], [0.5, 1.0]]), 1, 1, 0, 0, 0, 0, 0, 0),
    "latch": (np.array([[1.0, 2.0], [2.0, 1.0]]), 0, 0, 0, 0, 0, 0, 1, 1),
    # det = 1 + value^3 for three rows, 1 - value^4 for four: the sign of the cycle decides
    "odd cycle": (cyclic(3, 7.0), 1, 1, 0, 0, 0, 0, 1, 1),
    "odd cycle, negative": (cyclic(3, -7.0), 0, 0, 0, 0, 0, 0, 0, 0),
    "even cycle": (cyclic(4, 7.0), 0, 0, 0, 0, 0, 0, 1, 1),
    "cycle of 13": (cyclic(13, 7.0), 1, 1, 0, 0, 0, 0, 1, 1),
    "cycle of 20": (cyclic(20, 7.0), 0, 0, 0, 0, 0, 0, 1, 1),
    "rotation of 40": (rotation(40, 3.0), 1, 1, 0, 0, 1, 1, 1, 1),
    "horn": (horn(), 0, 0, 0, 0, 0, 0, 1, 0),
    "horn, below": (horn() - 1e-6 * np.eye(5), 0, 0, 0, 0, 0, 0, 0, 0),
    "horn, above": (horn() + 1e-6 * np.eye(5), 0, 0, 0, 0, 0, 0, 1, 1),
    "murty": (np.eye(12) + 2.0 * np.triu(np.ones((12, 12)), 1), 1, 1, 1, 0, 1, 0, 1, 1),
    "decimals": (np.array([[0.1, 0.3], [0.3, 0.9]]), 0, 1, 0, 0, 1, 0, 1, 1),
    "units": (np.array([[1e12, 2.0], [-0.01, 1e-9]]), 1, 1, 1, 0, 1, 1, 1, 1),
}
CHECKS = (
    is_p_matrix,
    is_p0_matrix,
    is_h_matrix,
    is_m_matrix,
    is_monotone,
    is_definite,
    is_copositive,
    lambda m: is_copositive(m, strict=True),
)


@pytest.mark.parametrize("name", TABLE)
def test_known_answers(name):
    matrix, *expected = TABLE[name]
    found = [check(matrix) for check in CHECKS]
    assert [v.holds for v in found] == [bool(e) for e in expected], [str(v) for v in found]
    for verdict in found:
        assert witnessed(matrix, verdict), str(verdict)


def determinant(matrix) -> Fraction:
    """Return the determinant of a matrix of doubles in rational arithmetic."""
    rows = [[Fraction(float(x)) for x in row] for row in matrix]
    value = Fraction(1)
    for k in range(len(rows)):
        pivot = next((r for r in range(k, len(rows)) if rows[r][k]), None)
        if pivot is None:
            return Fraction(0)
        if pivot != k:
            rows[k], rows[pivot], value = rows[pivot], rows[k], -value
        value *= rows[k][k]
        for row in rows[k + 1 :]:
            factor = row[k] / rows[k][k]
            row[:] = [a - factor * b for a, b in zip(row, rows[k], strict=True)]
    return value


def witnessed(m, verdict: Verdict) -> bool:
    """Return whether a failed claim's witness contradicts the definition, in plain arithmetic."""
    w = verdict.witness
    if verdict.holds is not False:
        return True
    assert w is not None
    n = len(m)
    slack = 4.0 * n * n * 2.0**-53
    if verdict.claim in ("a P-matrix", "a P0-matrix"):
        rows = list(w.rows)
        value = determinant(m[np.ix_(rows, rows)])
        size = float(np.prod(np.linalg.norm(m[np.ix_(rows, rows)], axis=1)))
        assert value < 0 or (verdict.claim == "a P-matrix" and value <= slack * size)
        reversal = w.vector * (m @ w.vector)
        return bool(
            w.vector.any()
            and np.all(reversal <= slack * (abs(w.vector) * (abs(m) @ abs(w.vector))))
        )
    if verdict.claim == "an M-matrix" and len(w.rows) == 2 and w.vector is None:
        return bool(m[w.rows] > 0.0 and w.rows[0] != w.rows[1])
    if verdict.claim == "an M-matrix" and w.value is not None:
        return bool(m[w.rows[0], w.rows[0]] <= 0.0)
    if verdict.claim in ("an H-matrix", "an M-matrix"):
        diagonal = np.abs(np.diag(m))
        others = np.abs(m) - np.diag(diagonal)
        x = w.vector
        return bool(
            x.any() and np.all(x >= 0.0) and np.all(others @ x >= diagonal * x * (1.0 - 1e-9))
        )
    value = w.vector @ m @ w.vector
    bound = slack * (np.abs(w.vector) @ np.abs(m) @ np.abs(w.vector))
    strict = verdict.claim in ("strongly monotone", "strictly copositive")
    assert "copositive" not in verdict.claim or np.all(w.vector >= 0.0)
    return bool(w.vector.any() and value <= (bound if strict else 0.0))


def minors(matrix):
    m = matrix.shape[0]
    return [
        np.linalg.det(matrix[np.ix_(k, k)])
        for size in range(1, m + 1)
        for k in map(list, itertools.combinations(range(m), size))
    ]


def test_minors_against_enumeration():
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(400):
        m = int(rng.integers(1, 7))
        matrix = rng.normal(size=(m, m)) + rng.uniform(0, 2) * np.eye(m)
        expected = bool(min(minors(matrix)) > 0.0)
        # scaling rows and columns keeps the signs of all minors
        left, right = 10.0 ** rng.uniform(-6, 6, (2, m))
        for scaled in (matrix, matrix * left[:, None] * right):
            for check in (is_p_matrix, is_p0_matrix):  # no minor is zero
                found = check(scaled)
                assert found.holds is expected
                assert witnessed(scaled, found)
        seen.add(expected)
    assert seen == {True, False}


def test_p_matrices_of_many_rows_are_decided():
    """``I + value P`` with a cycle P of n rows is P exactly if n is odd or ``value^n < 1``.

    All its proper principal minors are 1: nothing but the determinant tells.
    """
    for n in (12, 15, 16, 19, 20):
        found = is_p_matrix(cyclic(n, 1.5))
        assert found.holds is bool(n % 2), (n, str(found))
        if not found:
            assert found.witness.rows == tuple(range(n))


def test_large_matrices_by_sufficient_conditions():
    rng = np.random.default_rng(4)
    m = rng.normal(size=(60, 60))
    definite = m @ m.T + np.eye(60) + (m - m.T)
    assert is_definite(definite)
    assert is_p_matrix(definite)
    dominant = m - np.diag(np.diag(m)) + np.diag(np.abs(m).sum(axis=1) + 1.0)
    scaled = dominant * 10.0 ** rng.uniform(-3, 3, 60)  # H-matrix, no longer dominant by rows
    assert is_h_matrix(scaled)
    assert is_p_matrix(scaled)
    # definite after a scaling that only the entries tell
    units = 10.0 ** rng.uniform(-6, 6, 60)
    assert is_p_matrix(definite * units[:, None])
    assert is_p_matrix(-definite).holds is False
    upper = np.triu(rng.normal(size=(30, 30)) * 50.0, 1) + np.eye(30)
    assert is_p_matrix(upper)  # triangular, however large the upper part
    hidden = np.eye(30) + np.triu(rng.normal(size=(30, 30)) * 50.0, 1)
    hidden[20, 10] = hidden[10, 20] = 2.0
    found = is_p_matrix(hidden)
    assert found.holds is False
    assert witnessed(hidden, found)


def test_undecided_is_said():
    """A cycle of 41 rows is P, which only its determinant tells: nothing cheap does."""
    found = is_p_matrix(cyclic(41, 1.5))
    assert found.holds is None
    assert "more than 20" in found.reason
    assert not found
    assert is_p_matrix([[1.0, np.nan], [0.0, 1.0]]).holds is None


def test_copositive_against_a_fine_grid():
    rng = np.random.default_rng(6)
    seen = set()
    corners = np.array(list(itertools.product(np.linspace(0.0, 1.0, 9), repeat=4)))[1:]
    for _ in range(200):
        matrix = rng.normal(size=(4, 4)) + rng.uniform(0, 3) * np.eye(4)
        found = is_copositive(matrix)
        least = np.einsum("ki,ij,kj->k", corners, matrix, corners).min()
        if least < 0.0:
            assert found.holds is False
        assert witnessed(matrix, found)  # and so a verdict against it is right
        seen.add(found.holds)
    assert seen == {True, False}


def test_theorems_name_the_hypothesis_that_fails():
    good, bad = is_definite(np.eye(2)), is_definite(-np.eye(2))
    open_ = Verdict.undecided("Lipschitz", "an expression is not known")
    assert Verdict.theorem("T applies", "T", {"A": good}).holds is True
    found = Verdict.theorem("T applies", "T", {"A": good, "B": open_, "C": bad})
    assert found.holds is False
    assert found.reason.startswith("hypothesis C")
    assert found.witness is bad.witness
    assert Verdict.theorem("T applies", "T", {"A": good, "B": open_}).holds is None
    assert found.to_dict()["hypotheses"]["B"]["verdict"] == "not decided"


def test_matrices_must_be_square():
    with pytest.raises(ValueError, match="square"):
        is_p_matrix([[1.0, 2.0]])
