"""All laws of a flat deck at all of its rows."""

from __future__ import annotations

from .diodes import diode
from .flat_deck import read
from .impulses import jumps, start
from .nodes import kirchhoff
from .quadrature import between_rows
from .rest import at_rest
from .storage import capacitors, inductors
from .switching import switch
from .thyristors import thyristor
from .two_terminal import controlled, independent, resistor
from .written import Rows, Violation


def violations(text: str, rows: Rows, *, stepped: bool = False) -> list[Violation]:
    """Return by how much each law is missed at most, largest first.

    Parameters
    ----------
    text : str
        A flat deck.
    rows : Rows
        All signals of ``FlatDeck.signals``, at the solver's own points and the deck's.
    stepped : bool
        Fixed steps by the implicit Euler formula: their sums replace integrals, and they see a
        control one step late.
    """
    deck = read(text)
    lag = int(stepped)
    out: list[Violation] = [Violation("order of rows", "", t, 1.0) for t in rows.turns_back]
    out += kirchhoff(deck, rows)
    for e in deck.elements:
        if e.letter == "r":
            out += resistor(e, rows)
        elif e.letter in "vi":
            out += independent(e, rows, deck)
        elif e.letter in "efghb":
            out += controlled(e, rows, stepped)
        elif e.letter in "sw":
            out += switch(e, rows, lag)
        elif e.letter == "d":
            out += diode(e, rows) + thyristor(e, rows, lag)
    caps, coils = capacitors(deck, rows), inductors(deck, rows)
    for store in caps + coils:
        out += between_rows(store, rows, stepped)
    out += start(deck, rows, caps, coils) + at_rest(deck, rows, caps, coils)
    out += jumps(deck, rows, caps, coils)
    return sorted(out, key=lambda v: -v.size)
