"""Symbols as SVG, upright between (0, -30) and (0, 30); the first terminal is at the top."""

from __future__ import annotations

#: half the height of a symbol
REACH = 30

_BODY = {
    "r": '<path d="M0,-30 V-20 M0,20 V30"/><rect x="-8" y="-20" width="16" height="40"/>',
    "c": '<path d="M0,-30 V-5 M-14,-5 H14 M-14,5 H14 M0,5 V30"/>',
    "l": '<path d="M0,-30 V-24 a6,6 0 0 1 0,12 a6,6 0 0 1 0,12 a6,6 0 0 1 0,12 a6,6 0 0 1 0,12'
         ' V30"/>',
    # anode at the top
    "d": '<path d="M0,-30 V30 M-11,12 H11"/><path class="fill" d="M-11,-9 H11 L0,12 z"/>',
    "v": '<path d="M0,-30 V-17 M0,17 V30 M-4,-8 H4 M0,-12 V-4 M-4,9 H4"/><circle r="17"/>',
    "i": '<path d="M0,-30 V-17 M0,17 V30 M0,-10 V8"/><circle r="17"/>'
         '<path class="fill" d="M0,12 l-4,-8 h8 z"/>',
    "s": '<path d="M0,-30 V-16 M0,16 V30 M0,16 L-14,-12"/><circle r="2.2" cy="-16"/>'
         '<circle r="2.2" cy="16"/>',
    "closed": '<path d="M0,-30 V-16 M0,16 V30 M0,16 L0,-16"/><circle r="2.2" cy="-16"/>'
              '<circle r="2.2" cy="16"/>',
    "controlled": '<path d="M0,-30 V-19 M0,19 V30"/><path d="M0,-19 L15,0 L0,19 L-15,0 z"/>',
    "box": '<path d="M0,-30 V-18 M0,18 V30"/><rect x="-15" y="-18" width="30" height="36"/>',
    # channel, gate at the left; the arrow is that of the body
    "m": '<path d="M0,-30 V-14 H-8 M0,30 V14 H-8 M-8,-20 V-8 M-8,-6 V6 M-8,8 V20 M-8,0 H0 V14'
         ' M-13,-16 V16 M-13,0 H-24"/>',
    "q": '<path d="M0,-30 V-18 L-10,-7 M0,30 V18 L-10,7 M-10,-15 V15 M-10,0 H-24"/>',
    "z": '<path d="M0,-30 V-18 L-9,-8 M0,30 V18 L-9,8 M-9,-16 V16 M-13,-12 V12 M-13,0 H-24"/>',
    "j": '<path d="M0,-30 V-10 H-9 M0,30 V10 H-9 M-9,-16 V16 M-9,0 H-24"/>',
}  # fmt: skip
_TIPS = {
    ("m", "n"): '<path class="fill" d="M-7,0 l7,-3.5 v7 z"/>',
    ("m", "p"): '<path class="fill" d="M0,0 l-7,-3.5 v7 z"/>',
    ("q", "n"): '<path class="fill" d="M-1,17 l-3,-8 l-5,5 z"/>',
    ("q", "p"): '<path class="fill" d="M-9,8 l8,3 l-5,5 z"/>',
    ("z", "n"): '<path class="fill" d="M-1,17 l-3,-8 l-5,5 z"/>',
}
_NAMES = {
    **dict.fromkeys("efgh", "controlled"), **dict.fromkeys("b", "controlled"), "w": "s",
}  # fmt: skip


def symbol(letter: str, kind: str, closed: bool = False) -> str:
    """Return the lines of a symbol.

    Parameters
    ----------
    letter : str
        Of the element.
    kind : str
        Polarity of a transistor.
    closed : bool
        Whether a switch conducts.
    """
    name = _NAMES.get(letter, letter)
    if name == "s" and closed:
        name = "closed"
    return _BODY.get(name, _BODY["box"]) + _TIPS.get((name, kind), "")


def ground(x: float, y: float) -> str:
    """Return the path of the symbol of ground below a point."""
    return f"M{x:g},{y:g} v10 m-10,0 h20 m-16.5,4.5 h13 m-9.5,4.5 h6"
