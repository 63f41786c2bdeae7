"""Laws of set-valued diodes: a monotone broken line in the plane of current and voltage.

::

    conducting    v - Vfwd  = Ron (i - G Vfwd),   i >= G Vfwd
    blocking      i = G v,                       -Vrev <= v <= Vfwd         G = 1/Roff
    breakdown     v + Vrev  = Rrev (i + G Vrev),  i <= -G Vrev
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .flat_deck import Element
from .written import FLOOR, Floats, Rows, Violation

_SET_VALUED = {"ron", "roff", "vfwd", "vrev", "rrev"}


@dataclass(frozen=True)
class Line:
    """The parameters of a diode's broken line [V, Ohm, S]; ``vrev`` is inf without breakdown."""

    vfwd: float = 0.0
    ron: float = 0.0
    conductance: float = 0.0
    vrev: float = np.inf
    rrev: float = 0.0


def line_of(element: Element) -> Line | None:
    """Return the broken line of a set-valued diode, None of anything else."""
    model = element.model
    if element.letter != "d" or len(element.nodes) != 2:
        return None
    if model is None:
        return Line()
    given = model.card
    if model.type != "d" or not ("ideal" in model.flags or _SET_VALUED & set(given)):
        return None
    if set(given) - _SET_VALUED:
        return None
    ron = given.get("ron", 0.0)
    roff = given.get("roff", np.inf)
    return Line(
        given.get("vfwd", 0.0),
        ron,
        1.0 / roff,
        given.get("vrev", np.inf),
        given.get("rrev", ron),
    )


def diode(element: Element, rows: Rows) -> list[Violation]:
    """Return the distance from the nearest piece, as shares of the ranges of v and i."""
    line, i = line_of(element), rows.current(element.name)
    if line is None or i is None:
        return []
    v = rows.voltage(*element.nodes)
    return rows.worst("diode", element.name, distance(line, v, i, rows))


def distance(line: Line, v: Floats, i: Floats, rows: Rows) -> Floats:
    """Return the distance of each row from a broken line."""
    g = line.conductance
    volt = rows.scale_of(v, "v")
    # what rounding leaves of the voltage flows through Roff
    ampere = rows.scale_of(i, "i") + 0.1 * FLOOR * g * rows.volts
    conducts = np.maximum(
        np.abs(v - line.vfwd - line.ron * (i - g * line.vfwd)) / volt, (g * line.vfwd - i) / ampere
    )
    blocks = np.maximum.reduce(
        [np.abs(i - g * v) / ampere, (v - line.vfwd) / volt, (-line.vrev - v) / volt]
    )
    out = np.minimum(conducts, blocks)
    if np.isfinite(line.vrev):
        breaks = np.abs(v + line.vrev - line.rrev * (i + g * line.vrev)) / volt
        out = np.minimum(out, np.maximum(breaks, (i + g * line.vrev) / ampere))
    return np.asarray(out)
