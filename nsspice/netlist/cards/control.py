"""Dot lines that ask for something: dispatch, and what is said about unknown ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ...errors import suggest
from ...lazy import resolve
from ..deck import Deck
from ..elements.reading import Reader
from ..expansion.definitions import parameters
from ..expansion.expand import Expander
from ..expansion.scope import Scope
from ..expressions.node import Node, TooLarge
from ..findings import Unreadable
from ..text.lines import Line
from .context import Context

#: where each card is read: only the readers of those that a deck has are imported
_READERS: dict[str, str] = {
    "ac": "periodic:ac",
    "csparam": "control:for_programs",
    "dc": "analyses:dc",
    "four": "periodic:four",
    "fourier": "periodic:four",
    "heatsink": "heat:heat_sink",
    "hb": "periodic:hb",
    "ic": "outputs:initial",
    "loop": "periodic:loop",
    "meas": "measure:measure",
    "measure": "measure:measure",
    "nodeset": "outputs:initial",
    "noise": "periodic:noise",
    "op": "analyses:op",
    "opt": "options:options",
    "option": "options:options",
    "options": "options:options",
    "plot": "outputs:outputs",
    "print": "outputs:outputs",
    "probe": "outputs:outputs",
    "probe64": "outputs:outputs",
    "pss": "periodic:pss",
    "pz": "ports:pz",
    "save": "outputs:outputs",
    "sp": "ports:sp",
    "step": "analyses:step",
    "tf": "periodic:tf",
    "tran": "analyses:tran",
}
#: read before the elements are built
_EARLY: dict[str, str] = {
    "global": "options:global_nodes",
    "temp": "options:temperature",
    "title": "options:title",
}
#: analyses that are computed, those that a program runs first
PROGRAM = frozenset(["op", "dc", "tran", "ac", "noise", "tf", "pz", "sp"])
_COMPUTED = (*PROGRAM, "pss", "hb", "loop", "sens")
#: cannot change a waveform
_IGNORED = {
    "backanno": "",
    "fft": "write .four for exact Fourier coefficients",
    "width": "",
    "wave": "",
    "net": "",
    "machine": "",
    "loadbias": "",
    "savebias": "",
    "text": "",
}
#: silent: every LTspice deck has them
_SILENT = {"backanno", "width", "text"}
#: analyses of their own: they change nothing of what others give
_OTHER_ANALYSES = ("acmodel", "disto")
_OTHER_HINT = "computed are .op, .dc, .tran, .ac, .pss, .hb, .loop, .noise, .tf, .pz, .sp and .sens"
_UNSUPPORTED = {
    "data": "write .step param name list ...",
    "alter": "write one netlist for each variant, or use .step",
    "del": "remove these lines",
    "ferret": "use .include with a local file",
    "load": "give initial values with .ic or IC=",
    "mc": "use .step",
    "wcase": "use .step",
}
_STRUCTURE = ("param", "subckt", "ends", "model", "include", "lib", "func", "if", "else", "elseif",
              "endif", "end", "control", "endc", "endl", "inc")  # fmt: skip


def _reader(place: str) -> Callable[[Context, Line], None]:
    reader: Callable[[Context, Line], None] = resolve(f".netlist.cards.{place}")
    return reader


def for_programs(context: Context, line: Line) -> None:
    """Read ``.csparam name=expression``: a number that programs know by its name."""
    for name, formula, _ in parameters(context.reader, line):
        context.for_programs[name] = context.here.number(formula)


class CardReader:
    """Reads the dot lines of an expanded deck.

    Parameters
    ----------
    deck : Deck
        Receives what the cards say.
    reader : Reader
        For values.
    scope : Scope
        The deck's own names.
    expander : Expander
        Holds the cards and the names of elements.
    """

    def __init__(self, deck: Deck, reader: Reader, scope: Scope, expander: Expander) -> None:
        self.context = self._context = Context(deck, reader, scope, expander)
        self._expander = expander
        self._computes = False  # whether the deck asks for an analysis that is computed

    @staticmethod
    def reads(card: str, inside: bool) -> bool:
        """Return whether a card asks for something, in the deck or inside a subcircuit."""
        if inside:
            return card in ("ic", "nodeset")
        return card in _READERS or card in _EARLY or card == "sens"

    def prepare(self) -> None:
        """Read what the elements depend on: .global, .temp, and .step without a .param."""
        for card, line, scope in self._expander.cards:
            if scope.prefix:
                continue
            if card in _EARLY:
                self._call(_reader(_EARLY[card]), line, scope)
            elif card == "step":
                self._call(_reader("analyses:early_step"), line, scope)
            elif card in ("options", "option", "opt"):
                self._call(_reader("options:early_options"), line, scope)

    def read(self, computes: bool = False) -> None:
        """Read all other cards; ``computes`` says that a program asks for analyses, too."""
        self._context.index()
        self._computes = computes or any(
            card in _COMPUTED and not scope.prefix for card, _, scope in self._expander.cards
        )
        for card, line, scope in self._expander.cards:
            if card in _EARLY and not scope.prefix:
                continue
            place = self._sens() if card == "sens" else _READERS.get(card)
            if place is None or (scope.prefix and card not in ("ic", "nodeset")):
                self._other(card, line, scope)
            else:
                self._call(_reader(place), line, scope)
        self._context.check_expressions()

    def command(self, line: Line, vectors: Mapping[str, Node] | None = None) -> None:
        """Read a command of a program that is a card without its dot.

        Raises
        ------
        Unreadable
            If it cannot be read.
        """
        card = line.text.split(None, 1)[0]
        dotted = type(line)(f".{line.raw}", line.file, line.number, line.source)
        self._context.here = self._context.home
        self._context.vectors = dict(vectors or {})
        try:
            place = self._sens() if card == "sens" else _READERS[card]
            _reader(place)(self._context, dotted)
        finally:
            self._context.vectors = {}

    def _sens(self) -> str:
        """Return what reads ``.sens``: of a periodic steady state, or of an operating point."""
        orbit = any(c == "pss" and not s.prefix for c, _, s in self._expander.cards)
        return "periodic:sens" if orbit else "periodic:sens_op"

    def _call(self, reader: Callable[[Context, Line], None], line: Line, scope: Scope) -> None:
        self._context.here = scope
        try:
            reader(self._context, line)
        except Unreadable as found:
            self._context.findings.record(found)
        except TooLarge:
            message = "the expressions of this line are too large"
            self._context.findings.error("NS1023", message, line.whole())

    def _other(self, card: str, line: Line, scope: Scope) -> None:
        """Report a card that is not read."""
        findings = self._context.findings
        start = line.text.index(".")
        where = line.span(start, start + 1 + len(card))
        if card in _IGNORED:
            if card not in _SILENT:
                findings.warning("NS1003", f".{card} is ignored", where, _IGNORED[card])
        elif self._computes and card in _OTHER_ANALYSES:
            findings.warning("NS1003", f".{card} is skipped", where, _OTHER_HINT)
        elif card in _OTHER_ANALYSES:
            findings.error("NS1002", f".{card} is not supported", where, _OTHER_HINT)
        elif card in _UNSUPPORTED:
            findings.error("NS1002", f".{card} is not supported", where, _UNSUPPORTED[card])
        elif card in _READERS or card in _EARLY:
            message = f".{card} inside a subcircuit is ignored"
            hint = "move it out of the .subckt block"
            findings.warning("NS1003", message, where, hint)
        else:
            known = [*_READERS, *_EARLY, *_STRUCTURE, "backanno"]
            hint = suggest(card, known, ".") or "a comment starts with *"
            findings.error("NS1001", f"unknown card .{card[:40]}", where, hint)
