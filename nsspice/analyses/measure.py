"""Evaluation of ``.measure`` cards on the rows of a solution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..errors import Diagnostic, suggest
from ..netlist.deck import Cond, Measure
from ..netlist.expression import Expression
from .bends import with_bends
from .curve import Curve, Floats
from .names import canonical
from .solution import Solution
from .spectrum import exact_statistic, spectral_measure

T = TypeVar("T")
#: operations on all that a window holds
_STATISTICS = frozenset(("max", "min", "pp", "avg", "rms", "integ", "max_at", "min_at"))
#: of complex signals
PARTS = ("db", "m", "p", "r", "i")
_INTEGRALS = frozenset(("avg", "mean", "integ", "rms"))


class NotFound(Exception):
    """A measure has no result; the text says why."""


def evaluate_measures(solution: Solution, cards: Sequence[Measure]) -> None:
    """Evaluate the cards of the solution's analysis, in deck order, into ``solution.measures``.

    A measure that finds nothing becomes nan, with a warning that says why.
    """
    rows = solution.with_jumps() if solution.analysis != "ac" else magnitudes(solution)
    for card in cards:
        if card.analysis != solution.analysis:
            continue
        try:
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
            f'.measure "{card.name}" leaves out impulses: {told}',
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
    if (exact := exact_statistic(solution, card)) is not None:
        return exact
    if operation == "thd" or operation.startswith("harm"):
        try:
            return spectral_measure(solution, card)
        except ValueError as why:
            raise NotFound(str(why)) from why
    solution = _fine(solution, card, earlier)
    if operation == "trig_targ":
        first = _instant(solution, _need(card.first, "TRIG"), card)
        return _instant(solution, _need(card.second, "TARG"), card) - first
    if operation == "when":
        return _instant(solution, _need(card.first, "WHEN"), card)
    curve = curve_of(solution, _need(card.expression, "expression"), earlier)
    if operation in ("find_when", "find_at", "deriv"):
        when = card.first
        x = card.at if card.at is not None else _instant(solution, _need(when, "WHEN"), card)
        y = curve.slope(x) if operation == "deriv" else curve.at(x)
        if np.isnan(y):
            raise NotFound(f"{x:.6g} lies outside the rows of the analysis")
        return y
    return statistic(curve.window(card.start, card.stop), operation)


def _between_events(solution: Solution, card: Measure, earlier: Mapping[str, float]) -> Measure:
    """Return a statistic from TRIG to TARG as one between their instants."""
    if not card.conditions or card.operation not in _STATISTICS:
        return card
    rows = _fine(solution, card, earlier)
    start = card.start if card.first is None else _instant(rows, card.first, card)
    stop = card.stop if card.second is None else _instant(rows, card.second, card)
    if start is not None and stop is not None and stop < start:
        raise NotFound(f"TARG, at {stop:.6g}, comes before TRIG, at {start:.6g}")
    return card._replace(start=start, stop=stop, first=None, second=None)


def _fine(solution: Solution, card: Measure, earlier: Mapping[str, float]) -> Solution:
    start, stop = (None, None) if card.conditions else (card.start, card.stop)
    if card.at is not None and not card.conditions:
        start = stop = card.at
    try:
        return with_bends(solution, card.expressions, earlier, start, stop)
    except KeyError as missing:
        raise NotFound(str(missing.args[0])) from None


def statistic(curve: Curve, name: str) -> float:
    """Return max, min, pp, avg (mean), rms, integ, max_at, min_at or final of a curve."""
    if curve.x.size == 0:
        raise NotFound("the window FROM..TO holds no rows")
    y = curve.y
    if name == "max":
        return float(y.max())
    if name == "min":
        return float(y.min())
    if name == "pp":
        return float(y.max() - y.min())
    if name in ("avg", "mean"):
        return curve.mean()
    if name == "rms":
        return curve.rms()
    if name == "integ":
        return curve.integral()
    if name == "max_at":
        return float(curve.x[int(y.argmax())])
    if name == "min_at":
        return float(curve.x[int(y.argmin())])
    if name == "final":
        return float(y[-1])
    raise NotFound(f"there is no operation {name!r}")


def curve_of(
    solution: Solution, expression: Expression, constants: Mapping[str, float] | None = None
) -> Curve:
    """Return the curve of an expression of signals over the axis of a solution."""
    values: dict[str, Floats | float] = {}
    for name in expression.variables():
        if constants is not None and name in constants:
            values[name] = constants[name]
            continue
        try:
            values[name] = solution[name]
        except KeyError as missing:
            raise NotFound(str(missing.args[0])) from None
    return Curve.of(solution.axis, np.asarray(expression.evaluate(values)))


def _param(expression: Expression, earlier: Mapping[str, float]) -> float:
    names = expression.variables()
    for name in names:
        if name not in earlier:
            hint = suggest(name, earlier)
            raise NotFound(f"no earlier measure is called {name!r}{hint and '; ' + hint}")
    return float(np.asarray(expression.evaluate({name: earlier[name] for name in names})))


def _instant(solution: Solution, cond: Cond, card: Measure) -> float:
    """Return the abscissa at which a condition holds."""
    if cond.at is not None:
        return cond.at
    curve = curve_of(solution, _need(cond.signal, "signal"))
    level, text = 0.0, f"{_need(cond.signal, 'signal').text}"
    if cond.other is not None:
        curve = Curve(curve.x, curve.y - curve_of(solution, cond.other).y)
        text += f" = {cond.other.text}"
    else:
        level = cond.value or 0.0
        text += f" = {level:.6g}"
    found = curve.crossings(level, cond.edge)
    low = max(cond.delay, -np.inf if card.start is None else card.start)
    if cond.delay or card.start is not None:
        found = found[found >= low]
    if card.stop is not None:
        found = found[found <= card.stop]
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
