"""The arguments of PWL: points, relative times, repeated parts."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..findings import Unreadable
from ..text.statement import Item
from .template import RepeatTemplate, Value
from .terminals import Terminals
from .waveforms import count_problem

_FORM = "write PWL REPEAT FOREVER (t1 v1 t2 v2 ...) ENDREPEAT, or REPEAT FOR 5 (...) ENDREPEAT"
_WORDS = ("repeat", "endrepeat")


class Points(NamedTuple):
    """The arguments of a PWL without signs and words.

    ``relative`` are the places of times after the one before (``+1u``), ``repeats`` the parts that
    are gone through more than once.
    """

    items: list[Item]
    relative: tuple[int, ...]
    repeats: tuple[RepeatTemplate, ...]


def points_of(terminals: Terminals, arguments: list[Item]) -> Points:
    """Return the points of a PWL.

    A plus before a time counts it from the time before, ``+1u``; that of ``+{tr}`` is a word of its
    own.  In a repeated part times count from its beginning.
    """
    line = terminals.line
    items: list[Item] = []
    relative: list[int] = []
    repeats: list[RepeatTemplate] = []
    at = 0
    while True:
        end = _next(arguments, at)
        _take(terminals, arguments[at:end], items, relative, bool(repeats))
        if end == len(arguments):
            return Points(items, tuple(relative), tuple(repeats))
        where = line.span(arguments[end].start, arguments[end].end)
        if arguments[end].text == "endrepeat":
            message = f"{terminals.name}: endrepeat without a preceding repeat"
            raise Unreadable("NS1044", message, where, _FORM)
        count, inside = _count(terminals, arguments, end)
        close = _next(arguments, inside)
        if close == len(arguments) or arguments[close].text == "repeat":
            what = "is not closed" if close == len(arguments) else "contains another one"
            message = f"{terminals.name}: a PWL repeat {what}"
            raise Unreadable("NS1044", message, where, _FORM)
        first = len(items)
        _take(terminals, arguments[inside:close], items, relative, False)
        if len(items) == first:
            message = f"{terminals.name}: nothing is repeated"
            raise Unreadable("NS1008", message, where, _FORM)
        repeats.append(RepeatTemplate(first, len(items), count, where))
        at = close + 1
        if count == math.inf and at < len(arguments):
            extra = line.span(arguments[at].start, arguments[at].end)
            message = f"{terminals.name}: nothing can follow a part that is repeated forever"
            raise Unreadable("NS1009", message, extra, "remove it, or write REPEAT FOR n")


def _next(arguments: list[Item], at: int) -> int:
    """Return the position of the next word of a repetition, or the end."""
    for k in range(at, len(arguments)):
        if arguments[k].kind == "word" and arguments[k].text in _WORDS:
            return k
    return len(arguments)


def _count(terminals: Terminals, arguments: list[Item], at: int) -> tuple[Value, int]:
    """Return how often a part is repeated, and where its points begin."""
    word = arguments[at + 1].text if at + 1 < len(arguments) else ""
    if word == "forever":
        return math.inf, at + 2
    if word == "for" and at + 2 < len(arguments):
        reader = terminals.reader
        return reader.value(terminals.line, arguments[at + 2], "a number of turns"), at + 3
    where = terminals.line.span(arguments[at].start, arguments[at].end)
    message = f"{terminals.name}: repeat must be followed by FOREVER, or by FOR and a number"
    raise Unreadable("NS1008", message, where, _FORM)


def _take(
    terminals: Terminals, part: list[Item], items: list[Item], relative: list[int], behind: bool
) -> None:
    """Append the points of one part; ``behind`` a repeated one all of its times are relative."""
    line = terminals.line
    signs = {k for k, a in enumerate(part) if line.raw[a.start : a.end] == "+"}
    left = [a for k, a in enumerate(part) if k not in signs] if signs else part
    marked = {id(part[k + 1]) for k in signs if k + 1 < len(part)}
    problem, hint = count_problem("pwl", len(left)) if left else ("", "")
    if problem:
        where = line.span(left[0].start, left[-1].end)
        raise Unreadable("NS1008", f"{terminals.name}: {problem}", where, hint)
    for k in range(0, len(left), 2):
        if id(left[k]) in marked or line.raw[left[k].start] == "+":
            relative.append(len(items) + k)
        elif behind:
            where = line.span(left[k].start, left[k].end)
            message = f"{terminals.name}: after a repeated part this time is ambiguous"
            hint = "make it relative to the previous time, +1u, or repeat the whole source"
            raise Unreadable("NS1009", message, where, hint)
    items += left
