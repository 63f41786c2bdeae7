"""E and G lines with a transfer function of s or z.

PSpice's ``LAPLACE`` and LTspice's ``Laplace=``; ``ZTRANS`` with a clock.
"""

from __future__ import annotations

import re

from ...errors import suggest
from ..expressions.expression_parser import voltage
from ..findings import Unreadable
from ..text.lines import Line
from .reading import Reader, assignments
from .template import Formula, ParamText, Template, Value
from .terminals import GROUND, Terminals

#: E1 a b LAPLACE {v(in)} = {1/(1+s)}
_PSPICE = re.compile(
    r"\s*\S+[\s,(]+[^\s,()]+[\s,]+[^\s,()]+[\s,)]+laplace\s*=?\s*"
    r"(?:\{([^{}]*)\}|'([^']*)')\s*=?\s*(?:\{(.*)\}|'([^']*)')\s*$"
)
#: E1 a b ZTRANS {v(in)} = {1/(z - 0.5)} period=10u
_SAMPLED = re.compile(
    r"\s*\S+[\s,(]+[^\s,()]+[\s,]+[^\s,()]+[\s,)]+ztrans\s*=?\s*"
    r"\{([^{}]*)\}\s*=?\s*\{([^{}]*)\}(.*)$"
)
#: what follows it, besides the period
CLOCK = ("period", "delay", "offset", "ic", "min", "max")
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


def sampled_transfer(
    reader: Reader, line: Line, result: Template, terminals: Terminals
) -> Template:
    """Return the element of a line with a transfer function of z."""
    hint = "write Ename n+ n- ZTRANS {v(in)} = {0.1*z/(z - 1)} period=10u"
    found = _SAMPLED.fullmatch(line.text)
    if found is None:
        message = f"{result.name}: the transfer function of z cannot be read"
        raise Unreadable("NS1080", message, result.span, hint)
    result.value = _formula(reader.formula(line, *found.span(1)), line)
    start, end = found.span(2)
    result.transfer = _formula(reader.formula(line, start, end), line, start, end)
    for key, begin, left, right in assignments(line, found.start(3))[1]:
        where = line.span(begin, right)
        if key not in CLOCK:
            near = suggest(key, CLOCK) or hint
            raise Unreadable("NS1014", f"{result.name}: unknown parameter {key}", where, near)
        result.params[key] = ParamText(reader.formula(line, left, right), where)
    if "period" not in result.params:
        message = f"{result.name}: the period of its clock is missing"
        raise Unreadable("NS1008", message, result.span, hint)
    result.sampled = True
    result.quantity = "v" if result.letter == "e" else "i"
    result.nodes = tuple(GROUND.get(node, node) for node in terminals.nodes[:2])
    result.node_spans = terminals.node_spans[:2]
    return result


def _formula(value: Value, line: Line, start: int = 0, end: int = 0) -> Formula:
    """Return a number as a formula, too."""
    from ..expressions.node import num

    return value if isinstance(value, Formula) else Formula(num(value), line, start, end)
