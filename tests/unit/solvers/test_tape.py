"""The compiled tape against numpy, extended precision and difference quotients."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from nsspice import _core
from nsspice.problems import Tape, TapeBuilder
from nsspice.problems.tape import OPS
from nsspice.solvers.moreau import (
    all_slopes_of,
    core_tape,
    function_slopes,
    function_values,
    source_slopes_of,
)

X = np.array([-30.0, -2.5, -0.7, -0.3, -1e-3, -1e-9, 1e-9, 1e-3, 0.3, 0.5, 0.7, 1.5, 2.5, 30.0])
L = np.longdouble


def evaluate(tape: Tape, z, u=None, t=None):
    z = np.atleast_2d(np.asarray(z, dtype=float))
    u = np.zeros((z.shape[0], 0)) if u is None else np.atleast_2d(np.asarray(u, dtype=float))
    t = np.zeros(z.shape[0]) if t is None else np.asarray(t, dtype=float)
    z, u, t = map(np.ascontiguousarray, (z, u, t))
    values, places, slopes = _core.tape_values(core_tape(tape), z, u, t)
    p = tape.outputs.size
    return values.reshape(-1, p), places, slopes.reshape(len(t), len(places))


def unary(name, points, constants=()):
    builder = TapeBuilder()
    builder.output(builder.op(name, builder.unknown(0), constants=tuple(constants)))
    values, places, slopes = evaluate(builder.finish(), np.reshape(points, (-1, 1)))
    return values[:, 0], slopes[:, 0] if places else np.zeros(len(points))


def binary(name, x, y):
    builder = TapeBuilder()
    builder.output(builder.op(name, builder.unknown(0), builder.unknown(1)))
    values, places, slopes = evaluate(builder.finish(), np.column_stack([x, y]))
    return values[:, 0], slopes if places else np.zeros((len(x), 2))


def test_slopes_by_unknowns_sources_and_the_time():
    """x u + t^2 and y, which is known at three points: u, 0, x, 2 t; and 0, 1, 0, 0."""
    builder = TapeBuilder()
    x, y, u, t = builder.unknown(0), builder.unknown(1), builder.source(0), builder.time()
    builder.output(builder.op("add", builder.op("mul", x, u), builder.op("square", t)))
    builder.output(y)
    tape = builder.finish()
    z, sources = np.array([[2.0, 3.0], [-1.0, 5.0], [0.5, 0.0]]), np.array([[7.0], [11.0], [13.0]])
    times = np.array([0.25, 3.0, -2.0])
    assert_array_equal(function_values(tape, z, sources, times)[:, 0], [14.0625, -2.0, 10.5])
    by_unknown, by_source, by_time = all_slopes_of(tape, z, sources, times)
    assert_array_equal(by_unknown[:, 0], [[7.0, 0.0], [11.0, 0.0], [13.0, 0.0]])
    assert_array_equal(by_unknown[:, 1], [[0.0, 1.0]] * 3)
    assert_array_equal(by_source[:, :, 0], [[2.0, 0.0], [-1.0, 0.0], [0.5, 0.0]])
    assert_array_equal(by_time, [[0.5, 0.0], [6.0, 0.0], [-4.0, 0.0]])
    assert_array_equal(function_slopes(tape, z, sources, times), by_unknown)
    assert_array_equal(source_slopes_of(tape, z, sources, times), by_source)


def test_the_instructions_of_both_sides_are_the_same():
    assert _core.tape_instructions() == list(OPS)


def asinh_slope(x):
    return 1 / np.sqrt(1 + x * x)


CURVES = {
    "neg": (lambda x: -x, lambda x: -1 + 0 * x, X),
    "inv": (lambda x: 1 / x, lambda x: -1 / x**2, X),
    "abs": (abs, np.sign, X),
    "sqrt": (np.sqrt, lambda x: 0.5 / np.sqrt(x), X[X > 0]),
    "exp": (np.exp, np.exp, X),
    "expm1": (np.expm1, np.exp, X),
    "ln": (np.log, lambda x: 1 / x, X[X > 0]),
    "log1p": (np.log1p, lambda x: 1 / (1 + x), X[X > -1]),
    "log10": (np.log10, lambda x: 1 / (x * np.log(L(10))), X[X > 0]),
    "sin": (np.sin, np.cos, X),
    "cos": (np.cos, lambda x: -np.sin(x), X),
    "tan": (np.tan, lambda x: 1 / np.cos(x) ** 2, X),
    "asin": (np.arcsin, lambda x: 1 / np.sqrt(1 - x * x), X[abs(X) < 1]),
    "acos": (np.arccos, lambda x: -1 / np.sqrt(1 - x * x), X[abs(X) < 1]),
    "atan": (np.arctan, lambda x: 1 / (1 + x * x), X),
    "sinh": (np.sinh, np.cosh, X),
    "cosh": (np.cosh, np.sinh, X),
    "tanh": (np.tanh, lambda x: 1 / np.cosh(x) ** 2, X),
    "asinh": (np.arcsinh, asinh_slope, np.append(X, [1e12, -1e12, 1e-200])),
    "acosh": (
        np.arccosh,
        lambda x: 1 / np.sqrt((x - 1) * (x + 1)),
        np.array([1.0000001, 1.5, 1e12]),
    ),
    "atanh": (np.arctanh, lambda x: 1 / (1 - x * x), X[abs(X) < 1]),
    "square": (lambda x: x * x, lambda x: 2 * x, X),
}


@pytest.mark.parametrize("name", CURVES)
def test_values_and_slopes_have_all_digits(name):
    """Extended precision gives the truth; 4 units in the last place of a double are granted."""
    function, slope, points = CURVES[name]
    exact = points.astype(L)
    value, derivative = unary(name, points)
    assert_allclose(value, function(exact).astype(float), rtol=1e-15, atol=0)
    assert_allclose(derivative, slope(exact).astype(float), rtol=2e-15, atol=0)


FLAT = {
    "not": lambda x: float(x == 0),
    "floor": np.floor,
    "ceil": np.ceil,
    "nint": np.rint,
    "int": np.trunc,
    "sgn": np.sign,
    "u": lambda x: np.heaviside(x, 0.5),
    "buf": lambda x: float(x > 0.5),
}


@pytest.mark.parametrize("name", FLAT)
def test_steps_have_no_slope(name):
    points = np.append(X, [0.0, 2.5, 3.5, 1.0])
    value, slope = unary(name, points)
    assert_array_equal(value, [FLAT[name](x) for x in points])
    assert_array_equal(slope, 0.0)


def test_ramps_take_the_slope_to_the_right():
    points = [-1.0, 0.0, 0.5, 1.0, 2.0]
    value, slope = unary("u2", points)
    assert_array_equal(value, [0, 0, 0.5, 1, 1])
    assert_array_equal(slope, [0, 1, 1, 0, 0])
    value, slope = unary("uramp", points)
    assert_array_equal(value, [0, 0, 0.5, 1, 2])
    assert_array_equal(slope, [0, 1, 1, 1, 1])


TWO = {
    "add": (np.add, lambda x, y: (1, 1)),
    "sub": (np.subtract, lambda x, y: (1, -1)),
    "mul": (np.multiply, lambda x, y: (y, x)),
    "div": (np.divide, lambda x, y: (1 / y, -x / y**2)),
    "pow": (np.power, lambda x, y: (y * x ** (y - 1), x**y * np.log(x))),
    "min": (np.minimum, lambda x, y: (x < y, x >= y)),
    "max": (np.maximum, lambda x, y: (x >= y, x < y)),
    "atan2": (np.arctan2, lambda x, y: (y / (x * x + y * y), -x / (x * x + y * y))),
    "hypot": (np.hypot, lambda x, y: (x / np.hypot(x, y), y / np.hypot(x, y))),
}


@pytest.mark.parametrize("name", TWO)
def test_functions_of_two_arguments(name):
    rng = np.random.default_rng(1)
    x, y = rng.uniform(0.1, 3.0, 50).astype(L), rng.uniform(-2.0, 3.0, 50).astype(L)
    function, slope = TWO[name]
    value, derivative = binary(name, x.astype(float), y.astype(float))
    assert_allclose(value, function(x, y).astype(float), rtol=2e-15)
    for k, part in enumerate(slope(x, y)):
        assert_allclose(derivative[:, k], (part + 0 * x).astype(float), rtol=4e-15)


def test_signed_power_and_comparisons():
    x = np.array([-2.0, -0.5, 0.0, 0.5, 2.0])
    value, slope = binary("pwr", x, np.full(5, 3.0))
    assert_allclose(value, x**3, rtol=1e-15)
    assert_allclose(slope[:, 0], 3 * x**2, rtol=1e-15)
    for name, truth in (("lt", np.less), ("ge", np.greater_equal), ("eq", np.equal)):
        assert_array_equal(binary(name, x, np.full(5, 0.5))[0], truth(x, 0.5).astype(float))
    assert_array_equal(binary("and", x, np.ones(5))[0], (x != 0).astype(float))
    assert_array_equal(binary("or", x, np.zeros(5))[0], (x != 0).astype(float))


def test_junction_keeps_its_digits_near_zero_and_saturates():
    v = np.array([-5.0, -1e-12, 1e-12, 0.6])
    value, slope = unary("junction", v, (1e-14, 0.025))
    exact = L(1e-14) * np.expm1(v.astype(L) / L(0.025))
    # exponents up to 200 are rounded to 200 ulps of one
    assert_allclose(value, exact.astype(float), rtol=5e-14)
    law = L(1e-14) / L(0.025) * np.exp(v.astype(L) / L(0.025))
    assert_allclose(slope, law.astype(float), rtol=5e-14)


@pytest.mark.parametrize("m", [0.33, 0.5, 1.0, 0.0])
def test_depletion_charge_is_the_integral_of_its_capacitance(m):
    cj, vj, fc = 2e-12, 0.8, 0.5
    v = np.array([-20.0, -1.0, -1e-9, 0.2, 0.399, 0.41, 0.9])
    charge, capacitance = unary("depletion", v, (cj, vj, m, fc))
    below = v < fc * vj
    law = cj * (1 - v[below] / vj) ** -m
    assert_allclose(capacitance[below], law, rtol=1e-14)
    edge = cj * (1 - fc) ** -m
    beyond = edge * (1 + m * (v[~below] - fc * vj) / (vj * (1 - fc)))
    assert_allclose(capacitance[~below], beyond, rtol=1e-14)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    for a, q in zip(v, charge, strict=True):
        ends = [(0.0, min(a, fc * vj)), (fc * vj, a)] if a > fc * vj else [(0.0, a)]
        total = 0.0
        for low, high in ends:
            points = low + (high - low) * (nodes + 1) / 2
            total += (high - low) / 2 * weights @ unary("depletion", points, (cj, vj, m, fc))[1]
        # 40 Gauss points: exact to rounding but for v = -20, where the branch point is near
        assert q == pytest.approx(total, rel=1e-8)


def test_tables_and_staircases():
    points = [0.0, 1.0, 1.0, 3.0, 2.0, 3.0, 2.0, 5.0]
    x = np.array([-1.0, 0.0, 0.25, 1.0, 1.5, 2.0, 9.0])
    value, slope = unary("table", x, (4.0, *points))
    assert_allclose(value, [1.0, 1.0, 1.5, 3.0, 3.0, 5.0, 5.0])
    assert_allclose(slope, [0.0, 2.0, 2.0, 0.0, 0.0, 0.0, 0.0])
    value, slope = unary("staircase", x, (3.0, 0.0, 7.0, 1.0, 8.0, 2.0, 0.0))
    assert_allclose(value, [0, 7, 7, 8, 8, 0, 0])


def test_composed_derivatives_agree_with_difference_quotients():
    """Central differences with step 1e-6 are good to about 1e-9 of the third derivative."""
    b = TapeBuilder()
    z = [b.unknown(k) for k in range(4)]
    u, t = b.source(0), b.time()
    one = b.op("mul", b.op("asinh", b.op("mul", z[0], z[1])), b.op("exp", b.op("neg", z[2])))
    two = b.op("div", b.op("sin", b.op("add", one, t)), b.op("add", b.op("square", z[3]), u))
    three = b.op("if", b.op("gt", z[0], z[2]), b.op("tanh", two), b.op("atan", one))
    for register in (one, two, three):
        b.output(register)
    tape = b.finish()
    rng = np.random.default_rng(7)
    z0, u0, t0 = rng.normal(size=(20, 4)), rng.uniform(1, 2, (20, 1)), rng.normal(size=20)
    _, places, slopes = evaluate(tape, z0, u0, t0)
    step = 1e-6
    everything = np.column_stack([z0, u0, t0])
    for entry, (function, variable) in enumerate(places):
        shifted = []
        for sign in (1.0, -1.0):
            x = everything.copy()
            x[:, variable] += sign * step
            shifted.append(evaluate(tape, x[:, :4], x[:, 4:5], x[:, 5])[0][:, function])
        quotient = (shifted[0] - shifted[1]) / (2 * step)
        assert_allclose(slopes[:, entry], quotient, atol=3e-8)
    assert {v for f, v in places if f == 0} == {0, 1, 2}
    assert {v for f, v in places if f == 1} == set(range(6))
