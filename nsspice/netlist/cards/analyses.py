"""``.op``, ``.dc``, ``.tran`` and ``.step``."""

from __future__ import annotations

import math
from typing import Literal

from ...errors import Span, suggest
from ..alteration import check
from ..deck import Alteration, DcCard, OpCard, Sweep, TranCard
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item
from .context import Context
from .options import above_absolute_zero
from .start_up import start_up

StepKind = Literal["element", "temp", "param", "model"]
#: points of one sweep
MAX_POINTS = 10_000_000

_TRAN_HINT = "write .tran step stop [start [maxstep]] [uic] [start=pss]"
_DC_HINT = "write .dc source start stop step"
_STEP_HINT = "write .step param name start stop increment, or .step param name list 1 2 3"


def op(context: Context, line: Line) -> None:
    """Read ``.op``."""
    words, pairs = context.split(line)
    if words or pairs:
        raise Unreadable("NS1080", ".op takes no arguments", line.whole())
    context.deck.analyses.append(OpCard(line.whole()))


def tran(context: Context, line: Line) -> None:
    """Read ``.tran tstep tstop [tstart [tmax]] [uic]``, or LTspice's ``.tran tstop``."""
    words, pairs = context.split(line)
    orbit = any(pair.text == "start" and pair.items[1].text == "pss" for pair in pairs)
    if len(pairs) > orbit:
        other = next(p for p in pairs if p.text != "start" or p.items[1].text != "pss")
        where = line.span(other.start, other.end)
        message = ".tran has no named argument except start=pss"
        raise Unreadable("NS1080", message, where, _TRAN_HINT)
    uic = False
    numbers: list[float] = []
    for item in words:
        where = line.span(item.start, item.end)
        if item.text in ("uic", "skipbp"):  # skipbp is PSpice's word for it
            uic = True
        elif item.text == "startup":
            start_up(context.deck, context.findings, where)
        elif item.text == "steady":
            message = ".tran steady does not end the run early: it goes on to its last instant"
            context.findings.warning("NS1003", message, where, "write .pss for the steady state")
        elif item.text in ("nodiscard", "step"):
            context.findings.warning("NS1003", f".tran {item.text} is ignored", where)
        elif item.kind == "word" and item.text.isalpha() and suggest(item.text, ["uic"]):
            raise Unreadable(
                "NS1080", f".tran: unknown word {item.text}", where, "did you mean uic?"
            )
        else:
            numbers.append(context.number(line, item, "a time"))
    where = line.whole()
    if not 1 <= len(numbers) <= 4:
        raise Unreadable(
            "NS1080", f".tran takes 1 to 4 times, not {len(numbers)}", where, _TRAN_HINT
        )
    step = None if len(numbers) == 1 else numbers[0]
    stop = numbers[0] if len(numbers) == 1 else numbers[1]
    start = numbers[2] if len(numbers) > 2 else 0.0
    largest = numbers[3] if len(numbers) > 3 else None
    if step == 0.0:  # LTspice writes .tran 0 10m for "no print step"
        step = None
    if stop <= 0.0 or (step is not None and step < 0.0):
        raise Unreadable("NS1080", ".tran: times must be positive", where, _TRAN_HINT)
    if not 0.0 <= start < stop:
        message = f".tran: the start {start:g} must be between 0 and the stop {stop:g}"
        raise Unreadable("NS1080", message, where, _TRAN_HINT)
    if step is not None and step > stop:
        message = f".tran: the step {step:g} is larger than the stop {stop:g}"
        raise Unreadable("NS1080", message, where, "the step comes first: " + _TRAN_HINT)
    if largest is not None and largest <= 0.0:
        largest = None
    context.deck.analyses.append(TranCard(step, stop, start, largest, uic, where, orbit))


def dc(context: Context, line: Line) -> None:
    """Read ``.dc name start stop step [name start stop step ...]``."""
    words, pairs = context.split(line)
    if pairs or not words:
        raise Unreadable("NS1080", ".dc needs a source and its range", line.whole(), _DC_HINT)
    sweeps = []
    rest = words
    while rest:
        scale, rest = _scale(rest)
        if not rest:
            raise Unreadable("NS1080", ".dc: the swept name is missing", line.whole(), _DC_HINT)
        item = rest[0]
        where = line.span(item.start, item.end)
        name = item.text
        kind: Literal["element", "temp"] = "temp" if name in ("temp", "temperature") else "element"
        if kind == "element" and not (context.is_element(name) and name[0] in "virbcl"):
            names = [e.name for e in context.deck.elements if e.letter in "vir"]
            hint = suggest(name, [*names, "temp"]) or "sweep a V, I, R, L or C, or temp"
            raise Unreadable(
                "NS1070", f".dc: there is no element {name[:60]} to sweep", where, hint
            )
        values, rest = _range(context, line, rest[1:], scale, ".dc")
        if kind == "temp":
            above_absolute_zero(min(values), where)
        sweeps.append(Sweep("temp" if kind == "temp" else name, kind, values, where))
    if len(sweeps) > 2:
        raise Unreadable("NS1080", ".dc sweeps at most two quantities", line.whole(), "use .step")
    context.deck.analyses.append(DcCard(tuple(sweeps), line.whole()))


