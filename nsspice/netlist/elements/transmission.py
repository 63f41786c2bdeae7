"""``T a b c d Z0= TD=``: a lossless line, two ports whose waves are delayed (Branin's method).

At each port the voltage is that of the wave that arrives plus Z0 times the current; what arrives is
``v + Z0 i`` of the other port, a delay before.

References: F. H. Branin, "Transient analysis of lossless transmission lines", Proc. IEEE 55 (1967)
2012, doi:10.1109/PROC.1967.6033.
"""

from __future__ import annotations

from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item
from .reading import Reader
from .template import CodeTemplate, Port
from .terminals import GROUND, Terminals

#: the code model that a template names for such a line
MODEL = "t"
_KNOWN = {"z0", "zo", "td", "f", "nl", "ic", "rel", "abs"}


def transmission(reader: Reader, line: Line, items: list[Item]) -> CodeTemplate:
    """Read ``T a b c d Z0= TD=``, or ``F= [NL=]`` in place of ``TD=``."""
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(4)
    result = terminals.template()
    params = terminals.params(_KNOWN)
    if "zo" in params:
        params["z0"] = params.pop("zo")
    hint = "write Tname a b c d Z0=50 TD=1n"
    if "z0" not in params or not {"td", "f"} & params.keys():
        message = f"{result.name}: impedance or delay of the line is missing"
        raise Unreadable("NS1008", message, result.span, hint)
    if "ic" in params:
        message = f"{result.name}: initial waves of a line (ic=) are not simulated"
        raise Unreadable("NS1002", message, params["ic"].span, "leave them out")
    nodes = [GROUND.get(node, node) for node in terminals.nodes]
    ports = (Port(nodes[0], nodes[1]),), (Port(nodes[2], nodes[3]),)
    where = result.span
    return CodeTemplate(result.name, where, ports, MODEL, where, params, own=True)


#: by letter: number of nodes, what the line may give, and its form
_LOSSY = {
    "o": (4, ("len", "ic"), "write Oname a b c d model, with .model model LTRA(R= L= C= LEN=)"),
    "y": (
        4,
        ("len", "length"),
        "write Yname a b c d model, with .model model TXL(R= L= C= LENGTH=)",
    ),
    "u": (3, ("l", "n"), "write Uname a b ground model L=1m, with .model model URC(RPERL= CPERL=)"),
}


def lossy(reader: Reader, line: Line, items: list[Item]) -> CodeTemplate:
    """Read ``O`` and ``Y`` with two ports, ``U`` with two nodes and that of its capacitance."""
    terminals = Terminals(reader, line, items)
    count, known, hint = _LOSSY[items[0].text[0]]
    terminals.take_nodes(count)
    result = terminals.template()
    terminals.model(result, terminals.next(), hint)
    params = terminals.params(known)
    if "ic" in params:
        message = f"{result.name}: initial waves of a line (ic=) are not simulated"
        raise Unreadable("NS1002", message, params["ic"].span, "leave them out")
    nodes = [GROUND.get(node, node) for node in terminals.nodes]
    ends = [Port(node, "0") for node in nodes]
    if count == 4:
        ends = [Port(nodes[0], nodes[1]), Port(nodes[2], nodes[3])]
    ports, where = tuple((end,) for end in ends), result.model_span or result.span
    return CodeTemplate(result.name, result.span, ports, result.model, where, params)


def coupled(reader: Reader, line: Line, items: list[Item]) -> CodeTemplate:
    """Read ``P a1 a2 ... ref b1 b2 ... ref model``."""
    terminals = Terminals(reader, line, items)
    plain = [item for item in items[1:] if item.kind != "pair"]
    count = len(plain) - 1
    hint = "write Pname a1 a2 ground b1 b2 ground model, with .model model CPL(R= L= C= LENGTH=)"
    if count < 4 or count % 2:
        message = f"{terminals.name}: as many nodes at both ends, and a model, are needed"
        raise Unreadable("NS1008", message, terminals.span, hint)
    terminals.take_nodes(count)
    result = terminals.template()
    terminals.model(result, terminals.next(), hint)
    params = terminals.params(("len", "length"))
    nodes = [GROUND.get(node, node) for node in terminals.nodes]
    half = count // 2
    near, far = nodes[:half], nodes[half:]
    ports = tuple(tuple(Port(node, end[-1]) for node in end[:-1]) for end in (near, far))
    where = result.model_span or result.span
    return CodeTemplate(result.name, result.span, ports, result.model, where, params)


def written_line(item: CodeTemplate, given: dict[str, float]) -> list[str]:
    """Return the elements of a line.

    Raises
    ------
    Unreadable
        For an impedance or a delay that is not positive.
    """
    near, far = ((vector[0].plus, vector[0].minus) for vector in item.ports)
    impedance = given["z0"]
    delay = given.get("td", 0.0)
    if "td" not in given and given["f"] > 0.0:
        delay = given.get("nl", 0.25) / given["f"]
    if not (impedance > 0.0 and delay > 0.0):
        message = f"{item.name}: impedance and delay of a line must be above zero"
        raise Unreadable("NS1025", message, item.span)
    return lossless(impedance, delay, near, far)


def lossless(
    impedance: float,
    delay: float,
    near: tuple[str, str],
    far: tuple[str, str],
    label: str = "",
) -> list[str]:
    """Return the elements of a line without loss; ``label`` is part of the names of its nodes."""
    (a, b), (c, d) = near, far
    wave = "v({},{}) + {!r}*i({})".format
    return [
        f"R1{label} {a} one{label} {impedance!r}",
        f"B1{label} one{label} {b} V={{delay({wave(c, d, impedance, f'B2{label}')}, {delay!r})}}",
        f"R2{label} {c} two{label} {impedance!r}",
        f"B2{label} two{label} {d} V={{delay({wave(a, b, impedance, f'B1{label}')}, {delay!r})}}",
    ]
