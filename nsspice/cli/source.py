"""The netlist of a command: a file, or ``-`` for standard input."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..circuit import Circuit

#: stands for standard input
STDIN = "-"


def path_of(netlist: str) -> Path:
    """Return the name after which a command's files are called."""
    return Path("stdin.net" if netlist == STDIN else netlist)


def circuit_of(netlist: str, params: Mapping[str, float] | None = None) -> Circuit:
    """Return the circuit of a command's argument."""
    from ..analyses.load import read, read_deck
    from ..circuit import build

    if netlist == STDIN:
        return build(read_deck(sys.stdin.read() + "\n", params, "<stdin>"))
    return read(Path(netlist), params)
