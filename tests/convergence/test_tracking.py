"""Orders of the Euler-Newton trackers, and generalized equations against independent solutions."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from oracle.enumeration import solutions
from scipy.optimize import brentq, minimize

import nsspice
from nsspice.problems import Cone, GeneralizedEquation, Ramp, Sign, TapeBuilder
from nsspice.solvers.generalized import solve
from nsspice.solvers.stepper import UnsolvedStep
from nsspice.solvers.tracker import track

DATA = Path(__file__).parents[2] / "netlists" / "thesis" / "data"

ARGSINH = """argsinh resistor and practical diode
V1 a 0 SIN(0 4 0.15915494309189535)
R1 a b V={asinh(i)}
D1 b 0 practical
.model practical D(Vfwd=1 Vrev=1)
.param h=0.1
.tran {h} 10
"""

#: errors of both methods at h = 0.1, 0.01, 1e-3 (Cibulka and Roubal 2017, Table 1; the last row of
#: the printed table is rounding of log(x + sqrt(x^2 + 1)), not of the method)
TABLE = {
    "euler-newton-rate": (1.995e-3, 2.0035e-7, 2.004e-11),
    "euler-newton": (2.718e-3, 2.2500e-7, 2.205e-11),
}


def argsinh_exact(p):
    return np.sinh(p - np.clip(p, -1.0, 1.0))


def argsinh() -> GeneralizedEquation:
    tape = TapeBuilder()
    tape.output(tape.op("asinh", tape.unknown(0)))
    return GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),))


def order(errors, ratio):
    return math.log(errors[0] / errors[1]) / math.log(ratio)


@pytest.mark.parametrize("method", TABLE)
def test_table_1_from_the_netlist(method):
    """Three digits of each entry; below 1e-10 rounding of 10 A takes the fourth."""
    for h, expected in zip((0.1, 0.01, 1e-3), TABLE[method], strict=True):
        solution = nsspice.tran(nsspice.read(ARGSINH, params={"h": h}), method=method)
        error = np.abs(-solution["i(v1)"] - argsinh_exact(4.0 * np.sin(solution.time))).max()
        assert error == pytest.approx(expected, rel=1e-3)
        assert solution.islands[0].method == method
        assert solution.certificate.passed  # of the linearised problems, which are solved exactly
        assert solution.islands[0].stats["grid_residual"] <= error
    solution = nsspice.tran(nsspice.read(ARGSINH, params={"h": 1e-4}), method=method)
    assert np.abs(-solution["i(v1)"] - argsinh_exact(4.0 * np.sin(solution.time))).max() <= 1e-13


def test_a_sweep_is_followed_as_well():
    deck = ARGSINH.replace(".tran {h} 10", ".dc V1 0 4 {h}")
    errors = []
    for h in (0.02, 0.01):
        circuit = nsspice.read(deck, params={"h": h})
        solution = nsspice.dc(circuit, method="euler-newton")
        errors.append(np.abs(-solution["i(v1)"] - argsinh_exact(solution.axis)).max())
        # a sweep is linear in its parameter, so that both predictors are the same
        other = nsspice.dc(circuit, method="euler-newton-rate")
        assert np.abs(other["i(v1)"] - solution["i(v1)"]).max() < 1e-12
    assert order(errors, 2.0) == pytest.approx(4.0, abs=0.1)


def test_storage_is_refused_and_correctors_are_an_option():
    with pytest.raises(nsspice.NsspiceError) as refused:
        nsspice.tran(nsspice.read(ARGSINH + "C1 b 0 1u\n"), method="euler-newton")
    assert refused.value.code == "NS4030"
    errors = []
    for h in (0.02, 0.01):
        circuit = nsspice.read(
            ARGSINH + ".options method=euler-newton correctors=0\n", params={"h": h}
        )
        (solution,) = circuit.run()
        errors.append(np.abs(-solution["i(v1)"] - argsinh_exact(4.0 * np.sin(solution.time))).max())
    assert order(errors, 2.0) == pytest.approx(2.0, abs=0.15)  # predictor alone
    with pytest.raises(nsspice.NsspiceError) as refused:
        nsspice.read(ARGSINH + ".options method=euler-newton correctors=x\n").run()
    assert refused.value.code == "NS4005"


@pytest.mark.parametrize("with_rate", [True, False])
def test_orders_on_the_grid_and_between(with_rate):
    def p(t):
        return 4.0 * np.sin(t)

    rate = (lambda t: 4.0 * np.cos(t)) if with_rate else None
    on_grid, between, alone = [], [], []
    for h in (0.02, 0.01):
        t = h * np.arange(round(10 / h) + 1)
        path = track(argsinh(), t, p, rate=rate, start=[0.0])
        on_grid.append(np.abs(path.z[:, 0] - argsinh_exact(p(t))).max())
        fine = np.linspace(0.0, 10.0, 7919)
        interpolated = np.array([path.at(s)[0] for s in fine])
        between.append(np.abs(interpolated - argsinh_exact(p(fine))).max())
        predicted = track(argsinh(), t, p, rate=rate, start=[0.0], correctors=0)
        alone.append(np.abs(predicted.z[:, 0] - argsinh_exact(p(t))).max())
    assert order(on_grid, 2.0) == pytest.approx(4.0, abs=0.1)
    assert order(alone, 2.0) == pytest.approx(2.0, abs=0.15)
    # kinks of the solution lie between grid points, anywhere: O(h) there
    assert between[1] < 0.02
    assert between[0] < 0.04


@pytest.mark.parametrize(("power", "expected"), [(2, 4.0), (1, 2.0)])
def test_inexact_predictors(power, expected):
    """Errors O(h^2) keep order 4; O(h) leave 2: the corrector squares what the predictor errs."""
    errors = []
    for h in (0.02, 0.01):
        t = h * np.arange(round(10 / h) + 1)
        e = 0.5 * h**power * np.cos(37.0 * np.arange(t.size - 1))[:, None]
        path = track(argsinh(), t, lambda s: 4.0 * np.sin(s), errors=e, start=[0.0])
        errors.append(np.abs(path.z[:, 0] - argsinh_exact(4.0 * np.sin(t))).max())
    assert order(errors, 2.0) == pytest.approx(expected, abs=0.3)


def test_non_smooth_data_keep_the_order():
    """4 |min(sin t, 0)| has kinks at multiples of pi, where the solution is at rest."""

    def p(t):
        return 4.0 * np.abs(np.minimum(np.sin(t), 0.0))

    errors = []
    for h in (0.02, 0.01):
        t = h * np.arange(round(10 / h) + 1)
        path = track(argsinh(), t, p, start=[0.0])
        errors.append(np.abs(path.z[:, 0] - argsinh_exact(p(t))).max())
    assert errors[1] == pytest.approx(2.2500e-7, rel=1e-3)
    assert order(errors, 2.0) == pytest.approx(4.0, abs=0.1)


def transistor(curve: str, alpha: float, beta: float, parameters):
    """Ebers-Moll in currents (I, I'): matrix, function, Jacobian, problem."""
    rb, rl, an, ai, ve, vc = parameters
    mix = np.array([[rb, rb], [rb, rb + rl]]) @ np.array([[1.0, -ai], [-an, 1.0]])
    weights = np.array([alpha, beta])
    shape = {"asinh": np.arcsinh, "atan": np.arctan}[curve]
    slope = {
        "asinh": lambda z: 1.0 / np.sqrt(1.0 + z * z),
        "atan": lambda z: 1.0 / (1.0 + z * z),
    }[curve]
    tape = TapeBuilder()
    z = [tape.unknown(0), tape.unknown(1)]
    for i in range(2):
        linear = [tape.op("mul", tape.constant(mix[i, j]), z[j]) for j in range(2)]
        bend = tape.op("mul", tape.constant(weights[i]), tape.op(curve, z[i]))
        tape.output(tape.op("add", tape.op("add", *linear), bend))
    problem = GeneralizedEquation(tape.finish(), ((0, Sign(-ve, ve)), (1, Sign(-vc, vc))))
    return (
        lambda x: mix @ x + weights * shape(x),
        lambda x: mix + np.diag(weights * slope(x)),
        problem,
        [(-ve, ve), (-vc, vc)],
    )


BOOK = (3e4, 3e3, 0.1, 0.7, 2.0, 4.0)


def inputs(t):
    return np.array([np.sin(t), np.sin(t) - 10.0 * np.sin(t)])


@pytest.mark.parametrize(("curve", "sign"), [("asinh", 1.0), ("atan", -1.0)])
def test_transistor_against_enumeration(curve, sign):
    alpha, beta = sign * 2.0 / np.pi, sign * 2.0
    g, jacobian, problem, signs = transistor(curve, alpha, beta, BOOK)
    t = np.linspace(0.0, 10.0, 41)
    path = solve(problem, t, inputs)
    for s, z in zip(t, path.z, strict=True):
        (only,) = solutions(g, jacobian, inputs(s), signs, [np.zeros(2)])
        assert np.abs(z - only).max() < 1e-17  # amperes of size 1e-3


@pytest.mark.parametrize("with_rate", [True, False])
def test_transistor_is_followed_with_order_four(with_rate):
    """Small resistances make the curves count: with those of the book errors are rounding."""
    _, _, problem, _ = transistor("asinh", 2.0, 1.0, (1.0, 0.5, 0.1, 0.7, 2.0, 4.0))
    rate = (lambda t: inputs(t + np.pi / 2)) if with_rate else None
    errors = []
    # steps above 0.05 are not yet asymptotic: the curves bend within a few hundredths
    for h in (0.05, 0.025):
        t = h * np.arange(round(10 / h) + 1)
        path = track(problem, t, inputs, rate=rate, start=[0.0, 0.0])
        errors.append(np.abs(path.z - solve(problem, t, inputs).z).max())
    assert errors[1] > 1e-9
    assert order(errors, 2.0) == pytest.approx(4.0, abs=0.1)


def test_thyristor_needs_correctors_at_its_kinks():
    """Appendix B 4.3: a negative slope inside, kinks at 0 and alpha; R keeps the sum monotone."""
    resistance, a, alpha, low = 1.0, 2.0, 3.0, -4.0

    def phi(z):  # phi(0) = 1 < phi(alpha), slopes 0.4 at 0 and alpha, down to -0.4 between
        return 1.0 + 0.05 * z + 0.35 * np.sin(2 * np.pi * z / alpha) * alpha / (2 * np.pi)

    def law(z):
        inner = np.where(z < 0, a * z, phi(z) - phi(0.0))
        return resistance * z + np.where(z > alpha, a * (z - alpha) + phi(alpha) - phi(0.0), inner)

    tape = TapeBuilder()
    z = tape.unknown(0)

    def number(value):
        return tape.constant(value)

    wave = tape.op("sin", tape.op("mul", number(2 * np.pi / alpha), z))
    inner = tape.op(
        "add",
        tape.op("mul", number(0.05), z),
        tape.op("mul", number(0.35 * alpha / (2 * np.pi)), wave),
    )
    above = tape.op(
        "add",
        tape.op("mul", number(a), tape.op("sub", z, number(alpha))),
        number(float(phi(alpha) - phi(0.0))),
    )
    below = tape.op("mul", number(a), z)
    curve = tape.op(
        "if",
        tape.op("lt", z, number(0.0)),
        below,
        tape.op("if", tape.op("gt", z, number(alpha)), above, inner),
    )
    tape.output(tape.op("add", tape.op("mul", number(resistance), z), curve))
    problem = GeneralizedEquation(tape.finish(), ((0, Sign(low, 1.0)),))

    def p(t):
        return 9.0 * np.sin(t)

    def exact(value):
        if low <= value <= 1.0:
            return 0.0
        offset = 1.0 if value > 1.0 else low
        return brentq(lambda x: law(x) + offset - value, -20.0, 20.0, xtol=1e-14)

    t = 0.01 * np.arange(1001)
    truth = np.array([exact(value) for value in p(t)])
    assert np.abs(solve(problem, t, p).z[:, 0] - truth).max() < 1e-13
    one = track(problem, t, p, start=[0.0], correctors=1)
    usual = track(problem, t, p, start=[0.0])
    assert np.abs(usual.z[:, 0] - truth).max() < 1e-9
    assert np.abs(one.z[:, 0] - truth).max() > 100 * np.abs(usual.z[:, 0] - truth).max()


def test_symmetric_problems_by_minimisation():
    """0 in A u + b + F(u) with A symmetric positive definite is the minimum of a convex function.

    With u = x - y, x, y >= 0 the kinks become linear terms, which a bounded quasi-Newton method
    takes; both sides agree to its tolerance.
    """
    rng = np.random.default_rng(11)
    for n in (1, 3, 6):
        m = rng.normal(size=(n, n))
        A = m @ m.T + 0.5 * np.eye(n)
        b = rng.normal(size=n)
        low, high = -rng.uniform(0.1, 1.0, n), rng.uniform(0.1, 1.0, n)

        def cost(v, A=A, b=b, low=low, high=high, n=n):
            x, y = v[:n], v[n:]
            u = x - y
            slope = A @ u + b
            return (
                0.5 * u @ A @ u + b @ u + high @ x - low @ y,
                np.concatenate([slope + high, -slope - low]),
            )

        best = minimize(
            cost,
            np.zeros(2 * n),
            jac=True,
            bounds=[(0, None)] * (2 * n),
            method="L-BFGS-B",
            options={"ftol": 1e-16, "gtol": 1e-12, "maxiter": 5000},
        )
        tape = TapeBuilder()
        z = [tape.unknown(k) for k in range(n)]
        for i in range(n):
            total = tape.constant(0.0)
            for j in range(n):
                total = tape.op("add", total, tape.op("mul", tape.constant(A[i, j]), z[j]))
            tape.output(total)
        pieces = tuple((i, Sign(low[i], high[i])) for i in range(n))
        found = solve(GeneralizedEquation(tape.finish(), pieces), [0.0], [-b]).z[0]
        u = best.x[:n] - best.x[n:]
        assert np.abs(found - u).max() < 1e-6


def equilibrium(kappa: float) -> GeneralizedEquation:
    """Exchange of one good between two agents, unknowns (l, m1, m2, x1, x2, lambda1, lambda2).

    -f in N_C becomes 0 in f + N_C; the endowments make g depend on time.
    """
    tape = TapeBuilder()
    price, m1, m2, x1, x2, k1, k2 = (tape.unknown(k) for k in range(7))
    wave = tape.op("sin", tape.op("mul", tape.constant(4.0 * np.pi), tape.time()))
    one = tape.constant(1.0)
    m0 = [tape.op("add", one, tape.op("mul", tape.constant(kappa), wave)), one]
    x0 = [tape.op("sub", one, tape.op("mul", tape.constant(0.1), wave)), one]
    spare = [tape.op("sub", x0[0], x1), tape.op("sub", x0[1], x2)]
    tape.output(tape.op("add", *spare))
    for m, k in ((m1, k1), (m2, k2)):
        tape.output(tape.op("sub", k, tape.op("inv", m)))
    for x, k in ((x1, k1), (x2, k2)):
        tape.output(tape.op("sub", tape.op("mul", k, price), tape.op("inv", x)))
    for i, m in enumerate((m1, m2)):
        tape.output(tape.op("add", tape.op("sub", m0[i], m), tape.op("mul", price, spare[i])))
    positive, goods = Cone(0.0), Cone(0.94, 1.08)
    graphs = [positive, positive, positive, goods, goods, positive, positive]
    return GeneralizedEquation(tape.finish(), tuple(enumerate(graphs)))


def test_economic_equilibrium():
    table = np.genfromtxt(DATA / "ex431_equilibrium_kappa0.9.csv", delimiter=",", names=True)
    names = ["l", "m1", "m2", "x1", "x2", "lambda1", "lambda2"]
    exact = np.column_stack([table[name] for name in names])
    problem, zero = equilibrium(0.9), np.zeros((table.size, 7))
    path = solve(problem, table["t"], zero, start=np.ones(7))
    # multipliers lambda up to 16: four digits of rounding in the worst of them
    assert np.abs(path.z - exact).max() < 1e-11
    errors = []
    for stride in (2, 1):
        t, data = table["t"][::stride], zero[::stride]
        for rate in (None, data):
            followed = track(problem, t, data, rate=rate, start=np.ones(7))
            errors.append(np.abs(followed.z - exact[::stride]).max())
    assert order(errors[0::2], 2.0) == pytest.approx(4.0, abs=0.5)
    assert order(errors[1::2], 2.0) == pytest.approx(4.0, abs=0.5)


def test_no_equilibrium_where_an_agent_has_nothing():
    """At t = 3/8 the first agent has no money: prices vanish and no multiplier exists."""
    with pytest.raises(UnsolvedStep):
        solve(equilibrium(1.0), [0.375], np.zeros((1, 7)), start=np.ones(7))


def test_pieces_say_what_is_wrong():
    with pytest.raises(ValueError, match="not monotone"):
        Sign(1.0, -1.0)
    with pytest.raises(ValueError, match="empty"):
        Cone(1.0, 0.0)
    with pytest.raises(ValueError, match="positive slope"):
        Ramp(0.0, 0.0)
    tape = TapeBuilder()
    tape.output(tape.unknown(0))
    with pytest.raises(ValueError, match="component"):
        GeneralizedEquation(tape.finish(), ((1, Cone(0.0)),))


def test_ramps_and_shifted_signs():
    """p = z + 2 (z - 1)^+ + Sgn(z - 3) in closed form."""
    tape = TapeBuilder()
    tape.output(tape.unknown(0))
    pieces = ((0, Ramp(1.0, 2.0)), (0, Sign(-1.0, 1.0, at=3.0)))
    problem = GeneralizedEquation(tape.finish(), pieces)
    z = np.array([-2.0, 0.5, 1.0, 2.0, 3.0, 3.0, 3.0, 5.0])
    forces = np.array([-1.0, -1.0, -1.0, -1.0, -1.0, 0.3, 1.0, 1.0])
    p = z + 2.0 * np.maximum(z - 1.0, 0.0) + forces
    assert np.abs(solve(problem, np.arange(8.0), p[:, None]).z[:, 0] - z).max() < 1e-14


@pytest.mark.parametrize("method", TABLE)
def test_a_path_that_ends_at_a_fold_is_told(method):
    """At p = 2 the branch of x^3 - 3 x = p from below ends; its tangent led to -7.8, certified."""
    deck = """a fold
V1 p 0 0
R1 p 0 1
B1 x 0 I=v(x)^3-3*v(x)-v(p)
.dc V1 -5 {stop} 0.01
"""
    circuit = nsspice.read(deck.format(stop=1.9))
    (found,) = circuit.run(method=method)
    assert found.certificate.passed
    x = found["v(x)"]
    assert np.abs(x**3 - 3 * x - found["v(p)"]).max() < 1e-3
    # with steps of 0.01 whose cubes are what the method leaves out, nothing is far off
    assert found.stats["grid_residual"] < 1e-3
    with pytest.raises(nsspice.StepError) as caught:
        nsspice.read(deck.format(stop=5)).run(method=method)
    assert "v1 = 2.0" in str(caught.value)
    lost = caught.value.partial
    x = lost["v(x)"]
    assert np.abs(x**3 - 3 * x - lost["v(p)"]).max() < 0.5  # at x = -1 no tangent tells more
