"""Values of independent sources at many instants, with both sides of steep edges.

Written from SPICE's manual (Nagel's argument lists); nothing of the package is used.
"""

from __future__ import annotations

import math
import re

import numpy as np

from .flat_deck import Element, FlatDeck, Unreadable, number
from .written import Floats

#: an edge lies within this share of the time beside the instant that a period's multiple gives
EDGE = 1e-13
_CALL = re.compile(r"(sin|pulse|pwl|exp|sffm|am)\s*\(([^)]*)\)")


def limits(element: Element, deck: FlatDeck, time: Floats) -> tuple[Floats, Floats]:
    """Return the least and the largest value of a source within rounding of each instant."""
    call = _CALL.search(element.rest)
    if call is None:
        words = [w for w in element.rest.split() if w != "dc"]
        level = np.full_like(time, number(words[0]) if words else 0.0)
        return level, level
    kind = call[1]
    values = [number(w) for w in re.split(r"[\s,]+", call[2].strip()) if w]
    if kind == "sin":
        smooth = _sine(values, deck, time)
        return smooth, smooth
    if kind == "exp":
        smooth = _exponential(values, deck, time)
        return smooth, smooth
    if kind == "pulse":
        times, levels = _pulse(values, deck)
    elif kind == "pwl" and "r" not in element.settings and "td" not in element.settings:
        times, levels = np.array(values[::2]), np.array(values[1::2])
    else:
        raise Unreadable(f"{element.name}: {kind}")
    near = EDGE * np.abs(time)
    sides = [
        _polyline(times, levels, time + shift * near, side)
        for shift in (-1, 0, 1)
        for side in ("left", "right")
    ]
    return np.minimum.reduce(sides), np.maximum.reduce(sides)


def changes_at_start(element: Element, deck: FlatDeck) -> bool:
    """Return whether a source has another value or a slope right after the start."""
    instants = np.array([0.0, 1e-9 * deck.stop])
    low, high = limits(element, deck, instants)
    return bool(low.min() != high.max())


def _polyline(times: Floats, levels: Floats, t: Floats, side: str) -> Floats:
    """Return a polygon's value, constant beyond its ends; equal times are ideal edges."""
    k = np.searchsorted(times, t, side="left" if side == "left" else "right")
    a, b = np.clip(k - 1, 0, len(times) - 1), np.clip(k, 0, len(times) - 1)
    length = times[b] - times[a]
    part = np.where(length > 0, (t - times[a]) / np.where(length > 0, length, 1.0), 0.0)
    out: Floats = levels[a] + (levels[b] - levels[a]) * part
    return np.where(k == 0, levels[0], np.where(k == len(times), levels[-1], out))


def _pulse(values: list[float], deck: FlatDeck) -> tuple[Floats, Floats]:
    """Return the vertices of all pulses of a run."""
    given = dict(enumerate(values))
    low, high, delay = (given.get(k, 0.0) for k in range(3))
    rise, fall = given.get(3, deck.step), given.get(4, deck.step)
    width = given.get(5, 2 * deck.stop)
    period = given.get(6, 0.0) or math.inf
    count = given.get(7, 0.0) or math.inf
    times: list[float] = []
    levels: list[float] = []
    k = 0
    while k < count and (k == 0 or delay + k * period <= deck.stop):
        begin = delay + k * period if k else delay
        points = [(0.0, low), (rise, high), (rise + width, high), (rise + width + fall, low)]
        if points[-1][0] > period * (1 + 1e-12):
            raise Unreadable("pulses that overlap")
        times += [begin + t for t, _ in points]
        levels += [v for _, v in points]
        k += 1
    return np.array(times), np.array(levels)


def _sine(values: list[float], deck: FlatDeck, time: Floats) -> Floats:
    given = dict(enumerate(values))
    if len(values) > 6:
        raise Unreadable("a sine that ends")
    offset, amplitude = given.get(0, 0.0), given.get(1, 0.0)
    s = np.maximum(time - given.get(3, 0.0), 0.0)
    angle = 2 * np.pi * given.get(2, 1 / deck.stop) * s + math.radians(given.get(5, 0.0))
    out: Floats = offset + amplitude * np.exp(-given.get(4, 0.0) * s) * np.sin(angle)
    return out


def _exponential(values: list[float], deck: FlatDeck, time: Floats) -> Floats:
    given = dict(enumerate(values))
    v1, v2, first = (given.get(k, 0.0) for k in range(3))
    second = given.get(4, first + deck.step)
    out = np.full_like(time, v1)
    rise, fall = given.get(3, deck.step), given.get(5, deck.step)
    for sign, begin, tau in ((1, first, rise), (-1, second, fall)):
        out = out - sign * (v2 - v1) * np.expm1(-np.maximum(time - begin, 0.0) / tau)
    return out
