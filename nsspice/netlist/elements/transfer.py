"""E and G lines with a transfer function of s: PSpice's ``LAPLACE`` and LTspice's ``Laplace=``."""

from __future__ import annotations

import re

from ..expressions.expression_parser import voltage
from ..findings import Unreadable
from ..text.lines import Line
from .reading import Reader
from .template import Formula, Template, Value
from .terminals import GROUND, Terminals

#: E1 a b LAPLACE {v(in)} = {1/(1+s)}
_PSPICE = re.compile(
    r"\s*\S+[\s,(]+[^\s,()]+[\s,]+[^\s,()]+[\s,)]+laplace\s*=?\s*"
    r"(?:\{([^{}]*)\}|'([^']*)')\s*=?\s*(?:\{(.*)\}|'([^']*)')\s*$"
)
#: E1 a b in+ in- Laplace=1/(1+s)
_LTSPICE = re.compile(r".*?\blaplace\s*=\s*(.*?)((?:\s+(?:window|nfft|mtol)\s*=\s*\S+)*)\s*$")


def transfer(reader: Reader, line: Line, result: Template, terminals: Terminals) -> Template:
    """Return the element of a line that is known to have a transfer function."""
    hint = "write Ename n+ n- LAPLACE {v(in)} = {1/(1 + 1m*s)}"
    found = _PSPICE.fullmatch(line.text)
    if found is not None:
        first = 1 if found.group(1) is not None else 2
        second = 3 if found.group(3) is not None else 4
        drive = reader.formula(line, *found.span(first))
        start, end = found.span(second)
    else:
        found = _LTSPICE.fullmatch(line.text)
        if found is None:
            message = f"{result.name}: the transfer function cannot be read"
            raise Unreadable("NS1080", message, result.span, hint)
        terminals.take_nodes(2, "controlling nodes")
        whole = len(line.raw) - len(line.raw.lstrip()), len(line.raw.rstrip())
        drive = Formula(voltage(*terminals.nodes[2:4]), line, *whole, made=True)
        start, end = found.span(1)
        if line.text[start : start + 1] + line.text[end - 1 : end] in ("{}", "''"):
            start, end = start + 1, end - 1
    result.value = _formula(drive, line)
    result.transfer = _formula(reader.formula(line, start, end), line, start, end)
    result.quantity = "v" if result.letter == "e" else "i"
    result.nodes = tuple(GROUND.get(node, node) for node in terminals.nodes[:2])
    result.node_spans = terminals.node_spans[:2]
    return result


def _formula(value: Value, line: Line, start: int = 0, end: int = 0) -> Formula:
    """Return a number as a formula, too."""
    from ..expressions.node import num

    return value if isinstance(value, Formula) else Formula(num(value), line, start, end)
