"""To what voltage over its source the gate of a MOSFET is driven, as far as sources say it.

A path from source to gate through voltage sources, resistors and inductors determines it: the
sources along it add up, and resistors carry no current where the gate draws none.  A controlled
source with a gain, as in a gate driver, adds its gain times what is so known of its control.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from ..netlist.deck import Element, Source

#: least and greatest value [V]
Range = tuple[float, float]
#: controlled sources whose control is another one
_DEEPEST = 3
#: branches by node: the next node, and the range of its voltage over this one
_Graph = dict[str, list[tuple[str, Range]]]


def gate_drives(elements: Iterable[Element]) -> dict[str, float]:
    """Return the largest voltage [V] from source to gate (of PMOS: from gate to source) by element.

    Parameters
    ----------
    elements : iterable of Element
        MOSFETs whose gate is driven by something else are left out of the result.

    Examples
    --------
    >>> from nsspice.netlist import parse_text
    >>> deck = parse_text("t\\nV1 a 0 PULSE(0 8 0 1n 1n 1u 2u)\\nR1 a g 2\\nM1 d g 0 X\\n"
    ...     "R2 d 0 1\\n.model X VDMOS(Vto=2 Kp=1)\\n")
    >>> gate_drives(deck.elements)
    {'m1': 8.0}
    """
    listed = list(elements)
    graph: _Graph = {}
    driven: list[Element] = []
    for element in listed:
        if element.letter == "v" and element.source is not None:
            _join(graph, element, extremes(element.source))
        elif element.letter in "rl":
            _join(graph, element, (0.0, 0.0))
        elif element.letter == "e" and isinstance(element.value, int | float):
            driven.append(element)
    for _ in range(_DEEPEST if driven else 0):
        waiting = []
        for element in driven:
            control = _between(graph, element.controls[1], element.controls[0])
            if control is None:
                waiting.append(element)
                continue
            gain = float(element.value)  # type: ignore[arg-type]
            low, high = sorted(gain * v for v in control)
            _join(graph, element, (low, high))
        driven = waiting
    found: dict[str, float] = {}
    for element in listed:
        if element.letter == "m" and element.model is not None:
            _, gate, source = element.nodes[:3]
            over = _between(graph, source, gate)
            if over is not None:
                p = element.model.type in ("pmos", "vdmosp") or "pchan" in element.model.params
                found[element.name] = -over[0] if p else over[1]
    return found


def _join(graph: _Graph, element: Element, voltage: Range) -> None:
    """Add a branch whose first node has a voltage over its second one."""
    a, b = element.nodes[:2]
    graph.setdefault(b, []).append((a, voltage))
    graph.setdefault(a, []).append((b, (-voltage[1], -voltage[0])))


def _between(graph: _Graph, begin: str, end: str) -> Range | None:
    """Return the range of a voltage along the shortest path on which a source is, or None."""
    seen = {(begin, False)}
    queue: deque[tuple[str, bool, Range]] = deque([(begin, False, (0.0, 0.0))])
    while queue:
        node, driven, total = queue.popleft()
        if node == end and driven:
            return total
        for other, (low, high) in graph.get(node, ()):
            state = (other, driven or (low, high) != (0.0, 0.0))
            if state not in seen:
                seen.add(state)
                queue.append((*state, (total[0] + low, total[1] + high)))
    return None


def extremes(source: Source) -> Range:
    """Return the least and the greatest voltage of a source."""
    values = [v for v in source.values if v is not None]
    if source.kind in ("pulse", "exp"):
        values = values[:2]
    elif source.kind == "pwl":
        values = values[1::2]
    elif source.kind and len(values) > 1:
        values = [values[0] - abs(values[1]), values[0] + abs(values[1])]
    elif not source.kind:
        values = [source.dc or 0.0]
    return (min(values), max(values)) if values else (0.0, 0.0)
