"""Schematics that are given instead of netlists: recognised, with the way to a netlist."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Schematic:
    """A program that draws schematics.

    Parameters
    ----------
    program : str
    begins : str
        A pattern for the first characters of its files.
    export : str
        How a netlist is made of them.
    """

    program: str
    begins: str
    export: str


_ALL = (
    Schematic(
        "LTspice",
        r"Version\s+\d[\d.]*\s+SHEET\b",
        "in LTspice choose View, SPICE Netlist, and save it; or run LTspice -netlist FILE.asc, "
        "which writes FILE.net",
    ),
    Schematic(
        "LTspice (a symbol)",
        r"Version\s+\d[\d.]*\s+SymbolType\b",
        "simulate a netlist that uses it",
    ),
    Schematic(
        "KiCad",
        r"\(kicad_sch\b|EESchema Schematic File\b",
        "in KiCad choose File, Export, Netlist, SPICE; or run "
        "kicad-cli sch export netlist --format spice FILE.kicad_sch",
    ),
    Schematic(
        "QSPICE",
        r"(?:\xff\xd8\xff\xdb)?\s*[\xab\u00ab]schematic\b",
        "in QSPICE choose View, Netlist, and save it; or run QUX -Netlist FILE.qsch",
    ),
    Schematic(
        "Qucs",
        r"<Qucs Schematic\b",
        "in Qucs-S choose Simulation, Save netlist, with SPICE as simulator",
    ),
    Schematic("xschem", r"v\s*\{xschem\b", "in xschem choose Netlist with SPICE as its format"),
)


def schematic_of(text: str) -> Schematic | None:
    """Return which program drew a text, None for anything that may be a netlist.

    Parameters
    ----------
    text : str
        The first lines will do.

    Examples
    --------
    >>> schematic_of("Version 4\\nSHEET 1 880 680\\n").program
    'LTspice'
    >>> schematic_of("a divider\\nV1 a 0 1\\n") is None
    True
    """
    head = text[:400].lstrip("\ufeff\ufffd \t\r\n")
    return next((s for s in _ALL if re.match(s.begins, head, re.IGNORECASE)), None)