def step(context: Context, line: Line) -> None:
    """Read ``.step [dec|oct|lin] param name start stop increment``, or ``list`` and values."""
    kind, name, where, values = _step(context, line)
    if kind == "element" and not context.is_element(name):
        names = [e.name for e in context.deck.elements if e.letter in "vir"]
        hint = suggest(name, [*names, *context.scope.known("params")]) or _STEP_HINT
        raise Unreadable("NS1070", f".step: there is no element {name[:60]}", where, hint)
    if kind == "model":
        target, _, key = name[1:-1].partition("[")
        check(context.deck, Alteration("model", target, key, (values[0],), where))
    context.deck.steps.append(Sweep(name, kind, values, where))


def early_step(context: Context, line: Line) -> None:
    """Give a stepped parameter without a .param of its own its first value."""
    kind, name, _, values = _step(context, line)
    if kind == "param" and name not in context.scope.params:
        context.scope.fixed.setdefault(name, values[0])


def _step(context: Context, line: Line) -> tuple[StepKind, str, Span, tuple[float, ...]]:
    """Read a .step line without looking at the elements."""
    words, pairs = context.split(line)
    if pairs:
        where = line.span(pairs[0].start, pairs[0].end)
        raise Unreadable("NS1080", ".step has no named arguments", where, _STEP_HINT)
    scale, rest = _scale(words)
    kind: StepKind = "element"
    if rest and rest[0].text in ("param", "temp", "temperature"):
        kind = "param" if rest[0].text == "param" else "temp"
        rest = rest[1:] if kind == "param" else rest
    if not rest:
        raise Unreadable("NS1080", ".step needs a name and values", line.whole(), _STEP_HINT)
    name = "temp" if kind == "temp" else rest[0].text
    where = line.span(rest[0].start, rest[0].end)
    if kind == "element" and len(rest) > 2 and rest[1].text in context.scope.models:
        kind, name = "model", f"@{rest[1].text}[{rest[2].text}]"  # .step npn 2n2222(bf) ...
        rest = rest[2:]
    if kind == "element" and name in context.scope.params:
        kind = "param"
    values, rest = _range(context, line, rest[1:], scale, ".step")
    if kind == "temp":
        above_absolute_zero(min(values), where)
    if rest:
        at = line.span(rest[0].start, rest[0].end)
        raise Unreadable(
            "NS1080", f".step: {rest[0].text[:40]} is not expected here", at, _STEP_HINT
        )
    return kind, name, where, values


def _scale(words: list[Item]) -> tuple[str, list[Item]]:
    """Take ``dec``, ``oct`` or ``lin`` from the front."""
    if words and words[0].text in ("dec", "oct", "lin"):
        return words[0].text, words[1:]
    return "lin", words


def _range(
    context: Context, line: Line, words: list[Item], scale: str, card: str
) -> tuple[tuple[float, ...], list[Item]]:
    """Return the values of a sweep and the items after it."""
    if words and words[0].text in ("dec", "oct", "lin", "list"):
        scale, words = words[0].text, words[1:]
    where = line.whole()
    if scale == "list":
        if not words:
            raise Unreadable("NS1080", f"{card}: the list is empty", where)
        return tuple(context.number(line, item, "a value") for item in words), []
    if len(words) < 3:
        raise Unreadable("NS1080", f"{card}: start, stop and step are needed", where,
                         _DC_HINT if card == ".dc" else _STEP_HINT)  # fmt: skip
    start, stop, count = (context.number(line, item, "a value") for item in words[:3])
    if scale == "lin":
        return _linear(start, stop, count, card, where), words[3:]
    if start <= 0.0 or stop <= 0.0 or count <= 0.0:
        raise Unreadable("NS1080", f"{card}: {scale} needs positive numbers", where)
    base = 10.0 if scale == "dec" else 2.0
    total = abs(math.log(stop, base) - math.log(start, base)) * count
    if total > MAX_POINTS:
        raise Unreadable("NS1080", f"{card}: more than {MAX_POINTS} points", where)
    whole = math.floor(total + 1e-9)
    sign = 1.0 if stop >= start else -1.0
    values = [start * base ** (sign * k / count) for k in range(whole + 1)]
    if whole and math.isclose(values[-1], stop, rel_tol=1e-9):
        values[-1] = stop
    return tuple(values), words[3:]


def _linear(
    start: float, stop: float, increment: float, card: str, where: Span
) -> tuple[float, ...]:
    """Return start, start+increment ... up to stop, which is met exactly if it lies on the grid."""
    if start == stop:
        return (start,)
    if increment == 0.0:
        raise Unreadable("NS1080", f"{card}: the step is zero", where)
    if (stop - start) * increment < 0.0:
        message = f"{card}: a step of {increment:g} does not go from {start:g} to {stop:g}"
        raise Unreadable("NS1080", message, where, "change the sign of the step")
    total = (stop - start) / increment
    if total > MAX_POINTS:
        raise Unreadable("NS1080", f"{card}: more than {MAX_POINTS} points", where)
    count = math.floor(total + 1e-9 * max(1.0, total))
    values = [start + k * increment for k in range(count + 1)]
    if abs(total - count) <= 1e-9 * max(1.0, total):
        values[-1] = stop
    return tuple(values)
