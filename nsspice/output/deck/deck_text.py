"""A whole deck as text: parameters, elements, models, subcircuits, then what is asked for."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Container, Iterator
from dataclasses import dataclass, field

from ...errors import Span
from ...netlist.cards.control import CardReader
from ...netlist.cards.options import OWN
from ...netlist.deck import Deck
from ...netlist.elements.reading import Reader
from ...netlist.elements.template import FunctionTemplate, GridText, ModelTemplate
from ...netlist.expansion.body import Body, BodyReader, Choice, Subcircuit
from ...netlist.findings import Findings
from ...netlist.parsing import Reading
from ...netlist.script.plan import REFUSED
from ...netlist.text.lines import Line
from ...netlist.text.numbers import read_number
from ...netlist.text.script import as_command
from . import words
from .element_lines import element_line

_WIDTH = 110
#: words of .tran without an effect
_IDLE_WORDS = re.compile(r"\s(?:steady|nodiscard|step)\b", re.IGNORECASE)
_PLAIN = re.compile(r"(?<![^\s(=,])[-+.\d][^\s(){}\[\]=,'\"]*")
#: cards that are written once for the whole deck
_MERGED = frozenset([
    "opt", "option", "options", "plot", "print", "probe", "probe64", "save", "title",
])  # fmt: skip


@dataclass(slots=True)
class Written:
    """A deck as text, and the names of definitions that nothing uses, which are not in it."""

    text: str
    unused: list[str] = field(default_factory=list)


def deck_text(reading: Reading, idle: Container[Span]) -> Written:
    """Return a deck, written again.

    Parameters
    ----------
    reading : Reading
    idle : container of Span
        Places of parameters without an effect.
    """
    writer = _Writer(idle, set(reading.scope.made))
    lines = list(writer.body(reading.body, reading.deck.title, reading.scope.models))
    lines += _merged(reading.deck)
    for script in reading.scripts:
        commands = [as_command(line).raw for line in script.commands]
        kept = [c for c in commands if c and c.split()[0].lower() not in REFUSED and c[0] != "!"]
        lines += [".control", *kept, ".endc"]
    text = "\n".join("\n".join(_folded(line)) for line in [_title(reading.deck), *lines, ".end"])
    return Written(text + "\n", writer.unused)


def _title(deck: Deck) -> str:
    """Return the first line; one that looks like an element is marked as a title."""
    title = " ".join(deck.title.split())
    return f"* {title}" if re.match(r"\.|[rlcvi]\w*\s", title, re.IGNORECASE) else title


def _folded(line: str) -> list[str]:
    """Return a long line as a line and its continuations, broken at blanks."""
    if len(line) <= _WIDTH or '"' in line:
        return [line]
    rows = textwrap.wrap(line, _WIDTH, break_long_words=False, break_on_hyphens=False)
    return [rows[0], *(f"+ {row}" for row in rows[1:])]


def _merged(deck: Deck) -> list[str]:
    """Return options and outputs, those that have an effect."""
    lines = []
    options = {k: p.value for k, p in deck.options.items() if k in OWN}
    if options:
        texts = [
            f"{key}={words.number(given) if isinstance(given, float) else given}"
            for key, given in options.items()
        ]
        lines.append(f".options {' '.join(texts)}")
    if deck.saves:
        lines.append(f".save {' '.join(signal.name for signal in deck.saves)}")
    return lines


class _Writer:
    """Writes bodies.

    Parameters
    ----------
    idle : container of Span
    used : set of str
        Models of the deck that elements use.
    """

    def __init__(self, idle: Container[Span], used: set[str]) -> None:
        self._idle = idle
        self._used = used
        self.unused: list[str] = []

    def body(
        self, body: Body, title: str = "", models: dict[str, ModelTemplate] | None = None
    ) -> Iterator[str]:
        """Yield the lines of a body; ``models`` are all those of the deck if it is that of it."""
        for name, (given, _) in body.params.items():
            yield f".param {name}={words.value(given)}"
        for function in body.functions.values():
            yield _function(function)
        for item in body.items:
            if isinstance(item, Choice):
                yield from self._choice(item, models is not None)
            else:
                yield element_line(item, self._idle)
        declared = dict(body.models)
        if models is not None:  # and the cards of standard parts
            declared |= {k: m for k, m in models.items() if m.span.file == "parts.lib"}
        for name, model in declared.items():
            if models is None or name in self._used:
                yield self._model(model)
            else:
                self.unused.append(f"model {name}")
        for definition in body.subcircuits.values():
            if definition.body is None:
                self.unused.append(f"subcircuit {definition.header.name}")
            else:
                yield from self._subcircuit(definition, definition.body)
        for card, line in body.cards:
            known = CardReader.reads(card, models is None)
            if known and (card not in _MERGED or models is None):
                yield _card(card, line)

    def _subcircuit(self, definition: Subcircuit, body: Body) -> Iterator[str]:
        header = definition.header
        defaults = [f"{name}={words.value(given)}" for name, (given, _) in header.params.items()]
        yield " ".join([".subckt", header.name, *header.nodes, *defaults])
        yield from self.body(body)
        yield f".ends {header.name}"

    def _choice(self, choice: Choice, outermost: bool) -> Iterator[str]:
        """Yield all branches; those not taken are read for the first time."""
        for k, branch in enumerate(choice.branches):
            if branch.condition is None:
                yield ".else"
            else:
                yield f".{'elseif' if k else 'if'} {words.formula(branch.condition.node)[1:-1]}"
            body = branch.body
            if body is None:
                findings = Findings()
                body = BodyReader(Reader(findings)).read(branch.block)
                if findings.errors:  # it may hold anything, such as cards of another program
                    where = findings.errors[0].span
                    self.unused.append(f"branch of .if on line {where.line if where else 0}")
                    body = Body()
            yield from self.body(body, models={} if outermost else None)
        yield ".endif"

    def _model(self, card: ModelTemplate) -> str:
        kind = f"ako:{card.base} {card.type}".strip() if card.base else card.type
        texts = []
        for key, given in card.params.items():
            if given.span in self._idle:
                continue
            if isinstance(given.value, GridText) and set(given.value.lists) == {"v"}:
                texts.append(f"{key}=[{' '.join(map(words.value, given.value.lists['v']))}]")
            else:
                texts.append(words.item(key, given))
        return f".model {card.name} {kind}" + (f"({' '.join(texts)})" if texts else "")


def _function(function: FunctionTemplate) -> str:
    body = words.formula(function.body.node)
    return f".func {function.name}({', '.join(function.formals)}) {body}"


def _card(card: str, line: Line) -> str:
    """Return a card as it is, with doubtful numbers as they were understood."""

    def understood(found: re.Match[str]) -> str:
        read = read_number(found.group())
        return words.number(read.value) if read is not None and read.trap else found.group()

    text = " ".join(line.raw.split())
    if card == "tran":
        text = _IDLE_WORDS.sub("", text)
    return _PLAIN.sub(understood, text)
