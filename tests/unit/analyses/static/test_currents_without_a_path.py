"""Currents that no junction carries: the search runs to teravolts, and the message says where."""

from __future__ import annotations

import pytest

import nsspice

BASE = """nothing can carry 1 uA out of the base
V1 c 0 5
Q1 c b 0 QN
I1 0 b -1u
.model QN NPN
.op
"""


def message_of(deck: str) -> str:
    with pytest.raises(nsspice.NsspiceError) as error:
        nsspice.read(deck).run()
    assert error.value.code == "NS3004"
    return str(error.value)


def test_the_node_whose_voltage_runs_away_is_named() -> None:
    message = message_of(BASE)
    assert "node b (q1 and i1)" in message
    assert "v(b) is -1" in message
    assert "put a resistor from there to ground" in message


def test_the_advice_helps() -> None:
    point = nsspice.read(BASE.replace(".op", "R1 b 0 1MEG\n.op")).run()[0]
    assert point["v(b)"][0] == pytest.approx(-1.0, rel=1e-6)


def test_a_law_without_a_root_gets_no_such_advice() -> None:
    message = message_of("no root\nB1 a 0 I={v(a)*v(a) + 1}\nR1 a 0 1e12\n.op\n")
    assert "resistor" not in message
    assert "nodeset" in message


def test_a_law_without_a_finite_value_is_told_in_words() -> None:
    message = message_of(
        "no value\nB1 a 0 V={1/v(b)}\nR1 a b 1\nR2 b 0 1\n"
        "B2 c 0 V={sqrt(-1-v(a)*v(a))}\nR3 c 0 1\n.op\n"
    )
    assert "has no finite value at any point tried" in message
    assert "inf" not in message.replace("finite", "")
