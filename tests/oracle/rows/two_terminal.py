"""Algebraic equations of resistors, sources, controlled sources and expressions."""

from __future__ import annotations

from functools import partial

import numpy as np

from .expressions import Expression
from .flat_deck import Element, FlatDeck, Unreadable, number
from .sources import limits
from .written import FLOOR, Floats, Rows, Violation

#: by how much comparisons are moved for rows at the instant at which they change
THRESHOLD = 1e-9


def resistor(element: Element, rows: Rows) -> list[Violation]:
    """Return how far v = R i is missed, as a share of the current's range.

    A current is told from the difference of node voltages; what rounding leaves of it, FLOOR of the
    largest voltage times the conductance, is added to the range.
    """
    v, i = rows.voltage(*element.nodes), rows.current(element.name)
    ohms = number(element.words[0])
    if i is None:
        return []
    if ohms == 0.0:
        return rows.worst("resistor", element.name, np.abs(v) / rows.volts)
    scale = rows.scale_of(i, "i") + 0.1 * FLOOR * rows.volts / abs(ohms)
    return rows.worst("resistor", element.name, np.abs(i - v / ohms) / scale)


def independent(element: Element, rows: Rows, deck: FlatDeck) -> list[Violation]:
    """Return how far a source is from its waveform."""
    kind = element.letter
    shown = rows.voltage(*element.nodes) if kind == "v" else rows.current(element.name)
    if shown is None:
        return []
    low, high = limits(element, deck, rows.time)
    scale = rows.scale_of(np.maximum(np.abs(low), np.abs(high)), kind)
    return rows.worst("source", element.name, np.maximum(low - shown, shown - high) / scale)


def controlled(element: Element, rows: Rows, stepped: bool) -> list[Violation]:
    """Return how far E, F, G, H or B is from what controls it; fixed steps compare late."""
    wanted = _wanted(element, rows, stepped)
    letter = element.letter
    voltage = letter in "eh" or (letter == "b" and "v" in element.settings)
    shown = rows.voltage(*element.nodes) if voltage else rows.current(element.name)
    if shown is None or not wanted:
        return []
    kind = "v" if voltage else "i"
    errors = [np.abs(shown - w) / max(rows.scale_of(shown, kind), rows.scale_of(w, kind))
              for w in wanted]  # fmt: skip
    return rows.worst("controlled source", element.name, np.minimum.reduce(errors))


def _wanted(element: Element, rows: Rows, stepped: bool) -> list[Floats]:
    """Return what a controlled source may show; two values within rounding of a comparison."""
    settings, words = element.settings, element.words
    text = next((settings[k] for k in ("v", "i", "value") if k in settings), None)
    if text is not None:
        text = element.rest.split("=", 1)[1]
        find = partial(lookup, rows)
        ways = [(0.0, False), (THRESHOLD, False), (-THRESHOLD, False), (0.0, True)]
        out = [Expression(text, find, *way).value() for way in ways[: 3 + stepped]]
        return [np.broadcast_to(np.asarray(x), rows.time.shape) for x in out]
    if element.letter in "eg":
        return [number(words[2]) * rows.voltage(words[0], words[1])]
    if element.letter in "fh":
        control = rows.current(words[0])
        return [] if control is None else [number(words[1]) * control]
    raise Unreadable(f"{element.name}: {element.rest}")


def lookup(rows: Rows, name: str, arguments: list[str]) -> Floats:
    """Return a signal that an expression names."""
    if name == "v":
        return rows.voltage(*arguments)
    if name == "i":
        found = rows.current(arguments[0])
        if found is not None:
            return found
    if name == "time":
        return rows.time
    raise Unreadable(f"{name}({','.join(arguments)}) in an expression")
