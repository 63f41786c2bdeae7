"""One mistake is one error: what rests on a line that cannot be read is not reported again."""

from __future__ import annotations

import pytest

from nsspice.netlist import NetlistError, parse_text


def codes(*lines: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        parse_text("title\n" + "\n".join(lines))
    return [d.code for d in caught.value.diagnostics]


def test_a_broken_model_is_not_missed() -> None:
    broken = ".model q npn(br=50 br=0.1)"
    assert codes(broken, "Q1 a b 0 q", "Q2 a b 0 q", "R1 a b 1") == ["NS1014"]
    # a name that stands nowhere in the broken line is missing nevertheless
    assert codes(broken, "Q1 a b 0 q", "Q2 a b 0 p") == ["NS1014", "NS1060"]
    inner = (".subckt s a b", ".model d d(is=1 is=2)", "D1 a b d", ".ends")
    assert codes(*inner, "X1 1 0 s", "X2 1 0 s", "V1 1 0 {v(x1.d1)}") == ["NS1014", "NS1025"]


def test_a_broken_definition_is_not_missed() -> None:
    assert codes(".subckt s a a", "R1 a 0 1", ".ends", "X1 b 0 s") == ["NS1080"]
    assert codes(".param x={1+}", "R1 a 0 {x}", ".param y={2*x}", "R2 a 0 {y}") == ["NS1020"]
    assert codes(".func f(x) {x+}", "R1 a 0 {f(1)}") == ["NS1020"]


def test_a_condition_without_value_hides_its_branches() -> None:
    lines = (".if (nobody)", ".model d d", ".param r=1", ".else", "L2 a 0 1", ".endif")
    assert codes(*lines, "D1 a 0 d", "R1 a 0 {r}", ".ic i(L2)=1") == ["NS1021"]


def test_branches_not_taken_are_not_judged() -> None:
    deck = parse_text(
        "title\n.if (0)\nM1 a 0 0 0 mm\nI1 0 1 AM 1 2 3 4 5 6 7 8\nR9 1 0 {1/0}\n.nonsense\n"
        ".model x d(is=\n.if (1)\nQ\n.endif\n.else\nR1 1 0 1\n.endif\nV1 1 0 1\n"
    )
    assert [element.name for element in deck.elements] == ["r1", "v1"]
    assert codes(".if (1)", "N1 a 0 0 0 mm", ".else", "R1 1 0", ".endif") == ["NS1005"]


def test_branches_are_chosen_in_each_instance() -> None:
    deck = parse_text(
        "title\n.subckt s a k=1\n.if (k = 1)\nR1 a 0 1\n.elseif (k=2)\nR1 a 0 2\n.endif\n.ends\n"
        "X1 a s\nX2 a s k=2\nX3 a s k=1\nV1 a 0 1\n"
    )
    assert [element.value for element in deck.elements[:3]] == [1.0, 2.0, 1.0]


def test_a_missing_parenthesis_on_a_model_is_a_warning() -> None:
    deck = parse_text("title\nQ1 a b 0 qp\n.model qp npn (bf=20\n+ tr=1n ; end\nR1 a b 1\n")
    assert deck.elements[0].model.params["tr"].value == 1e-9
    assert [(w.code, w.span.line, w.span.column) for w in deck.warnings] == [("NS1003", 4, 7)]
    assert codes(".model q npn(bf=20", "n=2)", "R1 a 0 1") == ["NS1005"]


def test_a_parenthesis_too_many_on_a_model_is_a_warning() -> None:
    """SPICE reads over it: ngspice's own example of a timer has one."""
    deck = parse_text("title\nQ1 a b 0 qp\n.model qp npn (bf=20\n+ cje=1p tr=1n) )\nR1 a b 1\n")
    assert deck.elements[0].model.params["tr"].value == 1e-9
    assert [(w.code, w.span.line, w.span.column) for w in deck.warnings] == [("NS1003", 4, 17)]
    quoted = parse_text('title\nD1 a 0 d\n.model d d(mfg="a)(b)" is={1f*(2)})\nR1 a 0 1\n')
    assert not quoted.warnings
    assert codes(".model qp npn (bf=20)) x=1", "R1 a 0 1") == ["NS1007"]
    source = parse_text("title\nV1 a 0 SIN(0 1 1k))\nR1 a 0 1\n")
    assert [w.code for w in source.warnings] == ["NS1003"]
    assert codes("R1 a 0 {2*(1+1}", "V1 a 0 1") == ["NS1020"]


def test_nothing_is_missed_of_a_file_that_could_not_be_included() -> None:
    rest = ("D1 a 0 dx", "X1 a 0 amp", "R1 a 0 {load}", ".ic v(inner)=1", "F1 a 0 vsense 2")
    assert codes(".include parts-that-are-not-here.lib", *rest) == ["NS1050"]
    assert codes(".include parts-that-are-not-here.lib", *rest, "R2 a") == ["NS1050", "NS1008"]
