"""One run tells all that is wrong with a deck, whatever kind of mistake it is."""

from __future__ import annotations

from pathlib import Path

import pytest

DECK = """many mistakes
V1 a 0 5
R1 a b 1 tc1=x
C1 b 0 -1u
V2 c 0 PULSE(0 1 0 -1u)
R2 c
.options reltol=abc tnom=x
.tran 1u 1m
"""


@pytest.mark.parametrize("command", ["run", "explain", "cost"])
def test_values_and_options_are_judged_beside_broken_lines(call, command):
    Path("many.net").write_text(DECK)
    result = call(command, "many.net")
    assert result.exit_code == 2
    told = [line for line in result.stderr.splitlines() if " error " in line]
    wanted = ["6:1 NS1008", "7:10 NS1010", "7:21 NS1010", "3:10 NS2005", "4:1 NS2005", "5:1 NS2011"]
    assert [f"{t.split(':', 1)[1].split(': error')[0]} {t.split()[2][:-1]}" for t in told] == wanted


def test_what_lines_say_together_waits_for_all_of_them(call):
    """The node c hangs in the air because R2 cannot be read: nothing is said of it."""
    Path("loop.net").write_text("loop\nV1 a 0 5\nV2 a 0 6\nI1 c 0 1\nR2 c\nF1 d 0 V9 1\n.op\n")
    result = call("run", "loop.net")
    assert [line.split()[2] for line in result.stderr.splitlines() if " error " in line] == [
        "NS1008:",
        "NS1070:",
    ]
