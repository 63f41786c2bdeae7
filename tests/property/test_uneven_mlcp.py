"""Complementarity problems in uneven units: the same problem, and the same solution."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsspice.problems import Csc
from nsspice.solvers import solve_mlcp

EMPTY = np.zeros(0)


def lcp(matrix, q):
    """Solve ``0 <= l`` orthogonal to ``q + M l >= 0``."""
    m = len(q)
    D = Csc.from_dense(np.asarray(matrix, float))
    zero = [Csc.zeros(shape) for shape in ((0, 0), (0, m), (m, 0))]
    return solve_mlcp(*zero, D, EMPTY, q)


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_units_do_not_matter(seed):
    """Positive definite matrices, rows and columns by 1e-8 to 1e8: 4 % were wrong, as solved."""
    rng = np.random.default_rng(seed)
    m = int(rng.integers(2, 5))
    root = rng.normal(size=(m, m))
    matrix = root @ root.T + 0.1 * np.eye(m)
    exact = np.where(rng.random(m) < 0.5, rng.random(m) + 0.1, 0.0)
    q = np.where(exact > 0.0, 0.0, rng.random(m) + 0.1) - matrix @ exact
    rows, columns = 10.0 ** rng.uniform(-8, 8, size=(2, m))
    found = lcp(rows[:, None] * matrix * columns, rows * q)
    assert found.solved
    # the condition of these matrices is below 1e3
    assert found.lam * columns == pytest.approx(exact, abs=1e-9 * (1.0 + exact.max()))


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_units_of_unknowns_do_not_matter(seed):
    """Equations next to the pairs, K z + A l = b and w = q - A' z + D l, by 1e-6 to 1e6."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    root = rng.normal(size=(n, n))
    K, A, D = root @ root.T + 0.1 * np.eye(n), rng.normal(size=(n, m)), 0.1 * np.eye(m)
    z, conducts = rng.normal(size=n), rng.random(m) < 0.5
    lam = np.where(conducts, rng.random(m) + 0.1, 0.0)
    slack = np.where(conducts, 0.0, rng.random(m) + 0.1)
    b, q = K @ z + A @ lam, slack + A.T @ z - D @ lam
    laws, unknowns = 10.0 ** rng.uniform(-6, 6, size=(2, n))
    slacks, multipliers = 10.0 ** rng.uniform(-6, 6, size=(2, m))
    found = solve_mlcp(
        Csc.from_dense(laws[:, None] * K * unknowns),
        Csc.from_dense(laws[:, None] * A * multipliers),
        Csc.from_dense(slacks[:, None] * A.T * unknowns),
        Csc.from_dense(slacks[:, None] * D * multipliers),
        laws * b,
        slacks * q,
    )
    assert found.solved
    # D >= 0.1 and K >= 0.1: the condition is below 1e4
    size = 1e-9 * (1.0 + np.abs(z).max() + lam.max())
    assert found.z * unknowns == pytest.approx(z, abs=size)
    assert found.lam * multipliers == pytest.approx(lam, abs=size)


def test_a_solution_that_rounding_makes_up_is_none():
    """l1 - 2 l2 = -2 and 1/2: at l = 8e16 both residuals are zero."""
    M, q, one = np.array([[1.0, -2.0], [2.0, -4.0]]), np.array([2.0, -1.0]), np.eye(2)
    found = solve_mlcp(
        Csc.from_dense(one),
        Csc.from_dense(-one),
        Csc.from_dense(-M),
        Csc.zeros((2, 2)),
        np.zeros(2),
        q,
    )
    assert not found.solved


def test_arguments_are_named():
    assert lcp([[1]], [-1]).lam.tolist() == [1.0]
    with pytest.raises(ValueError, match="q has the shape"):
        solve_mlcp(*[Csc.zeros((0, 0))] * 4, EMPTY, np.ones(1))
    with pytest.raises(ValueError, match="D has entries that are not numbers"):
        lcp([[np.nan]], [1.0])
    with pytest.raises(ValueError, match="q has entries that are not numbers"):
        lcp([[1.0]], [np.inf])
    with pytest.raises(IndexError, match="outside of a matrix of shape"):
        Csc.from_triplets((2, 2), [-1], [0], [1.0])
