"""Regularity at solutions of generalized equations, against solutions of perturbed ones."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.dvi import GE, LCP, VI, Cone, Sgn, unknowns
from nsspice.dvi.equations.static import Static
from nsspice.problems.theorems import corollary_2_1, theorem_2_2_6, theorem_2_4


def verdicts(problem, values):
    """Return the three properties at a solution."""
    static = Static(problem.assembly)
    z, lam, residual = static.solve(values, 0.0)
    assert residual < 1e-10
    return theorem_2_2_6(static.system, static.jacobian(z, 0.0), z, lam), static, z


U, W = unknowns("u"), unknowns("w", 2)

#: problem, start, (metrically regular, strongly subregular, strongly regular)
CASES = {
    # p in a z + Sgn(z) at z = 0 with the value inside: regular whatever a
    "inside the jump": (GE(-0.5 * U + Sgn(U) - 0.2, of=U), 0.0, (True, True, True)),
    # at its end p = 1: z = (p - 1)^+ / a for a > 0
    "end, rising": (GE(2.0 * U + Sgn(U) - 1.0, of=U), 0.0, (True, True, True)),
    # for a < 0 near p = 1: the branch z = (p - 1)/a, p < 1, and z = 0 for p < 1; none beyond
    "end, falling": (GE(-2.0 * U + Sgn(U) - 1.0, of=U), 0.0, (False, True, False)),
    # a = 0: the whole half line solves p = 1
    "end, flat": (GE(0.0 * U + Sgn(U) - 1.0, of=U), 0.0, (False, False, False)),
    # complementarity with lam = w = 0
    "LCP vertex": (LCP([[1.0]], [0.0]), 0.0, (True, True, True)),
    "LCP vertex, negative": (LCP([[-1.0]], [0.0]), 0.0, (False, True, False)),
    "LCP vertex, P": (LCP([[1.0, -3.0], [0.5, 1.0]], [0.0, 0.0]), 0.0, (True, True, True)),
    # both minors positive but the determinant: several solutions for some q
    "LCP vertex, not P": (LCP([[1.0, 2.0], [2.0, 1.0]], [0.0, 0.0]), 0.0, (None, True, False)),
    "smooth root": (VI(U**2 - 1.0, of=U), 1.0, (True, True, True)),
    "interior of a box": (VI(W - 0.5, {W: Cone(0)}, of=W), 0.5, (True, True, True)),
}


@pytest.mark.parametrize("name", CASES)
def test_properties_at_a_solution(name):
    problem, start, known = CASES[name]
    names = {u.name: start for u in problem.unknowns}
    found, _, _ = verdicts(problem, names)
    for (key, verdict), holds in zip(found.items(), known, strict=True):
        if holds is not None:
            assert verdict.holds is holds, f"{key}: {verdict}"
    # strong regularity implies the two others
    if found["strong metric regularity"]:
        assert found["metric regularity"]
        assert found["strong metric subregularity"]


@pytest.mark.parametrize("seed", range(12))
def test_lcp_at_the_vertex_by_counting(seed):
    """At q = 0 all pairs are at the vertex: strong regularity there is the P-property."""
    random = np.random.default_rng(seed)
    M = random.standard_normal((2, 2))
    problem = LCP(M, [0.0, 0.0])
    found, _, _ = verdicts(problem, {u.name: 0.0 for u in problem.unknowns})
    counts = set()
    for angle in np.linspace(0.0, 2 * np.pi, 60, endpoint=False) + 0.01:
        counts.add(len(LCP(M, [np.cos(angle), np.sin(angle)]).solutions()))
    assert bool(found["strong metric regularity"]) == (counts == {1})
    if found["metric regularity"]:
        assert 0 not in counts


def test_moduli_against_differences():
    """The modulus of strong regularity is the largest change of an unknown per unit of p."""
    A = np.array([[3.0, 1.0], [-1.0, 2.0]])
    problem = GE(A @ W + Sgn(W) - [4.0, 0.3], of=W)
    found, _, z = verdicts(problem, {u.name: 0.0 for u in problem.unknowns})
    strong = found["strong metric regularity"]
    assert strong
    change = 0.0
    base = problem.solve()[W]
    for row in range(2):
        for h in (1e-6, -1e-6):
            p = np.array([4.0, 0.3])
            p[row] += h
            moved = GE(A @ W + Sgn(W) - p, of=W).solve()[W]
            change = max(change, np.abs(moved - base).max() / abs(h))
    assert strong.witness.value == pytest.approx(change, rel=1e-6)
    assert z.size == 4


def test_corollary_2_1_and_theorem_2_4():
    assert corollary_2_1(np.array([[2.0, 5.0], [-5.0, 1.0]]))
    assert not corollary_2_1(np.array([[1.0, 2.0], [2.0, 1.0]]))
    # f(z) = 2 z + |z| has df(0) = [1, 3]; f(z) = |z| / 2 + 0.2 z has [-0.3, 0.7]
    for f, holds in ((2.0 * U + abs(U), True), (0.5 * abs(U) + 0.2 * U, None)):
        problem = GE(f + Sgn(U) - 0.5, of=U)
        static = Static(problem.assembly)
        z, _, _ = static.solve({"u": 0.0}, 0.0)
        rows = [static.assembly.columns.index("u")]
        assert theorem_2_4(static.system, z, rows).holds is holds
