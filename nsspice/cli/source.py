"""The netlist of a command: a file, or ``-`` for standard input."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import JUNCTIONS, SEED, is_confined

if TYPE_CHECKING:
    from ..circuit import Circuit

#: stands for standard input
STDIN = "-"


def path_of(netlist: str) -> Path:
    """Return the name after which a command's files are called."""
    return Path("stdin.net" if netlist == STDIN else netlist)


def circuit_of(netlist: str, params: Mapping[str, float] | None = None) -> Circuit:
    """Return the circuit of a command's argument; ``--confined``: nothing from outside."""
    from ..analyses.request.load import read_deck
    from ..circuit import build

    context = click.get_current_context(silent=True)
    seed = 0 if context is None else int(context.meta.get(SEED) or 0)
    junctions = None if context is None else context.meta.get(JUNCTIONS)
    source: str | Path = Path(netlist)
    if netlist == STDIN:
        source = sys.stdin.read() + "\n"
    deck = read_deck(
        source, params, "<stdin>", confined=is_confined(), seed=seed, junctions=junctions
    )
    return build(deck)
