"""The netlist of a command: a file, or ``-`` for standard input."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..circuit import Circuit
    from ..netlist.deck import Deck

#: stands for standard input
STDIN = "-"


def name_of(netlist: str) -> Path:
    """Return the name after which a command's files are called."""
    return Path("stdin.net" if netlist == STDIN else netlist)


def deck_of(netlist: str, params: Mapping[str, float] | None = None) -> Deck:
    """Return the deck of a command's argument."""
    from ..analyses.load import read_deck

    if netlist == STDIN:
        return read_deck(sys.stdin.read() + "\n", params, "<stdin>")
    return read_deck(Path(netlist), params)


def circuit_of(netlist: str, params: Mapping[str, float] | None = None) -> Circuit:
    """Return the circuit of a command's argument."""
    from ..circuit import build

    return build(deck_of(netlist, params))
