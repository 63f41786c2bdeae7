"""The element letters: which reader takes a line, and what is said about the others."""

from __future__ import annotations

import re

from ...element_kinds import KINDS
from ...lazy import resolve
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item, items
from .reading import Reader, closed_once, flat
from .template import CodeTemplate, InstanceTemplate, Template
from .terminals import GROUND

#: the charge of a capacitor or the flux of an inductor as an expression
_LAW = re.compile(r"[\s,)](q|flux)\s*=")

#: U lines that are digital: a type with a number of inputs, or power nodes of PSpice
_GATE = re.compile(r"^\s*\S+\s+\w+\s*\(|\bdpwr\b|\$g_dpwr|\bio_level\b")

#: letters of other simulators: what the element is, and what to do
_UNSUPPORTED = {
    "n": ("Verilog-A device", "write the function as a B element"),
    "u": ("digital gate", "use A elements, as XSPICE writes them"),
}


def element(reader: Reader, line: Line) -> Template | InstanceTemplate | CodeTemplate:
    """Read one element line.

    Raises
    ------
    Unreadable
        With the first thing that is wrong with the line.
    """
    text = line.text
    letter = text[0] if text[0] > " " else text.lstrip()[0]
    if letter == "b" or ("=" in text and _is_law(letter, line)):
        law: Template = resolve(KINDS["b"].reader)(reader, line)
        return law
    if letter == "a":
        from .code_model import code_model

        return code_model(reader, line)
    kind = KINDS.get(letter)
    if letter == "t":
        from .transmission import transmission

        return transmission(reader, line, items(line))
    if letter in "opyu" and not (letter == "u" and _GATE.search(line.text)):
        from .transmission import coupled, lossy

        return (coupled if letter == "p" else lossy)(reader, line, items(line))
    if kind is None and letter != "x":
        raise _unknown(line, letter)
    if letter in "vi" and line.text.count("(") != line.text.count(")"):
        line = closed_once(reader.findings, line)
    found = items(line)
    if found[0].kind != "word":
        where = line.span(found[0].start, found[0].end)
        hint = "a line starts with the name of an element, then its nodes"
        raise Unreadable("NS1009", "the name of an element is missing here", where, hint)
    if kind is None:
        return instance(reader, line, found)
    plain: Template = resolve(kind.reader)(reader, line, found)
    return plain


def _is_law(letter: str, line: Line) -> bool:
    """Return whether an R, C or L line gives its law as an expression."""
    if letter == "r":
        from .controlled import is_law

        return is_law(line)
    return letter in "cl" and _LAW.search(line.text) is not None


def _unknown(line: Line, letter: str) -> Unreadable:
    """Return what to say about a line that starts with another character."""
    start = len(line.text) - len(line.text.lstrip())
    word = line.raw[start:].split()[0][:40]
    where = line.span(start, start + len(word))
    if letter in _UNSUPPORTED:
        what, hint = _UNSUPPORTED[letter]
        return Unreadable("NS1005", f"{word}: {what} elements are not supported", where, hint)
    if letter == "+":
        return Unreadable("NS1004", "a continuation line without a line to continue", where)
    hint = "a line starts with an element letter, a dot or *; a comment starts with *"
    return Unreadable("NS1004", f"no element starts with {letter}", where, hint)


def instance(reader: Reader, line: Line, content: list[Item]) -> InstanceTemplate:
    """Read ``X n1 n2 ... subcircuit [params:] [name=value ...]``."""
    pairs: list[Item] = []
    found = list(flat(content, pairs))
    name = found[0].text
    words = [item for item in found[1:] if item.text != "params:"]
    span = line.whole()
    for item in words:
        if item.kind != "word":
            where = line.span(item.start, item.end)
            message = f"{name}: {item.text[:40]} is not a node or a subcircuit name"
            raise Unreadable("NS1009", message, where, "parameters are written name=value")
    if not words:
        hint = "write Xname node node ... subcircuit name=value"
        raise Unreadable("NS1008", f"{name}: the subcircuit name is missing", span, hint)
    target = words[-1]
    nodes = tuple(GROUND.get(item.text, item.text) for item in words[:-1])
    spans = tuple(line.span(item.start, item.end) for item in words[:-1])
    params = {}
    for pair in pairs:
        if not pair.text:
            where = line.span(pair.start, pair.end)
            raise Unreadable("NS1007", f"{name}: a name is needed to the left of =", where)
        if pair.text in params:
            twice = line.span(pair.start, pair.end)
            message = f"{name}: parameter {pair.text} is given twice"
            raise Unreadable("NS1014", message, twice, "remove one of them")
        params[pair.text] = reader.param(line, pair)
    where = line.span(target.start, target.end)
    return InstanceTemplate(name, span, nodes, spans, target.text, where, params)
