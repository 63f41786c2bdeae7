"""Regularity at kinks: what `.regularity` says against the turns of a plane map around its kink."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.dvi import GE, LCP, VI, Cone, Sgn, maximum, minimum, unknowns
from nsspice.dvi.equations import static

U = unknowns("u")
A, B = unknowns("a"), unknowns("b")
BOTH = np.array([A, B])


def regularity(g, of):
    """Return whether the solution 0 is strongly regular."""
    point = VI(g, of=of).solve()
    assert point.residual == 0.0
    return point.regularity.strong


@pytest.mark.parametrize(
    ("g", "strong"),
    [
        (abs(U), False),  # |u| = p: none for p < 0, two for p > 0
        (maximum(U, -U / 2.0), False),
        (maximum(U, U / 2.0), True),
        (minimum(U, 3.0 * U), True),
        (U + abs(U), False),  # zero for all u < 0
        (3.0 * U + 2.0 * abs(U) + minimum(U, 0.0), True),
        (abs(maximum(U, 2.0 * U)), False),  # a kink inside a kink
    ],
)
def test_kinks_of_one_unknown(g, strong):
    """One to one exactly if both slopes have one sign."""
    assert regularity(g, U) in ((strong,) if "max(" not in str(g) else (strong, None))


def test_the_doubling_of_angles():
    """(|a| - |b|, |a + b| - |a - b|) keeps its orientation and takes every value twice."""
    point = VI([abs(A) - abs(B), abs(A + B) - abs(A - B)], of=BOTH).solve()
    assert point.regularity.strong is False
    assert "2 solutions" in point.regularity.verdict.reason
    # by hand: (1, 0) and (-1, 0) have the value (1, 0)
    g = VI([abs(A) - abs(B), abs(A + B) - abs(A - B)], of=BOTH).function()
    assert g(np.array([1.0, 0.0])).tolist() == g(np.array([-1.0, 0.0])).tolist() == [1.0, 0.0]


def turns(g) -> bool | None:
    """Return whether a map of the plane that is linear on rays is one to one.

    It is if the angle of its values goes round once, without turning back, as the argument does.
    None where values come too near to zero for a grid to tell.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    values = np.array([g(np.array([np.cos(w), np.sin(w)])) for w in angle])
    size = np.linalg.norm(values, axis=1)
    if size.min() < 1e-2 * size.max():
        return None
    moves = np.diff(np.unwrap(np.arctan2(values[:, 1], values[:, 0])))
    if 0.0 < np.min(np.abs(moves)) < 1e-6:
        return None
    return bool(np.all(moves > 0.0) or np.all(moves < 0.0)) and abs(moves.sum()) < 7.0


@pytest.mark.parametrize("seed", range(6))
def test_random_maps_of_the_plane(seed):
    """Sums of absolute values of up to four forms, some of them in both components."""
    random = np.random.default_rng(seed)
    told = 0
    for _ in range(8):
        g = []
        forms = [int(x) * A + int(y) * B for x, y in random.integers(-2, 3, (4, 2)) if x or y]
        for _row in range(2):
            part = int(random.integers(-3, 4)) * A + int(random.integers(-3, 4)) * B
            for form in forms:
                part = part + int(random.integers(-1, 2)) * abs(form)
            g.append(part)
        try:
            problem = VI(g, of=BOTH)
        except nsspice.errors.UsageError:  # an unknown that does not appear
            continue
        truth = turns(problem.function())
        found = problem.solve(start=[0.0, 0.0]).regularity.strong
        if truth is None:
            continue
        told += found is not None
        assert found in (truth, None), (g, truth)
    assert told >= 3


@pytest.mark.parametrize(
    ("g", "u", "strong"),
    [
        # pairs at the vertex of their graph beside a kink, u >= 0 at u = 0
        (VI(U + abs(U), {U: Cone(0.0)}), U, True),  # -p = 2u for u >= 0: one solution each
        (VI(abs(U) - 2.0 * U, {U: Cone(0.0)}), U, False),  # -u: two for small p > 0
        (GE(abs(U) + Sgn(U) - 1.0, of=U), U, True),
        (GE(-abs(U) + Sgn(U) - 1.0, of=U), U, False),
    ],
)
def test_kinks_beside_pairs(g, u, strong):
    point = g.solve(start=0.0)
    assert point[u] == pytest.approx(0.0, abs=1e-12)
    assert point.regularity.strong is strong, point.regularity.verdict


def test_regularity_of_a_large_problem_is_judged_when_asked_for(monkeypatch):
    """784 unknowns took 12 s of singular values for an LCP that is solved in 0.4 s."""
    m, judged = 200, []
    judge = static.strong_regularity
    monkeypatch.setattr(
        static, "strong_regularity", lambda *given: judged.append(1) or judge(*given)
    )
    M = 4.0 * np.eye(m) - np.eye(m, k=1) - np.eye(m, k=-1)
    point = LCP(M, -np.ones(m)).solve()
    assert not judged
    assert point.regularity.strong
    assert judged
    assert np.abs(M @ point[LCP(M, -np.ones(m)).unknowns] - 1.0).max() < 1e-12
