"""LTspice's ``.tran startup``: constant sources rise from zero in the first 20 us."""

from __future__ import annotations

from dataclasses import replace

from ...errors import Span
from ..deck import Deck
from ..findings import Findings

#: [s]
RISE = 20e-6


def start_up(deck: Deck, findings: Findings, where: Span) -> None:
    """Replace all constant sources by ramps, so that the circuit starts without them.

    Parameters
    ----------
    deck : Deck
    findings : Findings
        Receives the names of sources with a waveform, which LTspice scales by the same ramp.
    where : Span
        Of the word ``startup``.
    """
    others = []
    for index, element in enumerate(deck.elements):
        source = element.source
        if source is None:
            continue
        if source.kind:
            others.append(element.name)
        elif source.dc:
            ramp = source._replace(dc=None, kind="pwl", values=(0.0, 0.0, RISE, source.dc))
            deck.elements[index] = replace(element, source=ramp)
    if others:
        names = ", ".join(others[:6]) + ", ..." * (len(others) > 6)
        message = f".tran startup raises constant sources; those with a waveform stay: {names}"
        findings.warning("NS1003", message, where)
