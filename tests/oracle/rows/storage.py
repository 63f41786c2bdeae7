"""Charges and fluxes of a run, element by element, from its written voltages and currents."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .expressions import Expression
from .flat_deck import Element, FlatDeck, Unreadable, number
from .two_terminal import lookup
from .written import FLOOR, Floats, Rows


@dataclass(frozen=True)
class Store:
    """A capacitor (an inductor): its charge (flux), the current (voltage) that fills it, and the
    range in which it is judged."""

    element: Element
    content: Floats
    rate: Floats
    scale: float
    #: content before the run, from the initial values of elements
    initial: float


def capacitors(deck: FlatDeck, rows: Rows) -> list[Store]:
    """Return all capacitors whose currents were written."""
    out = []
    for e in deck.elements:
        i = rows.current(e.name)
        if e.letter == "c" and i is not None:
            v = rows.voltage(*e.nodes)
            start = e.setting("ic", 0.0)
            if "q" in e.settings:
                charge, before = _curve(e, rows, v), _curve(e, rows, np.array([start]))
                scale = max(float(np.abs(charge).max()), 1e-300)
            else:
                farad = number(e.words[0])
                charge, before = farad * v, np.array([farad * start])
                scale = farad * max(float(np.abs(v).max()), FLOOR * rows.volts)
            out.append(Store(e, charge, i, scale, float(before[0])))
    return out


def inductors(deck: FlatDeck, rows: Rows) -> list[Store]:
    """Return all inductors with the fluxes of what is coupled to them."""
    coils = [e for e in deck.elements if e.letter == "l" and rows.current(e.name) is not None]
    flux: dict[str, Floats] = {}
    before: dict[str, float] = {}
    least: dict[str, float] = {}
    henry: dict[str, float] = {}
    for e in coils:
        i, start = _current(rows, e), e.setting("ic", 0.0)
        if "flux" in e.settings:
            flux[e.name] = _curve(e, rows, i)
            before[e.name] = float(_curve(e, rows, np.array([start]))[0])
            least[e.name] = 1e-300
        else:
            henry[e.name] = number(e.words[0])
            flux[e.name], before[e.name] = henry[e.name] * i, henry[e.name] * start
            least[e.name] = henry[e.name] * FLOOR * rows.amperes
    for pair in (e for e in deck.elements if e.letter == "k"):
        if len(pair.rest.split()) != 1:
            raise Unreadable(f"{pair.name}: {pair.rest}")
        if not set(pair.nodes) <= set(henry):
            raise Unreadable(f"{pair.name}: couples what is not linear")
        one, other = (deck.named(n) for n in pair.nodes)
        mutual = number(pair.rest) * np.sqrt(henry[one.name] * henry[other.name])
        for a, b in ((one, other), (other, one)):
            flux[a.name] = flux[a.name] + mutual * _current(rows, b)
            before[a.name] += mutual * b.setting("ic", 0.0)
    stores = []
    for e in coils:
        # the parts of a flux cancel in a transformer: the range is that of its own part
        own = henry.get(e.name, 0.0) * float(np.abs(_current(rows, e)).max())
        scale = max(float(np.abs(flux[e.name]).max()), own, least[e.name])
        stores.append(Store(e, flux[e.name], rows.voltage(*e.nodes), scale, before[e.name]))
    return stores


def _current(rows: Rows, element: Element) -> Floats:
    found = rows.current(element.name)
    assert found is not None
    return found


def _curve(element: Element, rows: Rows, x: Floats) -> Floats:
    """Return the charge or flux that an expression of x gives."""
    text = element.rest.split("=", 1)[1]

    def find(name: str, arguments: list[str]) -> Floats:
        return x if name == "x" else lookup(rows, name, arguments)

    return np.broadcast_to(Expression(text, find).value(), x.shape).copy()
