"""Standard parts by name: cards for decks that use a 1N4148 and do not bring its model."""

from __future__ import annotations

from pathlib import Path

from ..elements.reading import Reader
from ..elements.template import ModelTemplate
from ..text.files import card_of
from ..text.lines import logical_lines, physical_lines
from ..text.source import read_text
from .definitions import model

LIBRARY = Path(__file__).parents[2] / "library" / "parts.lib"


class Parts:
    """The cards of ``library/parts.lib``, read when a model is missing.

    Parameters
    ----------
    reader : Reader
    """

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self._cards: dict[str, ModelTemplate] | None = None

    def __call__(self, name: str) -> ModelTemplate | None:
        """Return the card of a part, with a warning; None if it is none of them."""
        if self._cards is None:
            rows = physical_lines(read_text(LIBRARY))
            lines = logical_lines(rows, LIBRARY.name)
            cards = [model(self._reader, line) for line in lines if card_of(line) == "model"]
            self._cards = {card.name: card for card in cards}
        found = self._cards.get(name)
        if found is not None:
            message = f"model {name} is not in the deck: nsspice's card for this part is used"
            hint = "copy the manufacturer's .model into the netlist for its exact values"
            self._reader.findings.warning("NS1098", message, found.span, hint)
        return found
