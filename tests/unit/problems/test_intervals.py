"""Bounds of derivatives: they enclose what a tape has at any point of the box, and are narrow."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nsspice.problems import TapeBuilder
from nsspice.problems.intervals import bounds
from nsspice.problems.slopes import shapes
from nsspice.solvers.moreau import function_slopes, function_values

ONE = (
    "neg",
    "square",
    "abs",
    "uramp",
    "exp",
    "atan",
    "asinh",
    "tanh",
    "sinh",
    "cosh",
    "sin",
    "cos",
)
POSITIVE = ("sqrt", "ln", "log10", "log1p", "inv")
TWO = ("add", "sub", "mul", "min", "max", "hypot", "div")


def random_tape(random: np.random.Generator) -> TapeBuilder:
    tape = TapeBuilder()
    registers = [tape.unknown(0), tape.unknown(1), tape.constant(1.7)]
    for _ in range(8):
        kind = random.integers(0, 3)
        a, b = (int(random.choice(registers)) for _ in range(2))
        if kind == 0:
            registers.append(tape.op(str(random.choice(ONE)), a))
        elif kind == 1:
            # positive arguments: 2 + tanh of something
            inner = tape.op("add", tape.op("tanh", a), tape.constant(2.0))
            registers.append(tape.op(str(random.choice(POSITIVE)), inner))
        else:
            name = str(random.choice(TWO))
            if name == "div":
                b = tape.op("add", tape.op("tanh", b), tape.constant(2.0))
            registers.append(tape.op(name, a, b))
    tape.output(registers[-1])
    return tape


@pytest.mark.parametrize("seed", range(60))
def test_bounds_enclose(seed):
    random = np.random.default_rng(seed)
    tape = random_tape(random).finish()
    box = [tuple(sorted(random.uniform(-1.5, 1.5, 2))) for _ in range(2)]
    found = bounds(tape, box)
    points = np.column_stack([random.uniform(a, b, 40) for a, b in box])
    none, time = np.zeros((40, 0)), np.zeros(40)
    values = function_values(tape, points, none, time)[:, 0]
    slopes = function_slopes(tape, points, none, time)[:, 0]
    fine = np.isfinite(slopes).all(axis=1) & np.isfinite(values)
    # rounding of both sides, a few units of the largest term
    room = 1e-12 * (1.0 + np.abs(values[fine]).max(initial=0.0))
    assert np.all(values[fine] >= found.values[0, 0] - room)
    assert np.all(values[fine] <= found.values[0, 1] + room)
    wide = 1e-11 * (1.0 + np.abs(slopes[fine]).max(initial=0.0))
    assert np.all(slopes[fine] >= found.low[0, :2] - wide)
    assert np.all(slopes[fine] <= found.high[0, :2] + wide)


CARRYING = {
    "junction": (1e-3, 0.5),
    "body": (0.6, 0.5),
    "softplus": (0.1, 1.0),
    "table": (4.0, -1.0, 0.0, 0.0, 2.0, 1.0, 1.0, 2.5, 1.5),
}
POWERS = [("pow", k) for k in (-2.0, -1.0, -0.5, 0.0, 0.5, 1.5, 2.0, 3.0)]
POWERS += [("pwr", k) for k in (-2.0, -0.5, 0.5, 2.0, 3.0)]


@pytest.mark.parametrize(("low", "high"), [(-1.7, -0.2), (0.1, 1.3), (0.9, 2.9), (-0.4, 0.6)])
@pytest.mark.parametrize("name", [*CARRYING, *POWERS], ids=str)
def test_curves_and_powers(name, low, high):
    """At samples neither values nor slopes of the core leave the bounds."""
    tape = TapeBuilder()
    x = tape.unknown(0)
    if isinstance(name, tuple):
        tape.output(tape.op(name[0], x, tape.constant(name[1])))
    else:
        tape.output(tape.op(name, x, constants=CARRYING[name]))
    built = tape.finish()
    found = bounds(built, [(low, high)])
    points = np.linspace(low, high, 41)[:, None]
    none, time = np.zeros((41, 0)), np.zeros(41)
    with np.errstate(all="ignore"):
        values = function_values(built, points, none, time)[:, 0]
        slopes = function_slopes(built, points, none, time)[:, 0, 0]
    # rounding of a power, a few units
    for seen, (least, most) in ((values, found.values[0]), (slopes, (found.low, found.high))):
        seen = seen[np.isfinite(seen)]
        room = 1e-14 * np.abs(seen).max(initial=0.0)
        assert np.all(seen >= np.ravel(least)[0] - room)
        assert np.all(seen <= np.ravel(most)[0] + room)


@pytest.mark.parametrize("exponent", [-2.0, -1.0, -0.5])
@pytest.mark.parametrize("name", ["inv", "pow", "pwr"])
def test_a_pole_leaves_no_bounds_of_a_slope(name, exponent):
    """1/x falls on both sides of zero, and jumps up there: its mean slopes have either sign."""
    tape = TapeBuilder()
    x = tape.unknown(0)
    arguments = [x] if name == "inv" else [x, tape.constant(exponent)]
    tape.output(tape.op(name, *arguments))
    (shape,), _ = shapes(tape.finish())
    assert shape is None


def test_unbounded_boxes_and_kinks():
    tape = TapeBuilder()
    x = tape.unknown(0)
    tape.output(tape.op("asinh", x))
    tape.output(tape.op("abs", x))
    tape.output(tape.op("mul", x, tape.op("mul", x, x)))
    tape.output(tape.op("floor", x))
    found = bounds(tape.finish(), [(-math.inf, math.inf)])
    assert (found.low[0, 0], found.high[0, 0]) == (0.0, 1.0)
    assert (found.low[1, 0], found.high[1, 0]) == (-1.0, 1.0)
    assert found.high[2, 0] == math.inf
    assert found.low[3, 0] == -math.inf  # a function that jumps has no bounded slope
    still = bounds(tape.finish(), [(0.0, 0.0)])
    assert (still.low[1, 0], still.high[1, 0]) == (-1.0, 1.0)  # Clarke's Jacobian at the kink


def test_results_backwards_are_narrower_where_one_argument_is_shared():
    """(3 w - 4.5 w^2 + 1.75 w^3)' at w = clip(x) near 2 is 6, whatever the clip does."""
    tape = TapeBuilder()
    w = tape.op("min", tape.unknown(0), tape.constant(2.0))
    cube = tape.op("mul", tape.constant(1.75), tape.op("pow", w, tape.constant(3.0)))
    square = tape.op("mul", tape.constant(-4.5), tape.op("pow", w, tape.constant(2.0)))
    line = tape.op("mul", tape.constant(3.0), w)
    tape.output(tape.op("add", line, tape.op("add", square, cube)))
    found = bounds(tape.finish(), [(1.99, 2.01)])
    assert found.low[0, 0] >= 0.0
    assert found.high[0, 0] < 6.4
