"""D, Q, J, M, Z, S and W lines."""

from __future__ import annotations

import re

from ..text.lines import Line
from ..text.statement import Item
from .reading import Reader
from .template import ParamText, Template
from .terminals import Terminals

_DIODE = {
    "area", "ic", "m", "temp", "dtemp", "pj", "w", "l", "v", "vfwd", "vrev", "ron", "rrev", "roff",
}  # fmt: skip
_TRANSISTOR = {
    "area", "areab", "areac", "m", "ic", "temp", "dtemp",
    "alphan", "alphai", "de", "dc",
}  # fmt: skip
_MOSFET = {
    "m", "w", "l", "ad", "as", "pd", "ps", "nrd", "nrs", "ic", "icvgs", "icvbs", "temp", "dtemp",
    "vto", "vh", "ron", "roff", "body",
}  # fmt: skip
_JFET = {"area", "m", "ic", "icvgs", "temp", "dtemp"}
_IGBT = {"m", "area", "vto", "vh", "vce0", "ron", "roff", "body", "temp", "dtemp"}
#: an area; 2N2222 and 1N4148 are names of models
_FACTOR = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?[^\W\d]*")

#: PSpice and LTspice mark the node of the substrate so: [4]
_BRACKETED = re.compile(r"\[[^\[\]]+\]")


def diode(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``D anode cathode [gate] [model] [area] [off] [ic=]``; without a model it is ideal."""
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(2)
    words = [item.text for item in items[3:5] if item.kind == "word"]
    # a gate comes before the model if two names follow
    if len(words) == 2 and words[1] != "off" and not _FACTOR.fullmatch(words[1]):
        terminals.take_nodes(1)
    result = terminals.template()
    item = terminals.peek()
    if item is not None and item.text != "off":
        terminals.model(result, terminals.next(), "")
    _tail(terminals, result, _DIODE)
    return result


def transistor(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``Q nc nb ne [ns] model [area] [off] [ic=vbe,vce]``; ``[ns]`` may be written so."""
    bracketed = len(items) > 4 and _BRACKETED.fullmatch(items[4].text) is not None
    if bracketed:
        node = items[4]
        bare = node._replace(text=node.text[1:-1], start=node.start + 1, end=node.end - 1)
        items = [*items[:4], bare, *items[5:]]
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(3)
    following = terminals.peek()
    words = [item for item in items[4:] if item.kind == "word"]
    # a fourth node comes before the model if two names follow, or a number that cannot be one
    second = words[1].text if len(words) > 1 else ""
    named = bool(second) and second != "off" and not _FACTOR.fullmatch(second)
    if following is not None and words and (named or bracketed):
        terminals.take_nodes(1)
    result = terminals.template()
    terminals.model(result, terminals.next(), "write Qname collector base emitter model")
    terminals.extend_pairs("ic", "vce")
    _tail(terminals, result, _TRANSISTOR | {"vce"})
    if "vce" in result.params:
        result.params["icvce"] = result.params.pop("vce")
    return result


def mosfet(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``M drain gate source [body] model [off] [W= L= m= ic=vds,vgs,vbs]``."""
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(3)
    terminals.extend_pairs("ic", "icvgs")
    terminals.extend_pairs("icvgs", "icvbs")
    ahead = [item for item in terminals.ahead() if item.text not in ("off", "thermal")]
    # the body comes before the model if two names follow
    if len(ahead) > 1:
        terminals.take_nodes(1)
    result = terminals.template()
    terminals.model(result, terminals.next(), "write Mname drain gate source body model")
    terminals.flags(result, ("off", "thermal"))
    result.params = terminals.params(_MOSFET)
    terminals.finish(result)
    return result


def jfet(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``J drain gate source model [area] [off] [ic=vds,vgs]``."""
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(3)
    terminals.extend_pairs("ic", "icvgs")
    result = terminals.template()
    terminals.model(result, terminals.next(), "write Jname drain gate source model")
    _tail(terminals, result, _JFET)
    return result


def igbt(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``Z collector gate emitter model [m=]``."""
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(3)
    result = terminals.template()
    terminals.model(result, terminals.next(), "write Zname collector gate emitter model")
    terminals.flags(result, ("off",))
    result.params = terminals.params(_IGBT)
    terminals.finish(result)
    return result


def _tail(terminals: Terminals, result: Template, known: set[str]) -> None:
    """Read area, flags and parameters."""
    line = terminals.line
    terminals.flags(result, ("on", "off"))
    item = terminals.peek()
    area = None
    if item is not None and item.kind != "pair":
        area = terminals.next()
    terminals.flags(result, ("on", "off"))
    result.params = terminals.params(known)
    if area is not None:
        value = terminals.reader.value(line, area, "an area factor")
        result.params["area"] = ParamText(value, line.span(area.start, area.end))
    terminals.finish(result)


def switch(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``S n+ n- nc+ nc- model [on|off]``."""
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(4, "nodes (two of them controlling)")
    result = terminals.template()
    result.nodes, result.controls = terminals.nodes[:2], terminals.nodes[2:]
    result.control_kind = "node"
    terminals.model(result, terminals.next(), "write Sname n+ n- nc+ nc- model")
    terminals.flags(result, ("on", "off"))
    result.params = terminals.params({"m"})
    terminals.finish(result)
    return result


def current_switch(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``W n+ n- Vname model [on|off]``."""
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(2)
    control = terminals.next()
    name = terminals.word(control, "the controlling source")
    assert control is not None
    result = terminals.template()
    result.controls = (name,)
    result.control_kind = "element"
    result.node_spans = (*terminals.node_spans, line.span(control.start, control.end))
    terminals.model(result, terminals.next(), "write Wname n+ n- Vname model")
    terminals.flags(result, ("on", "off"))
    result.params = terminals.params({"m"})
    terminals.finish(result)
    return result
