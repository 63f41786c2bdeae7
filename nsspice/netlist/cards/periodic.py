"""``.pss``, ``.ac`` and ``.loop``: the periodic steady state, and responses to small signals."""

from __future__ import annotations

import math

from ...errors import suggest
from ..deck import AcCard, FourCard, LoopCard, NoiseCard, OpCard, PssCard, SensCard, TfCard
from ..elements.reading import flat, key_of
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item
from .context import Context
from .outputs import probe

_NAMES = ("period", "fund", "harms", "tstab", "tstep", "trigger", "level")
#: frequencies of one card
_POINTS = 1_000_000
_AC_HINT = "write .ac dec 10 1 1meg: points per decade, first and last frequency"
_HINT = "write .pss period=10u, .pss fund=100k, or .pss trigger=v(node) level=0"


def pss(context: Context, line: Line) -> None:
    """Read ``.pss [period=T|fund=f] [trigger=signal [level=]] [tstab=] [tstep=] [harms=]``."""
    given: dict[str, Item] = {}
    for item in context.tail(line):
        where = line.span(item.start, item.end)
        if item.kind != "pair":
            raise Unreadable("NS1080", ".pss takes only named arguments", where, _HINT)
        key = key_of(line, item)
        if key not in _NAMES or key in given:
            reason = "is given twice" if key in given else "is unknown"
            raise Unreadable("NS1080", f".pss: {key[:40]} {reason}", where, _HINT)
        given[key] = item

    def number(name: str, default: float) -> float:
        item = given.get(name)
        return default if item is None else context.number(line, item.items[1], "a number")

    def positive(name: str) -> float | None:
        value = number(name, math.nan)
        if name in given and not (math.isfinite(value) and value > 0.0):
            where = line.span(given[name].start, given[name].end)
            raise Unreadable("NS1080", f".pss: {name} must be positive", where, _HINT)
        return value if name in given else None

    if "period" in given and "fund" in given:
        where = line.span(given["fund"].start, given["fund"].end)
        raise Unreadable("NS1080", ".pss takes a period or a fundamental, not both", where, _HINT)
    fundamental = positive("fund")
    period = positive("period") if fundamental is None else 1.0 / fundamental
    trigger = None
    if "trigger" in given:
        right = given["trigger"].items[1]
        where = line.span(right.start, right.end)
        if right.kind != "call":
            raise Unreadable("NS1080", ".pss: the trigger must be a signal", where, _HINT)
        trigger = probe(context, right, where)
        if period is not None:
            message = (
                ".pss: a trigger and a period are both given, but the trigger determines the period"
            )
            raise Unreadable("NS1080", message, where, "remove one of them")
    harmonics = number("harms", 20.0)
    tstab = number("tstab", 0.0)
    if not (harmonics >= 1.0 and harmonics == int(harmonics)) or not 0.0 <= tstab < math.inf:
        message = ".pss: harms must be at least 1, and tstab must not be negative"
        raise Unreadable("NS1080", message, line.whole(), _HINT)
    card = PssCard(
        period,
        trigger,
        number("level", 0.0),
        tstab,
        positive("tstep"),
        int(harmonics),
        line.whole(),
    )
    context.deck.analyses.append(card)


def hb(context: Context, line: Line) -> None:
    """Read ``.hb f`` or ``.hb tones=f [nharms=n]``: the same steady state, found in time."""
    hint = "write .hb 1meg, or .pss fund=1meg harms=20; two tones need a common period"
    pairs: list[Item] = []
    tones = [context.number(line, word, "a frequency") for word in flat(context.tail(line), pairs)]
    harmonics = 20.0
    for pair in pairs:
        value = context.number(line, pair.items[1], "a number")
        if pair.text in ("tones", "tone"):
            tones.append(value)
        elif pair.text in ("nharms", "nharm"):
            harmonics = value
        else:
            where = line.span(pair.start, pair.end)
            raise Unreadable("NS1080", f".hb: {pair.text[:40]} is unknown", where, hint)
    if len(tones) != 1 or not (math.isfinite(tones[0]) and tones[0] > 0.0):
        raise Unreadable("NS1080", ".hb takes one frequency", line.whole(), hint)
    if not (harmonics >= 1.0 and harmonics == int(harmonics)):
        raise Unreadable("NS1080", ".hb: nharms must be at least 1", line.whole(), hint)
    card = PssCard(1.0 / tones[0], None, 0.0, 0.0, None, int(harmonics), line.whole())
    context.deck.analyses.append(card)


