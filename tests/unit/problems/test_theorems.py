"""Theorems as verdicts on problems whose answer is known: none may be wrong."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.dvi import (
    DLCP,
    DMVI,
    DVI,
    GE,
    LCP,
    VI,
    Box,
    Cone,
    Polyhedron,
    SecondOrderCone,
    Sgn,
    asinh,
    atan,
    complementarity,
    contact,
    cos,
    equation,
    exp,
    multiplier,
    sin,
    states,
    t,
    tanh,
    unknowns,
)

X, V = states("x", "v")
N, U = multiplier("n", "u")
Q = unknowns("q", 2)


def dvi(rates, *conditions, start=None):
    return DVI(rates, list(conditions), start=start or dict.fromkeys(rates, 1.0))


#: name, problem, what the verdicts must say: True holds, False fails, None not decided.  A
#: statement about existence or uniqueness that is not true must never hold.
PROBLEMS = {
    # --- linear complementarity: classes and their witnesses
    "identity": (LCP(np.eye(2), [-1, -1]), {"P": True, "M": True, "uniqueness": True}),
    "two solutions": (
        LCP([[1, 2], [2, 1]], [-1, -1]),
        {"P": False, "copositive": True, "existence": True, "uniqueness": False},
    ),
    "P, not definite": (
        LCP([[1, -3], [0.5, 1]], [-1, -1]),
        {"P": True, "strongly monotone": False, "existence": True},
    ),
    "rotation": (
        LCP([[0, 1], [-1, 0]], [-1, -1]),
        {"P": False, "P0": True, "monotone": True, "existence": False},
    ),
    "infeasible": (LCP([[-1.0]], [-1.0]), {"P": False, "existence": False}),
    "monotone, feasible": (
        LCP([[1, 1], [1, 1]], [-1, -1]),
        {"P": False, "monotone": True, "existence": True},
    ),
    "M-matrix": (
        LCP([[2, -1], [-1, 2]], [1, -5]),
        {"M": True, "H": True, "P": True, "strongly monotone": True},
    ),
    "strictly copositive": (
        LCP([[1, 4], [4, 1]], [-1, -1]),
        {"P": False, "strictly copositive": True, "existence": True},
    ),
    # --- variational inequalities
    "strongly monotone VI": (
        VI(2.0 * Q - Q.sum() * 0.5 + np.array([sin(Q[0]), 0.0]) * 0.5, {Q: Cone(0)}, of=Q),
        {"strongly monotone": True, "existence": True, "uniqueness": True, "Theorem 2.2.1": True},
    ),
    "concave": (VI(-1.0 * Q, {Q: Box(-1, 1)}, of=Q), {"monotone": False, "existence": True}),
    "no solution": (VI(Q[0] * 0 + 1.0, of=Q[0]), {"existence": None, "strongly monotone": False}),
    "skew, uniform P": (
        VI(np.array([[1, -5], [5, 1]]) @ Q, {Q: Cone(0)}, of=Q),
        {"uniform P": True, "strongly monotone": True, "uniqueness": True},
    ),
    "P, not monotone": (
        VI(np.array([[1, -3], [0.5, 1]]) @ Q, {Q: Cone(0)}, of=Q),
        {"uniform P": True, "monotone": False, "uniqueness": True, "Theorem 2.2.3": True},
    ),
    "asinh and sign": (
        GE(asinh(Q[0]) + Sgn(Q[0]), of=Q[0]),
        {"monotone": True, "strongly monotone": None, "uniqueness": True},
    ),
    "falling and sign": (
        GE(2.0 * Q[0] - atan(3.0 * Q[0]) + Sgn(Q[0]), of=Q[0]),
        {"strongly monotone": False, "uniqueness": None},
    ),
    "steep enough and sign": (
        GE(2.0 * Q[0] - atan(Q[0]) + Sgn(Q[0]), of=Q[0]),
        {"strongly monotone": True, "uniqueness": True},
    ),
    "over a polyhedron": (
        VI(Q - 1.0, {Q: Polyhedron([[1, 1]], [1])}, of=Q),
        {"existence": True, "uniqueness": True, "Theorem 2.2.3": None},
    ),
    # --- dry friction and relays
    "Coulomb": (
        dvi({V: -9.81 * Sgn(V)}),
        {"Theorem 2.3.3": True, "existence": True, "uniqueness": True, "Theorem 2.2.1": False},
    ),
    "Coulomb with load": (
        dvi({V: sin(t) - 9.81 * Sgn(V)}),
        {"Theorem 2.3.3": False, "Theorem 2.3.2": True, "uniqueness": True},
    ),
    "spring and friction": (
        dvi({X: V, V: -X - Sgn(V)}),
        {"Theorem 2.3.3": True, "one-sided Lipschitz": True, "uniqueness": True},
    ),
    "repelling sign": (
        dvi({X: Sgn(X)}, start={X: 0}),
        {"existence": True, "uniqueness": None, "Theorem 2.3.3": None},
    ),
    "corrected 2.3.1": (
        dvi({X: sin(t) + 2 - Sgn(X, 0, 2)}),
        {"Theorem 2.3.2": True, "Theorem 2.2.9": True, "uniqueness": True},
    ),
    "Filippov spiral": (
        dvi({X: -Sgn(X) + 2 * Sgn(V), V: -2 * Sgn(X) - Sgn(V)}),
        {"existence": True, "Theorem 2.2.9": True},
    ),
    "sign in a nonlinear field": (
        dvi({X: -tanh(X) - Sgn(X)}),
        {"Theorem 2.3.3": True, "uniqueness": True},
    ),
    "growing beyond bounds": (
        dvi({X: X**2 - Sgn(X)}),
        {"existence": None, "uniqueness": None, "linear growth": None},
    ),
    # --- contact
    "compliant": (
        dvi({X: V, V: N - 9.81}, complementarity(N, X + N / 1e4)),
        {"Theorem 2.2.1": True, "Theorem 2.2.2": True, "Corollary 2.2.1": True, "existence": True},
    ),
    "rigid": (
        dvi({X: V, V: N - 9.81}, contact(N, X)),
        {"existence": None, "uniqueness": None, "linear growth": None, "Corollary 2.2.1": False},
    ),
    "forced compliant": (
        dvi({X: V, V: N - 9.81 + cos(t)}, complementarity(N, X + N)),
        {"Theorem 2.2.2": True, "Corollary 2.2.1": False, "uniqueness": True},
    ),
    # --- the thesis's other hypotheses
    "three selections": (
        dvi({X: -X - U}, equation(U, abs(U + X) - abs(U - X) - U), start={X: 1, U: 0}),
        {"Theorem 2.2.1": False, "uniqueness": None},
    ),
    "relaxation by 2.2.4": (
        dvi({X: -X + U}, VI(X + 0 * U, {U: Box(0, 5)}, of=U)),
        {"Theorem 2.2.4": True, "Theorem 2.2.9": True, "uniqueness": True},
    ),
    "the wrong sign for 2.2.4": (
        dvi({X: -X - U}, VI(X + 0 * U, {U: Box(0, 5)}, of=U)),
        {"Theorem 2.2.4": False, "Theorem 2.2.9": True, "uniqueness": None},
    ),
    "DLCP with definite D": (
        DLCP([[0, 1], [-1, 0]], [[1], [0]], [[0, 1]], [[2]], x0=[1, 0]),
        {"Corollary 2.2.1": True, "existence": True, "uniqueness": True},
    ),
    "DLCP with P but not definite D": (
        DLCP([[-1]], [[1, 1]], [[1], [1]], [[1, -3], [0.5, 1]], x0=[1]),
        {"Corollary 2.2.1": False, "Theorem 2.2.3": True, "Theorem 2.2.2": True},
    ),
    "DLCP of negative D": (
        DLCP([[-1]], [[1]], [[1]], [[-1]], x0=[1]),
        {"existence": None, "Theorem 2.2.1": False, "Theorem 2.2.3": False},
    ),
    "relative degree one": (
        DLCP([[0]], [[1]], [[1]], [[0]], x0=[1]),
        {"Theorem 3.3.1": True, "Theorem 2.2.1": False},
    ),
    "relative degree one, wrong sign": (
        DLCP([[0]], [[-1]], [[1]], [[0]], x0=[1]),
        {"Theorem 3.3.1": False, "existence": None},
    ),
    "DMVI, strongly monotone": (
        DMVI({X: -U}, g={U: U - X}, phi=abs(U), start={X: 3}),
        {"Theorem 2.2.1": True, "existence": True, "uniqueness": True},
    ),
    "DMVI over a box": (
        DMVI({X: -U}, g={U: -X}, phi=abs(U), within={U: Box(-1, 1)}, start={X: 3}),
        {"Theorem 2.2.9": True, "existence": True},
    ),
    "nonlinear DVI": (
        dvi({X: -X + sin(U)}, VI(2 * U + tanh(U) - X, {U: Cone(0)}, of=U)),
        {"Theorem 2.2.1": True, "Theorem 2.2.2": True, "uniqueness": True},
    ),
    "not Lipschitz": (
        dvi({X: -exp(X) + U}, VI(U - X, {U: Cone(0)}, of=U)),
        {"Theorem 2.2.1": True, "Theorem 2.2.2": None},
    ),
    "friction in the plane, curved set": (
        VI(Q[0] * 0 + 1.0 * np.array([*Q, U]), {(*Q, U): SecondOrderCone(1)}, of=[*Q, U]),
        {"strongly monotone": True, "existence": True, "uniqueness": True},
    ),
}


def test_there_are_forty_of_them():
    assert len(PROBLEMS) >= 40


@pytest.mark.parametrize("name", PROBLEMS)
def test_no_verdict_is_wrong(name):
    problem, expected = PROBLEMS[name]
    found = problem.verdict()
    for statement, holds in expected.items():
        assert found[statement].holds is holds, f"{statement}: {found[statement]}"
        assert found[statement].reason
    assert str(found)
    assert found.to_dict().keys() == found.keys()


def test_a_verdict_names_the_hypothesis():
    found = PROBLEMS["rigid"][0].verdict()
    assert "the set of n is unbounded" in found["existence"].reason
    assert "hypothesis D" in found["Corollary 2.2.1"].reason
    relay = PROBLEMS["repelling sign"][0].verdict()["one-sided Lipschitz"]
    assert "scalar product" in relay.reason
    three = PROBLEMS["three selections"][0].verdict()["Theorem 2.2.1"]
    assert "(iii)" in three.reason


def test_a_region_decides_what_the_whole_space_does_not():
    u = multiplier("u")
    problem = DVI({X: -(X**3) + u}, [complementarity(u, X + u)], start={X: 1.0})
    assert problem.verdict()["existence"].holds is None
    local = problem.verdict(region={X: (-2, 2)})
    assert local["uniqueness"]
    assert "while the states stay in the region" in local["existence"].claim


def test_moduli_of_theorem_2_2_1():
    """u = max(-x, 0) / 4: the Lipschitz constant L / mu of the theorem is that of u."""
    problem = DVI({X: U}, [complementarity(U, X + 4.0 * U)], start={X: 1.0})
    assert problem.verdict()["Theorem 2.2.1"].witness.value == pytest.approx(0.25)


@pytest.mark.parametrize("seed", range(25))
def test_what_is_proved_of_random_problems_is_true(seed):
    """A DLCP proved to have one trajectory: each short step has one solution, mode by mode.

    One proved not to need a P-matrix would show a step with none or several.
    """
    random = np.random.default_rng(seed)
    n, m = 2, 2
    A, B = random.standard_normal((n, n)), random.standard_normal((n, m))
    C, D = random.standard_normal((m, n)), random.standard_normal((m, m)) + random.integers(0, 2)
    verdict = DLCP(A, B, C, D, x0=np.zeros(n)).verdict()
    if not verdict["uniqueness"]:
        return
    h = 1e-6  # D decides: h C W B is far below its entries
    M = h * C @ np.linalg.solve(np.eye(n) - h * A, B) + D
    for _ in range(20):
        q = random.standard_normal(m)
        assert len(LCP(M, q).solutions()) == 1
