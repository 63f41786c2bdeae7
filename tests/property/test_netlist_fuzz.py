"""No text makes the netlist reader crash, hang or eat memory; expressions mean what they say."""

from __future__ import annotations

import ast
import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

from nsspice.netlist import Expression, NetlistError, format_number, parse_text, read_number

#: seconds for any small text; a thousand times what it takes
PATIENCE = 5.0

GOOD = """every card of the dialect
.param half={full/2} full=10 f=50
.func square(x) {x*x}
.global vdd
.options reltol=1e-4 temp=30 method=moreau
.model dm D(Vfwd=0.7 Ron={half/100}) ; comment
.model sm SW(vt=1 vh=0.1 ron=0)
.model qm NPN(alphaN=0.99 DE=dm)
.subckt cell a b params: r=1k
R1 a m {r*2}
C1 m b 1u ic=0
.subckt deep x
L1 x 0 1m
.ends deep
Xd m deep
.ends cell
V1 in 0 DC 5 SIN(0 {full} {f} 0 0)
V2 vdd 0 PULSE(0 5 0 1n 1n 5u 10u)
I1 0 in PWL(0 0 1u 1m
+ 2u 0) r=0 td=1u
R1 in out 4.7k tc1=1m
R2 out 0 R='square(3)+1'
R3 out 0 V={i**3+2*i}
C1 out 0 10u ic=1
L1 out x 1m
L2 x 0 1m
K1 L1 L2 0.9
D1 in out dm off
D2 out 0
S1 out 0 in 0 sm on
W1 out 0 V1 wm
.model wm csw(it=1m)
Q1 out in 0 qm
E1 e 0 in 0 10
E2 e2 0 VALUE={v(in)*2}
G1 0 e2 TABLE {v(in,out)} = (0,0) (1,1m)
F1 0 e2 POLY(2) V1 V2 0 1 2 3
H1 h 0 V1 1k
B1 b 0 V=v(in)>1 ? time : uramp(v(out))
X1 in out cell r={half*100}
.if (half > 2)
R9 in 0 1
.elseif (half == 1)
R9 in 0 2
.else
R9 in 0 3
.endif
.ic v(out)=1
.nodeset v(in)=2
.op
.dc V1 0 5 0.5 V2 0 1 1
.tran 1u 1m 0 1u uic
.step param f list 50 60
.save v(in) i(r1) p(d1)
.print tran v(in,out)
.meas tran top MAX v(out) from=0 to=1m
.meas tran delay TRIG v(in) VAL=1 RISE=1 TARG v(out) VAL=1 FALL=LAST
.meas tran when1 FIND v(in)*2 WHEN v(out)=v(x) CROSS=2
.meas tran twice PARAM='top*2'
.control
run
.endc
.end
"""

WORDS = """( ) { } ' " = , + - * / ** ^ ? : && || ! < > == ; $ // . .. R1 C1 L1 V1 D1 Q1 X1 E1 G1 F1
H1 B1 K1 S1 W1 M1 A1 0 a b gnd 1k 2k2 4R7 1M 1,5 1e999 1e-999 -1 {1/0} {x} {a*} i v(a) v(a,b) i(v1)
time poly(2) poly(99) table value= vol= tc= ic= sin( pulse( pwl( dc ac .param .func .model .subckt
.ends .if .elseif .else .endif .include .lib .endl .control .endc .end .tran .dc .op .step .meas .ic
.save .print .options .global .temp x=y y=x params: dec list param µ 1µ İ ß 'x' "f" #branch @r1[i]
all trig targ when find rise=last"""
BREAKS = ["\n", "\n+", "\n*", " ", "\x00", "\t", "\r", "\f", "\u2028", "\n.subckt s a b\n",
          "\nX1 a b s\n", "\n.ends\n", "\nR2 a 0 1k\n"]  # fmt: skip
TOKENS = st.sampled_from([*WORDS.split(), *BREAKS, *BREAKS])


