"""The complementarity driver against enumeration of all modes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from oracle import Mlcp, OracleInfeasible, residual, solve
from oracle.mlcp import mode_point

from nsspice.problems.csc import Csc
from nsspice.solvers import solve_mlcp


def by_core(p: Mlcp, start=None):
    roles = np.where(p.switch, np.where(p.closed, 1, 2), 0).astype(np.uint8)
    return solve_mlcp(
        *(Csc.from_dense(x) for x in (p.K, p.A, p.B, p.D)),
        p.b,
        p.q,
        roles=roles,
        row_kind=p.voltage_row.astype(np.uint8),
        start=start,
    )


def all_solutions(p: Mlcp) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return a solution of every mode that has one by its least-norm point."""
    found = []
    for bits in itertools.product([False, True], repeat=p.m):
        active = np.where(p.switch, p.closed, np.array(bits, dtype=bool))
        z, lam = mode_point(p, active, np.zeros(p.n), np.zeros(p.m))
        if residual(p, z, lam) <= 1e-11:
            found.append((z, lam))
    return found


def problem(K, A, B, D, b, q, closed=None, switch=None) -> Mlcp:
    n, m = A.shape
    none = np.zeros(m, dtype=bool)
    return Mlcp(
        K, A, B, D, b, q,
        np.zeros(n, dtype=bool),
        none if switch is None else switch,
        none if closed is None else closed,
    )  # fmt: skip


def p_matrix_lcp(rng: np.random.Generator) -> Mlcp:
    """Draw w = q + M l with M positive definite and not symmetric."""
    m = int(rng.integers(1, 7))
    X, Y = rng.normal(size=(m, m)), rng.normal(size=(m, m))
    M = X @ X.T + 0.1 * np.eye(m) + Y - Y.T
    empty = np.zeros((0, 0))
    return problem(empty, np.zeros((0, m)), np.zeros((m, 0)), M, np.zeros(0), rng.normal(size=m))


def monotone_mlcp(rng: np.random.Generator, integer: bool) -> Mlcp:
    """Draw a monotone problem with free unknowns, often singular when made of small integers."""
    n, m = int(rng.integers(1, 6)), int(rng.integers(1, 7))
    if integer:
        X, Y = rng.integers(-1, 2, (n, n)), rng.integers(-1, 2, (n, n))
        A, b, q = rng.integers(-1, 2, (n, m)), rng.integers(-2, 3, n), rng.integers(-1, 3, m)
        X = np.diag(rng.integers(0, 2, n)) @ X
    else:
        X, Y, A = (rng.normal(size=s) for s in ((n, n), (n, n), (n, m)))
        b, q = rng.normal(size=n), rng.normal(size=m)
    K = (X @ X.T + Y - Y.T).astype(float)
    A = A.astype(float)
    return problem(K, A, A.T.copy(), np.zeros((m, m)), b.astype(float), q.astype(float))


@pytest.mark.parametrize("seed", range(120))
def test_positive_definite_lcp_has_its_one_solution(seed):
    p = p_matrix_lcp(np.random.default_rng([1, seed]))
    got = by_core(p)
    assert got.solved
    solutions = all_solutions(p)
    assert solutions
    scale = max(np.abs(solutions[0][1]).max(), 1e-300)
    for _, lam in solutions:  # more than one mode only where a pair is degenerate
        assert np.abs(got.lam - lam).max() <= 1e-10 * scale


@pytest.mark.parametrize("integer", [False, True])
def test_monotone_mlcp_is_solved_exactly_if_it_is_feasible(integer):
    solvable = 0
    for seed in range(40):
        p = monotone_mlcp(np.random.default_rng([2, integer, seed]), integer)
        try:
            solve(p)
        except OracleInfeasible:
            assert not by_core(p).solved, f"seed {seed}"
            continue
        solvable += 1
        got = by_core(p)
        assert got.solved, f"seed {seed}"
        assert residual(p, got.z, got.lam) <= 1e-10, f"seed {seed}"
    assert solvable >= 12


def test_problems_that_only_enumeration_proves_unsolvable():
    for seed in range(60):
        p = monotone_mlcp(np.random.default_rng([3, seed]), True)
        if all_solutions(p):
            got = by_core(p)
            assert got.solved, f"seed {seed}"
            assert residual(p, got.z, got.lam) <= 1e-10, f"seed {seed}"


def test_switched_pairs_obey_their_state():
    for seed in range(40):
        rng = np.random.default_rng([4, seed])
        p = monotone_mlcp(rng, False)
        switch = rng.random(p.m) < 0.5
        closed = switch & (rng.random(p.m) < 0.5)
        p = problem(p.K, p.A, p.B, p.D, p.b, p.q, closed, switch)
        try:
            exact = solve(p)
        except OracleInfeasible:
            continue
        got = by_core(p)
        assert got.solved, f"seed {seed}"
        assert residual(p, got.z, got.lam) <= 1e-10, f"seed {seed}"
        assert np.abs(got.lam[switch & ~closed]).max(initial=0.0) <= 1e-15
        assert np.abs(got.lam - exact.lam).max() <= 1e-7 * max(np.abs(exact.lam).max(), 1.0)


def test_start_point_selects_the_nearest_of_many_solutions():
    # a floating node between two blocking diodes keeps the voltage it had
    K, A = np.zeros((1, 1)), np.array([[1.0, -1.0]])
    p = problem(K, A, A.T.copy(), np.zeros((2, 2)), np.zeros(1), np.array([4.0, 4.0]))
    got = by_core(p, (np.array([3.0]), np.zeros(2)))
    assert got.solved
    assert got.z[0] == pytest.approx(3.0, rel=1e-12)
    assert by_core(p).z[0] == pytest.approx(0.0, abs=1e-12)
