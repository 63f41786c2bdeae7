"""All that a worker needs to run the points of a sweep: plain values, sent once."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from .. import __version__
from ..analyses.request.controller import Controller
from ..analyses.request.targets import Target
from ..errors import Diagnostic, UsageError
from ..netlist.deck import Deck, kind_of
from ..netlist.parsing import Outline, deck_of, outline_of
from ..netlist.text.source import read_text


@dataclass(frozen=True, slots=True)
class Options:
    """How each point is run.

    Parameters
    ----------
    method, theta, step, reltol, accuracy
        As for :func:`nsspice.tran`; None leaves it to the deck.
    power : bool
        Average powers of all elements, where a ``.tran`` or ``.pss`` is run.
    loads : tuple of str
        Elements whose power is useful.
    controllers : tuple of Controller
        With canonical names; each run begins with copies of them.
    """

    method: str | None = None
    theta: float | None = None
    step: float | None = None
    reltol: float | None = None
    accuracy: str | None = None
    power: bool = False
    loads: tuple[str, ...] = ()
    controllers: tuple[Controller, ...] = ()


@dataclass(frozen=True, slots=True)
class Plan:
    """A deck, what is changed in it and what is measured.

    Parameters
    ----------
    file : str
        Name of the deck for messages.
    text : str
    root : str
        Folder under which the deck and what it includes lie.
    folder : str
        Of the deck, relative to the root.
    files : tuple of (str, str)
        Included files relative to the root, and their texts.
    overrides : tuple of (str, float)
        Values in place of the deck's ``.param`` cards.
    confined : bool
    targets : tuple of Target
        What the columns of the points change.
    cards : tuple of str
        ``.measure`` cards besides those of the deck.
    options : Options
    """

    file: str
    text: str
    root: str
    folder: str
    files: tuple[tuple[str, str], ...]
    overrides: tuple[tuple[str, float], ...]
    confined: bool
    targets: tuple[Target, ...]
    cards: tuple[str, ...]
    options: Options

    @property
    def key(self) -> str:
        """A hash of everything that decides about the results, the version included."""
        content = {**asdict(self), "root": "", "version": __version__}
        text = json.dumps(content, sort_keys=True, default=_named)
        return hashlib.sha256(text.encode()).hexdigest()

    def outline(self, folder: Path) -> Outline:
        """Return the lines of the deck.

        Parameters
        ----------
        folder : Path
            Where its files are on this machine.
        """
        return outline_of(self.text, self.file, folder, self.confined, self.cards)

    def deck(self, outline: Outline, params: Mapping[str, float]) -> Deck:
        """Return the deck with other values of some parameters.

        Parameters
        ----------
        outline : Outline
            Of the deck.
        params : mapping of str to float

        Raises
        ------
        NetlistError
            The outline must not be used again.
        """
        given = {**dict(self.overrides), **params}
        deck = deck_of(outline, given)
        deck.overrides, deck.confined, deck.source = given, self.confined, self.text
        deck.steps = []  # the sweep replaces them
        return deck

    @classmethod
    def of(
        cls, deck: Deck, targets: Sequence[Target], cards: Sequence[str], options: Options
    ) -> Plan:
        """Return the plan for a deck that was read from a file or text."""
        main = Path(deck.file)
        here = Path() if deck.source else main.parent
        text = deck.source or read_text(main)
        included = [path.resolve() for path in deck.included]
        home = here.resolve()
        root = Path(os.path.commonpath([home, *(p.parent for p in included)]))
        files = tuple((os.path.relpath(path, root), read_text(path)) for path in included)
        return cls(
            deck.file,
            text,
            str(root),
            os.path.relpath(home, root),
            files,
            tuple(deck.overrides.items()),
            deck.confined,
            tuple(targets),
            tuple(cards),
            options,
        )


def _named(value: object) -> str:
    """Return the text of a value: of a function and an object without text its name."""
    plain = type(value).__repr__ is object.__repr__ or callable(value)
    return getattr(value, "__qualname__", type(value).__qualname__) if plain else str(value)


def measure_cards(deck: Deck, measures: Mapping[str, str]) -> tuple[str, ...]:
    """Return the ``.measure`` cards that a mapping of names to texts stands for.

    Parameters
    ----------
    deck : Deck
    measures : mapping of str to str
        What follows the name on a card: ``"AVG v(out) FROM=1m TO=2m"``; with the kind of
        analysis before it if the deck has several.

    Raises
    ------
    UsageError
        NS4005 if it is not clear which analysis is measured.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read("divider\\nV1 a 0 1\\nR1 a 0 1\\n.op\\n")
    >>> measure_cards(circuit.deck, {"out": "find v(a) at=0"})
    ('.measure op out find v(a) at=0',)
    """
    kinds = list(dict.fromkeys(kind_of(card) for card in deck.analyses))
    cards = []
    for name, text in measures.items():
        first, _, rest = text.strip().partition(" ")
        kind, what = (first.lower(), rest) if first.lower() in kinds else ("", text.strip())
        if not kind and len(kinds) != 1:
            message = f"measure {name} does not say of which analysis: {text!r}"
            hint = f"write it before the rest: {' or '.join(kinds) or 'tran'} {text.strip()}"
            raise UsageError(Diagnostic("NS4005", message, hint=hint))
        cards.append(f".measure {kind or kinds[0]} {name} {what}")
    return tuple(cards)
