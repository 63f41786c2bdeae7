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
        ("Q1 a b 0 BC547", "NS1060", "add .model bc547"),
        (".tran 1u 1m startup uic", "NS1002", "uic to start from zero"),
        (".tran 1u 1m steady", "NS1002", "stop time"),
        ("S1 a 0 c 0 s\n.model s vswitch(von=1 vhon=.6 voff=0)", "NS2008", "leave it out"),
    ],
)
def test_what_to_do(lines: str, code: str, words: str) -> None:
    with pytest.raises(NetlistError) as caught:
        read(f"t\nV1 a 0 1\nR1 a b 1\n{lines}\n")
    assert caught.value.code == code
    assert words in str(caught.value)
