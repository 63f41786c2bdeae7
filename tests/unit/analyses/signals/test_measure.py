"""Every form of .measure against closed forms on sampled analytic waveforms."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.analyses.solution.solution import Solution
from nsspice.analyses.transient.measure import evaluate_measures
from nsspice.errors import Span
from nsspice.netlist.deck import Cond, Measure
from nsspice.netlist.expressions.expression import Expression

SPAN = Span("t.net", 7, 1)
PERIOD = 1e-3
X = Expression.parse


@pytest.fixture
def solution() -> Solution:
    t = np.linspace(0.0, 5 * PERIOD, 50001)
    phase = 2 * np.pi * t / PERIOD
    return Solution(
        "tran",
        "waves",
        "time",
        t,
        {
            "v(a)": 3.0 * np.sin(phase),
            "v(b)": 3.0 * np.cos(phase),
            "v(ramp)": 1000.0 * t,
            "i(r1)": 1e-3 * np.sin(phase),
        },
    )


def measure(solution: Solution, operation: str, **fields: object) -> float:
    card = Measure("m", "tran", operation, SPAN, **fields)  # type: ignore[arg-type]
    evaluate_measures(solution, [card])
    return solution.measures["m"]


@pytest.mark.parametrize(
    ("operation", "expected", "tolerance"),
    [
        ("max", 3.0, 1e-9),
        ("min", -3.0, 1e-9),
        ("pp", 6.0, 1e-9),
        ("avg", 0.0, 1e-9),
        ("rms", 3.0 / np.sqrt(2.0), 1e-6),
        ("integ", 0.0, 1e-12),
        ("max_at", 0.25 * PERIOD, 1e-9),
        ("min_at", 0.75 * PERIOD, 1e-9),
    ],
)
def test_statistics_of_a_sine(solution, operation, expected, tolerance):
    value = measure(solution, operation, expression=X("v(a)"))
    assert value == pytest.approx(expected, abs=tolerance)


def test_statistics_in_a_window(solution):
    half = {"start": 0.0, "stop": PERIOD / 2}
    assert measure(solution, "avg", expression=X("v(a)"), **half) == pytest.approx(
        6 / np.pi, rel=1e-6
    )
    integral = measure(solution, "integ", expression=X("v(a)"), **half)
    assert integral == pytest.approx(3.0 * PERIOD / np.pi, rel=1e-6)
    assert measure(solution, "min", expression=X("v(a)"), **half) == pytest.approx(0.0, abs=1e-9)


def test_expressions_of_signals(solution):
    power = measure(solution, "avg", expression=X("v(a)*i(r1)"), start=0.0, stop=PERIOD)
    assert power == pytest.approx(1.5e-3, rel=1e-6)
    # between rows there are lines: chords of the circle, 1e4 in a turn
    text = "sqrt(v(a)**2 + v(b)**2)"
    radius = measure(solution, "pp", expression=X(text), start=0.0, stop=PERIOD)
    assert radius == pytest.approx(3.0 * (1.0 - np.cos(np.pi / 1e4)), rel=1e-6)


def test_differences_of_nodes(solution):
    assert measure(solution, "max", expression=X("v(a,b)")) == pytest.approx(
        3 * np.sqrt(2), rel=1e-6
    )


@pytest.mark.parametrize(
    ("edge", "index", "expected"),
    [
        ("rise", 1, 1 / 12),
        ("rise", 3, 2 + 1 / 12),
        ("fall", 2, 1 + 5 / 12),
        ("cross", 4, 1 + 5 / 12),
        ("rise", 0, 4 + 1 / 12),
        ("cross", 0, 4 + 5 / 12),
    ],
)
def test_when(solution, edge, index, expected):
    cond = Cond(X("v(a)"), 1.5, edge=edge, index=index)
    assert measure(solution, "when", first=cond) == pytest.approx(expected * PERIOD, abs=1e-11)


def test_when_of_two_signals(solution):
    cond = Cond(X("v(a)"), other=X("v(b)"), edge="cross", index=1)
    assert measure(solution, "when", first=cond) == pytest.approx(PERIOD / 8, abs=1e-11)


def test_delay(solution):
    cond = Cond(X("v(a)"), 1.5, edge="rise", delay=1.5 * PERIOD)
    assert measure(solution, "when", first=cond) == pytest.approx((2 + 1 / 12) * PERIOD, abs=1e-11)


def test_find_when_and_at(solution):
    cond = Cond(X("v(a)"), 1.5, edge="rise")
    found = measure(solution, "find_when", expression=X("v(b)"), first=cond)
    assert found == pytest.approx(3 * np.cos(np.pi / 6), rel=1e-6)
    assert measure(solution, "find_at", expression=X("v(ramp)"), at=1.23e-3) == pytest.approx(1.23)


def test_trig_targ(solution):
    rise = {"first": Cond(X("v(a)"), 0.3, edge="rise"), "second": Cond(X("v(a)"), 2.7, edge="rise")}
    expected = (np.arcsin(0.9) - np.arcsin(0.1)) / (2 * np.pi) * PERIOD
    assert measure(solution, "trig_targ", **rise) == pytest.approx(expected, abs=1e-11)
    from_start = {"first": Cond(at=0.1e-3), "second": Cond(X("v(ramp)"), 2.0, edge="rise")}
    assert measure(solution, "trig_targ", **from_start) == pytest.approx(1.9e-3)


def test_statistics_between_two_events(solution):
    """From the phase of 30 degrees to that of 150 degrees, where the sine is at half its height."""
    ends = {"first": Cond(X("v(a)"), 1.5, edge="rise"), "second": Cond(X("v(a)"), 1.5, edge="fall")}
    third, root = 2 * np.pi / 3, np.sqrt(3.0)  # the angle, and cos 30 - cos 150
    square = 9.0 * (third + root / 2) / 2 / third  # 9 sin^2: (x - sin 2x / 2) / 2
    expected = {
        "avg": 3.0 * root / third,
        "integ": 3.0 * root * PERIOD / (2 * np.pi),
        "rms": np.sqrt(square),
        "max": 3.0,
        "min": 1.5,
        "pp": 1.5,
        "max_at": PERIOD / 4,
    }
    for operation, value in expected.items():
        # lines between points of 2 pi / 10000: (6e-4)^2 / 8 of the height
        found = measure(solution, operation, expression=X("v(a)"), **ends)
        assert found == pytest.approx(value, rel=1e-7), operation


def test_one_end_of_a_window_may_be_left_out(solution):
    second = Cond(X("v(ramp)"), 2.0, edge="rise")
    up = measure(solution, "max", expression=X("v(ramp)"), second=second)
    assert up == pytest.approx(2.0, rel=1e-12)
    down = measure(solution, "min", expression=X("v(ramp)"), first=second, stop=3e-3)
    assert down == pytest.approx(2.0, rel=1e-12)


def test_deriv(solution):
    value = measure(solution, "deriv", expression=X("v(a)"), at=PERIOD)
    assert value == pytest.approx(3 * 2 * np.pi / PERIOD, rel=1e-6)


def test_param_uses_earlier_results(solution):
    cards = [
        Measure("top", "tran", "max", SPAN, expression=X("v(a)")),
        Measure("ratio", "tran", "param", SPAN, expression=_names("2*top")),
    ]
    evaluate_measures(solution, cards)
    assert solution.measures["ratio"] == pytest.approx(6.0)


def _names(text: str) -> Expression:
    """An expression of plain names, as the netlist reader builds them for PARAM."""
    from nsspice.netlist.expressions.node import Node

    node = X(text.replace("top", "v(top)")).node

    def rename(n: Node) -> Node:
        if n.op == "var":
            return Node("name", (), "top")
        return Node(n.op, tuple(map(rename, n.args)), n.value)

    return Expression(rename(node), None, text)


@pytest.mark.parametrize(
    ("operation", "fields", "words"),
    [
        ("when", {"first": Cond(X("v(a)"), 9.0)}, "v(a) = 9 has no crossings"),
        ("when", {"first": Cond(X("v(a)"), 0.5, edge="rise", index=9)}, "only 5 rising crossings"),
        ("find_at", {"expression": X("v(a)"), "at": 1.0}, "outside the rows"),
        ("max", {"expression": X("v(a)"), "start": 1.0, "stop": 2.0}, "contains no rows"),
        ("max", {"expression": X("v(bb)")}, "no signal 'v(bb)'"),
        ("avg", {"expression": X("1/(v(a)-v(a))")}, "not a finite number"),
        ("avg", {"expression": X("v(a)"), "first": Cond(at=2e-3), "second": Cond(at=1e-3)},
         "TARG, at 0.001, comes before TRIG, at 0.002"),
        ("rms", {"expression": X("v(b)"), "first": Cond(X("v(a)"), 9.0)}, "has no crossings"),
    ],
)  # fmt: skip
def test_what_is_not_found_is_nan_with_a_warning(solution, operation, fields, words):
    value = measure(solution, operation, **fields)
    assert np.isnan(value)
    (warning,) = solution.warnings
    assert warning.code == "NS5001"
    assert words in warning.message
    assert warning.span is SPAN


def test_other_analyses_are_left_alone(solution):
    evaluate_measures(solution, [Measure("m", "dc", "max", SPAN, expression=X("v(a)"))])
    assert solution.measures == {}