@pytest.fixture(autouse=True, scope="module")
def nothing_kept():
    """Keep the odd shapes of these tests out of the user's store."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NSSPICE_CACHE", "")
        yield


def read(text: str, patience: float = PATIENCE) -> None:
    """Parse a text: it either works or says why not, and soon."""
    start = time.process_time()
    try:
        findings = parse_text(text, directory=Path("nowhere")).warnings
        severity = "warning"
    except NetlistError as error:
        findings = error.diagnostics
        severity = "error"
    assert time.process_time() - start < patience
    assert findings or severity == "warning"
    for finding in findings:
        assert finding.code.startswith(("NS1", "NS2005"))  # impossible temperatures
        assert finding.severity == severity
        assert finding.message
        assert len(finding.render()) < 5000


def test_the_good_deck_is_good() -> None:
    deck = parse_text(GOOD)
    assert len(deck.elements) == 25
    assert not deck.warnings


@given(st.text(max_size=400))
@settings(max_examples=300, deadline=None)
def test_arbitrary_text(text: str) -> None:
    read("title\n" + text)


@given(st.lists(TOKENS, max_size=80), st.sampled_from(["", " "]))
@settings(max_examples=600, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_words_of_the_dialect_in_any_order(words: list[str], glue: str) -> None:
    read("title\n" + glue.join(words))


@given(
    st.lists(
        st.tuples(st.integers(0, len(GOOD)), st.integers(0, 30), TOKENS | st.just("")),
        min_size=1,
        max_size=4,
    )
)
@settings(max_examples=400, deadline=None)
def test_a_good_deck_with_mistakes(edits: list[tuple[int, int, str]]) -> None:
    text = GOOD
    for place, width, new in edits:
        text = text[:place] + new + text[place + width :]
    read(text)


@given(st.binary(max_size=300))
@settings(max_examples=200, deadline=None)
def test_arbitrary_bytes(data: bytes) -> None:
    from nsspice.netlist.text.source import decode

    read(decode(data))


def long_lines(size: int) -> list[str]:
    """Return lines of about ``size`` characters that are hard in different ways."""
    return [
        "R1 a 0 " + "(" * size,
        "R1 a 0 " + ")" * size,
        "R1 a 0 {" + "(" * size + "}",
        "R1 a 0 {" + "(" * (size // 2) + "1" + ")" * (size // 2) + "}",
        "R1 a 0 {" + "-" * size + "1}",
        "R1 a 0 {" + "!" * size + "1}",
        "R1 a 0 {" + "1+" * (size // 2) + "1}",
        "R1 a 0 {" + "2**" * (size // 3) + "1}",
        "R1 a 0 {" + "1?1:" * (size // 4) + "1}",
        "R1 a 0 {" + "abs(" * (size // 5) + "1" + ")" * (size // 5) + "}",
        "R1 a 0 " + "{" * size,
        "R1 a 0 " + "'" * size,
        "R1 a 0 " + "{a" * (size // 2),
        "R1 a 0 " + "x" * size,
        "R1 a 0 " + "1 " * (size // 2),
        "R1 a 0 1" + " " * size,
        "R1 a 0 1" + "," * size,
        "R1 a 0 1" + "0" * size,
        "R1 a 0 " + "a=1 " * (size // 4),
        "V1 a 0 PWL(" + "".join(f"{k} {k} " for k in range(size // 14)) + ")",
        "B1 a 0 V=" + "v(a)+" * (size // 5) + "1",
        "B1 a 0 V=" + "v(" * (size // 2),
        ".param " + "a=1 " * (size // 4),
        ".param " + "a" * size + "=1",
        ".func f(" + "x," * (size // 2) + ") 1",
        ".if " + "(" * size,
        ".meas tran x max " + "(" * size,
        ".meas tran x max " + "from=" * (size // 5),
        ".save " + "v(a) " * (size // 5),
        "E1 a 0 POLY(50) " + "a 0 " * 50 + "1 " * (size // 10),
        "X1 " + "a " * (size // 2),
        "." + "a" * size,
        "*" * size,
        ";" * size,
        '"' + "x;" * (size // 2),
        "/" * size,
        "$ " * (size // 2),
        "\n+" * (size // 2),
        "R1 a 0 1" + "\n+ " * (size // 3),
    ]


def head(line: str) -> str:
    """Return a name for a test."""
    return repr(line[:20])


@pytest.mark.parametrize("line", long_lines(50_000), ids=head)
def test_long_lines(line: str) -> None:
    read(f"title\nR9 a 0 1\n{line}\n", patience=30.0)


@pytest.mark.soak
@pytest.mark.parametrize("line", long_lines(1_000_000), ids=head)
def test_very_long_lines(line: str) -> None:
    read(f"title\nR9 a 0 1\n{line}\n", patience=120.0)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (  # 2^60 resistors
            "X1 a s0\n"
            + "".join(f".subckt s{k} a\nX1 a s{k + 1}\nX2 a s{k + 1}\n.ends\n" for k in range(40))
            + ".subckt s40 a\nR1 a 0 1\n.ends",
            "NS1043",
        ),
        ("X1 a s\n.subckt s a\nX1 a s\n.ends", "NS1042"),
        (".subckt s a\n" * 3000 + ".ends\n" * 3000 + "R1 a 0 1", "NS1042"),
        (
            "X1 a s0\n"
            + "".join(f".subckt s{k} a\nX1 a s{k + 1}\n.ends\n" for k in range(3000))
            + ".subckt s3000 a\nR1 a 0 1\n.ends",
            "NS1042",
        ),
        (".if 1\n" * 3000 + "R1 a 0 1\n" + ".endif\n" * 3000, "NS1042"),
        (  # functions that double at every level
            ".func f0(x) {x+1}\n"
            + "".join(f".func f{k + 1}(x) {{f{k}(x)*f{k}(x+1)}}\n" for k in range(60))
            + "B1 a 0 V=f60(v(a))",
            "NS1023",
        ),
        (  # the same with numbers, which fold and never grow
            ".func f0(x) {x+1}\n"
            + "".join(f".func f{k + 1}(x) {{f{k}(x)*f{k}(1)*0}}\n" for k in range(60))
            + "R1 a 0 {f60(1)}",
            "NS1023",
        ),
        (".func f(x) {f(x)}\nR1 a 0 {f(1)}", "NS1031"),
        (
            "".join(f".func f{k}(x) {{f{k + 1}(x)}}\n" for k in range(3000))
            + ".func f3000(x) {x}\nR1 a 0 {f0(1)}",
            "NS1023",
        ),
    ],
    ids=[
        "2^40",
        "self",
        "nested-definitions",
        "chain",
        "nested-if",
        "doubling",
        "folding",
        "loop",
        "deep",
    ],
)
def test_bombs_are_named_and_soon(text: str, code: str) -> None:
    start = time.process_time()
    with pytest.raises(NetlistError) as caught:
        parse_text("title\n" + text)
    assert code in [d.code for d in caught.value.diagnostics]
    assert time.process_time() - start < 30.0


def test_a_long_chain_of_parameters_needs_no_recursion() -> None:
    count = 20_000
    chain = "\n".join(f".param p{k}={{p{k + 1}+1}}" for k in range(count))
    deck = parse_text(f"title\nR1 a 0 {{p0}}\n{chain}\n.param p{count}=0\n")
    assert deck.elements[0].value == count


# -- numbers ---------------------------------------------------------------------------------------


@given(st.floats(allow_nan=False, allow_infinity=False))
@example(-0.0)
@example(5e-324)
def test_numbers_read_back_to_the_same_double(value: float) -> None:
    found = read_number(format_number(value))
    assert found is not None
    assert not found.trap
    assert math.copysign(1.0, found.value) == math.copysign(1.0, value)
    assert found.value == value


@given(
    st.decimals(-1000, 1000, places=4),
    st.sampled_from([("T", 12), ("g", 9), ("MEG", 6), ("k", 3), ("m", -3), ("u", -6), ("µ", -6)]),
    st.sampled_from(["", "Ohm", "Hz", "s"]),
)
def test_a_suffix_is_exactly_its_power_of_ten(
    value: object, suffix: tuple[str, int], unit: str
) -> None:
    letters, power = suffix
    found = read_number(f"{value}{letters}{unit}")
    assert found is not None
    assert found.value == float(f"{value}e{power}")


# -- expressions -----------------------------------------------------------------------------------

LEAVES = st.sampled_from(["v(a)", "v(b)", "time"]) | st.integers(1, 9).map(str)
SMOOTH = ("sin", "cos", "atan", "tanh", "exp", "sqrt", "ln", "cosh", "sinh", "asinh", "abs", "tan")


def trees(smooth: bool) -> st.SearchStrategy[str]:
    """Return random expressions, fully in parentheses, valid for SPICE and for Python."""

    def grow(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        pair = st.tuples(inner, inner)
        made = [
            pair.flatmap(lambda p: st.sampled_from("+-*/").map(lambda op: f"({p[0]}{op}{p[1]})")),
            pair.map(lambda p: f"{p[0]} + {p[1]}*2 - 3/({p[1]})"),
            inner.map(lambda x: f"(-{x})"),
            st.tuples(inner, st.sampled_from(["2", "3", "0.5"])).map(lambda p: f"({p[0]})**{p[1]}"),
            st.tuples(st.sampled_from(SMOOTH), inner).map(lambda p: f"{p[0]}({p[1]})"),
            st.tuples(st.sampled_from(["max", "min"]), inner, inner).map(
                lambda p: f"{p[0]}({p[1]},{p[2]})"
            ),
        ]
        if not smooth:
            made.append(pair.map(lambda p: f"(({p[0]})<({p[1]}))"))
            made.append(pair.map(lambda p: f"(({p[0]})>=({p[1]}))"))
        return st.one_of(made)

    return st.recursive(LEAVES, grow, max_leaves=8)


class _RealPowers(ast.NodeTransformer):
    """Replace ``a ** b`` by a power that raises where Python would give a complex number."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.op, ast.Pow):
            return ast.Call(ast.Name("real_power", ast.Load()), [node.left, node.right], [])
        return node


