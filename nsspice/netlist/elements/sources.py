"""V and I lines with their waveforms."""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise

from ...errors import suggest
from ..expressions.expression_parser import voltage
from ..expressions.node import call, num
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item
from .reading import Reader, flat
from .template import Formula, ParamText, SourceTemplate, Template, Value
from .terminals import Terminals
from .waveforms import KINDS, count_problem

_SPELLINGS = {"sine": "sin"}
_OTHER = {"noise", "external", "distof1", "distof2", "wavefile", "pat"}
_PARAMS = {"r", "td", "m", "rser", "cpar", "rpar", "ac", "dc", "load", "file", "portnum", "z0"}
#: what a V says about itself as a port
_PORT = ("portnum", "z0", "pwr", "freq", "phase")
#: below it the current of a load is proportional to its voltage [V]
_FALL = 0.5
#: words that end the arguments of a waveform
#: amplitude and phase for .disto alone
_DISTORTION = frozenset(["distof1", "distof2"])
_KEYWORDS = {"dc", "ac", "load", "portnum", "z0", "pwr", *_DISTORTION, *KINDS}


def source(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``V n+ n- [DC v] [AC mag [phase]] [waveform(...)]`` and the same for I.

    Parentheses and commas only separate: ``PULSE 0 5 1u`` is ``PULSE(0 5 1u)``.
    """
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(2)
    result = terminals.template()
    # most sources are a lone DC value
    value = SourceTemplate(result.span)
    result.source = value
    load: Item | None = None
    port: dict[str, ParamText] = {}
    while (item := terminals.next()) is not None:
        word = item.text if item.kind == "word" else ""
        kind = _SPELLINGS.get(word, word)
        if kind == "dc":
            if terminals.peek() is None or _next_is(terminals, {"ac", *KINDS, *_SPELLINGS}):
                continue  # V1 a 0 DC PULSE(0 1): the waveform also gives the value at DC
            value.dc = _number(terminals, terminals.next(), "the DC value")
        elif kind == "ac":
            magnitude = _optional(terminals)
            phase = _optional(terminals) if magnitude is not None else None
            value.ac = (
                1.0 if magnitude is None else _number(terminals, magnitude, "a magnitude"),
                0.0 if phase is None else _number(terminals, phase, "a phase"),
            )
        elif kind in _DISTORTION:
            for _ in ("amplitude", "phase"):
                _optional(terminals)
        elif kind in KINDS:
            _waveform(terminals, value, item, kind)
        elif kind == "tbl" and result.letter == "i":
            _table(terminals, result, _arguments(terminals))
        elif kind == "load" and result.letter == "i":
            load = item
        elif kind in _PORT[: None if port else 1] and result.letter == "v":
            _port(terminals, port, item)
        elif kind in _OTHER:
            where = line.span(item.start, item.end)
            message = f"{result.name}: the waveform {kind} is not supported"
            raise Unreadable("NS1002", message, where, f"known: {', '.join(KINDS)}")
        elif value.dc is None and not value.kind:
            if word and reader.number(line, item.start, item.end) is None:
                near = suggest(word, [*KINDS, "dc", "ac", "sine"])
                if near:
                    where = line.span(item.start, item.end)
                    raise Unreadable(
                        "NS1009", f"{result.name}: unknown waveform {word}", where, near
                    )
            value.dc = _number(terminals, item, "a DC value or a waveform")
        else:
            _unexpected(terminals, item, result)
    for pair in terminals.pairs:
        if pair.text == "tbl" and result.letter == "i":
            _table(terminals, result, list(flat([pair.items[1]])))
    terminals.pairs = [pair for pair in terminals.pairs if pair.text != "tbl"]
    params = terminals.params(_PARAMS)
    params |= port
    if "dc" in params:
        value.dc = terminals.param_value(params.pop("dc"))
    if "ac" in params:
        value.ac = (terminals.param_value(params.pop("ac")), 0.0)
    for key in ("r", "td"):
        if key == "r" and key in params and value.repeats:
            message = f"{result.name}: r= together with a repeated part"
            raise Unreadable("NS1009", message, params[key].span, "keep one of them")
        if key in params and value.kind == "pwl":
            value.options[key] = terminals.param_value(params.pop(key))
        elif key in params:
            raise Unreadable("NS1014", f"{result.name}: {key}= belongs to PWL", params[key].span)
    result.params = params
    if load is not None:
        _load(terminals, result, load)
    if result.quantity:
        if value.kind or value.dc is not None:
            message = f"{result.name}: a table and another value are given"
            raise Unreadable("NS1009", message, result.span, "keep one of them")
        result.source = None
    return result


def _port(terminals: Terminals, port: dict[str, ParamText], item: Item) -> None:
    """Take ``portnum n`` and what follows it: ``z0 r pwr p freq f phase a``."""
    given = terminals.next()
    value = _number(terminals, given, f"the value of {item.text}")
    assert given is not None
    where = terminals.line.span(item.start, given.end)
    if item.text in ("portnum", "z0"):
        port[item.text] = ParamText(value, where)
    else:
        message = f"{terminals.name}: {item.text} of the port is ignored"
        hint = "write a waveform for a run in time"
        terminals.reader.findings.warning("NS1003", message, where, hint)


def _table(terminals: Terminals, result: Template, points: list[Item]) -> None:
    """Let the current of a source follow a table of the voltage across it (LTspice)."""
    from .controlled import table_law

    result.value = table_law(terminals, voltage(*result.nodes), points)
    result.quantity = "i"


def _load(terminals: Terminals, result: Template, item: Item) -> None:
    """Let the current of a load fall to zero with its voltage (LTspice)."""
    value, where = result.source, terminals.line.span(item.start, item.end)
    assert value is not None
    if value.kind or value.dc is None:
        message = f"{terminals.name}: a load with a waveform is not simulated"
        hint = "write a constant current, or a B source: I=table(v(a,b), 0, 0, 0.5, 1)*v(wave)"
        raise Unreadable("NS1002", message, where, hint)
    current = value.dc.node if isinstance(value.dc, Formula) else num(value.dc)
    across = voltage(*result.nodes)
    tree = call("pwl", across, num(0.0), num(0.0), num(_FALL), current)
    line = terminals.line
    start = len(line.raw) - len(line.raw.lstrip())
    result.value = Formula(tree, line, start, len(line.raw.rstrip()), made=True)
    result.quantity = "i"
    value.dc = None
    message = f"{terminals.name}: the current of the load falls to zero below {_FALL:g} V"
    hint = f"for another law write {terminals.name.upper()} n+ n- TBL(v1 i1 v2 i2 ...)"
    terminals.reader.findings.warning("NS1097", message, where, hint)


def _optional(terminals: Terminals) -> Item | None:
    """Take the next item if it is a value and not a keyword."""
    item = terminals.peek()
    if item is None or (item.kind == "word" and item.text[0] not in "0123456789.+-"):
        return None
    return terminals.next()


def _next_is(terminals: Terminals, words: Collection[str]) -> bool:
    """Return whether the next item is one of some keywords."""
    item = terminals.peek()
    return item is not None and item.kind == "word" and item.text in words


def _number(terminals: Terminals, item: Item | None, what: str) -> Value:
    """Return a value that must be there."""
    if item is None:
        raise Unreadable("NS1008", f"{terminals.name}: {what} is missing", terminals.span)
    return terminals.reader.value(terminals.line, item, what)


def _waveform(terminals: Terminals, value: SourceTemplate, word: Item, kind: str) -> None:
    """Take the arguments of a waveform: everything up to the next keyword."""
    line = terminals.line
    where = line.span(word.start, word.end)
    if value.kind:
        message = f"{terminals.name}: a second waveform after {value.kind}"
        raise Unreadable("NS1009", message, where, "keep one of them")
    value.kind = kind
    arguments = _arguments(terminals)
    if kind == "pwl":
        from .broken_line import points_of

        arguments, value.relative, value.repeats = points_of(terminals, arguments)
    reader = terminals.reader
    value.values = reader.values(line, arguments, f"an argument of {kind}")
    if any(pair.text == "file" for pair in terminals.pairs):
        message = f"{terminals.name}: PWL data from a file are not supported"
        raise Unreadable("NS1002", message, where, "write the points into the netlist")
    problem, hint = count_problem(kind, len(arguments))
    if problem:
        raise Unreadable("NS1008", f"{terminals.name}: {problem}", where, hint)
    _decimal_commas(terminals, arguments)


def _arguments(terminals: Terminals) -> list[Item]:
    """Take everything up to the next keyword."""
    return terminals.until(_KEYWORDS)


def _decimal_commas(terminals: Terminals, arguments: list[Item]) -> None:
    """Warn where a comma is between digits while blanks separate the other arguments."""
    line = terminals.line
    if "," not in line.text:
        return
    commas = [
        (a, b) for a, b in pairwise(arguments) if b.start == a.end + 1 and line.text[a.end] == ","
    ]
    if commas and 2 * len(commas) < len(arguments) - 1:
        first, second = commas[0]
        shown = line.raw[first.start : second.end]
        terminals.reader.findings.warning(
            "NS1013",
            f"{terminals.name}: {shown} is read as two arguments: a comma is a separator",
            line.span(first.start, second.end),
            "write decimals with a point: 1.5",
        )


def _unexpected(terminals: Terminals, item: Item, result: Template) -> None:
    """Report an item after the value."""
    where = terminals.line.span(item.start, item.end)
    near = suggest(item.text, [*KINDS, "dc", "ac"])
    message = f"{result.name}: {item.text[:40]} is not expected here"
    line = terminals.line
    if line.text[item.start - 1] == "," and line.text[item.start - 2].isdigit():
        raise Unreadable("NS1013", f"{result.name}: the comma separates two values here", where,
                         "write decimals with a point: 1.5")  # fmt: skip
    raise Unreadable("NS1009", message, where, near)
