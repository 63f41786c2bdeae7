"""``.pss``: the periodic steady state."""

from __future__ import annotations

import math

from ..deck import PssCard
from ..findings import Unreadable
from ..lines import Line
from ..statement import Item
from .context import Context
from .outputs import probe
from .reading import key_of

_NAMES = ("period", "fund", "harms", "tstab", "tstep", "trigger", "level")
_HINT = "write .pss period=10u, .pss fund=100k, or .pss trigger=v(node) level=0"


def pss(context: Context, line: Line) -> None:
    """Read ``.pss [period=T|fund=f] [trigger=signal [level=]] [tstab=] [tstep=] [harms=]``."""
    given: dict[str, Item] = {}
    for item in context.tail(line):
        where = line.span(item.start, item.end)
        if item.kind != "pair":
            raise Unreadable("NS1080", ".pss has named arguments only", where, _HINT)
        key = key_of(line, item)
        if key not in _NAMES or key in given:
            reason = "is given twice" if key in given else "is unknown"
            raise Unreadable("NS1080", f".pss: {key[:40]} {reason}", where, _HINT)
        given[key] = item

    def number(name: str, default: float) -> float:
        item = given.get(name)
        return default if item is None else context.number(line, item.items[1], "a number")

    def positive(name: str) -> float | None:
        value = number(name, math.nan)
        if name in given and not (math.isfinite(value) and value > 0.0):
            where = line.span(given[name].start, given[name].end)
            raise Unreadable("NS1080", f".pss: {name} must be positive", where, _HINT)
        return value if name in given else None

    if "period" in given and "fund" in given:
        where = line.span(given["fund"].start, given["fund"].end)
        raise Unreadable("NS1080", ".pss takes a period or a fundamental, not both", where, _HINT)
    fundamental = positive("fund")
    period = positive("period") if fundamental is None else 1.0 / fundamental
    trigger = None
    if "trigger" in given:
        right = given["trigger"].items[1]
        where = line.span(right.start, right.end)
        if right.kind != "call":
            raise Unreadable("NS1080", ".pss: the trigger is a signal", where, _HINT)
        trigger = probe(context, right, where)
        if period is not None:
            message = ".pss: a trigger decides about the period, which is given, too"
            raise Unreadable("NS1080", message, where, "leave one of them out")
    harmonics = number("harms", 20.0)
    tstab = number("tstab", 0.0)
    if not (harmonics >= 1.0 and harmonics == int(harmonics)) or not 0.0 <= tstab < math.inf:
        message = ".pss: harms counts from 1, and tstab is not negative"
        raise Unreadable("NS1080", message, line.whole(), _HINT)
    card = PssCard(
        period,
        trigger,
        number("level", 0.0),
        tstab,
        positive("tstep"),
        int(harmonics),
        line.whole(),
    )
    context.deck.analyses.append(card)
