"""What measures look at between the rows: which signals, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...circuit import Circuit
from ...netlist.deck import Measure
from ...netlist.expressions.node import COMPLEX_FORMS
from ..signals.signal_names import canonical
from .cards import Tran

_SIGNALS = ("v(", "i(", "p(")
#: operations that a closed form of the steady state answers
_INTEGRALS = frozenset(("avg", "rms", "integ", "thd", *(f"harm{k}" for k in range(101))))
#: an instant is that of a row up to this part of the distance of the rows
_ON_ROW = 1e-9


def measured_signals(cards: Sequence[Measure]) -> list[str]:
    """Return the canonical names of the signals that measures need, each once."""
    names: dict[str, None] = {}
    for card in cards:
        if card.operation == "param":
            continue
        for expression in card.expressions:
            for name in expression.variables():
                kind, parenthesis, inner = name.partition("(")
                part = parenthesis and kind in COMPLEX_FORMS
                whole = f"{kind[0]}({inner}" if part else name
                if whole[:2] in _SIGNALS:
                    names[canonical(whole)] = None
    return list(names)


@dataclass(frozen=True, slots=True)
class Watched:
    """Signals that are followed between the rows of a transient.

    Parameters
    ----------
    parts : frozenset of (int, str)
        Island and name of each recorded quantity that such a signal is made of.
    start, stop : float
        Between which instants they are [s].
    """

    parts: frozenset[tuple[int, str]]
    start: float
    stop: float

    @classmethod
    def of(
        cls,
        circuit: Circuit,
        analysis: Tran,
        more: Sequence[str] = (),
        kind: str = "tran",
        every: bool = False,
    ) -> Watched | None:
        """Return what the measures of a deck and ``more`` signals need, None if rows will do.

        Those of a steady state (``pss``) that are integrals follow from closed forms instead, those
        at output points from rows, unless ``every`` signal is asked for.
        """
        closed = _INTEGRALS if kind == "pss" and not every else frozenset()
        cards = [
            card
            for card in circuit.deck.measures
            if card.analysis == kind
            and card.operation not in ("param", *closed)
            and (every or not _at_row(card, analysis))
        ]
        windows = [_window(card, analysis) for card in cards]
        if more:
            windows.append((0.0, analysis.stop))
        if not windows:
            return None
        start, stop = min(w[0] for w in windows), max(w[1] for w in windows)
        return cls.signals(circuit, [*measured_signals(cards), *more], start, stop)

    @classmethod
    def signals(cls, circuit: Circuit, names: Sequence[str], start: float, stop: float) -> Watched:
        """Return what some signals are made of, over a window [s]."""
        parts = set()
        for name in names:
            for local in _linear(circuit, name):
                parts |= {(home, part) for home, part, _ in circuit.parts(local)}
        return cls(frozenset(parts), start, stop)

    def within(self, circuit: Circuit) -> Watched:
        """Return the same of a part of the circuit, whose islands have other numbers."""
        parts = {(home, name) for _, part in self.parts for home, name, _ in circuit.parts(part)}
        return Watched(frozenset(parts), self.start, self.stop)


def _linear(circuit: Circuit, name: str) -> list[str]:
    """Return the signals that a power is made of, or the signal itself."""
    if not name.startswith("p("):
        return [name]
    powers = circuit.device(name[2:-1]).powers
    return [part for current, a, b in powers for part in (f"v({a},{b})", f"i({current})")]


def _at_row(card: Measure, analysis: Tran) -> bool:
    """Return whether a measure asks for a value at the instant of a row."""
    if card.operation != "find_at" or card.at is None:
        return False
    rows = (card.at - analysis.start) / analysis.row_distance
    return abs(rows - round(rows)) <= _ON_ROW or card.at == analysis.stop


def _window(card: Measure, analysis: Tran) -> tuple[float, float]:
    """Return between which instants a measure looks at signals."""
    start = 0.0 if card.start is None else card.start
    stop = analysis.stop if card.stop is None else card.stop
    return start, stop
