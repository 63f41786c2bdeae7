"""``.save .print .plot .probe`` and ``.ic .nodeset``."""

from __future__ import annotations

import re

from ...errors import Span
from ..deck import Param, Signal
from ..elements.terminals import GROUND
from ..expressions.node import COMPLEX_FORMS
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item
from .context import Context

_ANALYSES = {"tran", "dc", "op", "pss", "ac"}
_OTHER_ANALYSES = {"noise", "tf", "four", "pz", "sp"}
_ALL = {"all", "alli", "allv", "allp"}
_HASH = re.compile(r"(.+)#branch")
_DEVICE = re.compile(r"@([^\[\]]+)\[(\w+)\]")


def outputs(context: Context, line: Line) -> None:
    """Read a list of signals; one that does not exist is left out with a warning."""
    found = context.tail(line)
    if found and found[0].kind == "word" and found[0].text in _ANALYSES:
        found = found[1:]
    elif found and found[0].text in _OTHER_ANALYSES and found[0].kind == "word":
        message = f"outputs of .{found[0].text} are ignored"
        context.findings.warning("NS1003", message, line.span(found[0].start, found[0].end))
        return
    for item in found:
        where = line.span(item.start, item.end)
        try:
            name = _signal(context, line, item, where)
        except Unreadable as problem:
            message = f"{problem.message}; it is omitted"
            context.findings.warning(problem.code, message, problem.span, problem.hint)
            continue
        if name and all(known.name != name for known in context.deck.saves):
            context.deck.saves.append(Signal(name, where))


def _signal(context: Context, line: Line, item: Item, where: Span) -> str:
    """Return the canonical name of one output, ``""`` for plot limits and the like."""
    text = item.text
    if item.kind == "call":
        return probe(context, item, where)
    if item.kind == "group":  # .plot limits (0,5)
        return ""
    if item.kind == "word":
        if text in _ALL:
            return text
        branch = _HASH.fullmatch(text)
        device = _DEVICE.fullmatch(text)
        if branch:
            return f"i({context.element(branch.group(1), where)})"
        if device and device.group(2) in ("i", "id", "ic", "current"):
            return f"i({context.element(device.group(1), where)})"
        if device and device.group(2) in ("ib", "ie"):
            return f"i({context.element(f'{device.group(1)}.{device.group(2)[1]}', where)})"
        if device and device.group(2) in ("p", "power"):
            return f"p({context.element(device.group(1), where)})"
        if not device:
            return f"v({context.node(text, where)})"
    shown = line.raw[item.start : item.end][:60]
    hint = "write v(node), v(a,b), i(element) or p(element)"
    raise Unreadable("NS1071", f"{shown} is not an output", where, hint)


def probe(context: Context, item: Item, where: Span) -> str:
    """Return the canonical name of ``v(a) v(a,b) i(x) p(x)``, and of ``ic(q1) ib(q1) ie(q1)``."""
    names = [part.text for part in item.items]
    if any(part.kind != "word" for part in item.items) or not 1 <= len(names) <= 2:
        hint = "write v(node), v(a,b), i(element) or p(element)"
        raise Unreadable("NS1071", f"{item.text}(...) is not an output", where, hint)
    if item.text == "v":
        full = [context.node(GROUND.get(name, name), where) for name in names]
        if len(full) == 2 and full[1] == "0":
            full.pop()
        return f"v({','.join(full)})"
    if item.text in COMPLEX_FORMS:  # .print ac vdb(out): real and imaginary part are written
        return probe(context, item._replace(text=item.text[0]), where)
    if item.text in ("ic", "id") and len(names) == 1:
        return f"i({context.element(names[0], where)})"
    if item.text in ("ib", "ie") and len(names) == 1:
        return f"i({context.element(f'{names[0]}.{item.text[1]}', where)})"
    if item.text in ("i", "p") and len(names) == 1:
        return f"{item.text}({context.element(names[0], where)})"
    hint = "write v(node), v(a,b), i(element) or p(element)"
    raise Unreadable("NS1071", f"{item.text}({','.join(names)}) is not an output", where, hint)


def initial(context: Context, line: Line) -> None:
    """Read ``.ic v(a)=1 i(l1)=2`` and ``.nodeset``."""
    found = context.tail(line)
    card = line.text.split()[0]
    target = context.deck.initial if card == ".ic" else context.deck.nodesets
    for item in found:
        where = line.span(item.start, item.end)
        left = item.items[0] if item.kind == "pair" else None
        if left is not None and left.kind == "word":  # .ic out=1
            left = Item("call", "v", left.start, left.end, (left,))
        if left is None or left.kind != "call" or len(left.items) != 1:
            message = f"{card}: v(node)=value is needed"
            raise Unreadable("NS1080", message, where, f"write {card} v(out)=0")
        name = left.items[0].text
        value = context.number(line, item.items[1], "a value")
        try:
            _set(context, target, left, name, value, where)
        except Unreadable as problem:  # the next one of the line may be right
            context.findings.record(problem)


def _set(
    context: Context, target: dict[str, Param], left: Item, name: str, value: float, where: Span
) -> None:
    """Put one initial value where it belongs."""
    if left.text == "v":
        node = context.node(name, where)
        if node == "0":
            raise Unreadable("NS1080", "ground has no initial value", where, "leave it out")
        target[node] = Param(node, value, where)
        return
    full = context.element(name, where) if left.text == "i" else ""
    for element in context.deck.elements:
        if element.name == full and element.letter == "l" and target is context.deck.initial:
            element.params.setdefault("ic", Param("ic", value, where))
            return
    message = f"{left.text}({name}) cannot be set here"
    raise Unreadable("NS1080", message, where, "give v(node), or i(inductor) in .ic", full)
