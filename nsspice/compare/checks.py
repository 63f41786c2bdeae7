"""The kinds of checks: a value, a measure, an impulse, a whole waveform."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..analyses.signals.curve import Curve
from ..analyses.signals.signal_names import canonical
from ..analyses.solution.solution import Solution
from ..analyses.solution.window_statistics import NotFound, bounds, statistic, value_at
from ..errors import NsspiceError, suggest
from ..netlist.expressions.expression import Expression
from .norms import distance
from .reference import read_table

_STATISTICS = ("max", "min", "final", "mean", "rms", "pp", "integ")
_NORMS = ("max", "l1", "rms")


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of one check.

    Parameters
    ----------
    text : str
        What was checked.
    passed : bool
    detail : str
        What was found, for failed checks.
    error, tolerance : float
        Distance from the expected value, and how much is allowed.
    """

    text: str
    passed: bool
    detail: str = ""
    error: float = float("nan")
    tolerance: float = float("nan")

    def __str__(self) -> str:
        return f"{'ok  ' if self.passed else 'FAIL'} {self.text}: {self.detail}"

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {
            "check": self.text,
            "passed": self.passed,
            "detail": self.detail,
            "error": self.error if np.isfinite(self.error) else None,
            "tolerance": self.tolerance if np.isfinite(self.tolerance) else None,
        }


@dataclass(frozen=True, slots=True)
class Check(ABC):
    """What all checks have in common.

    Parameters
    ----------
    tolerance : float
        Absolute.
    why : str
        How the tolerance was derived.
    analysis : str or None
        ``op``, ``dc`` or ``tran``; the first analysis of the deck if None.
    number : int
        Which run of that analysis, counted from 1: for decks with ``.step`` or several cards.
    """

    tolerance: float
    why: str
    analysis: str | None
    number: int

    @property
    @abstractmethod
    def text(self) -> str:
        """What is checked."""

    def signals(self) -> list[str]:
        """Return the signals that are needed."""
        return []

    def evaluate(self, solutions: Sequence[Solution], netlist: Path) -> Outcome:
        """Make the check."""
        kind = self.analysis or solutions[0].analysis
        runs = [s for s in solutions if s.analysis == kind]
        if len(runs) < self.number:
            return Outcome(self.text, False, f"the deck has {len(runs)} runs of .{kind}")
        try:
            return self.apply(runs[self.number - 1], netlist)
        except NotFound as why:
            return Outcome(self.text, False, str(why))
        except NsspiceError as error:
            return Outcome(self.text, False, error.diagnostics[0].render())

    @abstractmethod
    def apply(self, solution: Solution, netlist: Path) -> Outcome:
        """Make the check on the right solution."""

    def near(self, found: float, value: float) -> Outcome:
        """Return the outcome of a comparison of two numbers."""
        error = abs(found - value)
        detail = (
            f"{found:.9g}, expected {value:.9g}, off by {error:.2e}, allowed {self.tolerance:g}"
        )
        if self.why:
            detail += f" ({self.why})"
        return Outcome(self.text, bool(error <= self.tolerance), detail, error, self.tolerance)


@dataclass(frozen=True, slots=True)
class ValueCheck(Check):
    """A signal at an instant, or a statistic of it over a window."""

    signal: Expression
    value: float
    at: float | None
    statistic: str | None
    start: float | None
    stop: float | None

    @property
    def text(self) -> str:
        """What is checked."""
        if self.at is not None:
            return f"{self.signal.text} at {self.at:g}"
        window = "" if self.start is None and self.stop is None else " in the window"
        return f"{self.statistic or 'value'} of {self.signal.text}{window}"

    def signals(self) -> list[str]:
        """Return the signals of the expression."""
        return _signals(self.signal)

    def apply(self, solution: Solution, netlist: Path) -> Outcome:
        """Compare the value."""
        if self.at is not None:
            low, high = bounds(solution)
            slack = 1e-12 * max(abs(low), abs(high))
            if not low - slack <= self.at <= high + slack:
                raise NotFound(f"{self.at:g} is outside the rows of the analysis")
            found = value_at(solution, self.signal, self.at)
        else:
            name = self.statistic or "final"
            found = statistic(solution, self.signal, name, self.start, self.stop)
        return self.near(found, self.value)


@dataclass(frozen=True, slots=True)
class MeasureCheck(Check):
    """The result of a ``.measure`` card."""

    measure: str
    value: float

    @property
    def text(self) -> str:
        """What is checked."""
        return f".measure {self.measure}"

    def apply(self, solution: Solution, netlist: Path) -> Outcome:
        """Compare the result."""
        if self.measure not in solution.measures:
            hint = suggest(self.measure, solution.measures)
            raise NotFound(f"there is no such measure{hint and '; ' + hint}")
        return self.near(solution.measures[self.measure], self.value)


@dataclass(frozen=True, slots=True)
class ImpulseCheck(Check):
    """The impulse of an element: the sum over the run, or at one instant."""

    impulse: str
    value: float
    at: float | None

    @property
    def text(self) -> str:
        """What is checked."""
        return f"impulse of {self.impulse}" + (f" at {self.at:g}" if self.at is not None else "")

    def apply(self, solution: Solution, netlist: Path) -> Outcome:
        """Compare the charge or flux."""
        slack = 1e-9 * max(abs(float(solution.axis[-1])), 1e-300) if solution.axis.size else 0.0
        found = [
            p.value
            for p in solution.impulses
            if p.element == self.impulse and (self.at is None or abs(p.time - self.at) <= slack)
        ]
        return self.near(sum(found), self.value)


