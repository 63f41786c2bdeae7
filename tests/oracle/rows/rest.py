"""The start of a transient from the DC state, in which nothing is being charged."""

from __future__ import annotations

import numpy as np

from .flat_deck import FlatDeck
from .sources import changes_at_start
from .storage import Store
from .written import Rows, Violation


def at_rest(deck: FlatDeck, rows: Rows, caps: list[Store], coils: list[Store]) -> list[Violation]:
    """Return currents of capacitors and voltages of inductors at a start from the DC state.

    Where a source moves or jumps at the start they are not zero right after it.
    """
    moving = any(changes_at_start(e, deck) for e in deck.elements if e.letter in "vi")
    timed = any("time" in e.rest for e in deck.elements)
    if deck.uic or moving or timed:
        return []
    out: list[Violation] = []
    for law, stores, kind in (("rest", caps, "i"), ("rest", coils, "v")):
        for s in stores:
            size = abs(float(s.rate[0])) / rows.scale_of(s.rate, kind)
            out.append(
                Violation(
                    law, s.element.name, float(rows.time[0]), float(np.nan_to_num(size, nan=np.inf))
                )
            )
    return out
