"""``.param``, ``.func``, ``.model`` and the header of ``.subckt``."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ...errors import Span
from ..elements.reading import Reader, assignments, closed_once, flat, key_of
from ..elements.template import Formula, FunctionTemplate, ModelTemplate, ParamText
from ..elements.terminals import GROUND
from ..expressions.node import num
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item, items

_RESERVED = {"time", "temper", "hertz"}
#: PSpice's lateral PNP: every PNP is lateral here, unless SUBS=1
_SAME_TYPES = {"lpnp": "pnp"}
_TYPES = frozenset(["d", "njf", "pjf", "nmos", "npn", "pmos", "pnp", "lpnp", "vdmos", "sw", "csw"])
#: .model D1 D {Ron=1m}: braces in the place of parentheses, all on their own
_BRACES = re.compile(r"^(\s*\.model\s+\S+\s+\w+\s*)\{([^{}]*)\}\s*$", re.IGNORECASE)
#: in_gain = [1 2 3], of a code model
_VECTOR = re.compile(r"=\s*\[\s*([^\[\]]*?)\s*\]")
_COUPLED = re.compile(r"\s*\.model\s+\S+\s+cpl\b", re.IGNORECASE)
#: R = 0.3 0 0.3, of a line of several conductors: the upper triangle of a matrix
_TRIANGLE = re.compile(
    r"\b([rlgc])\s*=\s*((?:[-+]?[.\d][\w.]*(?:[-+]\d+\w*)?[\s,]*){3,})", re.IGNORECASE
)
_FUNCTION = re.compile(
    r"\s*\.(?:func|param|params)\s+([^\W\d]\w*)\s*\(([^()]*)\)\s*=?\s*", re.IGNORECASE
)


def parameters(reader: Reader, line: Line) -> Iterator[tuple[str, Formula, Span]]:
    """Yield the ``name=expression`` items of a .param line with the places of their names."""
    start = len(line.text) - len(line.text.lstrip()) + len(line.text.split()[0])
    first, found = assignments(line, start)
    stray = line.text[start:first].strip(" \t,")
    if stray or not found:
        shown = stray[:40] or ".param"
        where = line.whole() if not stray else line.span(line.text.index(stray, start), first)
        raise Unreadable("NS1080", f"{shown}: name=value is needed", where, "write .param r=1k")
    for name, begin, left, right in found:
        where = line.span(begin, begin + len(name))
        if name in _RESERVED:
            raise Unreadable("NS1080", f"{name} is reserved", where, "choose another name")
        if left == right:
            raise Unreadable("NS1080", f"parameter {name} has no value", where, "write name=value")
        yield name, as_formula(reader, line, left, right), where


def as_formula(reader: Reader, line: Line, start: int, end: int) -> Formula:
    """Return an expression as a formula, also when it is a plain number."""
    value = reader.formula(line, start, end)
    return value if isinstance(value, Formula) else Formula(num(value), line, start, end)


def function(reader: Reader, line: Line) -> FunctionTemplate | None:
    """Read ``.func f(x, y) {expr}``; None if a .param line defines no function."""
    found = _FUNCTION.match(line.text)
    if found is None:
        if line.text.lstrip().startswith(".func"):
            raise Unreadable("NS1080", ".func needs a name and arguments", line.whole(),
                             "write .func f(x) {x*x}")  # fmt: skip
        return None
    name = found.group(1)
    formals = tuple(word for word in re.split(r"[\s,]+", found.group(2)) if word)
    where = line.span(*found.span(1))
    for formal in formals:
        if not re.fullmatch(r"[^\W\d][\w.]*", formal):
            raise Unreadable("NS1080", f"{formal[:40]} cannot name an argument", where)
    if len(set(formals)) < len(formals):
        raise Unreadable("NS1080", f"function {name}: two arguments share a name", where)
    start, end = found.end(), len(line.raw.rstrip())
    if end - start >= 2 and line.text[start] + line.text[end - 1] in ("{}", "''", '""'):
        start, end = start + 1, end - 1
    return FunctionTemplate(name, formals, as_formula(reader, line, start, end), where)


def model(reader: Reader, line: Line) -> ModelTemplate:
    """Read ``.model name type(par=value ... word)``, with or without parentheses."""
    pairs: list[Item] = []
    words: list[Item] = []
    line = closed_once(reader.findings, _bracketed(line))
    for item in flat(items(line)):
        (pairs if item.kind == "pair" else words).append(item)
    hint = "write .model name type(parameter=value ...)"
    if len(words) < 3 or words[1].kind != "word" or words[2].kind != "word":
        raise Unreadable("NS1080", ".model needs a name and a type", line.whole(), hint)
    name, kind = words[1].text, words[2].text
    where = line.span(words[1].start, words[1].end)
    base = ""
    if kind.startswith("ako:"):  # a kind of another model, whose type may be said once more
        base = kind[4:]
        if not base and len(words) > 3:  # ako: name
            base = words.pop(3).text
        kind = words.pop(3).text if len(words) > 3 and words[3].text in _TYPES else ""
    kind = _SAME_TYPES.get(kind, kind)
    params: dict[str, ParamText] = {}
    _pair_up(words, pairs)
    for item in words[3:]:  # bare words such as ideal are switches that are on
        if item.kind != "word" or not re.fullmatch(r"[^\W\d]\w*", item.text):
            at = line.span(item.start, item.end)
            shown = line.raw[item.start : item.end][:40]
            message = f"model {name}: {shown} is not a parameter"
            raise Unreadable("NS1009", message, at, "parameters are written name=value")
        params[item.text] = ParamText(1.0, line.span(item.start, item.end))
    for pair in pairs:
        key = key_of(line, pair)
        given = reader.param(line, pair)
        if key in params and params[key].value != given.value:
            at = line.span(pair.start, pair.end)
            raise Unreadable("NS1014", f"model {name}: parameter {key} is given twice", at)
        params[key] = given
    return ModelTemplate(name, kind, where, params, base)


def _bracketed(line: Line) -> Line:
    """Return a line with parentheses for the braces of a model, and tables for its vectors."""
    raw = _BRACES.sub(r"\1(\2)", line.raw.rstrip())
    raw = _VECTOR.sub(r"=table(v=\1)", raw)
    if _COUPLED.match(raw):
        raw = _TRIANGLE.sub(r" \1=table(v=\2) ", raw)
    if raw == line.raw.rstrip():
        return line
    return Line(raw, line.file, line.number, line.source, line.pieces)


def _pair_up(words: list[Item], pairs: list[Item]) -> None:
    """Take a number or text after a word for its value: SW(RON 0.001)."""
    kept: list[Item] = []
    for value in words[3:]:
        number = value.kind in ("expr", "string")
        number = number or (value.kind == "word" and value.text[0] in "+-.0123456789")
        if number and kept and kept[-1].kind == "word" and kept[-1].text[0].isalpha():
            key = kept.pop()
            pairs.append(Item("pair", key.text, key.start, value.end, (key, value)))
        else:
            kept.append(value)
    words[3:] = kept


class Header:
    """``.subckt name n1 n2 ... [params:] [p=default ...]``."""

    def __init__(self, reader: Reader, line: Line) -> None:
        pairs: list[Item] = []
        found = [i for i in flat(items(line)[1:], pairs) if i.text != "params:"]
        hint = "write .subckt name node node ... parameter=default"
        if not found or any(item.kind != "word" for item in found):
            raise Unreadable("NS1080", ".subckt needs a name and node names", line.whole(), hint)
        self.name = found[0].text
        self.line = line
        self.span = line.span(found[0].start, found[0].end)
        self.nodes = tuple(GROUND.get(item.text, item.text) for item in found[1:])
        self.params: dict[str, tuple[Formula, Span]] = {}
        seen: set[str] = set()
        for item in found[1:]:
            where = line.span(item.start, item.end)
            if item.text in seen:
                message = f"subcircuit {self.name}: node {item.text} appears twice"
                raise Unreadable("NS1080", message, where)
            seen.add(item.text)
        for pair in pairs:
            right = pair.items[1]
            start, end = right.start, right.end
            if right.kind in ("expr", "string"):
                start, end = start + 1, end - 1
            where = line.span(pair.start, pair.end)
            self.params[key_of(line, pair)] = (as_formula(reader, line, start, end), where)