def ac(context: Context, line: Line) -> None:
    """Read ``.ac dec|oct|lin n from to`` or ``.ac list f ...``, with ``sidebands=n``."""
    pairs: list[Item] = []
    words = list(flat(context.tail(line), pairs))
    sidebands = 0.0
    for pair in pairs:
        where = line.span(pair.start, pair.end)
        if pair.text != "sidebands":
            raise Unreadable("NS1080", f".ac: {pair.text[:40]} is unknown", where, _AC_HINT)
        sidebands = context.number(line, pair.items[1], "a number")
        if not (sidebands >= 0.0 and sidebands == int(sidebands)):
            raise Unreadable("NS1080", ".ac: sidebands must be 0 or more", where, _AC_HINT)
    frequencies = frequency_range(line, ".ac", words, context)
    card = AcCard(frequencies, int(sidebands), line.whole())
    context.deck.analyses.append(card)


def loop(context: Context, line: Line) -> None:
    """Read ``.loop source dec|oct|lin n from to``, or ``list f ...``."""
    words = list(flat(context.tail(line)))
    hint = "write .loop V1 dec 10 1 1meg: a voltage source of 0 V in the loop, and frequencies"
    if not words or any(word.kind == "pair" for word in words):
        raise Unreadable("NS1080", ".loop needs a source and frequencies", line.whole(), hint)
    name, where = words[0].text, line.span(words[0].start, words[0].end)
    source = next((e for e in context.deck.elements if e.name == name), None)
    if source is None:
        names = [e.name for e in context.deck.elements if e.letter == "v"]
        raise Unreadable(
            "NS1070", f".loop: there is no source {name[:60]}", where, suggest(name, names) or hint
        )
    if source.letter != "v" or source.value is not None or "0" in source.nodes:
        message = f".loop: {name} is not a voltage source between two nodes of the loop"
        raise Unreadable("NS1080", message, where, hint)
    frequencies = frequency_range(line, ".loop", words[1:], context)
    context.deck.analyses.append(LoopCard(name, frequencies, line.whole()))


def noise(context: Context, line: Line) -> None:
    """Read ``.noise v(out[,ref]) source dec|oct|lin n from to [points]``."""
    hint = "write .noise v(out) V1 dec 10 1 1meg: a voltage, a source, and frequencies"
    items = list(context.tail(line))
    if len(items) < 2 or items[0].kind != "call" or items[0].text != "v":
        raise Unreadable("NS1080", ".noise needs a voltage and a source", line.whole(), hint)
    output = probe(context, items[0], line.span(items[0].start, items[0].end))
    words = list(flat(items[1:]))
    source = _source(context, line, ".noise", words, hint)
    # SPICE's points per summary change no result
    count = 5 if len(words) == 6 and words[1].text in ("dec", "oct", "lin") else len(words)
    frequencies = frequency_range(line, ".noise", words[1:count], context)
    context.deck.analyses.append(NoiseCard(output, source, frequencies, line.whole()))


def tf(context: Context, line: Line) -> None:
    """Read ``.tf output source``: a voltage, or the current of a voltage source."""
    hint = "write .tf v(out) V1: an output and a source"
    items = list(context.tail(line))
    if len(items) != 2 or items[0].kind != "call" or items[0].text not in ("v", "i"):
        raise Unreadable("NS1080", ".tf needs an output and a source", line.whole(), hint)
    where = line.span(items[0].start, items[0].end)
    output = probe(context, items[0], where)
    if output.startswith("i("):
        known = next((e for e in context.deck.elements if e.name == output[2:-1]), None)
        if known is None or known.letter != "v":
            message = f".tf: the current {output} is not that of a voltage source"
            raise Unreadable("NS1080", message, where, "put a 0 V source in its path")
    source = _source(context, line, ".tf", list(flat(items[1:])), hint)
    context.deck.analyses.append(TfCard(output, source, line.whole()))


def _source(context: Context, line: Line, card: str, words: list[Item], hint: str) -> str:
    """Return the name of the V or I that the first word is."""
    if not words or words[0].kind != "word":
        raise Unreadable("NS1080", f"{card} needs a source", line.whole(), hint)
    name, where = words[0].text, line.span(words[0].start, words[0].end)
    names = [e.name for e in context.deck.elements if e.letter in "vi"]
    if name not in names:
        message = f"{card}: there is no source {name[:60]}"
        raise Unreadable("NS1070", message, where, suggest(name, names) or hint)
    return name


