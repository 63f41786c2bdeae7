"""A lines: ports of XSPICE's code models, with vectors in brackets and types after a percent."""

from __future__ import annotations

import re

from ..findings import Unreadable
from ..text.lines import Line
from .reading import Reader, assignments
from .template import CodeTemplate, ParamText, Port
from .terminals import GROUND

_TOKEN = re.compile(r"%\w+|[\[\]()~]|[^\s,()\[\]~%]+")
_PAIR = re.compile(r"[a-z]\w*\s*=")
#: LTspice's devices with eight terminals, and what their lines may give
TYPES = ("and", "or", "xor", "buf", "inv", "schmitt", "schmtbuf", "schmtinv", "dflop", "srflop")
PARAMETERS = frozenset([
    "vhigh", "vlow", "ref", "td", "vt", "vh", "ic", "trise", "tfall", "tau", "rout", "cout",
    "rhigh", "rlow", "tripdt",
])  # fmt: skip
_FORM = "write Aname input output model, with vectors in brackets: A1 [a b] out model"


def code_model(reader: Reader, line: Line) -> CodeTemplate:
    """Read ``A name port ... model``; a port is ``a``, ``[a b]``, ``%vd(a b)``, ``~a`` or null.

    Raises
    ------
    Unreadable
        If brackets do not match, or the model is missing.
    """
    found = _PAIR.search(line.text)
    end = found.start() if found else len(line.text)
    tokens = [(m.group(), m.start(), m.end()) for m in _TOKEN.finditer(line.text, 0, end)]
    if len(tokens) == 10 and tokens[9][0] in TYPES:
        return _device(reader, line, tokens, end)
    name, span = tokens[0][0] if tokens else line.text.split("=")[0].strip(), line.whole()
    if len(tokens) < 3 or not re.match(r"[\w.]", tokens[-1][0]):
        raise Unreadable("NS1008", f"{name}: ports and a model are needed", span, _FORM)
    ports: list[tuple[Port, ...]] = []
    vector: list[Port] | None = None
    kind, inverted, around = "", False, False
    at, last = 1, len(tokens) - 1
    while at < last:
        text = tokens[at][0]
        at += 1
        if text == "[" and vector is None:
            vector = []
        elif text == "]" and vector is not None:
            ports.append(tuple(vector))
            vector = None
        elif text.startswith("%"):
            kind = text[1:]
        elif text == "~":
            inverted = True
        elif text == "(" and at < last and tokens[at][0] == "[":
            around = True  # %vd([a b c d])
        elif text == ")" and around and vector is None:
            around, kind = False, ""
        elif text in "[]()":
            if text == "(" and at + 2 < last and tokens[at + 2][0] == ")":
                plus, minus = tokens[at][0], tokens[at + 1][0]
                at += 3
                made = Port(_node(plus), _node(minus), kind, inverted)
                ports, vector = _put(ports, vector, made)
                inverted = False
                continue
            where = line.span(*tokens[at - 1][1:])
            raise Unreadable("NS1007", f"{name}: {text} is out of place", where, _FORM)
        elif kind.endswith("d") and kind not in ("", "d") and at < last:
            made = Port(_node(text), _node(tokens[at][0]), kind, inverted)  # %vd a b
            at += 1
            ports, vector = _put(ports, vector, made)
            inverted = False
        else:
            ports, vector = _put(ports, vector, Port(_node(text), "0", kind, inverted))
            inverted = False
        if vector is None and text not in ("[", "~", "(") and not text.startswith("%"):
            kind = ""
    if vector is not None:
        raise Unreadable("NS1007", f"{name}: [ without ]", span, _FORM)
    model, start, end = tokens[-1]
    return CodeTemplate(name, span, tuple(ports), model, line.span(start, end))


def _device(
    reader: Reader, line: Line, tokens: list[tuple[str, int, int]], end: int
) -> CodeTemplate:
    """Read LTspice's ``A n1 ... n8 TYPE name=value ...``."""
    _, given = assignments(line, end)
    params: dict[str, ParamText] = {}
    for key, begin, left, right in given:
        where = line.span(begin, right)
        if key not in PARAMETERS:
            message = f"{tokens[0][0]}: unknown parameter {key} is ignored"
            reader.findings.warning("NS1014", message, where)
            continue
        params[key] = ParamText(reader.formula(line, left, right), where)
    ports = tuple((Port(_node(text), "0"),) for text, _, _ in tokens[1:9])
    model, start, stop = tokens[9]
    span = line.whole()
    where = line.span(start, stop)
    return CodeTemplate(tokens[0][0], span, ports, model, where, params, own=True)


def _put(
    ports: list[tuple[Port, ...]], vector: list[Port] | None, port: Port
) -> tuple[list[tuple[Port, ...]], list[Port] | None]:
    """Add a port to the open vector, or to the line."""
    if vector is not None:
        return ports, [*vector, port]
    return [*ports, (port,)], None


def _node(name: str) -> str:
    return GROUND.get(name, name)
