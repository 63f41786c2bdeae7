"""Resistances on the cards of junctions and transistors in series with a coil.

A blocking junction passes 1e-14 A.  Over 20 mOhm that is 2e-16 V, less than the rounding of the
voltages of its ends.  Taken from their difference the current was wrong by more than itself, the
coil followed it, and steps of attoseconds did not end.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

CHOKE = """half-wave rectifier with a choke
V1 in 0 SIN(0 24 48761)
L1 in a 16.03u
D1 a out DS
C1 out 0 18.3n IC=0
R1 out 0 294.2
.model DS D(IS=1e-14 N=1.2 RS=20m)
.tran 51n 41u uic
"""
RELAY = """relay: a transistor switches a coil, a diode takes over its current
V1 vcc 0 12
L1 vcc c 100m
R1 c cc 100
Q1 cc b 0 QN
D1 c vcc DF
Rb in b 4.7k
Vin in 0 PULSE(0 5 1m 1u 1u 5m 20m)
.model QN NPN(IS=1e-14 BF=200 RC=0.5 RB=10 RE=0.1)
.model DF D(IS=1e-12 RS=50m)
.tran 50u 20m
"""


def rewritten(deck: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert old in deck
        deck = deck.replace(old, new)
    return deck


#: the same resistances as elements, where the coil does not depend on their small differences
PAIRS = {
    "choke": (
        CHOKE,
        rewritten(CHOKE, ("L1 in a", "L1 in b"), (" RS=20m)", ")\nRs b a 20m")),
        ("i(l1)", "v(out)"),
    ),
    "relay": (
        RELAY,
        rewritten(
            RELAY,
            (" RC=0.5 RB=10 RE=0.1)", ")"),
            ("R1 c cc 100", "R1 c cc 100.5"),
            ("4.7k", "4.71k"),
            ("Q1 cc b 0", "Re e 0 0.1\nQ1 cc b e"),
            ("D1 c vcc", "D1 c f"),
            (" RS=50m)", ")\nRf f vcc 50m"),
        ),
        ("i(l1)", "v(c)"),
    ),
}


@pytest.mark.parametrize("name", PAIRS)
def test_on_the_card_or_as_an_element(name: str) -> None:
    card, element, signals = PAIRS[name]
    circuits = [nsspice.read(text) for text in (card, element)]
    runs = [nsspice.tran(circuit, method="sdirk", reltol=1e-7) for circuit in circuits]
    for run in runs:
        assert run.certificate.passed
        assert run.stats["steps"] < 4000
    for signal in signals:
        error = np.abs(runs[0][signal] - runs[1][signal])
        # rows at edges err by the slope there, so the mean; errors of some hundred steps add up
        assert error.mean() < 1e-5 * np.ptp(runs[1][signal])


@pytest.mark.parametrize("ohms", ["20m", "1", "1n"])
@pytest.mark.parametrize("start", ["", " uic"])
def test_ends_by_default(ohms: str, start: str) -> None:
    deck = rewritten(CHOKE, ("RS=20m", f"RS={ohms}"), (" uic", start))
    run = nsspice.tran(nsspice.read(deck))
    assert run.certificate.passed
    assert run.stats["steps"] < 2000
    # the coil carries what the junction does, while it blocks, too
    blocks = run["v(a)"] < run["v(out)"] - 2.0
    assert blocks.any()
    assert np.abs(run["i(l1)"][blocks] + 1e-14).max() < 1e-5 * np.abs(run["i(l1)"]).max()
    difference = np.abs(run["i(d1)"] - run["i(l1)"])
    assert difference.max() < 1e-9 * np.abs(run["i(l1)"]).max()