def four(context: Context, line: Line) -> None:
    """Read ``.four [f] signal ... [harms=n] [periods=n]``."""
    hint = "write .four 50 v(out) i(L1): the fundamental (not needed with .pss) and signals"
    counts = {"harms": 10.0, "periods": 1.0}
    signals: list[str] = []
    frequency = None
    for item in context.tail(line):
        where = line.span(item.start, item.end)
        if item.kind == "pair":
            if item.text not in counts:
                raise Unreadable("NS1080", f".four: {item.text[:40]} is unknown", where, hint)
            value = context.number(line, item.items[1], "a number")
            if not (value >= 1.0 and value == int(value)):
                message = f".four: {item.text} must be at least 1"
                raise Unreadable("NS1080", message, where, hint)
            counts[item.text] = value
        elif item.kind == "call" and item.text == "p":
            message = ".four of a power is left out: it is a product of two signals"
            context.findings.warning("NS1003", message, where, "run --power has mean powers")
        elif item.kind == "call":
            signals.append(probe(context, item, where))
        elif frequency is None and not signals:
            frequency = context.number(line, item, "a frequency")
            if not (math.isfinite(frequency) and frequency > 0.0):
                raise Unreadable("NS1080", ".four: the frequency must be positive", where, hint)
        else:
            raise Unreadable("NS1080", ".four takes one frequency, then signals", where, hint)
    if not signals:
        raise Unreadable("NS1080", ".four needs voltages or currents", line.whole(), hint)
    harmonics, periods = int(counts["harms"]), int(counts["periods"])
    card = FourCard(frequency, tuple(signals), harmonics, periods, line.whole())
    context.deck.fours.append(card)


def sens(context: Context, line: Line) -> None:
    """Read ``.sens signal ... [element ...]`` or ``.sens measure ... [parameter|element ...]``."""
    _sens(context, line)


def _sens(context: Context, line: Line) -> SensCard:
    hint = "write .sens v(out) i(L1), or .sens followed by a measure and parameters or elements"
    signals: list[str] = []
    elements: list[str] = []
    names: list[str] = []
    for item in context.tail(line):
        where = line.span(item.start, item.end)
        if signals and item.text in ("ac", "dc") and not context.is_element(item.text):
            message = ".sens: the sensitivities are those of the operating point"
            context.findings.warning("NS1003", message, where, "ac and its range are left out")
            break
        if item.kind == "call":
            signals.append(probe(context, item, where))
        elif item.kind == "word" and (signals or context.is_element(item.text)):
            elements.append(context.element(item.text, where))
        elif item.kind == "word":
            names.append(item.text)
        else:
            raise Unreadable("NS1080", ".sens takes signals and elements", where, hint)
    if any(name.startswith("p(") for name in signals) or not (signals or names):
        message = ".sens needs voltages or currents, or measures"
        raise Unreadable("NS1080", message, line.whole(), hint)
    if signals and names:
        message = ".sens takes signals or measures, not both"
        raise Unreadable("NS1080", message, line.whole(), "write two cards")
    card = SensCard(tuple(signals), tuple(elements), line.whole(), tuple(names))
    context.deck.sensitivities.append(card)
    return card


def sens_op(context: Context, line: Line) -> None:
    """Read a ``.sens`` of a deck without ``.pss``: that of signals needs the operating point."""
    card = _sens(context, line)
    if card.signals and not any(isinstance(c, OpCard) for c in context.deck.analyses):
        context.deck.analyses.append(OpCard(line.whole()))


def frequency_range(
    line: Line, card: str, words: list[Item], context: Context
) -> tuple[float, ...]:
    """Return the frequencies that a card asks for [Hz]."""
    hint = _AC_HINT.replace(".ac", card)
    kinds = ("dec", "oct", "lin", "list")
    if not words or words[0].text not in kinds:
        raise Unreadable("NS1080", f"{card} needs {', '.join(kinds)}", line.whole(), hint)
    kind, numbers = words[0].text, [context.number(line, w, "a number") for w in words[1:]]
    frequencies = numbers if kind == "list" else _frequencies(line, kind, numbers)
    if not frequencies or not all(math.isfinite(f) and f >= 0.0 for f in frequencies):
        message = f"{card}: frequencies must be 0 or more"
        raise Unreadable("NS1080", message, line.whole(), hint)
    return tuple(frequencies)


def _frequencies(line: Line, kind: str, numbers: list[float]) -> list[float]:
    """Return the frequencies of a range [Hz]: points per decade or octave, or in all."""
    if len(numbers) != 3:
        raise Unreadable("NS1080", f".ac {kind} takes three numbers", line.whole(), _AC_HINT)
    count, first, last = numbers
    if count < 1.0 or count != int(count) or not first <= last:
        message = ".ac needs a whole number of points and frequencies in rising order"
        raise Unreadable("NS1080", message, line.whole(), _AC_HINT)
    if kind == "lin":
        if count > _POINTS:
            raise Unreadable("NS1080", f".ac: more than {_POINTS} points", line.whole())
        steps = max(int(count) - 1, 1)
        return [first + (last - first) * k / steps for k in range(int(count))]
    if first <= 0.0:
        raise Unreadable(
            "NS1080", f".ac {kind}: frequencies must be positive", line.whole(), _AC_HINT
        )
    base = 10.0 if kind == "dec" else 2.0
    total = math.log(last / first, base) * count
    if total > _POINTS:
        raise Unreadable("NS1080", f".ac: more than {_POINTS} points", line.whole())
    found = [first * base ** (k / count) for k in range(math.floor(total + 1e-9) + 1)]
    if math.isclose(found[-1], last, rel_tol=1e-9):
        found[-1] = last
    return found
