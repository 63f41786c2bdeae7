"""Numbers, expressions and ``name=value`` items as text that reads back to the same values."""

from __future__ import annotations

import re
from collections.abc import Container, Mapping

from ...errors import Span
from ...netlist.elements.template import Formula, GridText, ParamText, Value
from ...netlist.expressions.node import Node, show
from ...netlist.text.numbers import SUFFIXES, format_number, read_number

#: suffixes by their power of ten
_SUFFIXES = [s for s in SUFFIXES if s.isascii() and s != "mil"]
#: functions of a tree whose names have not been looked up
_CALLED = re.compile(r"\?(?=\w)")
#: what a word of a model or a parameter may consist of
_WORD = re.compile(r"[^\s(){}\[\]=,;\"'$*]+")


def number(value: float) -> str:
    """Return a number as people write it, if that reads back to the same double.

    Examples
    --------
    >>> number(10e3), number(4.7e-6), number(0.25), number(1 / 3)
    ('10k', '4.7u', '0.25', '0.3333333333333333')
    """
    best = format_number(value)
    for suffix in _SUFFIXES:
        digits = round(value / SUFFIXES[suffix], 9)
        text = f"{format_number(digits)}{suffix}"
        read = read_number(text)
        if 1.0 <= abs(digits) < 1e3 and len(text) < len(best) and read and read.value == value:
            best = text
    return best


def formula(node: Node) -> str:
    """Return an expression in braces."""
    return "{" + _CALLED.sub("", show(node)) + "}"


def value(given: Value) -> str:
    """Return a number, or an expression in braces."""
    if isinstance(given, Formula):
        return value(float(given.node.value)) if given.node.op == "num" else formula(given.node)
    return number(given)


def item(key: str, given: ParamText) -> str:
    """Return ``name=value``; a name alone is one that was written so."""
    content = given.value
    if isinstance(content, GridText):
        lists = [f"{name}={' '.join(map(value, row))}" for name, row in content.lists.items()]
        return f"{key}=table({' '.join(lists)})"
    if isinstance(content, str):
        text = given.word or content
        return f"{key}={text}" if _WORD.fullmatch(text) else f'{key}="{text}"'
    if content == 1.0 and given.span.length == len(key):
        return key
    return f"{key}={value(content)}"


def items(params: Mapping[str, ParamText], idle: Container[Span]) -> list[str]:
    """Return the ``name=value`` items that have an effect."""
    return [item(key, given) for key, given in params.items() if given.span not in idle]
