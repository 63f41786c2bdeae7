"""R, L, C and K lines."""

from __future__ import annotations

import re

from ..findings import Unreadable
from ..text.lines import Line
from ..text.numbers import read_number
from ..text.statement import Item
from .core import CHAN, HYSTERESIS
from .parasitics import PARASITICS
from .reading import Reader
from .template import ParamText, Template
from .terminals import Terminals

_COMMON = {"m", "temp", "dtemp", "scale"}
#: what LTspice writes of a part from its catalogue, and no law of the element contains
_NOTES = {"mfg", "pn", "type", "pppkg"}
_RATINGS = {
    "r": {"tol", "pwr"} | _NOTES,
    "c": {"v", "irms", "mtbf"} | _NOTES,
    "l": {"ipk", "irms"} | _NOTES,
}
_KNOWN = {
    "r": _COMMON
    | {"r", "v", "tc", "tc1", "tc2", "tce", "ac", "noisy", "noise", "ic"}
    | _RATINGS["r"],
    "c": _COMMON | {"c", "ic", "tc", "tc1", "tc2"} | PARASITICS | _RATINGS["c"],
    "l": _COMMON
    | {"l", "ic", "tc", "tc1", "tc2", "nt"}
    | PARASITICS
    | _RATINGS["l"]
    | CHAN
    | HYSTERESIS,
}
#: what follows a number by mistake after a blank: 10 kOhm
_SCALE = re.compile("(t|g|meg|k|m|u|\u00b5|n|p|f)?(ohms?|\u03c9|\u2126|f|farads?|h|henry)?")
_WHAT = {"r": "resistance", "c": "capacitance", "l": "inductance"}


def passive(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``R n+ n- value``, and C and L in the same form.

    The value may also be ``R={expr}``, for R also ``V={expr(i)}``; a name in its place is a model.
    """
    terminals = Terminals(reader, line, items)
    letter = terminals.name[0]
    terminals.take_nodes(2)
    terminals.extend_pairs("tc", "tc2")
    what = _WHAT[letter]
    result = terminals.template()
    found, noiseless = terminals.next(), None
    if found is not None:
        number = None
        if found.kind == "word":
            number = reader.number(line, found.start, found.end)
        if number is not None:
            result.value = number
            model = terminals.next_name()  # R1 a b 1k rmod
            if model and model.text == "noiseless":  # LTspice
                noiseless = line.span(model.start, model.end)
                model = terminals.next_name()
            if model and _SCALE.fullmatch(model.text):
                where = line.span(model.start, model.end)
                shown = f"{line.raw[found.start : found.end]}{line.raw[model.start : model.end]}"
                message = f"{terminals.name}: {model.text} is not expected here"
                hint = f"write the suffix and unit without a blank: {shown}"
                raise Unreadable("NS1009", message, where, hint)
            if model:
                result.model, result.model_span = model.text, line.span(model.start, model.end)
        elif found.kind == "word":
            result.model, result.model_span = found.text, line.span(found.start, found.end)
            after = terminals.next()  # R1 a b rmod 1k
            if after is not None:
                result.value = reader.value(line, after, f"a {what}")
        else:
            result.value = reader.value(line, found, f"a {what}")
    params = terminals.params(_KNOWN[letter])
    if noiseless is not None and letter == "r":
        params["noisy"] = ParamText(0.0, noiseless)
    for rating in _RATINGS[letter]:
        params.pop(rating, None)
    own = params.pop(letter, None)
    if letter == "r" and "v" in params:
        voltage = params.pop("v")
        if own is not None or result.value is not None:
            raise Unreadable("NS1009", f"{terminals.name}: both a resistance and V= are given",
                             voltage.span, "keep one of them")  # fmt: skip
        result.value = terminals.param_value(voltage)
        result.quantity = "v"
    elif own is not None:
        if result.value is not None:
            raise Unreadable("NS1009", f"{terminals.name}: the {what} is given twice", own.span)
        result.value = terminals.param_value(own)
    if "tc" in params:
        params["tc1"] = params.pop("tc")
    result.params = params
    terminals.finish(result)
    if result.value is None and not result.model and not CHAN & params.keys():
        raise Unreadable("NS1008", f"{terminals.name}: the {what} is missing", result.span,
                         f"write {letter.upper()}name node node value")  # fmt: skip
    return result


def coupling(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read ``K L1 L2 [L3 ...] k [core]``; a core may have one winding."""
    terminals = Terminals(reader, line, items)
    rest = terminals.rest()
    pairs = terminals.params({"k"})
    result = terminals.template()
    hint = "write Kname L1 L2 coefficient"
    if "k" in pairs:
        result.value = terminals.param_value(pairs["k"])
    elif rest:
        last = rest.pop()
        given = rest and (rest[-1].kind != "word" or read_number(rest[-1].text))
        if last.kind == "word" and given:
            result.model, result.model_span = last.text, line.span(last.start, last.end)
            last = rest.pop()
        result.value = reader.value(line, last, "a coupling coefficient")
    if len(rest) < (1 if result.model else 2):
        message = f"{terminals.name}: two inductors and a coefficient are needed"
        raise Unreadable("NS1008", message, result.span, hint)
    result.controls = tuple(terminals.word(item, "an inductor") for item in rest)
    result.node_spans = tuple(line.span(item.start, item.end) for item in rest)
    result.control_kind = "element"
    return result