@dataclass(frozen=True, slots=True)
class WaveformCheck(Check):
    """A whole waveform against a column of a CSV file."""

    reference: str
    time: str
    column: str
    signal: Expression
    scale: float
    offset: float
    norm: str
    start: float | None
    stop: float | None

    @property
    def text(self) -> str:
        """What is checked."""
        return f"{self.signal.text} against {Path(self.reference).name}:{self.column}"

    def signals(self) -> list[str]:
        """Return the signals of the expression."""
        return _signals(self.signal)

    def apply(self, solution: Solution, netlist: Path) -> Outcome:
        """Compare the waveforms."""
        table = read_table(netlist.parent / self.reference)
        known = table.curve(self.time, self.column)
        reference = Curve(known.x, known.y * self.scale + self.offset)
        d = distance(_rows_of(solution, self.signal), reference, self.start, self.stop)
        error = d.by_name(self.norm)
        detail = f"{self.norm} distance {error:.3e}, allowed {self.tolerance:g}"
        if self.why:
            detail += f" ({self.why})"
        if np.isnan(error):
            detail = "the waveforms have no time in common"
        return Outcome(self.text, bool(error <= self.tolerance), detail, error, self.tolerance)


_COMMON = ("tolerance", "why", "analysis", "number")
_KEYS = {
    "measure": ("measure", "value"),
    "impulse": ("impulse", "value", "at"),
    "reference": ("reference", "time", "column", "signal", "scale", "offset", "norm", "from", "to"),
    "signal": ("signal", "value", "at", "statistic", "from", "to"),
}


def check_from(item: Mapping[str, Any]) -> Check:
    """Return the check of a TOML table.

    Raises
    ------
    ValueError
        With a sentence, for unknown, missing or wrong items.

    Examples
    --------
    >>> check_from({"signal": "v(out)", "at": 1e-3, "value": 5, "tolerance": 1e-6}).text
    'v(out) at 0.001'
    >>> check_from({"signal": "v(out)", "at": 1e-3, "value": 5})
    Traceback (most recent call last):
    ...
    ValueError: it needs tolerance
    """
    if not isinstance(item, Mapping):
        raise ValueError("it must be a table below its own line [[check]]")
    kind = next((k for k in ("measure", "impulse", "reference", "signal") if k in item), None)
    if kind is None:
        raise ValueError("it needs one of signal, measure, impulse, reference")
    keys = (*_KEYS[kind], *_COMMON)
    for key in item:
        if key not in keys:
            hint = suggest(key, keys) or f"keys: {', '.join(keys)}"
            raise ValueError(f"unknown key {key!r}; {hint}")
    get = _Getter(item)
    tolerance = get.number("tolerance")
    if tolerance < 0.0:
        raise ValueError("tolerance must not be negative")
    analysis = get.word("analysis", ("op", "dc", "tran"))
    common = (tolerance, str(item.get("why", "")), analysis, get.count("number"))
    if kind == "measure":
        return MeasureCheck(*common, get.text("measure").lower(), get.number("value"))
    if kind == "impulse":
        name = get.text("impulse").lower()
        return ImpulseCheck(*common, name, get.number("value"), get.optional("at"))
    signal = Expression.parse(get.text("signal"))
    window = (get.optional("from"), get.optional("to"))
    if kind == "reference":
        return WaveformCheck(
            *common,
            get.text("reference"),
            get.text("time"),
            get.text("column"),
            signal,
            get.number("scale", 1.0),
            get.number("offset", 0.0),
            get.word("norm", _NORMS) or "max",
            *window,
        )
    at, which = get.optional("at"), get.word("statistic", _STATISTICS)
    if at is not None and which is not None:
        raise ValueError("at and statistic cannot be used together")
    return ValueCheck(*common, signal, get.number("value"), at, which, *window)


class _Getter:
    """Typed access to the items of a check."""

    def __init__(self, item: Mapping[str, Any]) -> None:
        self.item = item

    def text(self, key: str) -> str:
        value = self.item.get(key)
        if not isinstance(value, str):
            raise ValueError(f"it needs {key}" if value is None else f"{key} must be a string")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        value = self.item.get(key, default)
        if value is None:
            raise ValueError(f"it needs {key}")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{key} must be a number")
        if not math.isfinite(value):  # a tolerance without bound would check nothing
            raise ValueError(f"{key} must be a finite number, not {value}")
        return float(value)

    def count(self, key: str) -> int:
        value = self.item.get(key, 1)
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise ValueError(f"{key} must be a whole number of at least 1")
        return value

    def optional(self, key: str) -> float | None:
        return self.number(key) if key in self.item else None

    def word(self, key: str, words: Sequence[str]) -> str | None:
        value = self.item.get(key)
        if value is not None and value not in words:
            raise ValueError(f"{key} must be one of {', '.join(words)}")
        return value


def signals_of(checks: Sequence[Check]) -> list[str]:
    """Return the signals that the checks read, each once."""
    return list(dict.fromkeys(name for item in checks for name in item.signals()))


def followed_by(checks: Sequence[Check]) -> list[str]:
    """Return the signals of which statistics are checked: rows do not show them."""
    values = [c for c in checks if isinstance(c, ValueCheck) and c.statistic not in (None, "final")]
    return signals_of(values)


def _rows_of(solution: Solution, expression: Expression) -> Curve:
    """Return the lines between the rows of a solution, of an expression of its signals."""
    try:
        values = {name: solution[name] for name in expression.variables()}
    except KeyError as missing:
        raise NotFound(str(missing.args[0])) from None
    return Curve.of(solution.axis, np.asarray(expression.evaluate(values)))


def _signals(expression: Expression) -> list[str]:
    return [canonical(n) for n in expression.variables() if n[:2] in ("v(", "i(", "p(")]
