"""What is compared: the measures of a deck, or of its beginning where the whole takes too long."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from ..analyses.request.periodic_sources import common_period
from ..circuit import Circuit
from ..errors import Diagnostic, UsageError
from ..netlist.deck import Deck, Measure, TranCard
from ..netlist.expressions.expression import Expression

#: signals that are measured where a deck measures nothing
_SIGNALS = 6
#: periods of the sources to which a long run is cut at least: one to begin, one to measure
_LEAST = 2
_STATISTICS = ("avg", "max", "min")


def prepared(circuit: Circuit) -> Deck:
    """Return the deck with measures; refuse one that has no transient.

    Raises
    ------
    UsageError
        NS4040
    """
    deck = circuit.deck
    cards = [card for card in deck.analyses if isinstance(card, TranCard)]
    if not cards or deck.steps:
        raise UsageError(
            Diagnostic(
                "NS4040",
                f"{deck.file} has {'.step cards' if cards else 'no transient'}: effects are "
                "compared in one transient",
                hint="add a .tran card" if not cards else "remove the .step cards",
            )
        )
    if any(m.analysis == "tran" for m in deck.measures):
        return deck
    return _measured(deck, _saved(circuit), _window(cards[0].tstop, _period(circuit)))


def beginning(circuit: Circuit, share: float) -> tuple[Deck, float] | None:
    """Return a deck that ends after about this share of the time, and when that is [s].

    It measures averages and extremes of what the deck measures or saves, over the last of its whole
    periods.  None if there is no transient to cut: several of them, or one of a few periods.
    """
    deck, period = circuit.deck, _period(circuit)
    cards = [card for card in deck.analyses if isinstance(card, TranCard)]
    if len(cards) != 1:
        return None
    (card,) = cards
    stop = share * card.tstop
    if period is not None and period > 0.0:  # nan: the sources have no common one
        stop = period * max(math.ceil(stop / period), _LEAST)
    if stop > 0.5 * card.tstop:
        return None
    asked = [m.expression for m in deck.measures if m.analysis == "tran" and m.expression]
    signals = list(dict.fromkeys(e.text for e in asked)) or _saved(circuit)
    analyses = [replace_stop(a, stop) if a is card else a for a in deck.analyses]
    others = [m for m in deck.measures if m.analysis != "tran"]
    cut = replace(deck, analyses=analyses, measures=others)
    return _measured(cut, signals, _window(stop, period)), stop


def replace_stop(card: TranCard, stop: float) -> TranCard:
    """Return a card that ends earlier and shows rows from the beginning."""
    return card._replace(tstop=stop, tstart=0.0)


def _saved(circuit: Circuit) -> list[str]:
    return ([s.name for s in circuit.deck.saves] or circuit.default_signals())[:_SIGNALS]


def _period(circuit: Circuit) -> float | None:
    waveforms = [w for island in circuit.islands for w in island.assemble().system.waveforms]
    return common_period(waveforms)


def _window(stop: float, period: float | None) -> tuple[float, float]:
    """Return the last whole periods, not more than half of the time; or its second half."""
    start = stop / 2.0
    if period is not None and 0.0 < period <= start:
        start = stop - math.floor(stop / 2.0 / period) * period
    return start, stop


def _measured(deck: Deck, signals: list[str], window: tuple[float, float]) -> Deck:
    span = deck.elements[0].span
    cards = [
        Measure(
            f"{operation} {name}", "tran", operation, span,
            expression=Expression.parse(name, span), start=window[0], stop=window[1],
        )
        for name in signals
        for operation in _STATISTICS
    ]  # fmt: skip
    return replace(deck, measures=[*deck.measures, *cards])


def sizes(values: Mapping[str, float]) -> dict[str, float]:
    """Return against what each measure is judged: itself, or for statistics the signal.

    The average of an alternating signal is nothing to compare with.

    Examples
    --------
    >>> sizes({"gain": -2.0, "avg v(a)": 1e-9, "max v(a)": 3.0, "min v(a)": -4.0})
    {'gain': 2.0, 'avg v(a)': 4.0, 'max v(a)': 4.0, 'min v(a)': 4.0}
    """
    largest: dict[str, float] = {}
    for name, value in values.items():
        largest[_of(name)] = max(largest.get(_of(name), 0.0), abs(value))
    return {name: largest[_of(name)] for name in values}


def _of(measure: str) -> str:
    """Return the signal whose statistic a measure is, or its own name, which has no blank."""
    label, colon, own = measure.rpartition(": ")
    _, blank, signal = own.partition(" ")
    return f"{label}{colon}{signal}" if blank else measure
