"""Rectifiers, clamps and converters over decades of their values: certified, right at every row.

A sample of the grid runs every day, ``-m soak`` runs all of it.  Whether the rows are right is the
word of the judge of rows, which sees nothing but them and the deck.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.textbook_circuits import CIRCUITS, textbook_deck
from oracle.rows.flat_deck import FlatDeck, read
from oracle.rows.judge import violations
from oracle.rows.written import FLOOR, Rows

import nsspice

#: decks of the soak
MOST = 2_500
#: a deck of each circuit and some others, by number; in those of the second list the current of a
#: closed diode is the difference of two potentials over a millionth of the load or less
EVERY_DAY = (*range(len(CIRCUITS)), *range(40, 2000, 79))
STIFF = (34, 107, 112, 125, 159, 213, 233, 253, 312, 336, 362, 1368)
#: part of its range that a law may be missed by in a row, as the own tests of the judge have it
MISSED = 1e-6
#: laws of an element at one row: what needs no quadrature between rows
AT_A_ROW = ("KCL", "source", "resistor", "diode", "switch", "gate")
#: of a potential that a solution of some ten equations is known to: elimination leaves 24 N u
KNOWN = 24 * 10 * 0.5 * float(np.finfo(np.float64).eps)


def known(deck: FlatDeck, rows: Rows) -> float:
    """Return the part of a current that potentials tell, of a diode with a resistance.

    It is their difference over the resistance, however the potentials are written.
    """
    diodes = [e for e in deck.elements if e.letter == "d"]
    ohms = max(e.model.card.get("ron", 0.0) if e.model else 0.0 for e in diodes)
    if ohms == 0.0:
        return 0.0
    least = min(float(np.abs(rows.columns[f"i({e.name})"]).max()) for e in diodes)
    return KNOWN * rows.volts / ohms / max(least, FLOOR * rows.amperes)


def largest_violation(text: str, solution: nsspice.Solution) -> tuple[float, str]:
    """Return the largest violation of a law at a row beyond what is known of it, and which."""
    deck = read(text)
    rows = Rows({"time": solution.time, **{name: solution[name] for name in deck.signals()}})
    found = [v for v in violations(text, rows) if v.law in AT_A_ROW]
    size, law = max(((v.size, f"{v.law} {v.element}") for v in found), default=(0.0, ""))
    return size - known(deck, rows), law


def certified(number: int) -> tuple[str, nsspice.Solution]:
    text = textbook_deck(number)
    circuit = nsspice.read(text)
    return text, nsspice.tran(circuit, signals=list(read(text).signals()), all_points=True)


@pytest.mark.parametrize("number", [*EVERY_DAY, *STIFF])
def test_textbook_circuits_are_certified(number):
    text, solution = certified(number)
    assert solution.certificate.passed, text
    size, law = largest_violation(text, solution)
    assert size <= MISSED, (law, text)


@pytest.mark.soak
@pytest.mark.parametrize("first", range(0, MOST, 50))
def test_all_of_the_grid(first):
    for number in range(first, first + 50):
        text, solution = certified(number)
        assert solution.certificate.passed, text
