"""Statistics and crossings of signals over a window of a solution, as exact as its engine."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ...errors import Diagnostic, NsspiceError, UsageError
from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import var
from ..signals import signal_statistics as statistics
from ..signals.signal_function import Floats, Trace
from .solution import Solution

_POWER = re.compile(r"\s*p\s*\(\s*([^\s(),]+)\s*\)\s*")


class NotFound(Exception):
    """A measure has no result; the text says why."""


def trace_of(
    solution: Solution,
    expression: Expression,
    constants: Mapping[str, float] | None = None,
    start: float | None = None,
    stop: float | None = None,
    other: Expression | None = None,
) -> Trace:
    """Return an expression of signals as a function over a window of a solution.

    Raises
    ------
    NotFound
        If there is no such signal.
    """
    constants = constants or {}
    names = expression.variables() | (other.variables() if other is not None else frozenset())
    try:
        motion = solution.motion(sorted(names - set(constants)), start, stop)
    except KeyError as missing:
        raise NotFound(str(missing.args[0])) from None
    except NsspiceError as error:
        raise NotFound(error.diagnostics[0].message) from None
    return Trace(motion, expression, constants, other)


def bounds(solution: Solution) -> tuple[float, float]:
    """Return the ends of the axis in rising order, nan of a solution without rows."""
    axis = solution.axis
    if not axis.size:
        return float("nan"), float("nan")
    first, last = float(axis[0]), float(axis[-1])
    return min(first, last), max(first, last)


def value_at(
    solution: Solution,
    expression: Expression,
    x: float,
    constants: Mapping[str, float] | None = None,
) -> float:
    """Return an expression at an abscissa: the row there if there is one, else of the motion."""
    axis, constants = solution.axis, constants or {}
    row = int(np.abs(axis - x).argmin())
    near = 1e-9 * abs(float(axis[-1] - axis[0])) / max(axis.size - 1, 1)
    names = expression.variables() - set(constants)
    if abs(float(axis[row]) - x) <= near and all(name in solution for name in names):
        known = {**constants, **{name: float(solution[name][row]) for name in names}}
        return float(expression.evaluate(known))
    return statistics.value(trace_of(solution, expression, constants, x, x), x)


def statistic(
    solution: Solution,
    expression: Expression,
    name: str,
    start: float | None = None,
    stop: float | None = None,
    constants: Mapping[str, float] | None = None,
) -> float:
    """Return max, min, pp, avg (mean), rms, integ, max_at, min_at or final over a window."""
    first, last = bounds(solution)
    low = first if start is None else max(start, first)
    high = last if stop is None else min(stop, last)
    if not low <= high:
        raise NotFound("the window FROM..TO contains no rows")
    if name == "final":
        return value_at(solution, expression, high, constants)
    trace = trace_of(solution, expression, constants, low, high)
    if name in ("avg", "mean"):
        return statistics.mean(trace, low, high)
    if name == "rms":
        return float(np.sqrt(statistics.mean(trace, low, high, square=True)))
    if name == "integ":
        return statistics.integral(trace, low, high)
    if name in ("max", "max_at"):
        return statistics.extreme(trace, low, high)[name == "max_at"]
    if name in ("min", "min_at"):
        return statistics.extreme(trace, low, high, least=True)[name == "min_at"]
    if name == "pp":
        (top, _), (bottom, _) = statistics.extremes(trace, low, high)
        return top - bottom
    raise NotFound(f"there is no operation {name!r}")


def statistic_of(
    solution: Solution, signal: str, name: str, start: float | None, stop: float | None
) -> float:
    """Return a statistic of a signal or expression, as :meth:`Solution.average` does.

    Raises
    ------
    UsageError
        NS4005 if there is no such signal, or the window lies outside of the run.
    """
    try:
        return statistic(solution, _parsed(signal), name, start, stop)
    except NotFound as why:
        raise _refused(signal, start, stop, why) from None


def _parsed(signal: str) -> Expression:
    """Return a signal or expression; the power ``p(r1)`` is an expression of its own."""
    power = _POWER.fullmatch(signal.lower())
    return Expression.parse(signal) if power is None else Expression(var(f"p({power[1]})"))


def crossings_of(
    solution: Solution,
    signal: str,
    level: float,
    edge: statistics.Edge,
    start: float | None,
    stop: float | None,
) -> Floats:
    """Return the instants at which a signal passes a level, as :meth:`Solution.crossings` does."""
    first, last = bounds(solution)
    low = first if start is None else max(start, first)
    high = last if stop is None else min(stop, last)
    try:
        if not low <= high:
            raise NotFound("the window contains no rows")
        trace = trace_of(solution, _parsed(signal), None, low, high)
    except NotFound as why:
        raise _refused(signal, start, stop, why) from None
    return statistics.crossings(trace, level, edge, low, high)


def _refused(signal: str, start: float | None, stop: float | None, why: NotFound) -> UsageError:
    window = "" if start is None and stop is None else f" from {start} to {stop}"
    message = f"{signal}{window}: {why}"
    hint = "name a signal of the circuit, and instants of the run"
    return UsageError(Diagnostic("NS4005", message, hint=hint))
