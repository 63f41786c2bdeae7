"""Nodes and sources whose names are keywords of E, F, G and H lines."""

from __future__ import annotations

import pytest

from nsspice import read
from nsspice.netlist import Deck, NetlistError, parse_text

KEYWORDS = ["freq", "laplace", "poly", "table", "value", "vol", "cur"]
#: each is twice the voltage of the node in
FORMS = [
    "POLY(1) in 0 0 2",
    "POLY 1 in 0 2",
    "poly ( 1 ) (in,0) 0 2",
    "VALUE={2*v(in)}",
    "VALUE = 2*v(in)",
    "VALUE 2*v(in)",
    "value {2*v(in)}",
    "value v(in) * 2",
    "TABLE {v(in)} = (0,0) (9,18)",
    "TABLE {v(in)} 0 0 9 18",
    "in 0 table=(0,0,9,18)",
    "in 0 {1+1}",
    "in 0 gain=2",
]


def deck(*lines: str) -> Deck:
    return parse_text("title\nV1 in 0 5\nR1 in 0 1k\n" + "\n".join(lines))


@pytest.mark.parametrize("name", KEYWORDS)
@pytest.mark.parametrize("given", ["2", "{1+1}", "gain=2", "(2)"])
def test_a_node_may_have_the_name_of_a_keyword(name: str, given: str) -> None:
    lines = f"title\nV1 {name} 0 5\nE1 a 0 {name} 0 {given}\nG1 0 b {name} a {given} m=1\n"
    solution = read(f"{lines}R1 a 0 1k\nR2 b 0 1\n.op\n").run()[0]
    assert float(solution["v(a)"][0]) == pytest.approx(10.0)
    assert float(solution["v(b)"][0]) == pytest.approx(-10.0)


@pytest.mark.parametrize("name", ["value", "vol"])
def test_a_source_may_have_the_name_of_a_keyword(name: str) -> None:
    found = deck(f"{name} x 0 1", "R2 x 0 1k", f"F1 0 y {name} 2", "R3 y 0 1")
    source = next(e for e in found.elements if e.name == "f1")
    assert (source.controls, source.value) == ((name,), 2.0)


def test_tables_of_nodes_with_such_names() -> None:
    found = read("title\nV1 poly 0 5\nE1 a 0 poly 0 table=(0,0,9,18)\nR1 a 0 1\n.op\n").run()[0]
    assert float(found["v(a)"][0]) == pytest.approx(10.0)


@pytest.mark.parametrize("form", FORMS)
def test_forms_are_read_as_before(form: str) -> None:
    text = f"title\nV1 in 0 5\nE1 a 0 {form}\nR1 a 0 1k\n.op\n"
    assert float(read(text).run()[0]["v(a)"][0]) == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("form", "code"),
    [
        ("FREQ {V(in)} = (1,0,0) (1k,-3,90)", "NS1002"),
        ("LAPLACE {V(in)} = {exp(-s)}", "NS1002"),
        ("laplace", "NS1080"),
    ],
)
def test_transfer_functions_are_still_named(form: str, code: str) -> None:
    with pytest.raises(NetlistError) as caught:
        deck(f"E1 a 0 {form}", "R2 a 0 1")
    assert [d.code for d in caught.value.diagnostics] == [code]
