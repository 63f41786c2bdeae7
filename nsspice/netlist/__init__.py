"""The netlist front end: SPICE text to an expanded deck.

``parse_text`` and ``parse_file`` return a ``Deck``; everything wrong with a netlist is raised
together, as one ``NetlistError``.  ``docs/reference/netlist.md`` describes the dialect; read
``parsing`` first, then the rooms in the order ``text``, ``expressions``, ``elements``,
``expansion``, ``cards``, ``script``.  Imports no other folder.

Examples
--------
>>> from nsspice.netlist import parse_text
>>> deck = parse_text('''rectifier
... V1 in 0 SIN(0 10 50)
... D1 in out
... R1 out 0 1k
... .tran 0.1m 40m''')
>>> [element.name for element in deck.elements]
['v1', 'd1', 'r1']
>>> deck.analyses[0].tstop
0.04
"""

from ..errors import NetlistError
from .deck import (
    Analysis,
    Cond,
    DcCard,
    Deck,
    Element,
    Measure,
    Model,
    OpCard,
    Param,
    Signal,
    Source,
    Sweep,
    TranCard,
)
from .expressions.expression import Expression
from .parsing import parse_file, parse_text
from .text.numbers import format_number, read_number

__all__ = [
    "Analysis",
    "Cond",
    "DcCard",
    "Deck",
    "Element",
    "Expression",
    "Measure",
    "Model",
    "NetlistError",
    "OpCard",
    "Param",
    "Signal",
    "Source",
    "Sweep",
    "TranCard",
    "format_number",
    "parse_file",
    "parse_text",
    "read_number",
]
