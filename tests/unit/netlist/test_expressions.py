"""Expressions: functions, precedence, derivatives, arrays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nsspice.netlist import Expression, NetlistError, parse_text
from nsspice.netlist.expressions.function_values import SCALAR, array_functions
from nsspice.netlist.expressions.functions import ARITY

#: arguments inside every domain and away from corners
ARGUMENTS = {
    "acosh": (1.7,), "atan2": (0.6, -0.4), "hypot": (0.6, 0.4), "pow": (1.3, 2.5),
    "pwr": (-1.3, 2.5), "pwrs": (-1.3, 2.5),
    "min": (0.6, 0.2, 0.9), "max": (0.6, 0.2, 0.9), "limit": (0.6, 0.2, 0.9), "if": (1.0, 0.6, 0.4),
    "ternary_fcn": (0.0, 0.6, 0.4), "pwl": (0.6, 0.0, 0.0, 1.0, 3.0, 2.0, 4.0),
    "table": (0.6, 0.0, 0.0, 1.0, 3.0), "steps": (0.6, 0.0, 2.0, 1.0, 3.0, 2.0),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(ARITY))
def test_every_function_on_floats_arrays_and_its_derivative(name: str) -> None:
    arguments = ARGUMENTS.get(name, (0.6,))
    rest = "".join(f", {a}" for a in arguments[1:])
    expression = Expression.parse(f"{name}(v(a){rest})")
    x = arguments[0]
    value = expression.evaluate({"v(a)": x})
    assert math.isfinite(value)
    many = np.broadcast_to(expression.evaluate({"v(a)": np.array([x, x])}), (2,))
    assert many == pytest.approx([value, value], rel=1e-14)
    h = 1e-6
    slope = (expression.evaluate({"v(a)": x + h}) - expression.evaluate({"v(a)": x - h})) / (2 * h)
    exact = expression.derivative("v(a)").evaluate({"v(a)": x})
    assert exact == pytest.approx(slope, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    "name", ["pow", "pwr", "atan2", "hypot", "min", "max", "limit", "pwl", "if"]
)
def test_derivatives_with_respect_to_the_other_arguments(name: str) -> None:
    arguments = tuple(abs(a) for a in ARGUMENTS[name])
    for place in range(1, len(arguments)):
        written = ["v(a)" if k == place else repr(a) for k, a in enumerate(arguments)]
        expression = Expression.parse(f"{name}({', '.join(written)})")
        x, h = arguments[place], 1e-6
        up, down = (expression.evaluate({"v(a)": x + s}) for s in (h, -h))
        exact = expression.derivative("v(a)").evaluate({"v(a)": x})
        assert exact == pytest.approx((up - down) / (2 * h), rel=1e-6, abs=1e-6)


def test_scalar_and_array_functions_are_the_same_set() -> None:
    assert set(SCALAR) == set(array_functions())


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("sqr(-3)", 9.0),
        ("1+2*3", 7), ("-2**2", -4), ("2**-1", 0.5), ("2**3**2", 512), ("2^3", 8), ("7/2/2", 1.75),
        ("1-2-3", -4), ("!0", 1), ("!2", 0), ("1 && 0 || 1", 1), ("1 || 0 && 0", 1), ("1<2", 1),
        ("2<=2", 1), ("1==1", 1), ("1!=1", 0), ("0 ? 1 : 0 ? 2 : 3", 3), ("1 ? 2 : 3 ? 4 : 5", 2),
        ("if(1>2, 3, 4)", 4), ("ternary_fcn(1, 3, 4)", 3), ("1k*2", 2000), ("4.7u", 4.7e-6),
        ("1µ*1e6", 1), ("pi", math.pi), ("ln(e)", 1), ("log(e)", 1), ("log10(100)", 2),
        ("u(0)", 0.5),
        ("u(1)", 1), ("uramp(-1)", 0), ("sgn(-3)", -1), ("sgn(0)", 0), ("int(-1.5)", -1),
        ("nint(2.6)", 3), ("floor(-1.5)", -2),
        ("ceil(1.2)", 2), ("pwr(-2,2)", -4), ("pwrs(-2,2)", -4), ("1 & 0 | 1", 1), ("~2 | ~0", 1),
        ("pow(-2,3)", -8),
        ("limit(5,0,1)", 1),
        ("limit(5,1,0)", 1), ("min(3,1,2)", 1), ("max(3,1,2)", 3), ("u2(0.3)", 0.3),
        ("pwl(0.5,0,0,1,2)", 1), ("table(-1,0,3,1,2)", 3), ("pwl(9,0,0,1,2)", 2), ("{1+2}*3", 9),
        ("pwl(1,0,0,1,1,1,5,2,5)", 1), ("1?2:{3}", 2), ("+5", 5), ("--5", 5), ("SIN(0)", 0),
    ],
)  # fmt: skip
def test_values(text: str, value: float) -> None:
    assert Expression.parse(text).evaluate({}) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1/v(a)", math.inf), ("-1/v(a)", -math.inf), ("v(a)/v(a)", math.nan),
        ("ln(v(a))", -math.inf),
        ("sqrt(v(a)-1)", math.nan), ("exp(v(a)+1000)", math.inf), ("(v(a)-1)**0.5", math.nan),
        ("v(a)**-1", math.inf), ("acos(v(a)+2)", math.nan), ("sinh(v(a)-1000)", -math.inf),
        ("cosh(v(a)+1000)", math.inf), ("atanh(v(a)+1)", math.inf), ("log10(v(a)-1)", math.nan),
        ("(v(a)+10)**999", math.inf), ("int(1/v(a))", math.inf),
    ],
)  # fmt: skip
@pytest.mark.parametrize("form", [float, lambda x: np.array([x])], ids=["float", "array"])
def test_outside_of_a_domain_nothing_is_raised(text: str, value: float, form) -> None:
    found = float(np.ravel(Expression.parse(text).evaluate({"v(a)": form(0.0)}))[0])
    assert found == value or (math.isnan(found) and math.isnan(value))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("V(A)", {"v(a)"}), ("v(a , b)", {"v(a,b)"}), ("v(gnd)", set()), ("v(a,0)", {"v(a)"}),
        ("v(0,a)", {"v(a)"}), ("v(a,a)", set()), ("i(V1)*time", {"i(v1)", "time"}), ("i*i", {"i"}),
        ("v(net-1/x)", {"v(net-1/x)"}), ("temper", {"temper"}), ("v(x1.m)", {"v(x1.m)"}),
        ("v (a)", {"v(a)"}), ("0*v(a)", {"v(a)"}),
    ],
)  # fmt: skip
def test_signals(text: str, wanted: set[str]) -> None:
    assert Expression.parse(text).variables() == wanted


def test_a_difference_the_other_way_round() -> None:
    assert Expression.parse("v(0,a)").evaluate({"v(a)": 2.0}) == -2.0


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "NS1020"), ("1+", "NS1020"), ("(1", "NS1020"), ("1)", "NS1020"), ("1 2", "NS1020"),
        ("a=1", "NS1020"), ("2x*", "NS1020"), ("zz", "NS1021"), ("foo(1)", "NS1022"),
        ("sin()", "NS1022"), ("sin(1,2)", "NS1022"), ("pwl(1,2,3,4)", "NS1022"),
        ("limit(1,2)", "NS1022"), ("v(a+b+c", "NS1020"), ("v(1,2,3)", "NS1022"),
        ("1 @ 2", "NS1020"), ("#", "NS1020"),
    ],
)  # fmt: skip
def test_refused(text: str, code: str) -> None:
    with pytest.raises(NetlistError) as caught:
        Expression.parse(text)
    assert caught.value.code == code


@pytest.mark.parametrize(
    ("text", "marked"),
    [("(12", "("), ("2*(12", "("), ("12)+3", ")"), ("12+", "+"), ("1 23", "23"), ("a=1", "="),
     ("12 @ 2", "@"), ("3*foo(1)", "foo")],
)  # fmt: skip
def test_what_is_wrong_is_marked(text: str, marked: str) -> None:
    line = f"B1 a 0 V={{{text}}}"
    with pytest.raises(NetlistError) as caught:
        parse_text(f"carets\n{line}\n")
    span = caught.value.diagnostics[0].span
    assert line[span.column - 1 :][: span.length] == marked


def test_lazy_branches_and_logic() -> None:
    expression = Expression.parse("v(a) > 0 ? 1/v(a) : 0")
    assert expression.evaluate({"v(a)": 0.0}) == 0.0
    assert list(expression.evaluate({"v(a)": np.array([0.0, 2.0])})) == [0.0, 0.5]
    assert Expression.parse("0 && v(a)").evaluate({}) == 0.0
    assert Expression.parse("1 || v(a)").evaluate({}) == 1.0


def test_a_missing_signal_is_a_key_error() -> None:
    with pytest.raises(KeyError):
        Expression.parse("v(a)").evaluate({})


def test_substitute() -> None:
    expression = Expression.parse("v(a)*i(v1)+temper")
    assert expression.substitute({"v(a)": 2.0, "i(v1)": 3.0, "temper": 1.0}).evaluate({}) == 7.0


def test_second_derivatives() -> None:
    twice = Expression.parse("v(a)**3*exp(v(a))").derivative("v(a)").derivative("v(a)")
    x = 0.7
    wanted = math.exp(x) * (x**3 + 6 * x**2 + 6 * x)
    assert twice.evaluate({"v(a)": x}) == pytest.approx(wanted, rel=1e-14)


def test_slopes_of_a_table_are_those_of_its_segments() -> None:
    slope = Expression.parse("table(v(a),1,2,3,8,5,4)").derivative("v(a)")
    assert [slope.evaluate({"v(a)": x}) for x in (0.0, 2.0, 4.0, 6.0)] == [0.0, 3.0, -2.0, 0.0]


def test_a_derivative_to_another_signal_is_zero() -> None:
    assert Expression.parse("v(a)**2").derivative("v(b)").text == "0"


@pytest.mark.parametrize("name", ["int", "nint", "floor", "ceil"])
@pytest.mark.parametrize("x", [0.0, -0.0, 0.3, -0.3])
def test_a_rounded_zero_keeps_its_sign(name, x):
    """As in arrays and on tapes, or 1/int(-0.3) would be +inf here and -inf there."""
    expression = Expression.parse(f"1/{name}(v(a))")
    (expected,) = expression.evaluate({"v(a)": np.array([x])})
    assert expression.evaluate({"v(a)": x}) == expected


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("eq0", "010"),
        ("ne0", "101"),
        ("gt0", "001"),
        ("ge0", "011"),
        ("lt0", "100"),
        ("le0", "110"),
    ],
)
def test_comparisons_with_zero(name: str, values: str) -> None:
    """ngspice's manual, section 5.1.3; of -2, 0 and 3."""
    for x, value in zip((-2.0, 0.0, 3.0), values, strict=True):
        found = parse_text(f"t\n.param y={{{name}({x})}}\nR1 a 0 {{1+y}}\nV1 a 0 1\n.op\n")
        assert found.elements[0].value == 1.0 + float(value)
