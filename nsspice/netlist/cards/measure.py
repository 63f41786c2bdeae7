"""``.measure`` (``.meas``)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Literal

from ...errors import Span, suggest
from ..deck import Cond, Measure
from ..expansion.binding import NOTHING
from ..expressions.expression import Expression
from ..findings import Unreadable
from ..text.lines import Line
from ..text.numbers import as_float
from .context import Context, after_card

_STATISTICS = {
    "max": "max", "min": "min", "pp": "pp", "avg": "avg", "rms": "rms", "integ": "integ",
    "integral": "integ", "max_at": "max_at", "min_at": "min_at", "thd": "thd",
    **{f"harm{k}": f"harm{k}" for k in range(101)},
}  # fmt: skip
_OPERATIONS = {*_STATISTICS, "trig", "find", "when", "deriv", "derivative", "param"}
_ANALYSES = ("tran", "dc", "op", "pss", "ac")
_NAMED = ("at", "from", "to", "val", "td", "rise", "fall", "cross")
_POWER = re.compile(r"(p|psw|tj)\s*\(\s*([^\s(),]+)\s*\)")
_PART = re.compile(
    r"(?<![\w.])(?:(harm\d+|thd|trig|targ|find|when|deriv|derivative|max_at|min_at|max|min|pp|avg|rms|integral|"
    r"integ)(?=[\s({']|$)|(at|from|to|val|td|rise|fall|cross|param)"
    # the sign of equality may be left out before a value, as LTspice has it
    r"(?:\s*=|(?=\s+(?:[-+.\d({']|last\b))|(?<=param)(?=\s)))|[(){}']"
)


_PARTS = {"mag": "m", "abs": "m", "db": "db", "ph": "p", "phase": "p", "re": "r", "real": "r",
          "im": "i", "img": "i", "imag": "i"}  # fmt: skip
_PART_OF = re.compile(rf"\b({'|'.join(_PARTS)})\s*\(\s*([vi])\s*\(([^()]*)\)\s*\)", re.IGNORECASE)


class Late(list[tuple[str, Expression]]):
    """Fields whose values earlier measures give."""


@dataclass(slots=True)
class _Part:
    """A keyword and the text up to the next one."""

    key: str
    start: int
    end: int
    named: dict[str, tuple[int, int]] = field(default_factory=dict)


def _once(context: Context, name: str, where: Span) -> str:
    """Return the name of a measurement, or another one if it is taken: all are measured."""
    known = {measure.name: measure for measure in context.deck.measures}
    if name not in known:
        return name
    count = next(k for k in range(2, len(known) + 2) if f"{name}#{k}" not in known)
    message = f"measurement {name} is already on line {known[name].span.line}: "
    message += f"this one is called {name}#{count}"
    context.findings.warning("NS1006", message, where, "rename one of them")
    return f"{name}#{count}"


def measure(context: Context, line: Line) -> None:
    """Read one measurement.

    Forms: ``max|min|pp|avg|rms|integ|max_at|min_at EXPR [from=] [to=]``, the same with ``trig ...
    targ ...`` for the window, ``find EXPR at=T``, ``find EXPR when A=B [rise=n]``, ``when A=B``,
    ``deriv EXPR at=T``, ``trig ... targ ...``, ``param='EXPR'``.  Without an analysis it is that of
    a transient.
    """
    found = re.compile(r"(\w+)\s+([^\s=(]+)\s*").match(line.text, after_card(line))
    hint = "write .measure tran name max v(out) from=0 to=1m"
    if found is None:
        raise Unreadable("NS1080", ".measure needs an analysis and a name", line.whole(), hint)
    analysis, name = found.groups()
    where, begin = line.span(*found.span(2)), found.end()
    if name in _OPERATIONS and analysis not in _ANALYSES:
        # LTspice lets the analysis be left out
        analysis, name = "tran", analysis
        where, begin = line.span(*found.span(1)), found.start(2)
    if analysis not in _ANALYSES:
        at = line.span(*found.span(1))
        if analysis in ("noise", "sp", "tf"):
            message = f".measure {analysis} is ignored: the summary lists its results"
            context.findings.warning("NS1003", message, at)
            return
        raise Unreadable("NS1080", f".measure: unknown analysis {analysis[:40]}", at,
                         suggest(analysis, _ANALYSES) or hint)  # fmt: skip
    if analysis == "ac":
        line = _complex(line)
    name = _once(context, name, where)
    parts = _parts(line, begin)
    if not parts:
        rest = line.text[begin:].split()
        word = rest[0] if rest else ""
        message = f".measure {name}: unknown operation {word[:40]}" if word else (
            f".measure {name}: the operation is missing")  # fmt: skip
        raise Unreadable("NS1080", message, where, suggest(word, _OPERATIONS) or hint)
    made = _Maker(context, line, name, analysis, where).make(parts)
    for expression in (
        made.expression,
        *(e for c in (made.first, made.second) if c for e in (c.signal, c.other)),
    ):
        if expression is not None and made.operation != "param":
            context.check_signals(expression, analysis == "ac")
    context.deck.measures.append(made)


def _complex(line: Line) -> Line:
    """Return a line with ``vm(out)`` for ``mag(v(out))``, and so on."""
    raw = _PART_OF.sub(lambda m: f"{m[2]}{_PARTS[m[1].lower()]}({m[3]})", line.raw)
    return line if raw == line.raw else type(line)(raw, line.file, line.number, line.source)


def _parts(line: Line, start: int) -> list[_Part]:
    """Cut the text at its keywords, outside of parentheses and quotes."""
    text = line.text
    depth, quoted = 0, False
    marks: list[tuple[str, bool, int, int]] = []
    for found in _PART.finditer(text, start):
        token = found.group()
        if token == "'":
            quoted = not quoted
        elif quoted:
            continue
        elif token in "({":
            depth += 1
        elif token in ")}":
            depth -= 1
        elif depth == 0:
            marks.append((found.group(1) or found.group(2), bool(found.group(2)), *found.span()))
    if marks and text[start : marks[0][2]].strip():
        return []
    parts: list[_Part] = []
    for index, (key, named, _, after) in enumerate(marks):
        end = marks[index + 1][2] if index + 1 < len(marks) else len(line.raw.rstrip())
        if named and key != "param":
            if not parts:
                return []
            parts[-1].named[key] = (after, end)
        else:
            parts.append(_Part(key, after, end))
    return parts


class _Maker:
    """Makes the measure of one line."""

    def __init__(self, context: Context, line: Line, name: str, analysis: str, span: Span) -> None:
        self._context = context
        self._line = line
        self._name = name
        self._analysis = analysis
        self._span = span

    def make(self, parts: list[_Part]) -> Measure:
        """Return the measure."""
        first = parts[0]
        key = first.key
        if key in _STATISTICS:
            ends = {part.key: part for part in parts[1:]}
            for part in parts[1:]:
                if part.key not in ("trig", "targ") or ends[part.key] is not part:
                    hint = "the window is from=T to=T, or trig ... targ ..."
                    raise self._wrong(part, f"{part.key} is not expected here", hint)
            return self._measure(
                _STATISTICS[key],
                first,
                expression=self._expression(first),
                first=self._edge(ends["trig"]) if "trig" in ends else None,
                second=self._edge(ends["targ"]) if "targ" in ends else None,
            )
        if key == "param":
            self._only(parts, 1)
            return self._measure("param", first, expression=self._formula(first))
        if key in ("find", "deriv", "derivative"):
            expression = self._expression(first)
            operation = "find" if key == "find" else "deriv"
            if len(parts) == 2 and parts[1].key == "when":
                condition = self._when(parts[1])
                name = f"{operation}_when" if operation == "find" else "deriv"
                return self._measure(name, parts[1], expression=expression, first=condition)
            self._only(parts, 1)
            if "at" not in first.named:
                raise self._wrong(first, f"{key} needs at=time or when signal=value")
            name = "find_at" if operation == "find" else "deriv"
            return self._measure(name, first, expression=expression)
        if key == "when":
            self._only(parts, 1)
            return self._measure("when", first, first=self._when(first))
        if key == "trig" and len(parts) == 2 and parts[1].key == "targ":
            return self._measure(
                "trig_targ", first, first=self._edge(first), second=self._edge(parts[1])
            )
        raise self._wrong(
            first, "trig and targ must both be given" if key in ("trig", "targ") else ""
        )

    def _measure(
        self,
        operation: str,
        part: _Part,
        expression: Expression | None = None,
        first: Cond | None = None,
        second: Cond | None = None,
    ) -> Measure:
        at = None
        late = Late()
        start = self._number(part, "from", late, "start") if "from" in part.named else None
        stop = self._number(part, "to", late, "stop") if "to" in part.named else None
        if "at" in part.named and first is None:
            at = self._number(part, "at", late, "at")
        return Measure(
            self._name, self._analysis, operation, self._span,
            expression, first, second, start, stop, at, late=tuple(late),
        )  # fmt: skip

    def _only(self, parts: list[_Part], count: int) -> None:
        if len(parts) > count:
            raise self._wrong(parts[count], f"{parts[count].key} is not expected here")

    def _wrong(self, part: _Part, reason: str, hint: str = "") -> Unreadable:
        where = self._line.span(part.start, part.end)
        message = f".measure {self._name}: {reason or 'this form is unknown'}"
        return Unreadable(
            "NS1080", message, where, hint or "see docs/reference/cards.md for the forms"
        )

    def _bounds(self, start: int, end: int) -> tuple[int, int]:
        """Return the bounds without blanks and one pair of braces, quotes, or par()."""
        text = self._line.text
        while start < end and text[start] in " \t,=":
            start += 1
        while end > start and text[end - 1] in " \t,":
            end -= 1
        wrapped = re.match(r"par\s*\(\s*'([^']*)'\s*\)$", text[start:end])
        if wrapped:
            return start + wrapped.start(1), start + wrapped.end(1)
        if end - start >= 2 and text[start] + text[end - 1] in ("{}", "''"):
            inner = text[start + 1 : end - 1]
            if not re.search(r"[{}']", inner):
                return start + 1, end - 1
        return start, end

    def _expression(self, part: _Part) -> Expression:
        start, end = self._bounds(part.start, part.end)
        if start >= end:
            raise self._wrong(part, f"{part.key} needs a signal")
        power = _POWER.fullmatch(self._line.text, start, end)
        if power:
            from ..expressions.node import var

            where = self._line.span(start, end)
            element = self._context.here.prefix + power.group(2)
            if power.group(1) != "p":
                element = self._context.element(power.group(2), where)
            name = f"{power.group(1)}({element})"
            return Expression(var(name), where, self._line.raw[start:end])
        return self._context.expression(self._line, start, end)

    def _formula(self, part: _Part) -> Expression:
        """Return the expression of param=, in which other measurements are names."""
        from ..elements.template import Formula
        from ..expressions.evaluate import rebuild
        from ..expressions.node import Node, num, var

        start, end = self._bounds(part.start, part.end)
        value = self._context.reader.formula(self._line, start, end)
        where, text = self._line.span(start, end), self._line.raw[start:end]
        if not isinstance(value, Formula):
            return Expression(num(value), where, text)
        measures = {known.name for known in self._context.deck.measures}

        def look_up(leaf: Node) -> Node:
            if leaf.op == "name" and leaf.value in measures:
                return var(str(leaf.value))
            return leaf

        tree = Formula(rebuild(value.node, look_up), self._line, start, end)
        return Expression(self._context.here.bind(tree), where, text)

    def _number(self, part: _Part, key: str, late: Late, name: str) -> float | None:
        """Return a number; one that earlier measures give goes into ``late``."""
        start, end = self._bounds(*part.named[key])
        value = self._context.reader.formula(self._line, start, end)
        measured = NOTHING if isinstance(value, float) else self._context.measured(value)
        if not measured:
            return self._context.here.number(value)
        found = self._context.expression(self._line, start, end)
        if not found.variables() <= measured.keys():
            return self._context.here.number(value)  # says what is wrong
        late.append((name, found))
        return None

    def _sides(self, part: _Part) -> tuple[Expression, Expression]:
        """Return the two sides of ``when a=b``."""
        text = self._line.text
        found = re.search(r"(?<![<>=!])=(?!=)", text[part.start : part.end])
        if found is None:
            raise self._wrong(part, "when needs signal=value")
        middle = part.start + found.start()
        sides = []
        for start, end in ((part.start, middle), (middle + 1, part.end)):
            left, right = self._bounds(start, end)
            sides.append(self._context.expression(self._line, left, right))
        return sides[0], sides[1]

    def _when(self, part: _Part) -> Cond:
        left, right = self._sides(part)
        edge, index = self._crossing(part)
        late = Late()
        delay = self._number(part, "td", late, "delay") if "td" in part.named else 0.0
        if right.variables():
            return Cond(left, None, right, edge, index, delay or 0.0, late=tuple(late))
        level = as_float(right.evaluate({}))
        return Cond(left, level, None, edge, index, delay or 0.0, late=tuple(late))

    def _edge(self, part: _Part) -> Cond:
        """Return a trig or targ: a crossing, or ``at=``."""
        late = Late()
        if "at" in part.named:
            at = self._number(part, "at", late, "at")
            return Cond(at=at, late=tuple(late))
        start, end = self._bounds(part.start, part.end)
        if "val" not in part.named and "=" in self._line.text[start:end]:
            return self._when(part)  # LTspice's trig v(a)=1
        edge, index = self._crossing(part)
        delay = self._number(part, "td", late, "delay") if "td" in part.named else 0.0
        if "val" not in part.named:
            raise self._wrong(part, f"{part.key} needs val= or at=")
        signal = self._context.expression(self._line, start, end)
        value = self._number(part, "val", late, "value")
        return Cond(signal, value, None, edge, index, delay or 0.0, late=tuple(late))

    def _crossing(self, part: _Part) -> tuple[Literal["rise", "fall", "cross"], int]:
        """Return which crossing counts; 0 stands for the last one."""
        edges: tuple[Literal["rise", "fall", "cross"], ...] = ("rise", "fall", "cross")
        for edge in edges:
            if edge in part.named:
                start, end = self._bounds(*part.named[edge])
                if self._line.text[start:end] == "last":
                    return edge, 0
                value = self._number(part, edge, Late(), edge)
                if value is None or value < 1 or value != int(value):
                    raise self._wrong(part, f"{edge}= needs 1, 2, 3 ... or last")
                return edge, int(value)
        return "cross", 1