def python_value(text: str, values: dict[str, float]) -> float:
    """Evaluate with Python's own rules; nan where Python has no real value."""
    names: dict[str, object] = {f: getattr(math, f) for f in SMOOTH if hasattr(math, f)}
    names |= {"ln": math.log, "abs": abs, "max": max, "min": min, "time": values["time"]}
    names |= {"va": values["v(a)"], "vb": values["v(b)"], "real_power": math.pow}
    tree = ast.parse(text.replace("v(a)", "va").replace("v(b)", "vb"), mode="eval")
    tree = ast.fix_missing_locations(_RealPowers().visit(tree))
    try:
        return float(eval(compile(tree, "expression", "eval"), {"__builtins__": {}}, names))
    except (ValueError, ZeroDivisionError, OverflowError):
        return math.nan


VALUES = st.fixed_dictionaries(
    {name: st.floats(-3, 3).map(lambda x: round(x, 3)) for name in ("v(a)", "v(b)", "time")}
)


@given(trees(smooth=False), VALUES)
@settings(max_examples=400, deadline=None)
def test_evaluation_agrees_with_python(text: str, values: dict[str, float]) -> None:
    wanted = python_value(text, values)
    assume(math.isfinite(wanted))
    expression = Expression.parse(text)
    found = expression.evaluate(values)
    assert found == pytest.approx(wanted, rel=1e-12, abs=1e-300)
    arrays = {name: np.array([value, value]) for name, value in values.items()}
    with np.errstate(all="raise"):
        many = np.broadcast_to(expression.evaluate(arrays), (2,))
    assert many == pytest.approx([wanted, wanted], rel=1e-9, abs=1e-300)


