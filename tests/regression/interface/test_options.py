"""Options that are read change what is computed; others are warned about, with their place."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.netlist.cards.options import CHANGING, FOREIGN, FORMS, OWN

RECTIFIER = """junction and RC
V1 a 0 SIN(0 5 1k)
D1 a b dj
R1 b 0 1k
C1 b 0 1u
.model dj D(IS=1e-12)
.tran 10u 2m
"""
INDUCTIVE = RECTIFIER.replace("C1 b 0 1u", "L1 b 0 10m")
LINEAR = "RC\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.tran 10u 1m\n"
#: a resistance of a temperature coefficient, a current through a junction
WARM = "warm\nI1 0 a 1m\nD1 a 0 dj\nR1 a 0 1k TC1=1e-2\n.model dj D(IS=1e-12)\n.op\n"
#: drain current of a transistor whose card says nothing of its size
MOSFET = """transistor
V1 d 0 5
V2 g 0 {level}
R1 d e 100
C1 e 0 1n
M1 e g 0 0 n
.model n NMOS(VTO=1 KP=1e-4 LAMBDA=0.1 CJ=1e-3 CJSW=1e-9 CGDO=1e-9 RSH=50)
.tran 10n 1u
"""
FOLLOWED = "path\nV1 a 0 SIN(0 2 1k)\nR1 a b 1k\nD1 b 0 dj\n.model dj D(IS=1e-9)\n.tran 2u 1m\n"

#: deck, what it says of the option, and the option that it is compared with (nothing: none)
CASES = {
    "abstol": (INDUCTIVE, "reltol=1e-8 abstol=1e-3", "reltol=1e-8"),
    "vntol": (RECTIFIER, "reltol=1e-8 vntol=1e-2", "reltol=1e-8"),
    "reltol": (RECTIFIER, "reltol=1e-2", ""),
    "order": (RECTIFIER, "order=2", ""),
    "accuracy": (RECTIFIER, "accuracy=energy", ""),
    "maxstep": (RECTIFIER, "maxstep=1u", ""),
    "method": (LINEAR, "method=moreau", ""),
    "step": (LINEAR, "method=moreau step=1u", "method=moreau"),
    "theta": (LINEAR, "theta=0.5", "theta=1"),
    "temp": (WARM, "temp=100", ""),
    "tnom": (WARM, "tnom=80", ""),
    "defl": (MOSFET, "defl=10u", ""),
    "defw": (MOSFET, "defw=10u", ""),
    "defad": (MOSFET, "defad=1e-8", ""),
    "defas": (MOSFET, "defas=1e-8", ""),
    "junctions": (RECTIFIER, "junctions=lines:0.05", ""),
    "mosfet": (MOSFET, "mosfet=switch", ""),
    "vgson": (MOSFET, "mosfet=switch vgson=10", "mosfet=switch"),
    "correctors": (
        FOLLOWED,
        "method=euler-newton correctors=5",
        "method=euler-newton correctors=3",
    ),
}


def _run(deck: str, options: str) -> nsspice.Solution:
    text = deck.replace("{level}", "4") + (f".options {options}\n" if options else "")
    return nsspice.read(text).run(on_failure="ignore")[0]


def test_there_is_a_case_for_every_option_that_is_read() -> None:
    assert set(CASES) == OWN


@pytest.mark.parametrize("name", sorted(CASES))
def test_an_option_changes_the_solution(name: str) -> None:
    deck, with_it, without = CASES[name]
    one, other = _run(deck, without), _run(deck, with_it)
    assert not any(w.code in ("NS1081", "NS4052") for w in other.warnings)
    steps = [solution.stats.get("steps") for solution in (one, other)]
    same = all(np.array_equal(one[n], other[n]) for n in one.signals if n in other.signals)
    assert not same or steps[0] != steps[1]


@pytest.mark.parametrize("name", sorted(FOREIGN | set(CHANGING)))
def test_an_option_of_other_programs_is_warned_about(name: str) -> None:
    found = nsspice.read(LINEAR + f".options acct {name}=7\n").deck.warnings
    assert [w.code for w in found] == ["NS1003" if name in CHANGING else "NS4052"]
    assert name in found[0].message
    place = found[0].span
    assert place is not None
    assert (place.line, place.column) == (6, 15)


@pytest.mark.parametrize("name", ["h", "hmax", "tol", "engine", "points", "seed", "events"])
def test_an_unknown_option_is_warned_about(name: str) -> None:
    (found,) = nsspice.read(LINEAR + f".options {name}=7\n").deck.warnings
    assert (found.code, found.span.line, found.span.column) == ("NS1081", 6, 10)


@pytest.mark.parametrize("name", sorted(FORMS))
def test_how_other_programs_print_is_not_worth_a_word(name: str) -> None:
    assert nsspice.read(LINEAR + f".options {name}\n").deck.warnings == []


def test_a_step_of_the_deck_is_that_of_the_call() -> None:
    """3 ms in steps of 1 us are 3000 steps: implicit Euler's values, by its recurrence."""
    deck = "RC\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u IC=0\n.tran 50u 3m uic\n"
    text = deck + ".options method=moreau step=1u\n"
    (solution,) = nsspice.read(text).run()
    assert solution.stats["steps"] == 3000
    assert solution["v(b)"][-1] == pytest.approx(1.0 - (1.0 + 1e-3) ** -3000, rel=1e-11)
    called = nsspice.tran(nsspice.read(deck), method="moreau", step=1e-6, uic=True)
    assert np.array_equal(called["v(b)"], solution["v(b)"])
    longer = nsspice.tran(nsspice.read(text), step=2e-6)
    assert longer.stats["steps"] == 1500


@pytest.mark.parametrize("option", ["step=0", "step=-1u", "maxstep=0", "maxstep=-1"])
def test_a_step_that_is_none(option: str) -> None:
    with pytest.raises(nsspice.UsageError, match="NS4005") as caught:
        nsspice.read(LINEAR + f".options {option}\n").run()
    assert caught.value.diagnostics[0].span.line == 6


@pytest.mark.parametrize("option", ["step=fast", "maxstep=fast"])
def test_a_step_that_is_no_number(option: str) -> None:
    with pytest.raises(nsspice.NetlistError, match="NS1010"):
        nsspice.read(LINEAR + f".options {option}\n")
