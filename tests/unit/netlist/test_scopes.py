"""Parameters, functions, subcircuits, models, conditionals, included files."""

from __future__ import annotations

import pytest

from nsspice.netlist import Deck, Expression, NetlistError, parse_file, parse_text


def deck(*lines: str, **options: object) -> Deck:
    return parse_text("title\n" + "\n".join(lines), **options)


def values(found: Deck) -> dict[str, object]:
    return {e.name: getattr(e.value, "text", e.value) for e in found.elements}


def codes(*lines: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        deck(*lines)
    return [d.code for d in caught.value.diagnostics]


def test_parameters_in_any_order() -> None:
    found = deck(
        "R1 a 0 {b}", ".param b={a*2} c='b+1'", ".param a=5 d=a*2 e = 1 + 2", "R2 a 0 {d+e}"
    )
    assert values(found) == {"r1": 10.0, "r2": 13.0}
    assert found.parameters == {"a": 5.0, "b": 10.0, "c": 11.0, "d": 10.0, "e": 3.0}


def test_given_parameters_win() -> None:
    found = deck("R1 a 0 {b}", ".param b={2*x} x=1", params={"X": 7})
    assert values(found) == {"r1": 14.0}
    assert not found.warnings
    assert [w.code for w in deck("R1 a 0 1", ".param x=1", params={"y": 7}).warnings] == ["NS1083"]


def test_given_parameters_without_effect_are_told() -> None:
    """Stepped ones too; one that an element asks for needs no .param."""
    step = ".step param rlod list 1 2"
    (warning,) = deck("R1 a 0 {rload}", ".param rload=1", step).warnings
    assert (warning.code, warning.span.line) == ("NS1083", 4)
    assert "rload" in warning.hint
    assert len(deck("R1 a 0 1", step, params={"rlod": 2.0}).warnings) == 1
    assert not deck("R1 a 0 {rlod}", step).warnings
    assert not deck("R1 a 0 {x}", params={"x": 7}).warnings
    assert not deck(".param unused=1", "R1 a 0 1", params={"unused": 7}).warnings


def test_loops_are_named_once() -> None:
    with pytest.raises(NetlistError) as caught:
        deck("R1 a 0 {a}", ".param a={b} b={c} c={a}")
    (found,) = caught.value.diagnostics
    assert found.code == "NS1030"
    assert "a -> b -> c -> a" in found.message


def test_a_later_definition_wins_with_a_warning() -> None:
    found = deck(".param r=1", ".param r=2", "R1 a 0 {r}")
    assert values(found) == {"r1": 2.0}
    assert [w.code for w in found.warnings] == ["NS1032"]


def test_functions() -> None:
    found = deck(
        ".func sq(x) {x*x}", ".func hyp(a,b) 'sqrt(sq(a)+sq(b))'", ".param f(y)={y+k}",
        ".param k=1", "R1 a 0 {hyp(3,4)}", "R2 a 0 {f(1)}", "B1 a 0 V=sq(v(a))",
    )  # fmt: skip
    assert values(found) == {"r1": 5.0, "r2": 2.0, "b1": "sq(v(a))"}
    value = found.elements[2].value
    assert isinstance(value, Expression)
    assert value.evaluate({"v(a)": 3.0}) == 9.0
    assert value.derivative("v(a)").evaluate({"v(a)": 3.0}) == 6.0


def test_functions_of_the_deck_hide_built_in_ones() -> None:
    assert values(deck(".func limit(a,b) {a+b}", "R1 a 0 {limit(1,2)}")) == {"r1": 3.0}


def test_function_mistakes() -> None:
    assert codes(".func f(x) {f(x)}", "R1 a 0 {f(1)}") == ["NS1031"]
    assert codes(".func f(x) {x}", "R1 a 0 {f(1,2)}") == ["NS1022"]
    # not that r1 is no parameter
    assert codes("R1 a 0 1", ".tran 1 2", ".meas w avg 2*p(r1)") == ["NS1022"]
    assert codes("R1 a 0 1", ".tran 1 2", ".meas w avg power(r1)") == ["NS1022"]
    assert codes(".func f {x}", "R1 a 0 1") == ["NS1080"]


SUB = (
    ".subckt cell a b r=1k params: c=1u",
    "R1 a m {r*k}",
    "C1 m b {c}",
    ".param k=2",
    ".ends cell",
)


def test_subcircuits() -> None:
    found = deck("X1 in 0 cell r={z}", ".param z=5", "X2 in out cell params: c=2u", *SUB)
    assert values(found) == {"x1.r1": 10.0, "x1.c1": 1e-6, "x2.r1": 2000.0, "x2.c1": 2e-6}
    assert [e.nodes for e in found.elements] == [
        ("in", "x1.m"), ("x1.m", "0"), ("in", "x2.m"), ("x2.m", "out"),
    ]  # fmt: skip
    assert found.elements[0].letter == "r"
    assert found.elements[0].span.line == 6


def test_nested_subcircuits_local_models_and_globals() -> None:
    found = deck(
        ".global vdd",
        "X1 p outer n=3",
        ".model dm D(vfwd=1)",
        "D0 p 0 dm",
        ".subckt outer p n=1",
        ".model dm D(vfwd={n})",
        ".subckt inner q r={n*2}",
        "D1 q vdd dm",
        "R1 q 0 {r}",
        "V1 q x 0",
        "F1 q 0 V1 2",
        "B1 q 0 I=v(q)*i(V1)+v(x)",
        ".ends",
        "Xi p inner",
        ".ends",
    )
    by_name = {e.name: e for e in found.elements}
    assert by_name["d0"].model.params["vfwd"].value == 1.0
    assert by_name["x1.xi.d1"].model.params["vfwd"].value == 3.0
    assert by_name["x1.xi.d1"].nodes == ("p", "vdd")
    assert by_name["x1.xi.r1"].value == 6.0
    assert by_name["x1.xi.f1"].controls == ("x1.xi.v1",)
    assert by_name["x1.xi.b1"].value.variables() == {"v(p)", "i(x1.xi.v1)", "v(x1.xi.x)"}


@pytest.mark.parametrize("rest", ["0 2N2222", "0 2N2222 2", "sub 2N2222 off", "0 2N2222 area=2"])
def test_a_substrate_before_a_model_that_starts_with_a_digit(rest: str) -> None:
    """LTspice writes the substrate of every transistor."""
    found = deck(f"Q1 c b e {rest}", ".model 2N2222 NPN(is=1f)").elements[0]
    assert len(found.nodes) == 4
    assert found.model.name == "2n2222"


def test_ground_inside_a_subcircuit() -> None:
    found = deck("X1 0 a s", ".subckt s p q", "B1 q GND V=v(q,p)+v(p)", ".ends")
    assert found.elements[0].nodes == ("a", "0")
    assert found.elements[0].value.variables() == {"v(a)"}


def test_ground_among_the_nodes_of_a_subcircuit() -> None:
    sub = (".subckt s in GND", "R1 in gnd 1", ".ends")
    found = deck("X1 a 0 s", "X2 a b s", *sub)
    assert [e.nodes for e in found.elements] == [("a", "0"), ("a", "0")]
    assert [(w.code, w.span.line) for w in found.warnings] == [("NS1045", 3)]


def test_instance_mistakes() -> None:
    assert codes("X1 in cell", *SUB) == ["NS1041"]
    assert codes("X1 in 0 cel", *SUB) == ["NS1040"]
    assert codes("X1 in 0 cell rr=1", *SUB) == ["NS1014"]
    assert codes("X1 in 0 cell r=hello", *SUB) == ["NS1010"]
    assert codes("X1 a b s", ".subckt s a b", "R1 a b 1") == ["NS1044"]
    assert codes("R1 a b 1", ".ends") == ["NS1044"]
    assert codes("R1 a b 1", ".subckt s a a", "R1 a a 1", ".ends") == ["NS1080"]
    assert codes("R1 a b 1", ".subckt s a", ".ends", ".subckt s b", ".ends") == ["NS1006"]
    same = deck("R1 a b 1", *2 * (".subckt s a", "R1 a 0 1", ".ends"))
    assert [w.code for w in same.warnings] == ["NS1006"]
    assert codes("X1 a s", ".subckt s a", "X1 a t", ".ends", ".subckt t a", "X1 a s", ".ends") == [
        "NS1042"
    ]


def test_mistakes_inside_a_subcircuit_are_reported_once() -> None:
    assert codes("X1 a s", "X2 a s", ".subckt s a", "R1 a 0 {zz}", ".ends") == ["NS1021"]


def test_models() -> None:
    found = deck("D1 a 0 Dx", ".model DX D(Ideal Vfwd=0.7, Ron = {r} type=npn)", ".param r=2")
    model = found.elements[0].model
    assert model is not None
    assert (model.name, model.type) == ("dx", "d")
    assert {k: p.value for k, p in model.params.items()} == {
        "ideal": 1.0, "vfwd": 0.7, "ron": 2.0, "type": "npn",
    }  # fmt: skip
    assert deck("D1 a 0 x", ".model x D").elements[0].model.params == {}
    assert deck("D1 a 0 x", ".model x D()").elements[0].model.params == {}
    assert deck("D1 a 0 x", ".model x D is=1e-14 n=1").elements[0].model.params["n"].value == 1.0
    assert deck("D1 a 0 x", ".model x D(v={i*2})").elements[0].model.params["v"].value.text == "i*2"
    assert codes("D1 a 0 x", ".model x D", ".model x D(is=1f)") == ["NS1061"]
    assert [w.code for w in deck("D1 a 0 x", ".model x D(n=2)", ".model X d n=2").warnings] == [
        "NS1061"
    ]
    assert codes("R1 a 0 1", ".model x") == ["NS1080"]
    assert codes("D1 a 0 x", ".model x ako:y D(is=1)") == ["NS1060"]
    for card in (".model x ako:y D(n=2)", ".model x ako:y (n=2)", ".model x ako: y n=2"):
        params = deck("D1 a 0 x", card, ".model y D(is=1f n=1)").elements[0].model.params
        assert {k: p.value for k, p in params.items()} == {"is": 1e-15, "n": 2.0}
    for card in (".model x D(Ron 1m Vfwd 0.7)", ".model x D {Ron=1m Vfwd=0.7}"):
        params = deck("D1 a 0 x", card).elements[0].model.params
        assert {k: p.value for k, p in params.items()} == {"ron": 1e-3, "vfwd": 0.7}


@pytest.mark.parametrize(("k", "value"), [(1, 1.0), (2, 2.0), (3, 3.0)])
def test_conditionals(k: int, value: float) -> None:
    found = deck(
        f".param k={k}", ".if (k == 1)", "R1 a 0 1", ".elseif k==2", ".param r=2", "R1 a 0 {r}",
        ".else", ".if (k > 2 && 1)", "R1 a 0 3", ".endif", ".endif",
    )  # fmt: skip
    assert values(found) == {"r1": value}


@pytest.mark.parametrize(
    ("card", "opener"), [(".ends", ".subckt"), (".endif", ".if"), (".else", ".if")]
)
def test_what_a_closing_card_lacks_is_named(card: str, opener: str) -> None:
    with pytest.raises(NetlistError) as caught:
        parse_text(f"closed\nR1 a 0 1\n{card}\n")
    assert caught.value.diagnostics[0].message == f"{card} without {opener}"


def test_conditional_mistakes() -> None:
    assert codes(".if 1", "R1 a 0 1") == ["NS1044"]
    assert codes("R1 a 0 1", ".endif") == ["NS1044"]
    assert codes("R1 a 0 1", ".else") == ["NS1044"]
    assert codes(".if {zz}", "R1 a 0 1", ".endif") == ["NS1021"]
    assert codes(".if 1", "R1 a 0 1", ".else", ".elseif 1", ".endif") == ["NS1044"]


def test_included_files(tmp_path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "main.net").write_text("main\nX1 a s\n.include sub/Parts.lib\n.inc 'sub/b.inc'\n")
    (tmp_path / "sub" / "Parts.lib").write_text(".subckt s a\nR1 a 0 1\n.ends\n.include more.inc\n")
    (tmp_path / "sub" / "more.inc").write_text("R2 a 0 2\n.end\nR9 a 0 9")
    (tmp_path / "sub" / "b.inc").write_text("R3 a 0 {1+}")
    with pytest.raises(NetlistError) as caught:
        parse_file(tmp_path / "main.net")
    assert caught.value.file.endswith("b.inc")
    assert caught.value.line == 1
    (tmp_path / "sub" / "b.inc").write_text("R3 a 0 3")
    assert values(parse_file(tmp_path / "main.net")) == {"x1.r1": 1.0, "r2": 2.0, "r3": 3.0}


@pytest.mark.parametrize(
    "path",
    [
        "C:\\Program Files (x86)\\LTC\\LTspiceIV\\lib\\cmp\\standard.dio",
        '"/Users/a b/Library/Application Support/LTspice/lib/cmp/standard.bjt"',
    ],
)
def test_the_catalogue_that_ltspice_names(path: str) -> None:
    """A netlist that brings its own models runs without it."""
    found = deck("D1 a 0 dm", ".model D D", f".lib {path}", ".model dm D(is=1f)")
    assert [(w.code, w.span.column) for w in found.warnings] == [("NS1053", 6 + (path[0] == '"'))]
    with pytest.raises(NetlistError) as caught:
        deck("D1 a 0 dm", ".lib D:\\cmp\\standard.dio")
    assert caught.value.code == "NS1050"


def test_include_mistakes(tmp_path) -> None:
    (tmp_path / "loop.inc").write_text("R1 a 0 1\n.include loop.inc\n")
    for line, code in [
        (".include loop.inc", "NS1051"),
        (".include loup.inc", "NS1050"),
        (".include", "NS1050"),
        (f".include {tmp_path}", "NS1050"),
        (".include /dev/stdin", "NS1050"),
        (".include a\x00b", "NS1050"),
    ]:
        with pytest.raises(NetlistError) as caught:
            parse_text(f"title\n{line}\nR2 a 0 1", directory=tmp_path)
        assert caught.value.code == code
        if "loup" in line:
            assert "did you mean loop.inc?" in str(caught.value)


LIBRARY = """* a library
.lib typ
.param r=1
.endl typ
.lib 'slow'
.param r=2
.lib other.lib x
.endl slow
R7 a 0 7
"""


def test_libraries(tmp_path) -> None:
    (tmp_path / "m.lib").write_text(LIBRARY)
    (tmp_path / "other.lib").write_text(".lib x\n.param q=3\n.endl\n")
    found = parse_text("t\nR1 a 0 {r}\n.lib m.lib TYP", directory=tmp_path)
    assert values(found) == {"r1": 1.0}
    found = parse_text('t\nR1 a 0 {r*q}\n.lib "m.lib" slow', directory=tmp_path)
    assert values(found) == {"r1": 6.0}
    found = parse_text("t\n.lib m.lib", directory=tmp_path)
    assert values(found) == {"r7": 7.0}
    with pytest.raises(NetlistError) as caught:
        parse_text("t\nR1 a 0 1\n.lib m.lib typp", directory=tmp_path)
    assert caught.value.code == "NS1052"
    assert "did you mean typ?" in str(caught.value)


def test_temperature_in_parameters() -> None:
    found = deck(".temp 50", "R1 a 0 {temper}", "B1 a 0 V=temper*v(a)")
    assert found.temperature == 50.0
    assert found.elements[0].value == 50.0
    assert found.elements[1].value.variables() == {"temper", "v(a)"}
