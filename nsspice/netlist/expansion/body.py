"""The content of a deck or subcircuit, each line read once however often it is instantiated."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from ...errors import Span
from ..elements.elements import element
from ..elements.reading import Reader
from ..elements.template import (
    CodeTemplate,
    Formula,
    FunctionTemplate,
    InstanceTemplate,
    ModelTemplate,
    Template,
)
from ..expressions.node import TooLarge
from ..findings import Findings, Unreadable
from ..text.files import card_of
from ..text.lines import Line
from ..text.structure import Block, Conditional, Definition
from .definitions import Header, as_formula, function, model, parameters


@dataclass(slots=True)
class Branch:
    """One branch of an .if, read when it is first taken; the condition of .else is None."""

    condition: Formula | None
    block: Block
    body: Body | None = None


@dataclass(slots=True)
class Choice:
    """The branches of an .if."""

    branches: list[Branch]


@dataclass(slots=True)
class Subcircuit:
    """A definition: header and body, the body read when it is first used."""

    header: Header
    block: Block
    body: Body | None = None


@dataclass(slots=True)
class Body:
    """What a block of lines declares.

    ``items`` holds elements, instances and choices in deck order; ``cards`` the dot lines that ask
    for analyses and outputs.
    """

    items: list[Template | InstanceTemplate | CodeTemplate | Choice] = field(default_factory=list)
    params: dict[str, tuple[Formula, Span]] = field(default_factory=dict)
    functions: dict[str, FunctionTemplate] = field(default_factory=dict)
    models: dict[str, ModelTemplate] = field(default_factory=dict)
    subcircuits: dict[str, Subcircuit] = field(default_factory=dict)
    cards: list[tuple[str, Line]] = field(default_factory=list)


#: a lone = in a condition, with a blank next to it that makes room for a second one
_LONE_EQUAL = re.compile(r"(?<![=<>!])(?: =|= |=)(?!=)")


def _equality(line: Line) -> Line:
    """Return the line of a condition with ``==`` for ``=``, which cannot mean anything else."""
    raw = _LONE_EQUAL.sub("==", line.raw)
    return line if raw == line.raw else Line(raw, line.file, line.number, line.source, line.pieces)


#: the points of a table after its expression
_TABLE = re.compile(r"\btable\s*\{[^{}]*\}\s*=?\s*(?=\()([-+\w.,()\s]+)$", re.IGNORECASE)


def _balanced(line: Line) -> Line | None:
    """Return the line of a table whose parentheses do not match, with one pair for each point.

    None for other lines, and if there is no second number for each first one.
    """
    found = _TABLE.search(line.raw)
    if found is None or line.raw.count("(") == line.raw.count(")"):
        return None
    numbers = re.findall(r"[^\s,()]+", found[1])
    if len(numbers) % 2:
        return None
    points = " ".join(f"({x},{y})" for x, y in zip(numbers[::2], numbers[1::2], strict=True))
    raw = line.raw[: found.start(1)] + points
    return Line(raw, line.file, line.number, line.source, line.pieces)


def _texts(entry: Line | Definition | Conditional) -> list[object]:
    """Return the lines of an entry without blanks, to compare it with another."""
    if isinstance(entry, Line):
        return [" ".join(entry.text.split())]
    if isinstance(entry, Definition):
        return [_texts(entry.header), *map(_texts, entry.block.entries)]
    return [[_texts(line), *map(_texts, block.entries)] for line, block in entry.branches]


def _content(model: ModelTemplate) -> list[object]:
    """Return the values of a card, to compare it with another."""
    texts = [
        (key, p.value.text if isinstance(p.value, Formula) else p.value)
        for key, p in sorted(model.params.items())
    ]
    return [model.type, model.base, texts]


class BodyReader:
    """Turns blocks into bodies.

    Parameters
    ----------
    reader : Reader
        For values; its findings collect what cannot be read.
    """

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self._findings: Findings = reader.findings

    def read(self, block: Block) -> Body:
        """Read all lines of a block; what cannot be read is recorded and left out."""
        body = Body()
        findings = self._findings
        reader = self._reader
        append = body.items.append
        for entry in block.entries:
            try:
                if isinstance(entry, Line):
                    text = entry.text
                    if text[0] == "." or text.lstrip()[0] == ".":
                        self._card(body, entry)
                    elif "table" in text and (balanced := _balanced(entry)) is not None:
                        message = "the parentheses of this table do not match: they are ignored"
                        findings.warning("NS1003", message, entry.whole())
                        append(element(reader, balanced))
                    else:
                        append(element(reader, entry))
                elif isinstance(entry, Definition):
                    self._definition(body, entry)
                else:
                    append(self._choice(entry))
            except Unreadable as found:
                findings.record(found)
                self.doubt(entry)
            except TooLarge:
                place = entry.whole() if isinstance(entry, Line) else None
                findings.error("NS1023", "the expressions of this line are too large", place)
        return body

    def doubt(self, *entries: Line | Definition | Conditional) -> None:
        """Note the names that entries with errors may have declared, so that none is missed."""
        for entry in entries:
            if isinstance(entry, Line):
                words = re.findall(r"[^\s(),={}]+", entry.text)
                self._findings.doubtful.update(words[:100])
            elif isinstance(entry, Definition):
                self.doubt(entry.header)
            else:
                for _, block in entry.branches:
                    self.doubt(*block.entries)

    def _definition(self, body: Body, entry: Definition) -> None:
        """Declare a subcircuit."""
        header = Header(self._reader, entry.header)
        before = body.subcircuits.get(header.name)
        if before is not None:
            message = f"subcircuit {header.name} is defined twice"
            hint = f"the other one is on line {before.header.span.line}"
            if _texts(entry) == _texts(Definition(before.header.line, before.block)):
                message = f"subcircuit {header.name} is defined twice, with the same text"
                self._findings.warning("NS1006", message, header.span, hint)
                return
            self._findings.error("NS1006", message, header.span, hint)
            return
        body.subcircuits[header.name] = Subcircuit(header, entry.block)

    def _choice(self, entry: Conditional) -> Choice:
        """Read the conditions."""
        branches: list[Branch] = []
        for index, (line, block) in enumerate(entry.branches):
            if index and branches[-1].condition is None:
                raise Unreadable(
                    "NS1044", "a branch comes after .else", line.whole(), "move .else last"
                )
            found = re.match(r"\s*\.\w+\s*", line.text)
            start = found.end() if found else 0
            if card_of(line) == "else":
                condition = None
            else:
                line = _equality(line)
                condition = as_formula(self._reader, line, start, len(line.raw.rstrip()))
            branches.append(Branch(condition, block))
        return Choice(branches)

    def _card(self, body: Body, line: Line) -> None:
        """Sort a dot line into declarations and requests."""
        card = card_of(line)
        if card in ("param", "params", "parameter", "parameters"):
            defined = function(self._reader, line)
            if defined is not None:
                self._function(body, defined)
                return
            for name, formula, where in parameters(self._reader, line):
                before = body.params.get(name)
                if before is not None:
                    message = f"parameter {name} is defined again; the last definition counts"
                    hint = f"the other one is on line {before[1].line}"
                    self._findings.warning("NS1032", message, where, hint)
                body.params[name] = (formula, where)
        elif card == "func":
            defined = function(self._reader, line)
            assert defined is not None
            self._function(body, defined)
        elif card == "model":
            found = model(self._reader, line)
            known = body.models.get(found.name)
            if known is not None:
                message = f"model {found.name} is defined twice"
                hint = f"the other one is on line {known.span.line}"
                if _content(found) == _content(known):
                    message = f"model {found.name} is defined twice, with the same values"
                    self._findings.warning("NS1061", message, found.span, hint)
                    return
                self._findings.error("NS1061", message, found.span, hint)
                return
            body.models[found.name] = found
        else:
            body.cards.append((card, line))

    def _function(self, body: Body, defined: FunctionTemplate) -> None:
        """Declare a function."""
        if defined.name in body.functions:
            message = f"function {defined.name} is defined again; the last definition counts"
            hint = f"the other one is on line {body.functions[defined.name].span.line}"
            self._findings.warning("NS1032", message, defined.span, hint)
        body.functions[defined.name] = defined
