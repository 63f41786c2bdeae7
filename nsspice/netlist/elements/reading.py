"""Reading values out of items: numbers, expressions, names, ``key=value`` pairs.

Everything here raises ``Unreadable`` with the place; the caller records it and goes on with the
next line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NoReturn

from ...errors import Span, suggest
from ..expressions import expression_parser
from ..expressions.node import Node
from ..findings import Findings, Unreadable
from ..text.lines import Line
from ..text.numbers import Number, as_float, read_number
from ..text.statement import Item
from .template import Formula, GridText, ParamText, Value

_NAME = re.compile(r"[^\W\d][\w.#$:\[\]!~-]*")
_PLAIN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_QUOTED = re.compile(r"\"[^\"]*\"|'[^']*'|\{[^}]*\}")
_KEY = re.compile(r"(?<![\w.<>=!])([^\W\d][\w.]*)\s*=(?!=)")


class Reader:
    """Values of one deck, with texts that come again remembered.

    Parameters
    ----------
    findings : Findings
        Receives the warnings about numbers.
    """

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        self._numbers: dict[str, Number | None] = {}
        self._trees: dict[str, Node] = {}

    def reporting(self, findings: Findings) -> Reader:
        """Return a reader that knows the same texts and reports elsewhere."""
        other = Reader(findings)
        other._numbers, other._trees = self._numbers, self._trees
        return other

    def number(self, line: Line, start: int, end: int, key: str = "") -> float | None:
        """Return the plain number at a place, None if it is something else.

        ``key`` is the name of the parameter that it belongs to.
        """
        text = line.raw[start:end]
        try:
            found = self._numbers[text]
        except KeyError:
            found = read_number(text)
            if len(self._numbers) < 200_000:
                self._numbers[text] = found
        if found is None:
            return None
        if found.trap:
            plain = not found.elsewhere or _may_be_farads(line, key)
            hint = found.hint if plain else found.elsewhere
            self.findings.warning("NS1011", found.trap, line.span(start, end), hint)
        if not math.isfinite(found.value):
            message = f"{text[:40]} is out of range"
            raise Unreadable("NS1010", message, line.span(start, end))
        return found.value

    def formula(self, line: Line, start: int, end: int) -> Value:
        """Return the expression at ``line[start:end]`` (without braces), a float if it is one."""
        text = line.raw[start:end]
        tree = self._trees.get(text)
        if tree is None:
            traps: list[str] = []

            def trap(message: str, hint: str, where: Span | None) -> None:
                traps.append(message)
                self.findings.warning("NS1011", message, where, hint)

            tree = expression_parser.parse(text, lambda s, e: line.span(start + s, start + e), trap)
            if not traps and len(self._trees) < 50_000:
                self._trees[text] = tree
        if tree.op == "num":
            value = as_float(tree.value)
            if not math.isfinite(value):
                message = f"{text[:40]} is out of range"
                raise Unreadable("NS1010", message, line.span(start, end))
            return value
        return Formula(tree, line, start, end)

    def value(self, line: Line, item: Item, what: str = "a value") -> Value:
        """Return the number or expression of one item."""
        kind = item.kind
        if kind == "word":
            number = self.number(line, item.start, item.end)
            if number is None and _NAME.fullmatch(line.raw[item.start : item.end]):
                return self.formula(line, item.start, item.end)  # a parameter without braces
            return self._worded(line, item, what) if number is None else number
        if kind in ("expr", "string"):
            return self.formula(line, item.start + 1, item.end - 1)
        if kind == "group" and len(item.items) == 1:
            return self.value(line, item.items[0], what)
        if kind == "call":  # vto=agauss(0.6, 0.1, 3)
            return self.formula(line, item.start, item.end)
        where = line.span(item.start, item.end)
        raise Unreadable("NS1009", f"{_shown(line, item)} is not {what}", where)

    def values(self, line: Line, items: Sequence[Item], what: str = "a value") -> list[Value]:
        """Return the numbers or expressions of many items: most are plain numbers."""
        raw = line.raw
        found: list[Value] = []
        for item in items:
            text = raw[item.start : item.end]
            number = math.nan
            # what ends in a digit, without a letter but e, has no suffix and no trap
            if item.kind == "word" and _PLAIN.fullmatch(text):
                number = float(text)
            # infinite numbers are reported where they are named
            found.append(number if math.isfinite(number) else self.value(line, item, what))
        return found

    def _worded(self, line: Line, item: Item, what: str) -> NoReturn:
        """Explain a word that is not a number where a number is needed."""
        where = line.span(item.start, item.end)
        text = line.raw[item.start : item.end]
        if re.match(r"[\d.]*\d[\w.]*[-+*/^]", text) or re.search(r"\w[*/+^-]\w", text):
            hint = "put an expression in braces, as in {2*r}"
        else:
            hint = "numbers look like 1.5, 2e-3, 10k, 4.7u"
        raise Unreadable("NS1010", f"{text[:60]} is not {what}", where, hint)

    def lenient(self, line: Line, item: Item, what: str = "a value") -> Value:
        """Return a number or expression where SPICE allows a parameter without braces."""
        if item.kind == "word":
            number = self.number(line, item.start, item.end)
            if number is not None:
                return number
            if re.fullmatch(r"[\w.*/+^-]+", item.text):
                return self.formula(line, item.start, item.end)
        return self.value(line, item, what)

    def param(self, line: Line, pair: Item) -> ParamText:
        """Return the value of a ``name=value`` item; a word is kept as it is."""
        right = pair.items[1]
        where = line.span(pair.start, pair.end)
        if right.kind == "word":
            number = self.number(line, right.start, right.end, pair.text)
            if number is not None:
                return ParamText(number, where)
            return ParamText(right.text, where, line.raw[right.start : right.end])
        if right.kind == "call" and right.text == "table":
            return ParamText(self._grid(line, right), where)
        if right.kind == "string":
            return ParamText(line.raw[right.start + 1 : right.end - 1], where)
        return ParamText(self.value(line, right), where)

    def _grid(self, line: Line, table: Item) -> GridText:
        """Return the lists of ``table(name=value value ... name=value ...)``."""
        lists: dict[str, list[Value]] = {}
        key = ""
        for item in table.items:
            where = line.span(item.start, item.end)
            if item.kind == "pair":
                key = key_of(line, item)
                if key in lists:
                    raise Unreadable("NS1014", f"table: {key} is given twice", where)
                lists[key] = [self.value(line, item.items[1])]
            elif key:
                lists[key].append(self.value(line, item))
            else:
                hint = "write table(i=0 10 20 v=0 600 e=...): a name before each list of numbers"
                raise Unreadable("NS1080", "a table consists of named lists", where, hint)
        return GridText({name: tuple(values) for name, values in lists.items()})

    def params(
        self, line: Line, pairs: Iterable[Item], known: Iterable[str], owner: str
    ) -> dict[str, ParamText]:
        """Return pairs by name; one outside of ``known`` is ignored unless it is a slip of one."""
        result: dict[str, ParamText] = {}
        for pair in pairs:
            key = key_of(line, pair)
            if key not in known:
                where = line.span(pair.start, pair.items[0].end)
                near = suggest(key, known)
                if near:
                    raise Unreadable("NS1014", f"{owner}: unknown parameter {key}", where, near)
                message = f"{owner}: unknown parameter {key} is ignored"
                hint = f"known: {', '.join(sorted(known))}"
                self.findings.warning("NS1014", message, where, hint)
                continue
            if key in result:
                where = line.span(pair.start, pair.end)
                raise Unreadable("NS1014", f"{owner}: parameter {key} is given twice", where)
            result[key] = self.param(line, pair)
        return result


def closed_once(findings: Findings, line: Line) -> Line:
    """Return a line with one closing parenthesis at its end for each that is open.

    SPICE reads over those too many and those missing there, which nothing else can be meant by.
    """
    raw = line.raw.rstrip()
    where = line.span(len(raw) - 1, len(raw))
    bare = _QUOTED.sub("", raw)
    surplus = bare.count(")") - bare.count("(")
    if surplus == 0:
        return line
    message, hint = "the closing parenthesis is missing here", "add it"
    if surplus > 0:
        message, hint = "a surplus closing parenthesis is ignored", "remove it"
    while surplus > 0 and raw.endswith(")"):
        raw, surplus = raw[:-1].rstrip(), surplus - 1
    if surplus > 0:  # it is elsewhere
        return line
    raw += ")" * -surplus
    findings.warning("NS1003", message, where, hint)
    return Line(raw, line.file, line.number, line.source, line.pieces)


def _may_be_farads(line: Line, key: str) -> bool:
    """Return whether a number may be meant as a capacitance: ``IS=10F`` is none."""
    text = line.text.lstrip()
    if text.startswith(".model"):
        return key.startswith("c")
    return text[:1] in ".cx" or key.startswith("c")


def key_of(line: Line, pair: Item) -> str:
    """Return the name on the left of a pair."""
    if not pair.text:
        where = line.span(pair.items[0].start, pair.items[0].end)
        raise Unreadable("NS1007", "put a name to the left of =", where)
    return pair.text


def flat(items: Iterable[Item], pairs: list[Item] | None = None) -> Iterator[Item]:
    """Yield words and expressions with groups and calls opened: parentheses only separate.

    Pairs go into the list, or are yielded as they are without one.
    """
    for item in items:
        kind = item.kind
        if kind == "pair" and pairs is not None:
            pairs.append(item)
        elif kind == "group":
            yield from flat(item.items, pairs)
        elif kind == "call":
            yield Item("word", item.text, item.start, item.start + len(item.text))
            yield from flat(item.items, pairs)
        else:
            yield item


def assignments(line: Line, start: int) -> tuple[int, list[tuple[str, int, int, int]]]:
    """Find ``name = expression`` items whose expressions need no braces.

    Parameters
    ----------
    line : Line
        The line.
    start : int
        Where to begin.

    Returns
    -------
    tuple
        Where the first name begins (the end of the line without one), and for each item its name,
        where the name begins, and where the expression begins and ends, without braces or quotes.
    """
    text = line.text
    depth = 0
    quoted = ""
    opened: list[int] = []  # depth before each character from start on would cost memory: scan once
    keys: list[tuple[str, int, int]] = []
    position = start
    for found in re.finditer(r"[(){}'\"]|" + _KEY.pattern, text[start:]):
        token = found.group()
        position = start + found.start()
        if quoted:
            quoted = "" if token == quoted else quoted
        elif token in "'\"":
            quoted = token
        elif token in "({":
            depth += 1
            opened.append(position)
        elif token in ")}":
            depth -= 1
        elif depth == 0:
            keys.append((found.group(1), position, start + found.end()))
    result = []
    for index, (key, begin, after) in enumerate(keys):
        stop = keys[index + 1][1] if index + 1 < len(keys) else len(text)
        result.append((key, begin, *_stripped(text, after, stop)))
    return (keys[0][1] if keys else len(text)), result


def _stripped(text: str, start: int, end: int) -> tuple[int, int]:
    """Return the bounds of a text without blanks, commas and one pair of braces or quotes."""
    while start < end and (text[start].isspace() or text[start] == ","):
        start += 1
    while end > start and (text[end - 1].isspace() or text[end - 1] == ","):
        end -= 1
    if end - start >= 2:
        first, last = text[start], text[end - 1]
        if first in "'\"" and last == first and first not in text[start + 1 : end - 1]:
            return start + 1, end - 1
        if first == "{" and last == "}" and "{" not in text[start + 1 : end - 1]:
            return start + 1, end - 1
    return start, end


def _shown(line: Line, item: Item) -> str:
    text = line.raw[item.start : item.end]
    return text if len(text) <= 40 else text[:37] + "..."
