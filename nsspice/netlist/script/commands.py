"""Lines of a program to statements: commands, loops and branches, nested as they are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from ..findings import Unreadable
from ..text.script import Command

LOOPS = ("repeat", "while", "dowhile", "foreach")
#: loops within loops
_MAX_NESTING = 30


@dataclass(slots=True)
class Loop:
    """``repeat n``, ``while c``, ``dowhile c``, ``foreach name word ...`` up to ``end``."""

    line: Command
    body: list[Statement] = field(default_factory=list)


@dataclass(slots=True)
class Branch:
    """``if c`` ... ``else`` ... ``end``."""

    line: Command
    body: list[Statement] = field(default_factory=list)
    other: list[Statement] = field(default_factory=list)


Statement = Command | Loop | Branch


def word_of(line: Command) -> str:
    """Return the name of a command."""
    return line.text.split(None, 1)[0] if line.text else ""


def statements(lines: list[Command]) -> list[Statement]:
    """Return the statements of a program.

    Raises
    ------
    Unreadable
        If a loop or branch is not closed, or something is closed that is not open.
    """
    rest = iter(lines)
    found, closing = _block(rest, 0)
    if closing is not None:
        raise _stray(closing)
    return found


def _block(lines: Iterator[Command], depth: int) -> tuple[list[Statement], Command | None]:
    """Return the statements up to the line that closes the block."""
    found: list[Statement] = []
    for line in lines:
        word = word_of(line)
        if word in ("end", "else"):
            return found, line
        if word not in LOOPS and word != "if":
            found.append(line)
            continue
        if depth >= _MAX_NESTING:
            message = f"loops are nested deeper than {_MAX_NESTING}"
            raise Unreadable("NS1042", message, line.whole())
        body, closing = _block(lines, depth + 1)
        other: list[Statement] = []
        if closing is not None and word == "if" and word_of(closing) == "else":
            other, closing = _block(lines, depth + 1)
        if closing is None:
            raise Unreadable("NS1044", f"{word} has no end", line.whole(), "close it with end")
        if word_of(closing) != "end":
            raise _stray(closing)
        found.append(Branch(line, body, other) if word == "if" else Loop(line, body))
    return found, None


def _stray(line: Command) -> Unreadable:
    """Return the finding about a line that closes nothing."""
    opener = "if" if word_of(line) == "else" else "a loop or if"
    return Unreadable("NS1044", f"{word_of(line)} without {opener}", line.whole())
