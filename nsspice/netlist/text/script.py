"""The lines of a ``.control`` block, as they are in the file."""

from __future__ import annotations

import re
from typing import NamedTuple

from ...errors import Span
from .lines import Line

#: in a program a dollar sign begins a comment only with a blank after it: $&x is a variable
_COMMENT = re.compile(r'"[^"]*"|((?:^|(?<=\s))(?:;|//|\$(?=\s|$)))')


class Script(NamedTuple):
    """A ``.control`` block: the place of its first line, and its commands."""

    where: Span
    commands: list[Line]


class Command(Line):
    """A line of a program with its variables put in; it is where the whole line is."""

    __slots__ = ()

    def span(self, start: int = 0, end: int | None = None) -> Span:
        """Return the place of the line in the file."""
        shown = self.source.strip()
        column = len(self.source) - len(self.source.lstrip()) + 1
        return Span(self.file, self.number, column, max(len(shown), 1), self.source)


def as_command(line: Line) -> Command:
    """Return a line with the variables that the rules of decks take for comments.

    Examples
    --------
    >>> as_command(Line("echo", "x.net", 3, "  echo $&x $ a remark")).raw
    'echo $&x'
    """
    raw = line.raw.strip()
    if line.pieces is None and "$" in line.source:
        raw = line.source.strip()
        for found in _COMMENT.finditer(raw):
            if found.group(1):
                raw = raw[: found.start()].rstrip()
                break
    return Command(raw, line.file, line.number, line.source)
