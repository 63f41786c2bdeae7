"""Evaluation of ``.measure`` cards, to the accuracy of the engine: rows do not matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from ...errors import Diagnostic, suggest
from ...netlist.deck import Cond, Measure
from ...netlist.expressions.expression import Expression
from ..averages.spectrum import exact_statistic, hot_measure, spectral_measure
from ..signals import signal_statistics as statistics
from ..signals.signal_names import canonical
from ..solution.solution import Solution
from ..solution.window_statistics import NotFound, bounds, statistic, trace_of, value_at

T = TypeVar("T")
#: operations on all that a window holds
_STATISTICS = frozenset(("max", "min", "pp", "avg", "rms", "integ", "max_at", "min_at"))
#: of complex signals
PARTS = ("db", "m", "p", "r", "i")
_INTEGRALS = frozenset(("avg", "mean", "integ", "rms"))


def evaluate_measures(solution: Solution, cards: Sequence[Measure]) -> None:
    """Evaluate the cards of the solution's analysis, in deck order, into ``solution.measures``.

    A measure that finds nothing becomes nan, with a warning that says why.
    """
    rows = magnitudes(solution) if solution.analysis == "ac" else solution
    for card in cards:
        if card.analysis != solution.analysis:
            continue
        try:
            card = _settled(card, solution.measures)
            card = _between_events(rows, card, solution.measures)
            value = measure(rows, card, solution.measures)
            if not np.isfinite(value):
                raise NotFound("the result is not a finite number")
        except NotFound as why:
            value = float("nan")
            solution.warnings.append(
                Diagnostic(
                    "NS5001",
                    f'.measure "{card.name}" has no result: {why}',
                    card.span,
                    "check the level, the edge number and the window (TD, FROM, TO)",
                    severity="warning",
                )
            )
        solution.measures[card.name] = value
        solution.warnings.extend(_left_out(solution, card))


def magnitudes(solution: Solution) -> Solution:
    """Return a response as measures see it: ``v(out)`` is its magnitude."""
    names = [n[3:-1] for n in solution.signals if n.startswith("re(")]
    table = {
        **{n: np.abs(solution[n]) for n in names},
        **{f"{n[0]}{p}{n[1:]}": solution[f"{n[0]}{p}{n[1:]}"] for n in names for p in PARTS},
    }
    return replace(solution, signals=table, columns=names, fine=None)


def _left_out(solution: Solution, card: Measure) -> list[Diagnostic]:
    """Return a warning where an integral of currents misses charge that moves in no time."""
    if card.operation not in _INTEGRALS or card.expression is None:
        return []
    start = -np.inf if card.start is None else card.start
    stop = np.inf if card.stop is None else card.stop
    currents = {canonical(name) for name in card.expression.variables() if name.startswith("i(")}
    charges: dict[str, float] = {}
    for impulse in solution.impulses:
        name = f"i({impulse.element})"
        if impulse.unit == "A s" and name in currents and start < impulse.time <= stop:
            charges[name] = charges.get(name, 0.0) + impulse.value
    if not charges:
        return []
    told = ", ".join(f"{charge:.6g} A s of {name}" for name, charge in charges.items())
    return [
        Diagnostic(
            "NS5002",
            f'.measure "{card.name}" omits impulses: {told}',
            card.span,
            "add this charge, or give its path a resistance",
            severity="warning",
        )
    ]


def measure(solution: Solution, card: Measure, earlier: Mapping[str, float]) -> float:
    """Return the value of one card.

    Parameters
    ----------
    solution : Solution
    card : Measure
    earlier : mapping of str to float
        Results that ``param`` expressions may use.

    Raises
    ------
    NotFound
        If a crossing, signal or point does not exist.
    """
    operation = card.operation
    if operation == "param":
        return _param(_need(card.expression, "expression"), earlier)
    if card.is_hot:
        try:
            return hot_measure(solution, card)
        except ValueError as why:
            raise NotFound(str(why)) from why
    if (exact := exact_statistic(solution, card)) is not None:
        return exact
    if card.is_spectral:
        try:
            return spectral_measure(solution, card)
        except ValueError as why:
            raise NotFound(str(why)) from why
    if operation == "trig_targ":
        first = instant(solution, _need(card.first, "TRIG"), card, earlier)
        return instant(solution, _need(card.second, "TARG"), card, earlier) - first
    if operation == "when":
        return instant(solution, _need(card.first, "WHEN"), card, earlier)
    expression = _need(card.expression, "expression")
    if operation in ("find_when", "find_at", "deriv"):
        x = card.at
        if x is None:
            x = instant(solution, _need(card.first, "WHEN"), card, earlier)
        low, high = bounds(solution)
        slack = 1e-12 * max(abs(low), abs(high))
        if not low - slack <= x <= high + slack:
            raise NotFound(f"{x:.6g} is outside the rows of the analysis")
        if operation == "deriv":
            return statistics.slope(trace_of(solution, expression, earlier), x)
        return value_at(solution, expression, x, earlier)
    return statistic(solution, expression, operation, card.start, card.stop, earlier)


def _settled(card: Measure, earlier: Mapping[str, float]) -> Measure:
    """Return a card with the values that earlier measures give."""
    first, second = (
        c if c is None or not c.late else replace(c, late=(), **_values(c.late, earlier))
        for c in (card.first, card.second)
    )
    return card._replace(first=first, second=second, **_values(card.late, earlier))


def _values(late: Sequence[tuple[str, Expression]], earlier: Mapping[str, float]) -> dict[str, Any]:
    """Return values by field."""
    found = {name: _param(expression, earlier) for name, expression in late}
    for name, value in found.items():
        if not np.isfinite(value):
            raise NotFound(f"{name} is not a finite number")
    return found


def _between_events(solution: Solution, card: Measure, earlier: Mapping[str, float]) -> Measure:
    """Return a statistic from TRIG to TARG as one between their instants."""
    if not card.conditions or card.operation not in _STATISTICS:
        return card
    start = card.start if card.first is None else instant(solution, card.first, card, earlier)
    stop = card.stop if card.second is None else instant(solution, card.second, card, earlier)
    if start is not None and stop is not None and stop < start:
        raise NotFound(f"TARG, at {stop:.6g}, comes before TRIG, at {start:.6g}")
    return card._replace(start=start, stop=stop, first=None, second=None)


def _param(expression: Expression, earlier: Mapping[str, float]) -> float:
    names = expression.variables()
    for name in names:
        if name not in earlier:
            hint = suggest(name, earlier)
            raise NotFound(f"no earlier measure is called {name!r}{hint and '; ' + hint}")
    return float(np.asarray(expression.evaluate({name: earlier[name] for name in names})))


def instant(solution: Solution, cond: Cond, card: Measure, earlier: Mapping[str, float]) -> float:
    """Return the abscissa at which a condition holds."""
    if cond.at is not None:
        return cond.at
    signal = _need(cond.signal, "signal")
    level = 0.0 if cond.other is not None else cond.value or 0.0
    text = f"{signal.text} = {cond.other.text if cond.other is not None else f'{level:.6g}'}"
    first, last = bounds(solution)
    low = max(cond.delay, first if card.start is None else card.start, first)
    high = last if card.stop is None else min(card.stop, last)
    trace = trace_of(solution, signal, earlier, first, last, cond.other)
    # where a window begins on the level, it has been passed before
    found = statistics.crossings(trace, level, cond.edge, first, last)
    found = found[(found >= low) & (found <= high)]
    wanted = -1 if cond.index == 0 else cond.index - 1
    if found.size == 0 or wanted >= found.size:
        kind = {"rise": "rising", "fall": "falling"}.get(cond.edge, "")
        number = "no" if found.size == 0 else f"only {found.size}"
        crossings = " ".join(filter(None, [kind, "crossing" + "s" * (found.size != 1)]))
        raise NotFound(f"{text} has {number} {crossings}")
    return float(found[wanted])


def _need(item: T | None, what: str) -> T:
    if item is None:
        raise NotFound(f"its {what} is missing")
    return item
