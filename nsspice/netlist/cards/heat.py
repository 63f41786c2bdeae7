"""``.heatsink``: a thermal network that several elements share."""

from __future__ import annotations

import math

from ..deck import Grid, HeatSinkCard
from ..elements.reading import key_of
from ..findings import Unreadable
from ..text.lines import Line
from .context import Context

_HINT = "write .heatsink Foster=table(r=0.5 tau=100) S1 D1, or Cauer=table(r=0.5 c=200)"
_SECOND = {"foster": "tau", "cauer": "c"}


def heat_sink(context: Context, line: Line) -> None:
    """Read ``.heatsink Foster=table(r=... tau=...) element ...``, or with Cauer."""
    elements: list[str] = []
    networks = []
    for item in context.tail(line):
        where = line.span(item.start, item.end)
        if item.kind == "word":
            elements.append(context.element(item.text, where))
        elif item.kind == "pair" and key_of(line, item) in _SECOND:
            key = key_of(line, item)
            networks.append(context.here.param(key, context.reader.param(line, item)))
        else:
            message = ".heatsink takes Foster or Cauer, and elements"
            raise Unreadable("NS1080", message, where, _HINT)
    if len(networks) != 1 or not elements:
        message = ".heatsink needs one of Foster and Cauer, and elements"
        raise Unreadable("NS1080", message, line.whole(), _HINT)
    (network,) = networks
    lists = network.value.lists if isinstance(network.value, Grid) else {}
    second = _SECOND[network.name]
    r, other = lists.get("r", ()), lists.get(second, ())
    if not (len(r) == len(other) > 0 and all(0.0 < x < math.inf for x in (*r, *other))):
        message = f".heatsink needs as many positive values r as {second}"
        raise Unreadable("NS1080", message, network.span, _HINT)
    twice = {n for card in context.deck.heat_sinks for n in card.elements} & set(elements)
    if twice or len(set(elements)) < len(elements):
        name = min(twice) if twice else max(elements, key=elements.count)
        message = f"{name} is on a heat sink twice"
        raise Unreadable("NS1080", message, line.whole(), "name each element once")
    context.deck.heat_sinks.append(HeatSinkCard(network, tuple(elements), line.whole()))
