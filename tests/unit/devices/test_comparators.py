"""Comparisons in expressions as switches: which ones, and what they make of a circuit."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import nsspice
from nsspice.circuit.dlcp import dlcp_form
from nsspice.devices.expressions.comparators import split
from nsspice.netlist.expressions.expression import Expression

SIGNALS = ("v(a)", "v(b)", "v(c)")


def value(text: str, levels: dict[str, float]) -> float:
    """Return what an expression without its comparisons gives, its comparators switched in turn."""
    tree, comparators = split(Expression.parse(text).node, "b1")
    levels = dict(levels)
    for comparator in comparators:
        control = Expression(comparator.control).evaluate(levels)
        levels[comparator.signal] = float(control > 0.0 or (control == 0.0 and comparator.closed))
    return Expression(tree).evaluate(levels)


@pytest.mark.parametrize(
    "text",
    [
        "if(v(a) > v(b), 5, -5)",
        "if(v(a) >= v(b), 5, -5) + 2*v(c)",
        "3*(v(a) < v(b)) - (v(b) <= v(c))",
        "if(v(a) > 1 && v(b) > 1 && v(c) > 1, 1, 0)",
        "if(v(a) > 1 || !(v(b) > v(c)), 7, 2)",
        "v(a) > 2 ? 0 : v(a) > 1 ? 5 : v(b) > 1 ? 4 : 9",
        "if(v(a) > 1, if(v(b) > 1, 1, 2), if(v(c) > 1, 3, 4))",
        "buf(v(a)) + 2*inv(v(b)) - 3*u(v(c) - 1.5)",
        "v(c)*(v(a) > v(b))",
        "if(v(a) > 1, v(b)*v(c), v(b) - v(c))",
        "if((v(a) > 1) + (v(b) > 1) > 1.5, 1, 0)",
    ],
)
def test_the_value_stays_that_of_the_expression(text: str) -> None:
    """At all corners of a cube, thresholds included (where a step is left out)."""
    for levels in itertools.product((0.0, 0.75, 1.0, 2.0, 3.0), repeat=3):
        if "u(" in text and levels[2] == 1.5:
            continue
        signals = dict(zip(SIGNALS, levels, strict=True))
        assert value(text, signals) == Expression.parse(text).evaluate(signals), levels


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("if(v(a) > 0, v(a), 0)", 0),  # continuous
        ("sgn(v(a))", 0),  # at rest it is zero
        ("max(v(a), 0)", 0),
        ("if(v(a) && v(b) > 1, 1, 0)", 0),  # not zero is true: no comparison
        ("if(v(a) > 1, 1, 0)", 1),
        ("if(v(a) > 1 && v(b) > 1, 1, 0)", 3),
        ("v(a) > 2 ? 0 : v(a) < 1 ? 5 : 2.5", 3),
    ],
)
def test_which_comparisons_are_switches(text: str, count: int) -> None:
    assert len(split(Expression.parse(text).node, "b1")[1]) == count


def test_nested_choices_take_few_switches() -> None:
    """A quantiser of 40 steps: not every product of conditions is a switch of its own."""
    text = "40"
    for k in reversed(range(40)):
        text = f"if(v(a) < {k + 0.5}, {k}, {text})"
    assert len(split(Expression.parse(text).node, "b1")[1]) < 80
    for level in (0.0, 0.6, 17.2, 39.4, 39.6, 100.0):
        assert value(text, {"v(a)": level}) == min(round(level), 40)


def test_what_only_chooses_between_numbers_keeps_a_circuit_linear() -> None:
    """The instants are those of the threshold, in closed form."""
    circuit = nsspice.read(
        "oscillator\nB1 a 0 V=v(b) > (v(a) > 0.5 ? 0.7 : 0.3) ? 0 : 1\n"
        "R1 a b 1k\nC1 b 0 1u\n.tran 10u 10m uic\n"
    )
    run = nsspice.tran(circuit)
    assert run.islands[0].method == "modewise"
    assert run.certificate.passed
    times = np.array([e.time for e in run.events if e.element == "b1#2"])
    # from 0 to 0.7, then between 0.3 and 0.7
    first, half = 1e-3 * np.log(1.0 / 0.3), 1e-3 * np.log(0.7 / 0.3)
    assert np.abs(times - first - half * np.arange(times.size)).max() <= 1e-12 * 10e-3
    assert times.size == 11
    assert not any("#" in name for name in run.signals)


@pytest.mark.parametrize("method", ["auto", "sdirk", "moreau"])
def test_steps_in_time_and_of_signals(method: str) -> None:
    """A resistance that follows a comparison, steps of the time, a current that is compared."""
    circuit = nsspice.read(
        "steps\nB1 a 0 V=if(time > 1.005m, 5, 0)\nR1 a b 1k\nC1 b 0 1u IC=0\n"
        "B2 c 0 V=3*u(time - 2.005m) + (v(b) > 2)*4\nR2 c 0 1k\n"
        "R3 d 0 R={if(v(b) > 2.5, 1k, 2k)}\nI3 0 d 1m\n"
        "B4 0 e I=if(i(B1) < -2m, 1m, -1m)\nR4 e 0 1k\n.tran 10u 5m uic\n"
    )
    run = nsspice.tran(circuit, method=method, step=1e-6 if method == "moreau" else None)
    assert run.certificate.passed
    t, tau = run.time, 1e-3
    begin = 1.005e-3
    high = 5.0 * (1.0 - np.exp(-np.maximum(t - begin, 0.0) / tau))
    reaches = {v: begin - tau * np.log(1.0 - v / 5.0) for v in (2.0, 2.5, 3.0)}
    # fixed steps: switches act up to one late, implicit Euler adds half of one
    allowed = 1.5e-6 * 5.0 / tau if method == "moreau" else 1e-4
    assert np.abs(run["v(b)"] - high).max() <= allowed
    near = 2.0 * (1e-6 if method == "moreau" else 1e-7)
    clear = np.ones(t.size, bool)
    for instant in (begin, 2.005e-3, *reaches.values()):
        clear &= np.abs(t - instant) > near
    expected = {
        "v(c)": 3.0 * (t > 2.005e-3) + 4.0 * (t > reaches[2.0]),
        "v(d)": np.where(t > reaches[2.5], 1.0, 2.0),
        "v(e)": np.where((t > begin) & (t < reaches[3.0]), 1.0, -1.0),
    }
    for name, exact in expected.items():
        assert np.abs(run[name] - exact)[clear].max() <= 1e-9 * 7.0, name


def test_static_solutions_follow_comparisons() -> None:
    circuit = nsspice.read(
        "sweep\nV1 x 0 0\nB1 a 0 V=if(v(x) > 1, 5, 0)\nR1 a b 1k\nD1 b 0 DX\n"
        ".model DX D(IS=1e-14)\n.dc V1 0.1 2 0.25\n"
    )
    sweep = circuit.run()[0]
    assert np.array_equal(sweep["v(a)"], np.where(sweep["v(x)"] > 1.0, 5.0, 0.0))


def test_the_circuit_has_a_dlcp_form_and_midpoint_steps() -> None:
    """The comparator is one pair of the form: its slack drives the filter."""
    circuit = nsspice.read(
        "pwm\nB1 a 0 V=if(v(r) > v(c), 10, 0)\nVr r 0 0.2\nVc c 0 PULSE(-1 1 0 5u 5u 0 10u)\n"
        "L1 a b 1m IC=0\nR1 b 0 10\n.tran 1u 2m uic\n"
    )
    form = dlcp_form(circuit.islands[0].assemble(27.0))
    assert (form.states, form.inputs, form.outputs) == (["i[l1]"], ["w[b1#1]"], ["i[b1#1]"])
    assert form.B[0, 0] == pytest.approx(1e3 * 10.0)  # 10 V for 1 V of the comparator, over 1 mH
    # i' = (v - 10 i) / 1 mH, v = 10 V for 0.6 of each period: 0.6 A in the mean
    exact = nsspice.tran(circuit)
    run = nsspice.tran(circuit, method="moreau", theta=0.5, step=1e-8)
    late = run.time > 1e-3
    assert np.mean(exact["i(l1)"][late]) == pytest.approx(0.6, abs=0.01)
    # each turn up to a step late: 10 V / 1 mH for 1e-8 s, and 100 of them within L/R
    assert np.abs(run["i(l1)"] - exact["i(l1)"]).max() <= 1e4 * 1e-8 * 20
