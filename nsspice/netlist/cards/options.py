"""``.options``, ``.temp``, ``.global`` and ``.title``."""

from __future__ import annotations

from ...errors import Span, suggest
from ..deck import Param, Sweep
from ..elements.reading import flat
from ..expressions.functions import no_temperature
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item
from .context import Context, after_card

#: options that nsspice reads
OWN = {
    "abstol", "accuracy", "correctors", "defad", "defas", "defl", "defw", "junctions", "maxstep",
    "method", "mosfet", "order", "reltol", "step", "temp", "theta", "tnom", "vgson", "vntol",
}  # fmt: skip
#: those whose value must be a number
NUMBERS = OWN - {"accuracy", "correctors", "junctions", "method", "mosfet"}
#: options by which other simulators print, plot or load: no waveform depends on them
FORMS = {
    "acct", "brief", "filetype", "ingold", "keepopinfo", "limpts", "list", "measdgt", "node",
    "nomarch", "nomod", "nopage", "numdgt", "opts", "plotabstol", "plotreltol", "plotvntol",
    "plotwinsize", "post", "probe", "rawpts", "savecurrents", "startclocks", "warn", "warnlimit",
    "width",
}  # fmt: skip
#: options that steer the numerics of other simulators: they have no effect (a warning)
FOREIGN = {
    "absi", "absv", "accurate", "autostop", "badmos3", "bypass", "chgtol", "cptime", "delmax",
    "fast", "gmindc", "gminsteps", "interp", "itl1", "itl2", "itl3", "itl4", "itl5", "itl6", "klu",
    "limtim", "lvlcod", "lvltim", "maxord", "minbreak", "mindeltagmin", "nodamp", "noinit",
    "noopac", "noopiter", "optran", "pivrel", "pivtol", "ramptime", "reli", "relv", "scalm",
    "solver", "sparse", "srcstepmethod", "srcsteps", "topologycheck", "trabstol", "trtol",
    "trtrunc", "trytocompact", "xmu",
}  # fmt: skip
#: options of other simulators that add elements to a circuit or scale them
CHANGING = {
    "cshunt": "it would add a capacitor to every node, which is not needed here",
    "gmin": "it would put a conductance across every junction, which is not needed here",
    "gshunt": "it would add a conductance to every node, which is not needed here",
    "rseries": "it would add a resistor to every inductor, which is not needed here",
    "rshunt": "it would add a resistor to every node, which is not needed here",
    "scale": "it belongs to elements with geometry",
}


def options(context: Context, line: Line) -> None:
    """Read ``.options name=value flag ...``; unknown names get a warning."""
    words, pairs = context.split(line)
    known = {*OWN, *FORMS, *FOREIGN, *CHANGING}
    without_effect: list[tuple[str, Span]] = []
    for item in [*words, *pairs]:
        key = item.text
        where = line.span(item.start, item.end)
        if item.kind not in ("word", "pair") or not key:
            raise Unreadable("NS1080", "options are written name=value", where)
        if key in CHANGING:
            message = f"option {key} is ignored"
            context.findings.warning("NS1003", message, where, CHANGING[key])
        elif key in FOREIGN:
            without_effect.append((key, where))
        elif key not in known:
            hint = suggest(key, known)
            context.findings.warning("NS1081", f"option {key[:40]} is unknown and ignored", where,
                                     hint)  # fmt: skip
        value: float | str = 1.0
        if item.kind == "pair":
            given = context.here.param(key, context.reader.param(line, item)).value
            if not isinstance(given, (float, str)):
                raise Unreadable("NS1025", f"option {key} needs a number or a word", where)
            value = given
        if key in NUMBERS and isinstance(value, str):
            message = f"option {key} cannot be {value[:40]!r}"
            context.findings.error("NS1010", message, where, "give a number")
        if key == "tnom" and isinstance(value, float):
            above_absolute_zero(value, where)
        context.deck.options[key] = Param(key, value, where)
    if without_effect:
        names = ", ".join(name for name, _ in without_effect)
        one = len(without_effect) == 1
        whose = "option {} controls" if one else "options {} control"
        message = whose.format(names) + " other programs, with no effect here"
        hint = "remove it, or leave it; accuracy here is reltol, and the longest step maxstep"
        context.findings.warning("NS4052", message, without_effect[0][1], hint)


def early_options(context: Context, line: Line) -> None:
    """Take the temperature from .options before the elements are built."""
    _, pairs = context.split(line)
    for pair in pairs:
        if pair.text == "temp":
            value = context.number(line, pair.items[1], "a temperature")
            where = line.span(pair.start, pair.end)
            _set_temperature(context, above_absolute_zero(value, where))


def temperature(context: Context, line: Line) -> None:
    """Read ``.temp value``; several values are a sweep."""
    words: list[Item] = list(flat(context.tail(line)))
    if not words:
        raise Unreadable("NS1080", ".temp needs a temperature", line.whole(), "write .temp 27")
    if len(words) > 1:
        values = tuple(context.number(line, word, "a temperature") for word in words)
        above_absolute_zero(min(values), line.whole())
        context.deck.steps.append(Sweep("temp", "temp", values, line.whole()))
        return
    value = context.number(line, words[0], "a temperature")
    where = line.span(words[0].start, words[0].end)
    _set_temperature(context, above_absolute_zero(value, where))


def above_absolute_zero(value: float, where: Span) -> float:
    """Return a temperature [degrees Celsius]; Unreadable NS2005 if no element can have it."""
    if why := no_temperature(value):
        message = f"a temperature of {value:g} degrees Celsius is {why}"
        raise Unreadable("NS2005", message, where, "temperatures are in degrees Celsius")
    return value


def _set_temperature(context: Context, value: float) -> None:
    context.deck.temperature = value
    context.scope.temperature = value


def global_nodes(context: Context, line: Line) -> None:
    """Read ``.global node ...``: names that subcircuits share."""
    names = [item.text for item in flat(context.tail(line)) if item.kind == "word"]
    if not names:
        raise Unreadable("NS1080", ".global needs node names", line.whole(), "write .global vdd")
    context.scope.add_globals(names)


def title(context: Context, line: Line) -> None:
    """Read ``.title text``."""
    context.deck.title = line.raw[after_card(line) :].strip()
