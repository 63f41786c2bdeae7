"""Statements that fail by a pole, an empty set or a number near zero: each is refuted by hand."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.optimize import linprog

from nsspice.dvi import (
    DVI,
    LCP,
    VI,
    Box,
    Cone,
    Polyhedron,
    log,
    maximum,
    multiplier,
    sqrt,
    states,
    t,
    tan,
    unknowns,
)
from nsspice.problems import exact
from nsspice.problems.settled import monotone_exactly, p_exactly

U = unknowns("u")
X = states("x")


@pytest.mark.parametrize(
    ("problem", "refuted"),
    [
        (VI(U - 1.0 / U, of=U), "u = -1 and u = 1 are solutions"),
        (VI(1.0 / U, {U: Box(-1, 1)}), "no solution: 1/u is never 0, and the ends push outwards"),
        (VI(U - 1.0 / (U - 1.0), of=U), "two solutions, (1 +- sqrt 5)/2"),
        (VI(U + tan(U), of=U), "u = 0 and one between each two poles"),
    ],
)
def test_a_pole_is_no_monotone_function(problem, refuted):
    """Slopes are positive on both sides of a pole; across it they say nothing."""
    found = problem.verdict()
    for statement in ("existence", "uniqueness", "strongly monotone", "uniform P"):
        assert found[statement].holds is None, f"{statement} although {refuted}"


@pytest.mark.parametrize(
    "problem",
    [
        VI(U + 1.0 / (2.0 + U), {U: Box(0, 3)}),
        VI(U + log(1.0 + U), {U: Box(0, 3)}),
        VI(U + sqrt(1.0 + U**2), {U: Box(-1, 3)}),
    ],
)
def test_a_pole_outside_is_no_reason(problem):
    """The same functions where K keeps away from their poles."""
    found = problem.verdict()
    assert found["existence"], found["existence"]
    assert found["uniqueness"], found["uniqueness"]


@pytest.mark.parametrize(
    ("load", "instant"), [(1.0 / (1.0 - t), 1.0), (tan(t), np.pi / 2), (log(2.0 - t), 2.0)]
)
def test_no_trajectory_for_all_times_beyond_a_pole(load, instant):
    """x' = -x + load(t) is linear, and its load ends at a finite instant."""
    found = DVI({X: -X + load}, start={X: 0.0}).verdict()
    assert found["existence"].holds is None, f"there is no load beyond {instant}"
    assert found["uniqueness"].holds is None
    assert DVI({X: -X + 1.0 / (1.0 + t)}, start={X: 0.0}).verdict()["existence"]


def test_an_empty_set_has_no_solution():
    """u <= -1 and u >= 1; the same with room between them has."""
    u = unknowns("u", 1)
    found = VI(u, {u: Polyhedron([[1], [-1]], [-1, -1])}).verdict()
    assert found["existence"].holds is False
    assert "empty" in found["existence"].reason
    assert VI(u, {u: Polyhedron([[1], [-1]], [1, 1])}).verdict()["existence"]
    # 1e-20 between the sides is room, -1e-20 is none
    for gap in (1e-20, -1e-20):
        K = Polyhedron([[1.0], [-1.0]], [gap, 0.0])
        assert VI(u, {u: K}).verdict()["existence"].holds is (gap > 0.0)


def test_numbers_near_zero_are_numbers():
    """Linear programs with tolerances of 1e-7 have decided otherwise."""
    assert LCP([[0.0]], [-1e-9]).verdict()["existence"].holds is False  # w = -1e-9
    skew = LCP([[0.0, 1e-10], [-1e-10, 0.0]], [-1.0, 1.0])
    assert skew.verdict()["existence"]
    # u = (1e10, 1e10) by hand: w = 1e-10 * 1e10 - 1 = 0 in both rows
    assert skew.solve()["u[0]"] == pytest.approx(1e10)
    assert LCP([[0.0, 1e-10], [-1e-10, 0.0]], [-1.0, -1.0]).verdict()["existence"].holds is False


def test_rounding_does_not_make_a_form_monotone():
    """x . Mx = -2^-53 for x = (1, -1): the least eigenvalue is half of that, beside 2."""
    assert not monotone_exactly([[1.0, 1.0], [1.0, 1.0 - 2.0**-53]])
    assert monotone_exactly([[1.0, 1.0], [1.0, 1.0]])
    assert p_exactly([[1.0, 1.0], [1.0, 1.0 + 2.0**-52]])
    assert not p_exactly([[1.0, 1.0], [1.0, 1.0]])


@pytest.mark.parametrize("seed", range(4))
def test_programs_without_rounding(seed):
    """Against HiGHS on small whole numbers, where its tolerances decide nothing."""
    random = np.random.default_rng(seed)
    for _ in range(60):
        m, n = random.integers(1, 6), random.integers(1, 5)
        C = random.integers(-3, 4, (m, n)).astype(float)
        d, c = random.integers(-3, 4, m).astype(float), random.integers(-2, 3, n).astype(float)
        got = linprog(-c, A_ub=C, b_ub=d, bounds=(None, None), options={"presolve": False})
        try:
            most = exact.maximise(c.tolist(), C, d.tolist())
        except exact.Empty:
            assert got.status == 2
            continue
        assert got.status == (3 if most is None else 0)
        if most is not None:
            assert float(most) == pytest.approx(-got.fun, abs=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_existence_of_linear_problems_mode_by_mode(seed):
    """Whole numbers: each mode's equations solved by hand, singular ones by linear programs."""
    random = np.random.default_rng(100 + seed)
    for _ in range(40):
        m = int(random.integers(1, 4))
        M = random.integers(-2, 3, (m, m)).astype(float)
        q = random.integers(-2, 3, m).astype(float)
        solved = False
        for on in itertools.product((False, True), repeat=m):
            active = np.array(on)
            both = np.vstack([M[active], -M[active], -M[~active]])[:, active]
            right = np.concatenate([-q[active], q[active], q[~active]])
            if not active.any():
                solved = solved or bool(np.all(q >= 0.0))
                continue
            cost = np.zeros(int(active.sum()))
            solved = solved or linprog(cost, A_ub=both, b_ub=right, bounds=(0, None)).status == 0
        assert LCP(M, q).verdict()["existence"].holds is solved, (M, q)


def test_a_kink_of_a_function_is_continuous():
    """A maximum has no gap: x' = -max(x, u) with u from a strongly monotone law."""
    u = multiplier("u")
    inner = VI(u + X, {u: Cone(0.0)}, of=u)
    assert DVI({X: -maximum(X, u)}, [inner], start={X: 1.0}).verdict()["uniqueness"]
