"""Models of nsspice.dvi: expressions, sets, conversions, and errors that name what is wrong."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

import nsspice
from nsspice import dvi
from nsspice.dvi import (
    DLCP,
    DMVI,
    DVI,
    LCP,
    MLCP,
    NCP,
    VI,
    Cone,
    Polyhedron,
    SecondOrderCone,
    Sgn,
    complementarity,
    contact,
    equation,
    multiplier,
    sin,
    states,
    t,
    unknowns,
)


def code_of(action):
    with pytest.raises(nsspice.NsspiceError) as raised:
        action()
    return raised.value.code, str(raised.value)


def test_expressions_are_exact_and_need_no_text():
    x, v = states("x", "v")
    f = sin(x * v) / (1.0 + x**2) - abs(v) + dvi.maximum(x, 2.0 * v)
    at = {"x": 0.3, "v": -0.7}
    for u in (x, v):
        h = 1e-6
        up, down = dict(at), dict(at)
        up[u.name] += h
        down[u.name] -= h
        slope = (f.value(up) - f.value(down)) / (2 * h)
        # central differences: h^2 times a third derivative below 10, and rounding / h
        assert f.derivative(u).value(at) == pytest.approx(slope, abs=1e-9)


def test_vectors_meet_numpy_and_scipy():
    q = unknowns("q", 3)
    M = np.arange(9.0).reshape(3, 3)
    values = {"q[0]": 1.0, "q[1]": -2.0, "q[2]": 0.5}
    x = np.array([1.0, -2.0, 0.5])
    for built, known in (
        (M @ q, M @ x),
        (2.0 * q - x, x),
        (np.exp(q), np.exp(x)),
        (q**2 / 4.0, x**2 / 4.0),
    ):
        assert np.allclose([e.value(values) for e in built], known, rtol=1e-15, atol=1e-15)
    assert q.sum().value(values) == -0.5
    assert (q @ x).value(values) == pytest.approx(x @ x)
    sparse = LCP(sp.csr_matrix([[2.0, 0.0], [0.0, 1.0]]), [-1.0, 1.0])
    assert sparse.solve()["u[0]"] == 0.5


@pytest.mark.parametrize(
    ("action", "code", "words"),
    [
        (lambda: DVI({states("x"): states("v")}, start={states("x"): 0}), "NS6001", "v appears in"),
        (lambda: DVI({states("x"): 1.0}, start={}), "NS6001", "x has no initial value"),
        (lambda: unknowns("Q"), "NS6001", "capital"),
        (lambda: unknowns("t"), "NS6001", "time"),
        (lambda: bool(states("x")), "NS6002", "condition"),
        (lambda: (states("x") + 1.0).name, "NS6002", "not a variable"),
        (lambda: states("x") * float("nan"), "NS6002", "nan"),
        (lambda: Sgn(states("v"), 1.0, -1.0), "NS6002", "monotone"),
        (lambda: LCP([[1.0, 2.0]], [1.0]), "NS6003", "M has the shape (1, 2)"),
        (lambda: LCP([[1.0]], [1.0, 2.0]), "NS6003", "q has the shape"),
        (lambda: DLCP([[1.0]], [[1.0]], [[1.0, 2.0]], [[1.0]], x0=[0.0]), "NS6003", "C has"),
        (lambda: DLCP([[1.0]], [[1.0]], [[1.0]], [[1.0]], x0=[0.0], E=[[0.0]]), "NS6003", "singul"),
        (lambda: complementarity(multiplier("a"), [1.0, 2.0]), "NS6003", "1 multipliers"),
        (lambda: contact(multiplier("n"), states("x"), restitution=1.2), "NS6003", "restitution"),
        (lambda: Polyhedron([[1.0]], [1.0, 2.0]), "NS6003", "C has 1 rows"),
        (lambda: SecondOrderCone(0.0), "NS6003", "interior"),
        (lambda: VI([unknowns("a"), unknowns("b")], of=unknowns("a")), "NS6003", "2 components"),
        (lambda: VI(unknowns("a"), {unknowns("a"): "K"}), "NS6003", "not a set for a"),
    ],
)
def test_a_wrong_model_is_named(action, code, words):
    found, message = code_of(action)
    assert found == code
    assert words in message


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"method": "magic"}, "NS6004"),
        ({"theta": 1.5}, "NS6004"),
        ({"variant": 3}, "NS6004"),
        ({"theta_on": "all"}, "NS6004"),
        ({"step": -1.0}, "NS6004"),
        ({"rows": 0}, "NS6004"),
        ({"theta": 0.5}, "NS6005"),  # restitution beside fixed steps
    ],
)
def test_a_wrong_run_is_named(options, code):
    x, v = states("x", "v")
    n = multiplier("n")
    ball = DVI({x: v, v: n - 9.81}, [contact(n, x, 0.5)], start={x: 1, v: 0})
    assert code_of(lambda: ball.run(1.0, **options))[0] == code
    assert code_of(lambda: ball.run(-1.0))[0] == "NS6004"


def test_hypotheses_are_named_where_something_is_refused():
    x, v = states("x", "v")
    friction = DVI({x: v, v: -Sgn(v)}, start={x: 0, v: 1})
    code, text = code_of(friction.to_ode)
    assert code == "NS6005"
    assert "P-matrix" in text or "singular" in text
    f = unknowns("f", 3)
    cone = VI(f - 1.0, within={f: SecondOrderCone(1.0)})
    code, text = code_of(lambda: DVI({x: 1.0 + 0 * x}, [cone], start={x: 0}))
    assert code == "NS6005"
    assert "Polyhedron" in text
    u = unknowns("u", 2)
    skew = VI(np.array([[1.0, 2.0], [-2.0, 1.0]]) @ u - 1.0, of=u)
    code, text = code_of(skew.minimise)
    assert code == "NS6005"
    assert "not a gradient" in text
    concave = VI(-1.0 * u, within={u: dvi.Box(-1.0, 1.0)})
    assert "not convex" in code_of(concave.minimise)[1]
    with_min = dvi.minimum(u[0], 0.0)
    assert (
        "convex" in code_of(lambda: DMVI({x: u[0]}, g={u[0]: u[0]}, phi=with_min, start={x: 0}))[1]
    )


def test_no_solution_is_told_with_the_names():
    q = unknowns("q")
    code, text = code_of(VI(q**2 + 1.0, of=q).solve)
    assert code == "NS6020"
    assert "unknowns q" in text
    # two conditions that cannot hold together: x >= 1 and x <= 0
    x, a, b = states("x"), *multiplier("a", "b")
    pressed = DVI({x: a - b}, [complementarity(a, x - 1.0), complementarity(b, -x)], start={x: 0.5})
    code, text = code_of(lambda: pressed.run(1.0))
    assert code == "NS6020"
    assert "a, b" in text or "b, a" in text


def test_conversions_of_chapter_two_agree():
    M, q = np.array([[2.0, 1.0], [0.0, 1.0]]), np.array([-3.0, 1.0])
    u = unknowns("u", 2)
    known = LCP(M, q).solve()[u]
    g = M @ u + q
    assert np.allclose(VI(g, within={u: Cone(0)}, of=u).solve()[u], known, atol=1e-14)
    assert np.allclose(NCP(g, u).solve()[u], known, atol=1e-14)
    polyhedron = Polyhedron(-np.eye(2), [0.0, 0.0])
    assert np.allclose(VI(g, within={u: polyhedron}, of=u).solve()[u], known, atol=1e-14)
    mixed = MLCP([[2.0]], [[1.0]], [[1.0]], [[0.0]], [-3.0], [1.0])
    assert mixed.solve()["z[0]"] == pytest.approx(1.5)
    natural = VI(lambda z: M @ z + q, within={u: Cone(0)}, of=u, jacobian=lambda z: M)
    assert np.allclose(natural.solve()[u], known, atol=1e-12)


def test_a_polyhedron_and_a_cone_project():
    """VI of u - a over K: the projection of a, against a direct formula and KKT."""
    u = unknowns("u", 2)
    half = Polyhedron([[1.0, 2.0]], [2.0])
    a = np.array([3.0, 1.0])
    s = VI(u - a, within={u: half}).solve()
    assert np.allclose(s[u], a - np.array([1.0, 2.0]) * 3.0 / 5.0, atol=1e-14)
    assert s.multipliers["u[0].face0"] == pytest.approx(0.6)
    f = unknowns("f", 3)
    random = np.random.default_rng(3)
    for _ in range(20):
        cone = SecondOrderCone(float(random.uniform(0.2, 2.0)))
        a = random.standard_normal(3)
        s = VI(f - a, within={f: cone}).solve()
        p = s[f]
        # projection on a closed convex cone: p in K, a - p in its polar, orthogonal
        assert np.linalg.norm(p[1:]) <= cone.mu * p[0] + 1e-12
        rest = a - p
        assert abs(rest @ p) < 1e-12
        assert rest[0] + cone.mu * np.linalg.norm(rest[1:]) < 1e-12
    flat = unknowns("g", 2)
    s = VI(flat - np.array([0.0, 1.0]), within={flat: SecondOrderCone(0.5)}).solve()
    assert np.allclose(s[flat], [0.4, 0.2], atol=1e-14)  # a polyhedron in the plane


def test_a_circuit_becomes_its_dlcp():
    for deck, signals in (
        ("ex424_bridge_thesis", ("v(n1)", "i(l1)")),
        ("ex411_coulomb_case2_m2", ("i(l1)",)),
        ("ex423_zener_rlc", ("v(n3)", "i(l1)")),
    ):
        circuit = nsspice.read(f"netlists/thesis/{deck}.net")
        wires = circuit.run()[0]
        problem = dvi.from_circuit(circuit)
        sol = problem.run(float(wires.time[-1]), rows=wires.time.size - 1)
        for k, name in enumerate(signals):
            size = np.abs(wires[name]).max()
            assert np.abs(sol[f"x[{k}]"] - wires[name]).max() < 1e-13 * size
    assert (
        code_of(lambda: dvi.from_circuit(nsspice.read("netlists/thesis/ex421_argsinh_diode.net")))[
            0
        ]
        == "NS6005"
    )
    pulsed = nsspice.read("p\nV1 a 0 PULSE(0 1 0 1u 1u 1m 2m)\nR1 a b 1\nL1 b 0 1\n")
    assert "pulse" in code_of(lambda: dvi.from_circuit(pulsed))[1]


def test_matrices_of_a_model():
    x, v = states("x", "v")
    n = multiplier("n")
    soft = DVI({x: v, v: n / 2.0 - 9.81}, [complementarity(n, x + n / 100.0)], start={x: 1, v: 0})
    found = soft.matrices()
    assert found["A"].tolist() == [[0.0, 1.0], [0.0, 0.0]]
    assert found["B"].tolist() == [[0.0], [0.5]]
    assert found["C"].tolist() == [[1.0, 0.0]]
    assert found["D"].tolist() == [[0.01]]


def test_a_solution_is_that_of_circuits(tmp_path):
    x, v = states("x", "v")
    block = DVI({x: v, v: -x - Sgn(v) + 0 * t}, start={x: -2, v: 6}, name="block")
    sol = block.run(2.0, rows=50)
    sol.to_csv(tmp_path / "block.csv")
    assert (tmp_path / "block.csv").read_text().splitlines()[0] == "time,x,v,sgn(v)"
    assert sol.certificate.passed
    assert "DLCP" in sol.summary()
    sol.plot(tmp_path / "block.svg")
    assert (tmp_path / "block.svg").stat().st_size > 1000
    u = unknowns("u")
    assert equation(u, u - 1.0).unknowns[0].name == "u"
