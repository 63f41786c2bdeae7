"""From files to one stream of logical lines: ``.include``, ``.lib``, ``.control``, ``.end``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from ...errors import Diagnostic, Span, suggest
from ..findings import Findings
from .data_files import numbers_of
from .lines import Line, logical_lines, physical_lines
from .script import Script
from .source import read_text

#: nested includes beyond this are a loop in disguise
MAX_DEPTH = 50
#: files included in all, each counted every time
MAX_INCLUDES = 10_000
#: lines of all files together, included files counted each time
MAX_LINES = 5_000_000

#: what LTspice writes into each netlist with a diode or a transistor, and PSpice into every one
_CATALOGUE = re.compile(
    r"[^\s\"'].*[\\/]lib[\\/]cmp[\\/]standard\.\w+"
    r"|(?<![^\s\"'])(?:nom\.lib|standard\.(?:dio|bjt|mos|jft|cap|ind|res|bead))\b",
    re.IGNORECASE,
)
#: libraries that come with nsspice
_OWN = {"control": Path(__file__).parents[2] / "library" / "control.lib"}
#: endings of files with models and subcircuits only
_LIBRARIES = frozenset(
    [".lib", ".sub", ".mod", ".model", ".models", ".mdl", ".dio", ".bjt", ".mos"]
)
#: the points of a source in a file of two columns
_POINTS = re.compile(r"\bpwl\s*\(?\s*file\s*=\s*(\"[^\"]*\"|'[^']*'|[^\s()]+)\s*\)?")
#: what code models of XSPICE read
_NUMBERS = re.compile(
    r"\s*\.model\s+\S+\s+(d_source|filesource|d_state)\b.*?"
    r"\b(?:input_|state_)?file\s*=\s*(\"[^\"]*\"|'[^']*'|[^\s()]+)"
)
_ARGUMENT = re.compile(r'"[^"]*"?|\'[^\']*\'?|\S+')


def card_of(line: Line) -> str:
    """Return the first word of a dot line without its dot, ``""`` for any other line.

    Examples
    --------
    >>> card_of(Line(".TRAN 1u 1m", "x.net", 2, ""))
    'tran'
    """
    text = line.text.lstrip()
    if text[:1] != ".":
        return ""
    found = re.match(r"\.([^\s(,={'\"]*)", text)
    return found.group(1) if found else ""


class FileReader:
    """Reads the main text and everything it includes.

    Parameters
    ----------
    findings : Findings
        Receives what is wrong with files and blocks.
    confined : Path, optional
        The folder that included files have to lie in, links resolved.

    Attributes
    ----------
    scripts : list of Script
        The ``.control`` blocks read so far.
    """

    def __init__(self, findings: Findings, confined: Path | None = None) -> None:
        self._confined = confined.resolve() if confined is not None else None
        self._includes = 0
        self.scripts: list[Script] = []
        self._findings = findings
        self._count = 0
        self._texts: dict[Path, list[str]] = {}

    @property
    def included(self) -> tuple[Path, ...]:
        """The files read so far, links resolved."""
        return tuple(self._texts)

    def main(self, rows: list[str], file: str, directory: Path) -> Iterator[Line]:
        """Yield the lines of the deck, from the line after the title on."""
        lines = logical_lines(rows[1:], file, 2)
        deck = directory / Path(file).name  # a deck that is only a text has no such file
        yield from self._lines(list(lines), directory, [deck.resolve()])

    def _lines(self, lines: list[Line], directory: Path, stack: list[Path]) -> Iterator[Line]:
        """Yield one file's lines, with included files in place of their cards."""
        index = 0
        while index < len(lines):
            line = lines[index]
            index += 1
            if line.text.lstrip()[:1] == ".":
                card = card_of(line)
                if card == "end":
                    if index < len(lines):
                        self._report_rest(lines[index:])
                    return
                if card == "control":
                    index = self._skip_control(lines, index - 1)
                    continue
                if card in ("include", "inc", "incl"):
                    yield from self._include(line, directory, stack, False)
                    continue
                if card == "lib":
                    closing = self._section_end(lines, index - 1)
                    if closing is None:
                        yield from self._include(line, directory, stack, True)
                    else:  # a section definition outside of its .lib call has no effect
                        index = closing + 1
                    continue
                if card in ("endl", "endc"):
                    opener = ".lib" if card == "endl" else ".control"
                    self._findings.error("NS1044", f".{card} without {opener}", line.whole())
                    continue
                if card == "model" and "file" in line.text and (found := _NUMBERS.match(line.text)):
                    line = self._with_numbers(line, found, directory)
            elif "file" in line.text and (found := _POINTS.search(line.text)):
                line = self._with_points(line, found, directory)
            self._count += 1
            if self._count > MAX_LINES:
                if self._count == MAX_LINES + 1:
                    message = f"included files contain more than {MAX_LINES} lines in total"
                    self._findings.error("NS1043", message, line.whole())
                return
            yield line

    def _report_rest(self, rest: list[Line]) -> None:
        """Warn of lines after .end, which some programs read all the same."""
        shown = ", ".join(f"'{line.shown()}'" for line in rest[:6]) + (", ..." * (len(rest) > 6))
        message = f"lines after .end are not read: {shown}"
        self._findings.warning("NS1093", message, rest[0].whole(), "move .end after them")

    def _skip_control(self, lines: list[Line], start: int) -> int:
        """Return the index after .endc; keep the commands between."""
        for index in range(start + 1, len(lines)):
            if card_of(lines[index]) in ("endc", "end"):
                break
        else:
            index = len(lines)
        where = lines[start].whole()
        if index == len(lines) or card_of(lines[index]) == "end":
            self._findings.error("NS1044", ".control without .endc", where)
        self.scripts.append(Script(where, lines[start + 1 : index]))
        return index + (index < len(lines) and card_of(lines[index]) == "endc")

    def _section_end(self, lines: list[Line], start: int) -> int | None:
        """Return the index of the .endl that closes a section opened here, None for a call."""
        words = _arguments(lines[start])
        if len(words) != 1:
            return None
        for index in range(start + 1, len(lines)):
            card = card_of(lines[index])
            if card == "endl":
                return index
            if card == "lib" and len(_arguments(lines[index])) == 1:
                return None
        return None

    def _include(
        self, line: Line, directory: Path, stack: list[Path], library: bool
    ) -> Iterator[Line]:
        """Yield the lines of an included file or of one section of a library."""
        words = _arguments(line)
        if not words or not words[0][0]:
            hint = 'write .include "models.lib"'
            self._findings.error("NS1050", "file name is missing", line.whole(), hint)
            self._findings.incomplete = True
            return
        name, start = words[0]
        catalogue = library and _CATALOGUE.search(line.raw, start)
        if catalogue:  # the path has no quotes, even with blanks
            name, words = catalogue.group(), words[:1]
        where = line.span(start, start + len(name))
        path = directory / Path(name).expanduser() if name[:1] == "~" else directory / name
        if "\\" in name and not path.exists():  # written on Windows
            path = directory / name.replace("\\", "/")
        if catalogue and not path.exists():
            message = f"the parts catalogue {name} is not available"
            hint = "copy the models you need from it into the netlist"
            self._findings.warning("NS1053", message, where, hint)
            return
        if library and name.lower() in _OWN and len(words) == 1 and not path.is_file():
            path = _OWN[name.lower()]
        # nobody learns whether a file exists outside the folder
        if _is_library(name, library) and not self._is_outside(path) and not _exists(path):
            message = f"library {name} does not exist"
            hint = f"looked for {path}; copy the models you need into the netlist"
            self._findings.absent.append(Diagnostic("NS1050", message, where, hint))
            return
        rows = self._open(path, name, where, stack)
        if rows is None:
            self._findings.incomplete = True
            return
        lines = list(logical_lines(rows, str(path)))
        if library and len(words) > 1:
            section = self._section(lines, words[1][0].lower(), name, line, words[1][1])
            if section is None:
                self._findings.incomplete = True
                return
            lines = section
        yield from self._lines(lines, path.parent, [*stack, path.resolve()])

    def _with_points(self, line: Line, found: re.Match[str], directory: Path) -> Line:
        """Return a source line with the points of a file in the place of ``file=name``."""
        start, end = found.span(1)
        name = line.raw[start:end].strip("\"'")
        rows = self._open(directory / name.replace("\\", "/"), name, line.span(start, end), [])
        points = " ".join(row.replace(",", " ") for row in rows or [])
        if rows is None or not points.strip():
            return line
        raw = f"{line.raw[: found.start()]}pwl({points}){line.raw[found.end() :]}"
        return Line(raw, line.file, line.number, line.source)

    def _with_numbers(self, line: Line, found: re.Match[str], directory: Path) -> Line:
        """Return the card of a code model with the numbers of its file: ``rows=[...]``."""
        start, end = found.span(2)
        name = line.raw[start:end].strip("\"'")
        rows = self._open(directory / name.replace("\\", "/"), name, line.span(start, end), [])
        values = numbers_of(found[1], rows or [])
        if not values:
            return line
        begin = re.search(r"(?:input_|state_)?file\s*=\s*$", line.raw[:start], re.IGNORECASE)
        first = begin.start() if begin else start
        raw = f"{line.raw[:first]}rows=[{' '.join(values)}]{line.raw[end:]}"
        return Line(raw, line.file, line.number, line.source)

    def _open(self, path: Path, name: str, where: Span, stack: list[Path]) -> list[str] | None:
        """Return the rows of an included file; None after a finding."""
        try:
            real = path.resolve()
            if self._is_outside(path):
                message = f"file {name} is outside the netlist's folder"
                hint = "this run is confined to that folder: copy the file into it"
                self._findings.error("NS1054", message, where, hint)
                return None
            self._includes += 1
            if self._includes > MAX_INCLUDES:
                if self._includes == MAX_INCLUDES + 1:
                    message = f"more than {MAX_INCLUDES} files are included"
                    hint = "if a file includes another twice, the number doubles at each level"
                    self._findings.error("NS1051", message, where, hint)
                return None
            if real in stack:
                loop = " -> ".join(p.name for p in [*stack[stack.index(real) :], real])
                message = f"file {name} includes itself: {loop}"
                self._findings.error("NS1051", message, where, "remove one of the .include cards")
                return None
            if len(stack) >= MAX_DEPTH:
                message = f"files are included more than {MAX_DEPTH} deep"
                self._findings.error("NS1051", message, where)
                return None
            if real not in self._texts:
                self._texts[real] = physical_lines(read_text(path))
            return self._texts[real]
        except FileNotFoundError:
            try:
                near = [entry.name for entry in path.parent.iterdir()]
            except (OSError, ValueError):
                near = []
            hint = suggest(path.name, near) or f"looked for {path}"
            self._findings.error("NS1050", f"file {name} does not exist", where, hint)
        except (OSError, ValueError, RuntimeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            self._findings.error("NS1050", f"file {name} cannot be read: {reason}", where)
        return None

    def _is_outside(self, path: Path) -> bool:
        """Return whether a file is not one that this run may read."""
        if self._confined is None or path in _OWN.values():
            return False
        try:
            return not path.resolve().is_relative_to(self._confined)
        except (OSError, ValueError, RuntimeError):  # no name of a file
            return False

    def _section(
        self, lines: list[Line], section: str, name: str, line: Line, start: int
    ) -> list[Line] | None:
        """Return the lines of one section of a library file."""
        known: list[str] = []
        for index, row in enumerate(lines):
            if card_of(row) != "lib":
                continue
            closing = self._section_end(lines, index)
            if closing is None:
                continue
            title = _arguments(row)[0][0].lower()
            if title == section:
                return lines[index + 1 : closing]
            known.append(title)
        hint = suggest(section, known) or (f"sections: {', '.join(known[:20])}" if known else "")
        message = f"library {name} has no section {section}"
        self._findings.error("NS1052", message, line.span(start, start + len(section)), hint)
        return None


def _is_library(name: str, library: bool) -> bool:
    """Return whether a file holds models: what else it may hold changes no deck silently."""
    return library or Path(name.replace("\\", "/")).suffix.lower() in _LIBRARIES


def _exists(path: Path) -> bool:
    """Return whether there is a file, of any kind."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return True  # what is wrong with it is said when it is opened


def _arguments(line: Line) -> list[tuple[str, int]]:
    """Return the words after the card with their places, quotes removed."""
    words = [(m.group(), m.start()) for m in _ARGUMENT.finditer(line.raw)][1:]
    return [(w[1:].rstrip(w[0]), s + 1) if w[0] in "\"'" else (w, s) for w, s in words]
