"""Laws of switches and thyristors: both states' equations, what turns them, and hysteresis.

A row tells the state where only one state's equation holds in it.  At the instant of a change both
sides are written, of which either may be meant: there the state is not compared with the control.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .flat_deck import Element
from .written import FLOOR, Bools, Floats, Rows, Violation

#: an equation is missed by more than this share of the range where it does not hold
CLEAR = 1e-6


@dataclass(frozen=True)
class Thresholds:
    """A switch: resistances [Ohm], and the control above (below) which it is in its upper (lower)
    state; ``inverted`` if the upper state is the open one."""

    ron: float
    roff: float
    above: float
    below: float
    inverted: bool = False


def thresholds_of(element: Element) -> Thresholds | None:
    """Return what a switch's model says, None for a smooth or unknown one."""
    model = element.model
    if element.letter not in "sw" or model is None:
        return None
    card = model.card
    ron, roff = card.get("ron", 0.0), card.get("roff", np.inf)
    kind = "v" if element.letter == "s" else "i"
    if model.type in ("sw", "csw"):
        middle, half = card.get(f"{kind}t", 0.0), abs(card.get(f"{kind}h", 0.0))
        return Thresholds(ron, roff, middle + half, middle - half)
    if model.type in ("vswitch", "iswitch"):
        on, off = card.get(f"{kind}on", 1.0 if kind == "v" else 1e-3), card.get(f"{kind}off", 0.0)
        return Thresholds(ron, roff, max(on, off), min(on, off), on < off)
    return None


def control_of(element: Element, rows: Rows) -> Floats | None:
    """Return the control of a switch."""
    words = element.words
    return rows.voltage(words[0], words[1]) if element.letter == "s" else rows.current(words[0])


def states(element: Element, rows: Rows) -> NDArray[np.int_] | None:
    """Return 1 where a switch is seen to be closed, -1 where open, 0 where a row tells neither."""
    errors = _errors(element, rows)
    if errors is None:
        return None
    closed, opened = errors
    return np.where(_sure(closed, opened), 1, np.where(_sure(opened, closed), -1, 0))


def switch(element: Element, rows: Rows, lag: int = 0) -> list[Violation]:
    """Return how far a switch is from both states, and from the one that its control asks for.

    Parameters
    ----------
    lag : int
        Rows by which fixed steps see a control late.
    """
    law, errors = thresholds_of(element), _errors(element, rows)
    if law is None or errors is None:
        return []
    closed, opened = errors
    out = rows.worst("switch", element.name, np.minimum(closed, opened))
    control, known = control_of(element, rows), states(element, rows)
    if control is None or known is None or law.ron == law.roff:
        return out
    upper = -known if law.inverted else known
    scale = max(float(np.abs(control).max()), abs(law.above), abs(law.below), 1e-12)
    high, low = (control - law.above) / scale, (law.below - control) / scale
    ends = _beside_jump(rows)
    for over, state in ((high, -1), (low, 1)):
        for k in range(lag):
            over = np.minimum(over, np.concatenate([np.zeros(k + 1), over[: -k - 1]]))
        out += rows.worst("gate", element.name, np.where((upper == state) & ~ends, over, 0.0))
    return out + _turns(element.name, rows, upper, -high, -low)


def _turns(
    name: str, rows: Rows, upper: NDArray[np.int_], short: Floats, far: Floats
) -> list[Violation]:
    """Return how far the control was from its threshold when the state changed."""
    known = np.flatnonzero(upper)
    error = np.zeros_like(rows.time)
    for k in np.flatnonzero(np.diff(upper[known])):
        p, q = known[k], known[k + 1]
        missing = short if upper[q] > 0 else far
        error[q] = max(float(missing[p : q + 1].min()), 0.0)
    return rows.worst("hysteresis", name, error)


def _errors(element: Element, rows: Rows) -> tuple[Floats, Floats] | None:
    """Return the shares of their ranges by which the equations of both states are missed."""
    law, i = thresholds_of(element), rows.current(element.name)
    if law is None or i is None:
        return None
    v = rows.voltage(*element.nodes)
    return _ohms(law.ron, v, i, rows), _ohms(law.roff, v, i, rows)


def _ohms(ohms: float, v: Floats, i: Floats, rows: Rows) -> Floats:
    if ohms == 0.0:
        return np.abs(v) / rows.scale_of(v, "v")
    if np.isinf(ohms):
        return np.abs(i) / rows.scale_of(i, "i")
    scale = rows.scale_of(i, "i") + 0.1 * FLOOR * rows.volts / ohms
    return np.abs(i - v / ohms) / scale


def _sure(holds: Floats, other: Floats) -> Bools:
    return (holds <= CLEAR) & (other > CLEAR)


def _beside_jump(rows: Rows) -> Bools:
    """Return the rows that share their instant with another one."""
    out = np.zeros(rows.time.size, bool)
    out[:-1] |= ~rows.moves
    out[1:] |= ~rows.moves
    return out
