"""Functionals as the core takes them: of one island, by the places of its outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..signals.curve import Floats
from .functional import Functional
from .refusals import undone

#: of a run: extremes nearer to an event are at it, as polynomials of the recording know it
_AT_EVENT = 1e-12


def goal_of(
    functional: Functional,
    local: Mapping[str, Sequence[tuple[str, float]]],
    names: Sequence[str],
    events: Floats,
    stop: float,
) -> dict[str, list[Any]]:
    """Return a functional as the core takes it, of what one island contributes."""
    place = {name: k for k, name in enumerate(names)}

    values = []
    for name, time, given, factor in functional.values:
        close = events[np.abs(events - time) <= _AT_EVENT * stop]
        instant, side = (float(close[0]), given) if given and close.size else (time, 0)
        values += [(place[part], instant, side, factor * f) for part, f in local[name]]
    products = []
    for one, other, start, end, factor in functional.products:
        if bool(local[one]) != bool(local[other]):
            raise undone("a product of signals of different islands is not differentiated", one)
        products += [
            (place[a], place[b], [start, end], factor * f * g)
            for a, f in local[one]
            for b, g in local[other]
        ]
    return {
        "integrals": [
            (place[part], [start, end], factor * f)
            for name, start, end, factor in functional.integrals
            for part, f in local[name]
        ],
        "values": values,
        "products": products,
        "waves": [
            (place[part], [start, end], turn, phase, factor * f)
            for name, start, end, turn, phase, factor in functional.waves
            for part, f in local[name]
        ],
    }
