"""Measures to first order: weighted integrals and values of signals, and numbers on their cards.

Every measure is a function of integrals of signals, of their products, of values at instants and of
the instants at which signals pass levels.  Its derivative is a sum of derivatives of these; where
an instant moves, what changes is the signal before it passes: of a crossing ``-dy / y'``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, UsageError
from ...netlist.deck import Cond, Measure
from ...netlist.expressions.expression import Expression
from ..averages.recorded_integrals import RecordedIntegrals
from ..signals import signal_statistics as statistics
from ..signals.signal_names import canonical
from ..solution.solution import Solution
from ..solution.window_statistics import bounds, trace_of
from ..transient.measure import instant
from .polynomial import NotPolynomial, Polynomial


@dataclass(slots=True)
class Functional:
    """What a measure depends on, to first order.

    Parameters
    ----------
    integrals : list of (str, float, float, float)
        Signal, window [s], factor.
    values : list of (str, float, bool, float)
        Signal, instant [s], side, factor: -1 and 1 before and after an event with which it moves,
        0 at an instant that is fixed.
    products : list of (str, str, float, float, float)
        Two signals, window, factor of the integral of their product.
    waves : list of (str, float, float, float, float, float)
        Signal, window, angular frequency, phase at the time 0, factor of the integral of the signal
        times the cosine.
    numbers : dict
        Derivatives by numbers on cards, named as in :func:`variation.of_cards`.
    """

    integrals: list[tuple[str, float, float, float]] = field(default_factory=list)
    values: list[tuple[str, float, int, float]] = field(default_factory=list)
    products: list[tuple[str, str, float, float, float]] = field(default_factory=list)
    waves: list[tuple[str, float, float, float, float, float]] = field(default_factory=list)
    numbers: dict[tuple[str, ...], float] = field(default_factory=dict)

    def add(self, factor: float, other: Functional) -> Functional:
        """Add a multiple of another one, and return the sum."""
        for mine, theirs in (
            (self.integrals, other.integrals),
            (self.values, other.values),
            (self.products, other.products),
            (self.waves, other.waves),
        ):
            mine.extend((*item[:-1], factor * item[-1]) for item in theirs)
        for key, value in other.numbers.items():
            self.numbers[key] = self.numbers.get(key, 0.0) + factor * value
        return self

    def signals(self) -> list[str]:
        """Return the signals, each once."""
        names = [item[0] for part in (self.integrals, self.values, self.waves) for item in part]
        names += [name for item in self.products for name in item[:2]]
        return list(dict.fromkeys(names))


@dataclass(slots=True)
class _Instant:
    """An instant, and how it moves."""

    time: float
    moves: Functional


class Tie(NamedTuple):
    """A measure whose extreme is reached a second time, what it is to first order there, when."""

    measure: str
    functional: Functional
    times: tuple[float, float]


class Linearised:
    """The measures of a solution to first order."""

    def __init__(self, circuit: Circuit, solution: Solution) -> None:
        self.ties: list[Tie] = []
        self._circuit, self._solution = circuit, solution
        self._cards = {m.name: m for m in circuit.deck.measures}
        self._known: dict[str, Functional] = {}

    def __getitem__(self, name: str) -> Functional:
        """Return a measure to first order.

        Raises
        ------
        UsageError
            NS4041 if it has no derivative here.
        """
        if name not in self._known:
            self._known[name] = self._of(self._cards[name])
        return self._known[name]

    def _of(self, card: Measure) -> Functional:
        operation, expression = card.operation, card.expression
        if operation == "param":
            return self._param(card)
        if operation == "when":
            return self._crossing(card, "first").moves
        if operation == "trig_targ":
            return self._crossing(card, "second").moves.add(
                -1.0, self._crossing(card, "first").moves
            )
        if expression is None or any(
            name.startswith(("psw(", "tj(")) for name in expression.variables()
        ):
            raise _none(card, "losses of switchings and temperatures are not differentiated")
        if operation in ("find_at", "find_when"):
            at = self._crossing(card, "first") if card.at is None else self._at(card)
            return self._value(card, expression, at)
        low, high = self._window(card)
        if operation in ("max", "min"):
            found, ties = self._extreme(card, expression, low, high, operation == "min")
            self.ties += ties
            return found
        if operation == "pp":
            top, tops = self._extreme(card, expression, low, high, False)
            bottom, bottoms = self._extreme(card, expression, low, high, True)
            for tie in tops:
                tie.functional.add(-1.0, bottom)
            lower = [Functional().add(1.0, top).add(-1.0, tie.functional) for tie in bottoms]
            self.ties += tops
            self.ties += [Tie(t.measure, f, t.times) for t, f in zip(bottoms, lower, strict=True)]
            return top.add(-1.0, bottom)
        if operation in ("avg", "integ", "rms"):
            return self._integral(card, expression, low, high)
        if card.is_spectral:
            return self._spectral(card, expression, low, high)
        raise _none(card, f"{operation} is not differentiated")

    def _param(self, card: Measure) -> Functional:
        assert card.expression is not None
        found, known = Functional(), self._solution.measures
        for name in sorted(card.expression.variables()):
            slope = float(card.expression.derivative(name).evaluate(known))
            found.add(slope, self[name])
        return found

    def _at(self, card: Measure) -> _Instant:
        assert card.at is not None
        return _Instant(card.at, Functional(numbers={(card.name, "at"): 1.0}))

    def _window(self, card: Measure) -> tuple[_Instant, _Instant]:
        first, last = bounds(self._solution)
        low, high = (
            _Instant(first, Functional()),
            _Instant(last, Functional(numbers={("stop",): 1.0})),
        )
        if card.first is not None:
            low = self._crossing(card, "first")
        elif card.start is not None and card.start > first:
            low = _Instant(card.start, Functional(numbers={(card.name, "start"): 1.0}))
        if card.second is not None:
            high = self._crossing(card, "second")
        elif card.stop is not None and card.stop < last:
            high = _Instant(card.stop, Functional(numbers={(card.name, "stop"): 1.0}))
        return low, high

    def _crossing(self, card: Measure, side: str) -> _Instant:
        cond: Cond = getattr(card, side)
        if cond.at is not None:
            return _Instant(cond.at, Functional(numbers={(card.name, side, "at"): 1.0}))
        assert cond.signal is not None
        time = instant(self._solution, cond, card, self._measured)
        first, last = bounds(self._solution)
        rate = statistics.slope(
            trace_of(self._solution, cond.signal, self._measured, first, last, cond.other), time
        )
        if rate == 0.0:
            raise _none(card, f"at {time:.9g} s the signal touches the level without crossing it")
        found = Functional().add(-1.0 / rate, self._signal(card, cond.signal, time, 0))
        if cond.other is not None:
            found.add(1.0 / rate, self._signal(card, cond.other, time, 0))
        else:
            found.numbers[card.name, side, "value"] = 1.0 / rate
        return _Instant(time, found)

    @property
    def _measured(self) -> Mapping[str, float]:
        return self._solution.measures

    def _values(self, names: Sequence[str], time: float, side: int = 0) -> dict[str, float]:
        # what holds on both sides of an instant is recorded around it
        recording = self._solution.recording
        around = recording is not None and recording.start < time < recording.stop
        wide = bounds(self._solution) if side and not around else (time, time)

        def value(name: str) -> float:
            trace = trace_of(self._solution, Expression.parse(name), None, *wide)
            return statistics.value(trace, time, left=side < 0)

        found = {}
        for name in names:
            parts = self._factors(name)
            found[name] = sum(value(a) * (1.0 if b is None else value(b)) for a, b in parts)
        return found

    def _signal(self, card: Measure, expression: Expression, time: float, side: int) -> Functional:
        """Return the value of an expression at an instant that is fixed (0), or at an event.

        Before it for the side -1, after it for 1.
        """
        names = [n for n in sorted(expression.variables()) if n != "time"]
        constants = [n for n in names if n in self._measured]
        names = [n for n in names if n not in constants]
        known = {**self._values(names, time, side), **self._measured, "time": time}
        found = Functional()
        for name in names:
            slope = float(expression.derivative(name).evaluate(known))
            for one, other in self._factors(name):
                if other is None:
                    found.values.append((one, time, side, slope))
                    continue
                ends = self._values([one, other], time, side)
                found.values.append((one, time, side, slope * ends[other]))
                found.values.append((other, time, side, slope * ends[one]))
        for name in constants:
            found.add(float(expression.derivative(name).evaluate(known)), self[name])
        return found

    def _factors(self, name: str) -> list[tuple[str, str | None]]:
        """Return what a signal is the sum of: itself, or of a power products of two."""
        if not name.startswith("p("):
            return [(canonical(name), None)]
        powers = self._circuit.device(name[2:-1]).powers
        voltage = [f"v({a},{b})" if b != "0" else f"v({a})" for _, a, b in powers]
        return [(v, f"i({current})") for v, (current, _, _) in zip(voltage, powers, strict=True)]

    def _value(self, card: Measure, expression: Expression, at: _Instant) -> Functional:
        found = self._signal(card, expression, at.time, 0)
        if at.moves.values or at.moves.numbers:
            found.add(self._rate(expression, at.time), at.moves)
        return found

    def _rate(self, expression: Expression, time: float) -> float:
        first, last = bounds(self._solution)
        return statistics.slope(
            trace_of(self._solution, expression, self._measured, first, last), time
        )

    def _extreme(
        self, card: Measure, expression: Expression, low: _Instant, high: _Instant, least: bool
    ) -> tuple[Functional, list[Tie]]:
        trace = trace_of(self._solution, expression, self._measured, low.time, high.time)
        top, time = statistics.extreme(trace, low.time, high.time, least=least)
        found = self._reached(card, expression, low, high, time, least)
        # whether it is reached once more, apart from the place where it has been found; at an end
        # that was cut off it is the same extreme, a flat one
        beside = 1e-3 * (high.time - low.time)
        others = [(statistics.value(trace, end.time), end.time) for end in (low, high)]
        for start, stop in ((low.time, time - beside), (time + beside, high.time)):
            if start < stop:
                value, at = statistics.extreme(trace, start, stop, least=least)
                others += [(value, at)] if at not in (start, stop) else []
        ties = [
            Tie(card.name, self._reached(card, expression, low, high, at, least), (time, at))
            for value, at in others
            if at != time and abs(value - top) <= 1e-9 * max(abs(top), abs(value))
        ]
        return found, ties

    def _reached(
        self,
        card: Measure,
        expression: Expression,
        low: _Instant,
        high: _Instant,
        time: float,
        least: bool,
    ) -> Functional:
        for end in (low, high):
            if time == end.time:
                return self._value(card, expression, end)
        trace = trace_of(self._solution, expression, self._measured, low.time, high.time)
        before, after = (statistics.value(trace, time, left=left) for left in (True, False))
        later = after < before if least else after > before
        return self._signal(card, expression, time, 1 if later else -1)

    def _integral(
        self, card: Measure, expression: Expression, low: _Instant, high: _Instant
    ) -> Functional:
        try:
            integrand = Polynomial.of(expression, self._measured)
            if card.operation == "rms":
                integrand = integrand.squared()
            found = self._whole(integrand, low.time, high.time)
        except NotPolynomial as why:
            raise _none(card, str(why)) from None
        length, value = high.time - low.time, self._measured[card.name]
        for end, sign in ((low, -1.0), (high, 1.0)):
            if end.moves.values or end.moves.numbers:
                known = self._values(sorted(expression.variables() - set(self._measured)), end.time)
                y = float(expression.evaluate({**known, **self._measured}))
                mean = {"avg": value, "rms": value * value, "integ": 0.0}[card.operation]
                y = y * y if card.operation == "rms" else y
                found.add(sign * (y - mean), end.moves)
        if card.operation == "integ":
            return found
        share = 1.0 / length if card.operation == "avg" else 0.5 / (length * value)
        return Functional().add(share, found)

    def _whole(self, integrand: Polynomial, low: float, high: float) -> Functional:
        """Return the integral of a polynomial of signals."""
        found = Functional()
        for name, factor in integrand.linear.items():
            for one, other in self._factors(name):
                if other is None:
                    found.integrals.append((one, low, high, factor))
                else:
                    found.products.append((one, other, low, high, factor))
        for (one, other), factor in integrand.quadratic.items():
            if one.startswith("p(") or other.startswith("p("):
                raise NotPolynomial("squares of powers are not differentiated")
            found.products.append((canonical(one), canonical(other), low, high, factor))
        return found

    def _spectral(
        self, card: Measure, expression: Expression, low: _Instant, high: _Instant
    ) -> Functional:
        integrals = self._solution.integrals or RecordedIntegrals.of(self._solution)
        if integrals is None:
            raise _none(card, "it cannot be integrated")
        window, name = (low.time, high.time), canonical(expression.text)
        over = integrals.over(window)
        order = 1 if card.operation == "thd" else int(card.operation[4:])
        mean, first = over.coefficients([name], [0, order])[name]
        length = window[1] - window[0]
        turn = 2.0 * math.pi * order / length
        phase = float(np.angle(first)) - turn * window[0]
        amplitude = Functional(waves=[(name, *window, turn, phase, 1.0 / length)])
        for end in (low, high):  # the waves themselves move with the window
            amplitude.numbers.update(dict.fromkeys(end.moves.numbers, math.nan))
        if card.operation != "thd":
            return Functional().add(2.0 if order else 1.0, amplitude)
        own, value = 2.0 * abs(first) ** 2, self._measured[card.name]
        found = Functional(products=[(name, name, *window, 1.0 / length)])
        found.integrals.append((name, *window, -2.0 * float(mean.real) / length))
        found = Functional().add(0.5 / (value * own), found)
        share = -(value * value + 1.0) / (2.0 * value * own) * 4.0 * abs(first)
        return found.add(share, amplitude)


def _none(card: Measure, why: str) -> UsageError:
    hint = "differentiate another measure, or use the difference of two runs"
    return UsageError(
        Diagnostic("NS4041", f"{card.name} has no derivative: {why}", card.span, hint)
    )
