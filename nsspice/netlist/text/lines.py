"""Logical lines: physical lines joined at ``+``, without comments, each character traceable.

``*`` in the first column starts a comment line; ``;`` anywhere, a blank and ``$``, and ``//`` start
a comment to the end of the line (not inside double quotes, which contain file names).
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator

from ...errors import Span

_COMMENT = re.compile(r'"[^"]*"|(;|//|(?:(?<=\s)|^)\$)')
_ASCII_LOWER = {upper: upper + 32 for upper in range(65, 91)}


class Line:
    """One logical line.

    Parameters
    ----------
    raw : str
        The joined text in its original spelling, comments removed.
    file : str
        File name for messages.
    number : int
        Number of the first physical line, from 1.
    source : str
        The first physical line as it is in the file.
    plain : bool
        Set when the line was found to be nothing but words.
    pieces : list of (int, int, int, str) or None
        For continued lines: start in ``raw``, line number, column offset, physical line.
    """

    __slots__ = ("file", "number", "pieces", "plain", "raw", "source", "text")

    def __init__(
        self,
        raw: str,
        file: str,
        number: int,
        source: str,
        pieces: list[tuple[int, int, int, str]] | None = None,
    ) -> None:
        self.raw = raw
        text = raw.lower()
        # a few letters grow when lowered (Turkish dotted I); columns must stay where they are
        self.text = text if len(text) == len(raw) else raw.translate(_ASCII_LOWER)
        self.plain = False
        self.file = file
        self.number = number
        self.source = source
        self.pieces = pieces

    def span(self, start: int = 0, end: int | None = None) -> Span:
        """Return the place of ``raw[start:end]``; a part over two lines is cut at the first."""
        if end is None:
            end = len(self.raw)
        if self.pieces is None:
            return Span(self.file, self.number, start + 1, max(end - start, 1), self.source)
        index = max(bisect_right(self.pieces, start, key=lambda piece: piece[0]) - 1, 0)
        first, number, column, source = self.pieces[index]
        if index + 1 < len(self.pieces):
            end = min(end, self.pieces[index + 1][0] - 1)
        return Span(self.file, number, start - first + column + 1, max(end - start, 1), source)

    def shown(self) -> str:
        """Return the text for a message, in short."""
        return " ".join(self.raw.split())[:60]

    def whole(self) -> Span:
        """Return the place of the line from its first visible character on."""
        start = len(self.raw) - len(self.raw.lstrip())
        return self.span(start, len(self.raw.rstrip()))


def without_comment(raw: str) -> str:
    """Return a physical line without its end-of-line comment.

    Examples
    --------
    >>> without_comment("R1 a 0 1k ; load")
    'R1 a 0 1k'
    >>> without_comment('.include "a;b.lib" $ models')
    '.include "a;b.lib"'
    """
    if ";" in raw or "$" in raw or "//" in raw:
        for found in _COMMENT.finditer(raw):
            if found.group(1):
                return raw[: found.start()].rstrip()
    return raw


def physical_lines(text: str) -> list[str]:
    """Split a text at line ends only (form feeds and the like do not count as lines)."""
    text = text.rstrip("\x1a\n\r\t ") + "\n" if "\x1a" in text[-20:] else text  # DOS: Ctrl-Z
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.split("\n")


def logical_lines(rows: list[str], file: str, first: int = 1) -> Iterator[Line]:
    """Join continuations and drop comments.

    Parameters
    ----------
    rows : list of str
        Physical lines, without the title.
    file : str
        File name for messages.
    first : int
        Line number of the first row.

    Examples
    --------
    >>> [line.text for line in logical_lines(["R1 a 0", "* load", "+ 1K"], "x.net", 2)]
    ['r1 a 0  1k']
    """
    raw, number = "", 0
    parts: list[tuple[str, int, int, str]] = []  # text, line number, column, physical line
    for offset, source in enumerate(rows):
        head = source[:1]
        if head == "*":
            continue
        if head <= " ":  # blank, tab or nothing: look at the first visible character
            stripped = source.lstrip()
            head = stripped[:1]
            if not head or head == "*":
                continue
        if head in ("+", ")") and number:  # a lone bracket ends the list of the line before
            start = source.index(head) + (head == "+")
            parts.append((without_comment(source)[start:], first + offset, start, source))
            continue
        content = without_comment(source)
        if not content or content.isspace():  # nothing but a comment
            continue
        if number:
            yield _joined(raw, file, number, rows[number - first], parts)
            parts = []
        raw, number = content, first + offset
    if number:
        yield _joined(raw, file, number, rows[number - first], parts)


def _joined(
    raw: str, file: str, number: int, source: str, parts: list[tuple[str, int, int, str]]
) -> Line:
    """Make one line of a first row and its continuations."""
    if not parts:
        return Line(raw, file, number, source)
    pieces = [(0, number, 0, source)]
    texts = [raw]
    length = len(raw)
    for text, row, column, physical in parts:
        pieces.append((length + 1, row, column, physical))
        texts.append(text)
        length += 1 + len(text)
    return Line(" ".join(texts), file, number, source, pieces)