@given(trees(smooth=False), VALUES)
@settings(max_examples=200, deadline=None)
def test_printed_expressions_read_back(text: str, values: dict[str, float]) -> None:
    expression = Expression.parse(text)
    again = Expression.parse(Expression(expression.node).text)
    first, second = expression.evaluate(values), again.evaluate(values)
    assert first == second or (math.isnan(first) and math.isnan(second))


@given(trees(smooth=True), VALUES)
@settings(max_examples=400, deadline=None)
def test_derivatives_agree_with_central_differences(text: str, values: dict[str, float]) -> None:
    expression = Expression.parse(text)

    def at(shift: float) -> float:
        return float(expression.evaluate({**values, "v(a)": values["v(a)"] + shift}))

    slopes = []
    for h in (1e-4, 5e-5):
        slopes.append((at(h) - at(-h)) / (2 * h))
    assume(all(math.isfinite(s) and abs(s) < 1e4 for s in slopes))
    assume(abs(at(0.0)) < 1e4)
    # two step sizes agree: no kink, no pole and no cancellation near this point
    assume(abs(slopes[0] - slopes[1]) <= 1e-5 * (1 + abs(slopes[0])))
    one_sided = [(at(s * 1e-4) - at(0.0)) / (s * 1e-4) for s in (1.0, -1.0)]
    # at a kink the central difference errs by half of theirs
    assume(abs(one_sided[0] - one_sided[1]) <= 1e-3 * (1 + abs(slopes[0])))
    derivative = expression.derivative("v(a)")
    exact = [derivative.evaluate({**values, "v(a)": values["v(a)"] + s}) for s in (0, 1e-6, -1e-6)]
    assume(not math.isnan(exact[0]))  # at the end of a domain, as sqrt(x - x)
    # beside the point too: at the tie of max(min(x, 0), x) a piece is chosen that holds only there
    assert slopes[1] in [pytest.approx(d, rel=1e-3, abs=1e-3) for d in exact]
