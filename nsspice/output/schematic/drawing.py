"""The schematic of a deck as SVG."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING

from .parts import GROUND, Part, parts_of, separate, short
from .placement import Placement, place
from .symbols import REACH, ground, symbol

if TYPE_CHECKING:
    from ...circuit import Circuit

_WIDE, _HIGH = 104.0, 92.0  # of a column and a row
_LEFT, _TOP = 64.0, 46.0
_STYLE = """
.wires,.core,.part{fill:none;stroke:#1b1f24;stroke-width:1.6;stroke-linecap:round;stroke-linejoin:round}
.fill,.dot{fill:#1b1f24} .part .fill{stroke-linejoin:miter}
text{fill:#1b1f24;stroke:none;font:12px system-ui,sans-serif} .value,.control{fill:#57606a}
.net{fill:#0b57d0;font-style:italic} .title{font-size:14px;font-weight:600}
.on{stroke:#1a7f37;stroke-width:3} .on .fill{fill:#1a7f37}
.off{stroke:#a8b0b9} .off .fill{fill:#a8b0b9}
@media(prefers-color-scheme:dark){.wires,.core,.part{stroke:#e6edf3} .fill,.dot,text{fill:#e6edf3}
.value,.control{fill:#9da7b3} .net{fill:#79b0ff} .on{stroke:#3fb950} .on .fill{fill:#3fb950}
.off{stroke:#57606a} .off .fill{fill:#57606a}}
"""


def schematic(circuit: Circuit, on: Mapping[str, bool] | None = None, caption: str = "") -> str:
    """Return the schematic of a circuit as an SVG document.

    Parameters
    ----------
    circuit : Circuit
    on : mapping of str to bool, optional
        Which elements conduct: these are green, those that block are grey.
    caption : str
        Below the title of the deck.

    Returns
    -------
    str

    Examples
    --------
    >>> import nsspice
    >>> deck = nsspice.read("divider\\nV1 a 0 1\\nR1 a b 1k\\nR2 b 0 1k\\n.op\\n")
    >>> schematic(deck).count('class="part"')
    3
    """
    left, body, highest = _LEFT, [], 0.0
    blocks = [(place(parts), parts) for parts in separate(parts_of(circuit.deck))]
    for placement, _ in blocks:
        highest = max(highest, max(placement.row.values()) * _HIGH)
    bottom = _TOP + highest + 24.0
    for placement, parts in blocks:
        body.append(_block(placement, parts, left, bottom, on or {}))
        left += _WIDE * (1 + max(placement.column.values()))
    width = max(left, 36.0 + 8.4 * max(len(circuit.deck.title), len(caption)))
    height = bottom + 40.0
    heading = [f'<text class="title" x="16" y="22">{escape(circuit.deck.title)}</text>']
    if caption:
        heading.append(f'<text class="value" x="16" y="40">{escape(caption)}</text>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'width="{width:g}" height="{height:g}" role="img">'
        f"<title>{escape(circuit.deck.title)}</title><desc>drawn by nsspice</desc>"
        f"<style>{_STYLE}</style>{''.join(heading)}{''.join(body)}</svg>\n"
    )


def _block(
    placement: Placement, parts: list[Part], left: float, bottom: float, on: Mapping[str, bool]
) -> str:
    """Draw connected parts: wires, dots, names of nets, symbols."""

    def x(column: float) -> float:
        return left + _WIDE * column

    def y(net: str) -> float:
        return bottom - _HIGH * placement.row[net]

    wires: list[str] = []
    drawn: list[str] = []
    joints: dict[tuple[float, float], int] = {}

    def joint(px: float, py: float) -> None:
        joints[px, py] = joints.get((px, py), 0) + 1

    for part in parts:
        c = placement.column[part]
        if part in placement.lying:
            one, _ = placement.lying[part]
            py = y(one)
            wires.append(f"M{x(c - 0.4):g},{py:g} H{x(c) - REACH:g} M{x(c) + REACH:g},{py:g} "
                         f"H{x(c + 0.4):g}")  # fmt: skip
            first = part.low if part.turned else part.high
            drawn.append(_symbol(part, x(c), py, -90.0 if first == one else 90.0, on))
            continue
        top, low = y(part.high), y(part.low)
        if top > low:
            top, low = low, top
        middle = _middle(top, low)
        wires.append(f"M{x(c):g},{top:g} V{middle - REACH:g} M{x(c):g},{middle + REACH:g} V{low:g}")
        upside_down = (y(part.high) > y(part.low)) != part.turned
        drawn.append(_symbol(part, x(c), middle, 180.0 if upside_down else 0.0, on))
        joint(x(c), top)
        joint(x(c), low)
    names = []
    for net, (first_, last) in placement.ends.items():
        py = y(net)
        below = net == GROUND and placement.row[net] > 0  # its symbol is next to what hangs there
        if last > first_:
            wires.append(f"M{x(first_):g},{py:g} H{x(last):g}")
        for (px, qy), count in joints.items():
            if qy == py and x(first_) <= px <= x(last):
                arms = count + (px > x(first_)) + (px < x(last)) + (px == x(first_) and below)
                if arms > 2:
                    names.append(f'<circle class="dot" cx="{px:g}" cy="{py:g}" r="3"/>')
        if net == GROUND:
            left_ = x(first_) - (34.0 if below else 0.0)
            wires.append(f"M{x(first_):g},{py:g} H{left_:g} {ground(left_, py)}")
        else:
            names.append(f'<text class="net" x="{x(first_) + 5:g}" '
                         f'y="{py - 5:g}">{escape(short(net))}</text>')  # fmt: skip
    cores = _cores(placement, parts, left, bottom)
    return f'<path class="wires" d="{" ".join(wires)}"/>{cores}{"".join(names)}{"".join(drawn)}'


def _middle(top: float, low: float) -> float:
    """Return the height of a symbol: between two rows, in the middle of a long wire."""
    rows = max(1, round((low - top) / _HIGH))
    return top + _HIGH * (0.5 + (rows - 1) // 2)


def _symbol(part: Part, px: float, py: float, angle: float, on: Mapping[str, bool]) -> str:
    """Draw a symbol, turned by an angle, with its name, value and control."""
    state = {True: " on", False: " off", None: ""}[on.get(part.name)]
    turn = f" rotate({angle:g})" if angle else ""
    lying = abs(angle) == 90.0
    lines = symbol(part.letter, part.kind, bool(on.get(part.name)))
    dot = ""
    if part.coupled:  # the dot of a winding is at its first terminal
        dot = '<circle class="fill" cx="-11" cy="-20" r="2.4"/>'
    texts = [(part.name, ""), (part.text, "value")]
    if lying:
        places = [(px, py - 20.0, "middle"), (px, py + 29.0, "middle")]
    else:
        places = [(px + 20.0, py - 2.0, "start"), (px + 20.0, py + 12.0, "start")]
    if part.control:
        texts.append((part.control, "control"))
        beside = (px - (26.0 if part.letter in "mqjz" else 18.0), py + 4.0, "end")
        places.append((px, py + 24.0, "middle") if lying else beside)
    labels = "".join(
        f'<text class="{kind}" x="{a:g}" y="{b:g}" text-anchor="{anchor}">'
        f"{escape(short(text))}</text>"
        for (text, kind), (a, b, anchor) in zip(texts, places, strict=True)
        if text
    )
    return (
        f'<g class="part{state}" data-name="{escape(part.name)}">'
        f'<g transform="translate({px:g} {py:g}){turn}">{lines}{dot}</g>{labels}</g>'
    )


def _cores(placement: Placement, parts: list[Part], left: float, bottom: float) -> str:
    """Return two lines between coupled windings in neighbouring columns."""

    def middle(part: Part) -> float:
        ends = sorted(bottom - _HIGH * placement.row[net] for net in (part.high, part.low))
        return _middle(*ends)

    columns = {part.name: part for part in parts}
    found = [
        f"M{left + _WIDE * (placement.column[part] + 0.72):g},"
        f"{0.5 * (middle(part) + middle(other)) - 34:g} v68 m5,0 v-68"
        for part in parts
        for other in (columns[name] for name in part.coupled if name in columns)
        if placement.column[other] - placement.column[part] == 1
    ]
    return f'<path class="core" d="{" ".join(found)}"/>' if found else ""
