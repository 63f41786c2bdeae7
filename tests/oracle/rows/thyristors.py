"""Laws of ideal thyristors: blocked, or a diode until the current has come to zero."""

from __future__ import annotations

import numpy as np

from .diodes import Line, distance
from .flat_deck import Element
from .switching import CLEAR
from .written import Floats, Rows, Violation


def thyristor(element: Element, rows: Rows, lag: int = 0) -> list[Violation]:
    """Return how far a thyristor is from both states, and how it came to leave one.

    Only a card that senses the voltage from gate to cathode (``VGT``), without breakover or
    reverse breakdown, is judged.
    """
    model, i = element.model, rows.current(element.name)
    if element.letter != "d" or model is None or model.type != "scr" or i is None:
        return []
    if set(model.card) - {"vgt", "vh", "ron"} or "vgt" not in model.card or len(element.nodes) != 3:
        return []
    a, k, gate = element.nodes
    card, v = model.card, rows.voltage(a, k)
    line = Line(card.get("vh", 0.0), card.get("ron", 0.0))
    fired = distance(line, v, i, rows)
    blocked = np.abs(i) / rows.scale_of(i, "i")
    out = rows.worst("thyristor", element.name, np.minimum(fired, blocked))
    control = rows.voltage(gate, k)
    scale = max(float(np.abs(control).max()), abs(card["vgt"]), 1e-12)
    over = (control - card["vgt"]) / scale
    forward = (blocked <= CLEAR) & (fired > CLEAR) & (v > line.vfwd)
    error = np.where(forward, over, 0.0)
    for n in range(lag + 1):
        # a row at an instant of change may lie on either side
        error = np.minimum(error, np.concatenate([np.zeros(n + 1), np.maximum(over[: -n - 1], 0)]))
    out += rows.worst("gate", element.name, error)
    conducts = (i > CLEAR * rows.scale_of(i, "i")) & (fired <= CLEAR)
    return out + _turns(element.name, rows, conducts, forward, over, blocked, lag)


def _turns(
    name: str,
    rows: Rows,
    conducts: np.ndarray,
    forward: np.ndarray,
    over: Floats,
    current: Floats,
    lag: int,
) -> list[Violation]:
    """Return by how much the gate was short when it fired, and which current was cut off."""
    state = np.where(conducts, 1, np.where(forward, -1, 0))
    known = np.flatnonzero(state)
    fires, opens = np.zeros_like(rows.time), np.zeros_like(rows.time)
    for k in np.flatnonzero(np.diff(state[known])):
        p, q = known[k], known[k + 1]
        if state[p] == -1 and state[q] == 1:
            fires[q] = max(float(-over[p : q + 1].max()), 0.0)
        elif state[p] == 1 and state[q] == -1 and not lag:
            opens[q] = float(current[p : q + 1][: max(q - p, 1)].min())
    return rows.worst("firing", name, fires) + rows.worst("extinction", name, opens)
