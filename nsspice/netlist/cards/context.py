"""What the readers of dot lines share: the deck, names in sight, values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from ...errors import Span, suggest
from ..deck import Deck
from ..elements.reading import Reader, flat
from ..elements.template import Formula, Value
from ..elements.terminals import GROUND
from ..expansion.binding import NOTHING, names
from ..expansion.expand import Expander
from ..expansion.scope import Scope
from ..expressions.expression import Expression
from ..expressions.expression_parser import voltage
from ..expressions.node import COMPLEX_FORMS, Node, var
from ..findings import Unreadable
from ..text.lines import Line
from ..text.script import Command
from ..text.statement import Item, items

#: ends of elements whose currents have names of their own: i(q1.b)
_TERMINALS = {
    "q": ("c", "b", "e", "s"), "d": ("a", "k", "g"), "m": ("d", "g", "s", "b"),
    "j": ("d", "g", "s"), "z": ("c", "g", "e"),
}  # fmt: skip


class Context:
    """Deck, scope and names for the readers of dot lines.

    Parameters
    ----------
    deck : Deck
        Receives what the cards say.
    reader : Reader
        For values.
    scope : Scope
        The deck's own scope.
    expander : Expander
        Holds the elements.
    """

    def __init__(self, deck: Deck, reader: Reader, scope: Scope, expander: Expander) -> None:
        self.deck = deck
        self.reader = reader
        self.findings = reader.findings
        self.scope = scope
        self.here = scope  # scope of the card being read: .ic may be in a subcircuit
        self.home = scope
        #: names of a program, that go before parameters in what it measures
        self.vectors: dict[str, Node] = {}
        #: numbers of ``.csparam``
        self.for_programs: dict[str, float] = {}
        self.nodes: set[str] = set()
        self._expander = expander

    def index(self) -> None:
        """Collect the node names once all elements are known."""
        self.nodes.add("0")
        for element in self.deck.elements:
            self.nodes.update(element.nodes)
            if element.letter in "egs":
                self.nodes.update(element.controls)

    def is_element(self, name: str) -> bool:
        """Return whether an element, or a terminal of one, has this full name; no instance has."""
        places = self._expander.places
        owner, _, terminal = name.rpartition(".")
        if name in places and terminal[:1] != "x":
            return True
        letter = owner.rpartition(".")[2][:1]
        if owner in places and terminal in _TERMINALS.get(letter, ()):
            return True
        return self.findings.is_doubtful(name)

    def is_node(self, name: str) -> bool:
        """Return whether a node has this full name."""
        return name in self.nodes or self.findings.is_doubtful(name)

    # -- words and values ----------------------------------------------------------------------

    def split(self, line: Line) -> tuple[list[Item], list[Item]]:
        """Return the words and the pairs after the card's name."""
        pairs: list[Item] = []
        return list(flat(self.tail(line), pairs)), pairs

    def tail(self, line: Line) -> list[Item]:
        """Return the items after the card's name."""
        first, *rest = items(line)
        if first.kind != "word":
            where = line.span(first.start, first.end)
            message = "put a blank after the name of the card"
            raise Unreadable("NS1007", message, where)
        return rest

    def number(self, line: Line, item: Item, what: str) -> float:
        """Return the number of one item; a parameter's name will do, too."""
        return self.here.number(self.reader.lenient(line, item, what))

    def expression(self, line: Line, start: int, end: int) -> Expression:
        """Return an expression of signals."""
        given = self.reader.formula(line, start, end)
        local = NOTHING if isinstance(given, float) else self.measured(given)
        if self.vectors or isinstance(line, Command):
            local = {**local, **self._named(given)}
        value = self.here.expression(given, local=local)
        if isinstance(value, Expression):
            return value
        from ..expressions.node import num

        return Expression(num(value), line.span(start, end), line.raw[start:end])

    def measured(self, given: Formula) -> Mapping[str, Node]:
        """Return the earlier measures among the names of an expression."""
        known = {measure.name for measure in self.deck.measures}
        found = [n for n in names(given.node) if n in known] if known else []
        return {n: var(n) for n in found if self.here.parameter(n) is None}

    def _named(self, given: Value) -> Mapping[str, Node]:
        """Return what the names of a command stand for: vectors, and voltages of nodes."""
        if isinstance(given, float):
            return NOTHING
        known = {word: voltage(word) for word in names(given.node) if self.is_node(word)}
        return {**known, **self.vectors}

    # -- signals -------------------------------------------------------------------------------

    def node(self, name: str, span: Span) -> str:
        """Return the full name of a node that must exist."""
        full = self.here.node(GROUND.get(name, name))
        if not self.is_node(full):
            message = f"there is no node {name[:60]}"
            raise Unreadable("NS1071", message, span, suggest(name, self._near(self.nodes)))
        return full

    def element(self, name: str, span: Span) -> str:
        """Return the full name of an element that must exist."""
        full = self.here.prefix + name
        if not self.is_element(full):
            if full in self._expander.places:
                message = f"{name[:60]} is an instance, which has no current of its own"
                raise Unreadable(
                    "NS1070", message, span, f"name an element inside it: i({name}.r1)"
                )
            hint = suggest(name, self._near(self._expander.places))
            raise Unreadable("NS1070", f"there is no element {name[:60]}", span, hint)
        return full

    def _near(self, names: Iterable[str]) -> list[str]:
        """Return names as they are written at this place."""
        prefix = self.here.prefix
        return [n[len(prefix) :] for n in names if n.startswith(prefix)]

    def check_signals(self, expression: Expression, complex_forms: bool = False) -> None:
        """Report the first signal of an expression that does not exist.

        Parts of complex signals, ``vdb(out)``, exist in ``.measure ac`` only.
        """
        where = expression.span
        for written in sorted(expression.variables()):
            form, parenthesis, inner = written.partition("(")
            if not parenthesis:
                continue
            name = f"{form[0]}({inner}" if form in COMPLEX_FORMS and complex_forms else written
            if form in COMPLEX_FORMS and not complex_forms:
                message = f"{written} is part of a complex signal, which exists only in .measure ac"
                raise Unreadable("NS1022", message, where)
            if name[1:2] != "(":
                continue
            for part in name[2:-1].split(","):
                if name[0] == "v" and not self.is_node(part):
                    message = f"{name}: there is no node {part[:60]}"
                    raise Unreadable("NS1071", message, where, suggest(part, self.nodes))
                if name[0] in "ip" and not self.is_element(part):
                    hint = suggest(part, self._expander.places)
                    message = f"{name}: there is no element {part[:60]}"
                    raise Unreadable("NS1070", message, where, hint)

    def check_expressions(self) -> None:
        """Check the signals of all element expressions."""
        for element in self.deck.elements:
            if isinstance(element.value, Expression):
                try:
                    self.check_signals(element.value)
                except Unreadable as found:
                    message = f"{element.name}: {found.message}"
                    self.findings.error(found.code, message, found.span, found.hint)


def after_card(line: Line) -> int:
    """Return where the text after the card's name begins."""
    found = re.match(r"\s*\.[^\s(,={'\"]*\s*", line.text)
    return found.end() if found else 0
