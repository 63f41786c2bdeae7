"""Expressions on a tape have the values and slopes of the expressions themselves."""

from __future__ import annotations

import math

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from oracle.tapes import run

from nsspice.devices.behaviour import Compiler, linear_form
from nsspice.netlist.expressions.expression import Expression
from nsspice.netlist.expressions.functions import ALIASES, ARITY, WITH_ZERO
from nsspice.netlist.expressions.node import Node, add, call, choose, inv, mul, neg, num, power, var
from nsspice.problems.tape import TapeBuilder

SIGNALS = ["v(a)", "v(b)", "i(x)"]
#: the base of a parsed tree: spellings are resolved, tables are written as pwl
FUNCTIONS = sorted(
    set(ARITY) - set(ALIASES) - set(WITH_ZERO) - {"pwl", "steps", "if", "ternary_fcn", "pow"}
)
#: halves, quarters and whole numbers make ties and corners likely
NUMBERS = st.one_of(
    st.sampled_from([0.0, 0.5, 1.0, -1.0, 2.0, -2.5, 1e-3, 1e3]),
    st.floats(-50, 50, allow_subnormal=False),
)


def grow(children: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    some = st.lists(children, min_size=2, max_size=3)

    def function(name: str) -> st.SearchStrategy[Node]:
        least, most = ARITY[name]
        args = st.lists(children, min_size=least, max_size=most or 3)
        return args.map(lambda found: call(name, *found))

    def table(points: list[tuple[float, float]]) -> st.SearchStrategy[Node]:
        flat = [num(x) for pair in sorted(points) for x in pair]
        return children.map(lambda x: call("pwl", x, *flat))

    def stairs(points: list[tuple[float, float]]) -> st.SearchStrategy[Node]:
        flat = [num(x) for pair in sorted(points) for x in pair][:-1]
        return children.map(lambda x: call("steps", x, *flat))

    points = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=4)
    more = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=2, max_size=4)
    compare = st.sampled_from(["lt", "le", "gt", "ge", "eq", "ne", "and", "or"])
    return st.one_of(
        some.map(add),
        some.map(mul),
        children.map(neg),
        children.map(inv),
        children.map(lambda x: Node("not", (x,))),
        st.tuples(children, children).map(lambda p: power(*p)),
        st.tuples(children, children).map(lambda p: add((p[0], neg(p[1])))),
        st.tuples(children, children).map(lambda p: mul((p[0], inv(p[1])))),
        st.tuples(compare, children, children).map(lambda p: Node(p[0], p[1:])),
        st.tuples(children, children, children).map(lambda p: choose(*p)),
        st.sampled_from(FUNCTIONS).flatmap(function),
        points.flatmap(table),
        more.flatmap(stairs),
    )


TREES = st.recursive(st.one_of(NUMBERS.map(num), st.sampled_from(SIGNALS).map(var)), grow)
VALUES = st.fixed_dictionaries(dict.fromkeys(SIGNALS, NUMBERS))


def on_tape(tree: Node) -> TapeBuilder:
    builder = TapeBuilder()
    places = {name: k for k, name in enumerate(SIGNALS)}
    register = Compiler(builder, lambda name: builder.unknown(places[name])).compile(tree)
    builder.output(register)
    return builder


@settings(max_examples=500, deadline=None)
@given(TREES, VALUES)
@example(inv(call("floor", num(-0.0))), dict.fromkeys(SIGNALS, 0.0))  # a zero keeps its sign
def test_a_tape_has_the_values_of_its_expression(tree: Node, values: dict[str, float]) -> None:
    expected = Expression(tree).evaluate(values)
    found = float(run(on_tape(tree).finish(), [values[name] for name in SIGNALS])[0][0])
    # sums and products are taken in the same order, tables by another formula
    if not math.isclose(found, expected, rel_tol=1e-9, abs_tol=1e-9):
        # comparisons with nan, and branches that only one of the two looks at
        parts = [tree]
        for node in parts:
            parts.extend(node.args)
        assert any(math.isnan(Expression(node).evaluate(values)) for node in parts)


LEAVES = st.one_of(NUMBERS.map(num), st.sampled_from(SIGNALS).map(var))
#: without corners
CURVES = sorted(set(FUNCTIONS) - {"abs", "min", "max", "limit", "u2", "uramp", "pwr"})


def grow_smooth(children: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    some = st.lists(children, min_size=2, max_size=3)

    def function(name: str) -> st.SearchStrategy[Node]:
        args = st.lists(children, min_size=ARITY[name][0], max_size=ARITY[name][1] or 3)
        return args.map(lambda found: call(name, *found))

    return st.one_of(
        some.map(add),
        some.map(mul),
        children.map(inv),
        st.tuples(children, children).map(lambda p: power(*p)),
        st.sampled_from(CURVES).flatmap(function),
    )


def grow_linear(children: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    some = st.lists(children, min_size=2, max_size=3)
    factor = NUMBERS.map(num)
    return st.one_of(
        some.map(add),
        children.map(neg),
        st.tuples(factor, children, factor).map(lambda p: mul((p[0], p[1], inv(p[2])))),
    )


@settings(max_examples=300, deadline=None)
@given(st.recursive(LEAVES, grow_smooth), VALUES)
def test_a_tape_has_the_slopes_of_its_expression(tree: Node, values: dict[str, float]) -> None:
    # quotients of tiny values cancel to rounding errors of any size, in both
    assume(all(v == 0.0 or abs(v) > 1e-3 for v in values.values()))
    slopes = run(on_tape(tree).finish(), [values[name] for name in SIGNALS])[1][0]
    for name, slope in zip(SIGNALS, slopes, strict=True):
        derivative = Expression(tree).derivative(name)
        expected = derivative.evaluate(values)
        # v(b) / v(b) / v(a)**31 has the rounding of a quotient times 2e9
        nudged = (derivative.evaluate(moved(values, ulps)) for ulps in (-3, -1, 1, 2, 5))
        steady = all(math.isclose(v, expected, rel_tol=1e-8, abs_tol=1e-8) for v in nudged)
        if steady and math.isfinite(slope) and abs(expected) < 1e12:
            assert math.isclose(slope, expected, rel_tol=1e-6, abs_tol=1e-6)


def moved(values: dict[str, float], ulps: int) -> dict[str, float]:
    """Return the values, each next to itself by some units in its last place."""
    return {name: v + ulps * math.ulp(v) for name, v in values.items()}


@settings(max_examples=200, deadline=None)
@given(st.recursive(LEAVES, grow_linear), VALUES)
def test_a_linear_form_has_the_values_of_its_expression(
    tree: Node, values: dict[str, float]
) -> None:
    form = linear_form(tree)
    expected = Expression(tree).evaluate(values)
    if form is None:  # a division by zero
        assert "/0" in Expression(tree).text or "/-0" in Expression(tree).text
        return
    total = form[0] + sum(factor * values[name] for name, factor in form[1].items())
    scale = abs(form[0]) + sum(abs(f * values[n]) for n, f in form[1].items())
    if math.isfinite(scale) and math.isfinite(expected):
        assert abs(total - expected) <= 1e-9 * max(1.0, scale)
