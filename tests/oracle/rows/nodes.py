"""Kirchhoff's current law at every node, from the currents of all elements there."""

from __future__ import annotations

import numpy as np

from .flat_deck import FlatDeck
from .written import FLOOR, Rows, Violation


def kirchhoff(deck: FlatDeck, rows: Rows) -> list[Violation]:
    """Return the sum of currents at each node as a share of the largest current there."""
    total = {n: np.zeros_like(rows.time) for n in deck.nodes}
    largest = dict.fromkeys(deck.nodes, 0.0)
    unknown: set[str] = set()
    for element in deck.elements:
        if element.letter == "k":
            continue
        i = rows.current(element.name)
        # a sensed gate draws no current, any other third terminal does
        sensed = element.letter == "d" and element.model is not None and "vgt" in element.model.card
        ends = element.nodes[:2] if sensed else element.nodes
        if i is None or len(ends) != 2:
            unknown.update(ends)
            continue
        for node, sign in zip(ends, (1.0, -1.0), strict=True):
            if node != "0":
                total[node] = total[node] + sign * i
                largest[node] = max(largest[node], float(np.abs(i).max()))
    out: list[Violation] = []
    for node in total:
        if node not in unknown:
            scale = max(largest[node], FLOOR * rows.amperes)
            out += rows.worst("KCL", node, np.abs(total[node]) / scale)
    return out
