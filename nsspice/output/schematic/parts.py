"""Elements of a deck as parts of a schematic: two ends, a symbol, a label."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ..si import number

if TYPE_CHECKING:
    from ...netlist.deck import Deck, Element

GROUND = "0"
#: parts that carry their current from a higher to a lower rail, or block it
VALVES = frozenset("dsmqjzw")
_UNITS = {"r": "Ω", "l": "H", "c": "F"}
#: ends and control of elements with three terminals
_THREE = frozenset("mqjz")
_LONGEST = 16  # characters of a label


@dataclass(eq=False)
class Part:
    """An element with the nets at its two ends.

    Parameters
    ----------
    name, letter : str
    high, low : str
        The net that is drawn above, and the one below.
    turned : bool
        True if ``high`` is the element's second terminal.
    directed : bool
        Whether the element itself says which end is above.
    level : bool
        Whether it is rather drawn lying, between two nets of one level.
    text, control : str
        Value, and what controls it.
    kind : str
        Polarity of a transistor: ``n`` or ``p``.
    coupled : list of str
        Windings on the same core.
    """

    name: str
    letter: str
    high: str
    low: str
    turned: bool = False
    directed: bool = False
    level: bool = False
    text: str = ""
    control: str = ""
    kind: str = "n"
    coupled: list[str] = field(default_factory=list)

    def turn(self) -> None:
        """Exchange the ends."""
        self.high, self.low, self.turned = self.low, self.high, not self.turned


def parts_of(deck: Deck) -> list[Part]:
    """Return the parts of a deck in the order of their lines."""
    parts = {e.name: _part(e) for e in deck.elements if e.letter != "k" and len(e.nodes) > 1}
    for e in deck.elements:
        if e.letter == "k":
            windings = [parts[name] for name in e.controls if name in parts]
            for part in windings:
                part.coupled += [w.name for w in windings if w is not part]
                part.directed, part.level = True, False
    # both ends on one net: nothing flows that the rest of the circuit would see
    return [part for part in parts.values() if part.high != part.low]


def _part(e: Element) -> Part:
    """Return the part of an element: which end is above, and what its label says."""
    first, second = e.nodes[0], e.nodes[2 if e.letter in _THREE and len(e.nodes) > 2 else 1]
    part = Part(e.name, e.letter, first, second, text=_text(e), control=_control(e))
    type_ = e.model.type.lower() if e.model is not None else ""
    part.kind = "p" if type_.startswith("p") else "n"
    upside_down = e.letter in "di" or (e.letter in _THREE and part.kind == "p")
    if e.letter == "v" and e.source is not None and (e.source.dc or 0.0) < 0.0:
        upside_down = True
    part.directed = e.letter in VALVES | {"v", "i"}
    if upside_down:
        part.turn()
    if not part.directed and part.high == GROUND:
        part.turn()
    part.level = e.letter in "rlc" and GROUND not in (first, second)
    return part


def _control(e: Element) -> str:
    """Return what controls an element: a gate, or a pair of nets."""
    if e.letter in _THREE and len(e.nodes) > 2:
        return e.nodes[1]
    if e.letter in "egs" and len(e.controls) == 2:
        plus, minus = e.controls
        return plus if minus == GROUND else f"−{minus}" if plus == GROUND else f"{plus}−{minus}"
    return ", ".join(e.controls) if e.letter in "fhw" else ""


def _text(e: Element) -> str:
    """Return the value of an element, or what stands for it."""
    if isinstance(e.value, float | int):
        return number(float(e.value), _UNITS.get(e.letter, ""), 4)
    if e.letter in "vi" and e.source is not None:
        words = e.span.text.split(None, 3)[3:] if e.span.text else []
        shape = re.match(r"(?i)(?:dc\s+)?([a-z]+)\s*\(", words[0]) if words else None
        unit = "V" if e.letter == "v" else "A"
        return shape[1].upper() if shape else number(float(e.source.dc or 0.0), unit, 4)
    if e.model is not None and e.letter not in "dswmqjz":
        return e.model.name
    return ""


def short(text: str) -> str:
    """Return a label that fits next to a symbol."""
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"


def separate(parts: Sequence[Part]) -> list[list[Part]]:
    """Return parts that are connected other than by ground, or by a core; the largest first."""
    groups: list[tuple[set[str], list[Part]]] = []
    for part in parts:
        nets = {part.high, part.low} - {GROUND} or {f"{part.name} alone"}
        nets |= {f"core of {w}" for w in (part.name, *part.coupled)} if part.coupled else set()
        mine = [part]
        rest = []
        for known, members in groups:
            if known & nets:
                nets, mine = nets | known, members + mine
            else:
                rest.append((known, members))
        groups = [*rest, (nets, mine)]
    order = {part: k for k, part in enumerate(parts)}
    found = [sorted(members, key=order.__getitem__) for _, members in groups]
    return sorted(found, key=lambda members: (-len(members), order[members[0]]))
