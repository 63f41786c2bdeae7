"""What to do next is told for what other simulators write."""

from __future__ import annotations

import pytest

from nsspice import read
from nsspice.netlist import NetlistError


@pytest.mark.parametrize(
    ("lines", "code", "words"),
    [
        ("D1 a 0 dd\n.param k=2\n.model dd D(is=1f n=1.3*k)", "NS2005", "braces: n={1.3*k}"),
        ("D1 a 0 dd\n.model dd D(is=1f n=abc)", "NS2005", "expression of parameters"),
        ("D1 a 0 D", "NS1060", "add .model d d"),
        ("Q1 a b 0 NPN", "NS1060", "add .model npn npn"),
        ("Q1 a b 0 BC549C", "NS1060", "add .model bc549c"),
        ("S1 a 0 c 0 s\n.model s vswitch(von=1 vhon=.6 voff=0)", "NS2008", "remove it"),
    ],
)
def test_what_to_do(lines: str, code: str, words: str) -> None:
    with pytest.raises(NetlistError) as caught:
        read(f"t\nV1 a 0 1\nR1 a b 1\n{lines}\n")
    assert caught.value.code == code
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("D1 a 0 dd\n.model dd D(IS=10F)", "write 10f for femto"),
        ("D1 a 0 dd\n.model dd D(CJO=10F)", "write 10 for farads, 10f for femto"),
        ("Q1 a a 0 qq\n.model qq NPN(ISE=10F)", "write 10f for femto"),
        ("R2 b 0 10F", "write 10f for femto"),
        ("L2 b 0 1 Cpar=10F", "write 10 for farads, 10f for femto"),
        ("C2 b 0 10F", "write 10 for farads, 10f for femto"),
        ("C2 b 0 cc 1\n.model cc C(TC1=10F)", "write 10f for femto"),
    ],
)
def test_what_a_capital_f_may_stand_for(line: str, hint: str) -> None:
    warnings = read(f"t\nV1 a 0 1\nR1 a b 1\nR9 b 0 1\n{line}\n").warnings
    (found,) = [w for w in warnings if w.code == "NS1011"]
    assert "10F is read as 1e-14" in found.message
    assert found.hint == hint


@pytest.mark.parametrize("unit", ["MHO", "MHOS", "A", "AMPS"])
def test_milli_before_units_that_nobody_has_mega_of(unit: str) -> None:
    circuit = read(f"t\nV1 a 0 1\nG1 a 0 a 0 24.8M{unit}\n")
    assert not circuit.warnings
    assert circuit.deck.elements[1].value == 0.0248


def test_gmin_is_not_dropped_in_silence() -> None:
    (found,) = read("t\nV1 a 0 1\nR1 a 0 1\n.options gmin=1n\n").warnings
    assert found.message == "option gmin is ignored"
    assert "across every junction" in found.hint


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (1, "the substrate of q1 carries no current"),
        (2, "the substrates of q1 and 1 more transistor carry no current"),
        (9, "the substrates of q1 and 8 more transistors carry no current"),
    ],
)
def test_idle_substrates_are_told_once(count: int, words: str) -> None:
    lines = "".join(f"Q{k} a a 0 s qq\n" for k in range(1, count + 1))
    circuit = read(f"t\nV1 a 0 1\nR1 a s 1\nR2 s 0 1\n{lines}.model qq NPN\n")
    (found,) = circuit.warnings
    assert found.code == "NS2052"
    assert words in found.message
