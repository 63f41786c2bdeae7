"""``.pz`` and ``.sp``: the linearised circuit between ports."""

from __future__ import annotations

from ..deck import PzCard, SpCard
from ..findings import Unreadable
from ..text.lines import Line
from .context import Context
from .periodic import frequency_range


def pz(context: Context, line: Line) -> None:
    """Read ``.pz n1 n2 n3 n4 vol|cur pol|zer|pz``."""
    hint = "write .pz in 0 out 0 vol pz: input nodes, output nodes, kind of input, what to find"
    words, pairs = context.split(line)
    kinds = [w.text for w in words[4:]]
    if pairs or len(kinds) != 2 or kinds[0] not in ("vol", "cur"):
        raise Unreadable("NS1080", ".pz needs two ports and two words", line.whole(), hint)
    if kinds[1] not in ("pol", "zer", "pz"):
        raise Unreadable("NS1080", f".pz: {kinds[1][:40]} is unknown", line.whole(), hint)
    nodes = [context.node(w.text, line.span(w.start, w.end)) for w in words[:4]]
    for a, b in (nodes[:2], nodes[2:]):
        if a == b:
            raise Unreadable("NS1080", ".pz: both nodes of a port are the same", line.whole(), hint)
    ports = (nodes[0], nodes[1]), (nodes[2], nodes[3])
    context.deck.analyses.append(PzCard(*ports, kinds[0], kinds[1], line.whole()))


def sp(context: Context, line: Line) -> None:
    """Read ``.sp dec|oct|lin n from to [0|1]``, or ``list f ...``."""
    words, pairs = context.split(line)
    if pairs:
        where = line.span(pairs[0].start, pairs[0].end)
        raise Unreadable("NS1080", ".sp has no named arguments", where, "write .sp dec 10 1 1g")
    noise = len(words) == 5 and words[0].text in ("dec", "oct", "lin")
    if noise and words.pop().text != "0":
        message = ".sp: noise parameters are not computed"
        context.findings.warning("NS1003", message, line.whole(), "use .noise")
    frequencies = frequency_range(line, ".sp", words, context)
    context.deck.analyses.append(SpCard(frequencies, line.whole()))
