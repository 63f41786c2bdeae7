"""Interval arithmetic: enclosures of the instructions of a tape and of their derivatives.

Intervals are formed element by element in ordinary arithmetic (R. E. Moore, *Interval Analysis*,
1966): they are right to the rounding of their ends.  At a kink the derivatives of both sides are
enclosed.  What has no value at some argument, or has a pole there, is unbounded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .csc import Floats

INF = math.inf
_MOST = float(np.finfo(np.float64).max)
_Function = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True)
class Enclosure:
    """Intervals ``[low, high]``, element by element.

    Examples
    --------
    >>> x = Enclosure(np.array([-1.0]), np.array([2.0]))
    >>> y = x * x
    >>> y.low.tolist(), x.square().low.tolist()
    ([-2.0], [0.0])
    """

    low: Floats
    high: Floats

    @classmethod
    def of(cls, low: npt.ArrayLike, high: npt.ArrayLike | None = None) -> Enclosure:
        """Return intervals between given ends, or around single values."""
        least = np.asarray(low, dtype=np.float64)
        return cls(least, least if high is None else np.asarray(high, dtype=np.float64))

    @classmethod
    def hull(cls, *ends: Floats) -> Enclosure:
        """Return the least interval around some values; what is not a number is anything."""
        low, high = np.minimum.reduce(ends), np.maximum.reduce(ends)
        unknown = np.isnan(low) | np.isnan(high)
        # what has overflowed is larger than any number, but not infinite
        low, high = np.minimum(low, _MOST), np.maximum(high, -_MOST)
        return cls(np.where(unknown, -INF, low), np.where(unknown, INF, high))

    def __add__(self, other: Enclosure) -> Enclosure:
        return Enclosure.hull(self.low + other.low, self.high + other.high)

    def __neg__(self) -> Enclosure:
        return Enclosure(-self.high, -self.low)

    def __sub__(self, other: Enclosure) -> Enclosure:
        return self + -other

    def __mul__(self, other: Enclosure | float) -> Enclosure:
        if isinstance(other, float):
            return self * Enclosure.of(other)
        ends = [
            # zero times anything is zero: the bounds are limits, not values
            np.where((a == 0.0) | (b == 0.0), 0.0, a * b)
            for a in (self.low, self.high)
            for b in (other.low, other.high)
        ]
        return Enclosure.hull(*ends)

    def inverse(self) -> Enclosure:
        """Return 1/x; anything where x may be zero."""
        zero = (self.low <= 0.0) & (self.high >= 0.0)
        return Enclosure(
            np.where(zero, -INF, 1.0 / np.where(zero, 1.0, self.high)),
            np.where(zero, INF, 1.0 / np.where(zero, 1.0, self.low)),
        )

    def square(self) -> Enclosure:
        """Return x^2."""
        return self.size().rising(np.square)

    def size(self) -> Enclosure:
        """Return |x|."""
        inside = (self.low <= 0.0) & (self.high >= 0.0)
        a, b = np.abs(self.low), np.abs(self.high)
        return Enclosure(np.where(inside, 0.0, np.minimum(a, b)), np.maximum(a, b))

    def rising(self, function: _Function) -> Enclosure:
        """Return a function that only rises, or only falls."""
        return Enclosure.hull(function(self.low), function(self.high))

    def power(self, exponent: float) -> Enclosure:
        """Return x to a constant power; without a value for x < 0 if the exponent is not whole."""
        if exponent == 0.0:
            return Enclosure.of(np.ones_like(self.low))
        if not float(exponent).is_integer():
            return self.rising(lambda x: np.where(x < 0.0, np.nan, np.abs(x) ** exponent))
        if exponent < 0.0:
            return self.power(-exponent).inverse()
        return (self if exponent % 2.0 else self.size()).rising(lambda x: x**exponent)

    def wave(self, shift: float) -> Enclosure:
        """Return ``sin(x + shift)``."""
        turn, quarter = 2.0 * math.pi, 0.5 * math.pi
        low, high = self.low + shift, self.high + shift
        # the first maximum and the first minimum from the lower end on
        top = np.ceil((low - quarter) / turn) * turn + quarter
        bottom = np.ceil((low + quarter) / turn) * turn - quarter
        ends = Enclosure.hull(np.sin(low), np.sin(high))
        whole = ~(self.high - self.low < turn)
        return Enclosure(
            np.where(whole | (bottom <= high), -1.0, ends.low),
            np.where(whole | (top <= high), 1.0, ends.high),
        )

    def where(self, condition: npt.NDArray[np.bool_], other: Enclosure) -> Enclosure:
        """Return self where a condition holds, else the other."""
        return Enclosure(
            np.where(condition, self.low, other.low), np.where(condition, self.high, other.high)
        )


def _positive(function: _Function) -> _Function:
    """Return a function that has no value below zero."""
    return lambda x: function(np.where(x < 0.0, np.nan, x))


def _inverse_of(function: _Function) -> Callable[[Enclosure], Enclosure]:
    """Return ``1/f`` of an even function that grows with the size of its argument."""
    return lambda x: x.size().rising(lambda size: 1.0 / function(size))


def _steps(*levels: float) -> Callable[[Enclosure], Enclosure]:
    """Return the slope of a line that begins at the first level and ends at the second one."""

    def slope(x: Enclosure) -> Enclosure:
        above, below = x.low > levels[0], x.high < levels[0]
        if len(levels) > 1:
            above, below = above & (x.high < levels[1]), below | (x.low > levels[1])
        return Enclosure(np.where(above, 1.0, 0.0), np.where(below, 0.0, 1.0))

    return slope


_LN10 = math.log(10.0)
#: functions of one argument: value and derivative
_ONE: dict[str, tuple[Callable[[Enclosure], Enclosure], Callable[[Enclosure], Enclosure]]] = {
    "neg": (lambda x: -x, lambda x: Enclosure.of(np.full_like(x.low, -1.0))),
    "inv": (lambda x: x.inverse(), lambda x: -x.square().inverse()),
    "square": (lambda x: x.square(), lambda x: x + x),
    "abs": (
        lambda x: x.size(),
        lambda x: Enclosure(np.where(x.low > 0.0, 1.0, -1.0), np.where(x.high < 0.0, -1.0, 1.0)),
    ),
    "uramp": (lambda x: x.rising(lambda a: np.maximum(a, 0.0)), _steps(0.0)),
    "u2": (lambda x: x.rising(lambda a: np.clip(a, 0.0, 1.0)), _steps(0.0, 1.0)),
    "sqrt": (lambda x: x.rising(np.sqrt), lambda x: x.rising(lambda a: 0.5 / np.sqrt(a))),
    "exp": (lambda x: x.rising(np.exp), lambda x: x.rising(np.exp)),
    "expm1": (lambda x: x.rising(np.expm1), lambda x: x.rising(np.exp)),
    "ln": (lambda x: x.rising(np.log), lambda x: x.rising(_positive(np.reciprocal))),
    "log10": (
        lambda x: x.rising(np.log10),
        lambda x: x.rising(_positive(lambda a: 1.0 / (a * _LN10))),
    ),
    "log1p": (
        lambda x: x.rising(np.log1p),
        lambda x: (x + Enclosure.of(1.0)).rising(_positive(np.reciprocal)),
    ),
    "sin": (lambda x: x.wave(0.0), lambda x: x.wave(0.5 * math.pi)),
    "cos": (lambda x: x.wave(0.5 * math.pi), lambda x: -x.wave(0.0)),
    "atan": (lambda x: x.rising(np.arctan), _inverse_of(lambda a: 1.0 + a * a)),
    "asinh": (lambda x: x.rising(np.arcsinh), _inverse_of(lambda a: np.hypot(1.0, a))),
    "tanh": (lambda x: x.rising(np.tanh), _inverse_of(lambda a: np.cosh(a) ** 2)),
    "sinh": (lambda x: x.rising(np.sinh), lambda x: x.size().rising(np.cosh)),
    "cosh": (lambda x: x.size().rising(np.cosh), lambda x: x.rising(np.sinh)),
}

_Enclosed = tuple[Enclosure, list[Enclosure]]


def enclosed(name: str, inner: Sequence[Enclosure], constants: Floats) -> _Enclosed | None:
    """Return the value of an instruction, and its partial derivatives, None where none are known.

    Parameters
    ----------
    name : str
        Of the instruction.
    inner : sequence of Enclosure
        Its arguments.
    constants : ndarray
        Those that it carries, others behind them.
    """
    if name in _ONE:
        value, slope = _ONE[name]
        return value(inner[0]), [slope(inner[0])]
    if name == "junction":
        size, width = float(constants[0]), float(constants[1])
        scaled = inner[0] * (1.0 / width)
        return scaled.rising(np.expm1) * size, [scaled.rising(np.exp) * (size / width)]
    if name in ("body", "softplus"):
        still = np.zeros_like(inner[0].low)
        slope_ends = (-0.5 / math.sqrt(float(constants[0])), 0.0) if name == "body" else (0.0, 1.0)
        slope_of = Enclosure(still + slope_ends[0], still + slope_ends[1])
        return Enclosure(still, still + INF), [slope_of]
    if name == "table":
        return _table(inner[0], constants)
    return _two(name, *inner) if len(inner) == 2 else None


def _two(name: str, a: Enclosure, b: Enclosure) -> _Enclosed | None:
    one = Enclosure.of(np.ones_like(a.low))
    if name == "add":
        return a + b, [one, one]
    if name == "sub":
        return a - b, [one, -one]
    if name == "mul":
        return a * b, [b, a]
    if name == "div":
        inverse = b.inverse()
        ratio = a * inverse
        return ratio, [inverse, -(ratio * inverse)]
    if name in ("pow", "pwr") and np.all(b.low == b.high) and np.ptp(b.low) == 0.0:
        exponent, still = float(b.low.flat[0]), Enclosure.of(np.zeros_like(a.low))
        if name == "pow":
            return a.power(exponent), [a.power(exponent - 1.0) * exponent, still]
        if exponent == 0.0:
            return None  # the sign, which jumps
        # sign(x) |x|^k, which has a pole at zero if k < 0
        pole = (exponent < 0.0) & (a.low <= 0.0) & (a.high >= 0.0)
        none = Enclosure.of(np.where(pole, np.nan, a.low), np.where(pole, np.nan, a.high))
        value = none.rising(lambda x: np.sign(x) * np.abs(x) ** exponent)
        return value, [none.size().power(exponent - 1.0) * exponent, still]
    if name in ("min", "max"):
        pick = np.minimum if name == "min" else np.maximum
        # how much of the slope is that of the first argument
        less, more = (a, b) if name == "min" else (b, a)
        share = Enclosure(
            np.where(less.high < more.low, 1.0, 0.0), np.where(less.low > more.high, 0.0, 1.0)
        )
        return Enclosure(pick(a.low, b.low), pick(a.high, b.high)), [share, one - share]
    if name == "hypot":
        x, y = a.size(), b.size()
        return Enclosure(np.hypot(x.low, y.low), np.hypot(x.high, y.high)), [
            Enclosure(np.where(v.low >= 0.0, 0.0, -1.0), np.where(v.high <= 0.0, 0.0, 1.0))
            for v in (a, b)
        ]
    return None


def _table(x: Enclosure, constants: Floats) -> _Enclosed | None:
    """Enclose a broken line that is level outside of its points."""
    count = int(constants[0])
    points = constants[1 : 1 + 2 * count].reshape(-1, 2)
    run, rise = np.diff(points[:, 0]), np.diff(points[:, 1])
    if np.any(run <= 0.0):
        return None
    level = (x.low <= points[0, 0]) | (x.high >= points[-1, 0])
    low, high = np.where(level, 0.0, INF), np.where(level, 0.0, -INF)
    for k, slope in enumerate(rise / run):
        touched = (points[k + 1, 0] >= x.low) & (points[k, 0] <= x.high)
        low = np.where(touched, np.minimum(low, slope), low)
        high = np.where(touched, np.maximum(high, slope), high)
    y = points[:, 1]
    return Enclosure(np.full_like(low, y.min()), np.full_like(low, y.max())), [Enclosure(low, high)]


__all__ = ["INF", "Enclosure", "enclosed"]
