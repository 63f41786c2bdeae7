"""What a ``.control`` block asks for.

ngspice runs the block as a program.  Most blocks only run analyses and look at the results; such a
block asks for what the same analyses ask for as cards.  One command that may change the circuit, or
that decides which commands run and how often, makes the block a program in earnest, which is not
executed.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from ...errors import Span
from ..findings import Findings
from .lines import Line

#: analyses that are computed; a command is spelt as the card is, without its dot
ANALYSES = ("op", "dc", "tran")
#: commands that leave the circuit as it is: they run, show, keep and compute with results
_LOOKING = (
    " ac asciiplot compose cross define deftype destroy diff display disto echo eprint exit fft "
    "fourier gnuplot hardcopy history iplot let linearize listing meas measure noise option "
    "options plot print psd pss pz quit rehash run rusage save sens set setcs setplot setscale "
    "settype shell show showmod sp spec status strcmp tf undefine unlet unset version where "
    "wrdata write wrnodev wrs2p xgraph "
)
#: words of ``set`` and ``option`` that change the circuit after all
_TEMPERATURE = re.compile(r"\b(temp|tnom)\b")
#: a variable of the program, which elsewhere begins a comment
_VARIABLE = re.compile(r"\$[&\w({]")


class Script(NamedTuple):
    """A ``.control`` block: the place of its first line, and its commands."""

    where: Span
    commands: list[Line]

    def analyses(self) -> list[Line]:
        """Return the commands that are analyses; none if the block is a program."""
        for line in self.commands:
            word = _word(line)
            if word not in ANALYSES and f" {word} " not in _LOOKING:
                return []
            if word in ("set", "option", "options") and _TEMPERATURE.search(line.text):
                return []
            if word in ANALYSES and _VARIABLE.search(line.source):
                return []
        return [line for line in self.commands if _word(line) in ANALYSES]

    def report(self, taken: list[Line], findings: Findings) -> None:
        """Warn once, naming the commands that are left out."""
        left = [line for line in self.commands if line not in taken]
        shown = ", ".join(f"'{line.shown()}'" for line in left[:12])
        shown += ", ..." if len(left) > 12 else ""
        known = [line for line in left if _word(line) in (*ANALYSES, "meas")]
        hint = f"write it as a card: .{known[0].shown()}" if known else ""
        message = f".control block is not executed: {shown}" if shown else ".control block is empty"
        if taken:
            read = ", ".join(f"'{line.shown()}'" for line in taken[:12])
            message = f"of the .control block only {read} is read; "
            message += f"not executed: {shown}" if shown else "it contains nothing else"
        findings.warning("NS1090", message, self.where, hint)


def _word(line: Line) -> str:
    """Return the name of a command."""
    return line.text.split(None, 1)[0]
