"""Bounds of the values and derivatives of a tape over a box: interval arithmetic.

Every register is enclosed by an interval for its value and one for each of its derivatives, by the
chain rule in interval arithmetic (A. Neumaier, *Interval Methods for Systems of Equations*, 1990,
ch. 1).  A box may be unbounded.  At a kink the derivatives of both sides are enclosed, so that the
result contains Clarke's generalised Jacobian; where a function jumps or has a pole, derivatives are
unbounded, for any values on both sides.
Bounds are formed in ordinary arithmetic: they are right to the rounding of their terms, to which
the verdicts on matrices are right, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ..dataclass import dataclass
from .csc import Floats
from .domain import gap
from .tape import OPS, WITH_CONSTANTS, Tape

INF = math.inf
Interval = tuple[float, float]
ALL: Interval = (-INF, INF)
_NAMES = list(OPS)


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """Enclosures over a box.

    Parameters
    ----------
    values : ndarray, shape (p, 2)
        Of the functions, lower and upper.
    low, high : ndarray, shape (p, n + 1)
        Of the derivatives by the unknowns and, last, by the time.
    gaps : tuple of str, length p
        Why a function need not be continuous on the box; empty where it is.
    """

    values: Floats
    low: Floats
    high: Floats
    gaps: tuple[str, ...] = ()


def bounds(tape: Tape, box: Sequence[Interval], time: Interval = (0.0, INF)) -> Bounds:
    """Return bounds of the functions of a tape and of their derivatives.

    Parameters
    ----------
    tape : Tape
        Without sources.
    box : sequence of (float, float)
        Of each unknown.
    time : (float, float)

    Examples
    --------
    >>> from nsspice.problems import TapeBuilder
    >>> builder = TapeBuilder()
    >>> x = builder.unknown(0)
    >>> _ = builder.output(builder.op("add", x, builder.op("atan", x)))
    >>> found = bounds(builder.finish(), [(-math.inf, math.inf)])
    >>> float(found.low[0, 0]), float(found.high[0, 0])
    (1.0, 2.0)
    """
    n = len(box)
    values: list[Interval] = []
    partials: list[list[tuple[int, Interval]]] = []  # of each register: argument, derivative
    inputs: dict[int, int] = {}  # registers that are unknowns, or the time (n)
    gaps: list[str] = []
    for k, (code, args) in enumerate(zip(tape.ops.tolist(), tape.args.tolist(), strict=True)):
        name = _NAMES[code]
        slopes: list[tuple[int, Interval]] = []
        gaps.append("")
        if name == "constant":
            c = float(tape.constants[args[0]])
            value: Interval = (c, c)
        elif name == "unknown":
            value = box[args[0]]
            inputs[k] = args[0]
        elif name == "time":
            value = time
            inputs[k] = n
        elif name == "source":
            value = ALL
        else:
            used = args[: OPS[name]]
            constants = tape.constants[args[1] :] if name in _CARRYING else tape.constants[:0]
            inner = [values[a] for a in used]
            value, found = _apply(name, inner, constants)
            below = next((gaps[a] for a in used if gaps[a]), "")
            gaps[-1] = below or gap(name, inner, constants)
            slopes = list(zip(used, found, strict=True))
        values.append(value)
        partials.append(slopes)
    out = tape.outputs.tolist()
    forward = _forward(partials, inputs, n)
    low, high = np.zeros((len(out), n + 1)), np.zeros((len(out), n + 1))
    for row, register in enumerate(out):
        if gaps[register]:
            low[row], high[row] = -INF, INF
            continue
        backward = _backward(partials, inputs, register, n)
        for column in range(n + 1):
            # both enclose: which is narrower depends on where terms cancel
            a, b = forward[register][column], backward[column]
            low[row, column], high[row, column] = max(a[0], b[0]), min(a[1], b[1])
    found_values = [ALL if gaps[r] else values[r] for r in out]
    return Bounds(np.array(found_values).reshape(-1, 2), low, high, tuple(gaps[r] for r in out))


def _forward(
    partials: Sequence[Sequence[tuple[int, Interval]]], inputs: dict[int, int], n: int
) -> list[list[Interval]]:
    """Return the derivatives of every register, by the chain rule from the unknowns on."""
    found: list[list[Interval]] = []
    for k, slopes in enumerate(partials):
        row: list[Interval] = [(0.0, 0.0)] * (n + 1)
        if k in inputs:
            row[inputs[k]] = (1.0, 1.0)
        for argument, slope in slopes:
            row = [
                add(total, times(slope, inner))
                for total, inner in zip(row, found[argument], strict=True)
            ]
        found.append(row)
    return found


def _backward(
    partials: Sequence[Sequence[tuple[int, Interval]]],
    inputs: dict[int, int],
    register: int,
    n: int,
) -> list[Interval]:
    """Return the derivatives of one register, by the chain rule from the result back."""
    adjoints: list[Interval] = [(0.0, 0.0)] * (register + 1)
    adjoints[register] = (1.0, 1.0)
    row: list[Interval] = [(0.0, 0.0)] * (n + 1)
    for k in range(register, -1, -1):
        weight = adjoints[k]
        if weight == (0.0, 0.0):
            continue
        if k in inputs:
            row[inputs[k]] = add(row[inputs[k]], weight)
        for argument, slope in partials[k]:
            adjoints[argument] = add(adjoints[argument], times(weight, slope))
    return row


_CARRYING = WITH_CONSTANTS


def add(a: Interval, b: Interval) -> Interval:
    """Return the sum; nothing is claimed where opposite infinities meet."""
    low, high = a[0] + b[0], a[1] + b[1]
    return (low if low == low else -INF), (high if high == high else INF)


def times(a: Interval, b: Interval) -> Interval:
    """Return the product; zero times infinity is zero, as a bound that is never reached."""
    if a == (0.0, 0.0) or b == (0.0, 0.0):
        return 0.0, 0.0
    ends = [_product(x, y) for x in a for y in b]
    return min(ends), max(ends)


def _product(x: float, y: float) -> float:
    return 0.0 if x == 0.0 or y == 0.0 else x * y


def _inverse(a: Interval) -> Interval:
    if a[0] < 0.0 < a[1] or a == (0.0, 0.0):
        return ALL
    low = INF if a[1] == 0.0 else 1.0 / a[1]
    high = INF if a[0] == 0.0 else 1.0 / a[0]
    if a[1] == 0.0:
        low, high = -INF, 1.0 / a[0]
        return low, high
    return low, high


def _safe(f: Callable[[float], float], x: float, otherwise: float) -> float:
    try:
        return f(x)
    except (OverflowError, ValueError, ZeroDivisionError):
        return otherwise


def _rising(f: Callable[[float], float], a: Interval) -> Interval:
    return _safe(f, a[0], -INF), _safe(f, a[1], INF)


def _sizes(a: Interval) -> Interval:
    """Return the smallest and the largest absolute value."""
    least = 0.0 if a[0] <= 0.0 <= a[1] else min(abs(a[0]), abs(a[1]))
    return least, max(abs(a[0]), abs(a[1]))


def _hill(f: Callable[[float], float], a: Interval) -> Interval:
    """Return the range of an even function that falls with the size of its argument to zero."""
    least, most = _sizes(a)
    return (0.0 if math.isinf(most) else _safe(f, most, 0.0)), _safe(f, least, INF)


def _wave(a: Interval, shift: float) -> Interval:
    """Return the range of ``sin(x + shift)``."""
    if not a[1] - a[0] < 2.0 * math.pi:
        return -1.0, 1.0
    low, high = a[0] + shift, a[1] + shift
    ends = (math.sin(low), math.sin(high))
    top = math.ceil((low - 0.5 * math.pi) / (2.0 * math.pi)) * 2.0 * math.pi + 0.5 * math.pi
    bottom = math.ceil((low + 0.5 * math.pi) / (2.0 * math.pi)) * 2.0 * math.pi - 0.5 * math.pi
    return (-1.0 if bottom <= high else min(ends)), (1.0 if top <= high else max(ends))


def _square(a: Interval) -> Interval:
    least, most = _sizes(a)
    return least * least, most * most


def _exp(x: float) -> float:
    return 0.0 if x == -INF else math.exp(x)


def _one(name: str, a: Interval) -> tuple[Interval, Interval]:
    """Return value and derivative of a function of one argument."""
    if name == "neg":
        return (-a[1], -a[0]), (-1.0, -1.0)
    if name == "inv":
        value = _inverse(a)
        inner = _square(value)
        return value, (-inner[1], -inner[0])
    if name == "square":
        return _square(a), (2.0 * a[0], 2.0 * a[1])
    if name == "abs":
        sign = (1.0 if a[0] > 0.0 else -1.0), (-1.0 if a[1] < 0.0 else 1.0)
        return _sizes(a), sign
    if name == "uramp":
        slope = (1.0 if a[0] > 0.0 else 0.0), (0.0 if a[1] < 0.0 else 1.0)
        return (max(a[0], 0.0), max(a[1], 0.0)), slope
    if name == "u2":
        inside = (
            (0.0 if a[0] <= 0.0 or a[1] >= 1.0 else 1.0),
            (0.0 if a[1] < 0.0 or a[0] > 1.0 else 1.0),
        )
        return (min(max(a[0], 0.0), 1.0), min(max(a[1], 0.0), 1.0)), inside
    if name in ("exp", "expm1"):
        value = _rising(_exp, a)
        shift = 1.0 if name == "expm1" else 0.0
        return (value[0] - shift, value[1] - shift), value
    if name in ("ln", "log10", "log1p"):
        b = a if name != "log1p" else (a[0] + 1.0, a[1] + 1.0)
        unit = math.log(10.0) if name == "log10" else 1.0
        if b[0] < 0.0:
            return ALL, ALL
        value = (_safe(math.log, b[0], -INF) / unit, _safe(math.log, b[1], INF) / unit)
        return value, times(_inverse(b), (1.0 / unit, 1.0 / unit))
    if name == "sqrt":
        if a[0] < 0.0:
            return ALL, ALL
        value = math.sqrt(a[0]), math.sqrt(a[1])
        return value, times(_inverse(value), (0.5, 0.5))
    if name == "sin":
        return _wave(a, 0.0), _wave(a, 0.5 * math.pi)
    if name == "cos":
        falling = _wave(a, 0.0)
        return _wave(a, 0.5 * math.pi), (-falling[1], -falling[0])
    if name == "atan":
        return _rising(math.atan, a), _hill(lambda x: 1.0 / (1.0 + x * x), a)
    if name == "asinh":
        return _rising(math.asinh, a), _hill(lambda x: 1.0 / math.hypot(1.0, x), a)
    if name == "tanh":
        return _rising(math.tanh, a), _hill(lambda x: 1.0 / math.cosh(x) ** 2, a)
    if name == "sinh":
        least, most = _sizes(a)
        steep = _safe(math.cosh, least, INF), _safe(math.cosh, most, INF)
        return _rising(math.sinh, a), steep
    if name == "cosh":
        least, most = _sizes(a)
        value = _safe(math.cosh, least, INF), _safe(math.cosh, most, INF)
        return value, _rising(math.sinh, a)
    return ALL, ALL  # jumps, poles and rarely used functions: nothing is claimed


def _apply(
    name: str, inner: Sequence[Interval], constants: Floats
) -> tuple[Interval, list[Interval]]:
    """Return the value of an instruction, and its partial derivatives."""
    if name == "body":
        steepest = -0.5 / math.sqrt(float(constants[0]))
        return (0.0, INF), [(steepest, 0.0)]
    if name == "softplus":
        return (0.0, INF), [(0.0, 1.0)]
    if name in ("junction", "table") and len(inner) == 1:
        return _curve(name, inner[0], constants)
    if len(inner) == 1:
        value, slope = _one(name, inner[0])
        return value, [slope]
    if len(inner) == 2:
        a, b = inner
        one: Interval = (1.0, 1.0)
        if name == "add":
            return add(a, b), [one, one]
        if name == "sub":
            return add(a, (-b[1], -b[0])), [one, (-1.0, -1.0)]
        if name == "mul":
            return times(a, b), [b, a]
        if name == "div":
            inverse = _inverse(b)
            ratio = times(a, inverse)
            slope = times(ratio, inverse)
            return ratio, [inverse, (-slope[1], -slope[0])]
        if name == "pow" and b[0] == b[1]:
            value, slope = _power(a, b[0])
            return value, [slope, (0.0, 0.0)]
        if name in ("min", "max"):
            pick = min if name == "min" else max
            first = (a[1] < b[0], a[0] > b[1]) if name == "min" else (a[0] > b[1], a[1] < b[0])
            share: Interval = (1.0 if first[0] else 0.0, 0.0 if first[1] else 1.0)
            rest: Interval = (1.0 - share[1], 1.0 - share[0])
            return (pick(a[0], b[0]), pick(a[1], b[1])), [share, rest]
        if name == "hypot":
            least, most = zip(_sizes(a), _sizes(b), strict=True)
            value = (math.hypot(*least), math.hypot(*most))
            return value, [_direction(a), _direction(b)]
    return ALL, [ALL] * len(inner)


def _direction(a: Interval) -> Interval:
    return (0.0 if a[0] >= 0.0 else -1.0), (0.0 if a[1] <= 0.0 else 1.0)


def _power(a: Interval, exponent: float) -> tuple[Interval, Interval]:
    """Return value and derivative of ``x^k`` for a constant k."""

    def ends(k: float) -> Interval:
        if k == 0.0:
            return 1.0, 1.0
        if k == int(k) and k > 0.0:
            if int(k) % 2:
                return _rising(lambda x: x ** int(k), a)
            least, most = _sizes(a)
            return _safe(lambda x: x ** int(k), least, INF), _safe(lambda x: x ** int(k), most, INF)
        if a[0] < 0.0:
            return ALL
        if k > 0.0:
            return _safe(lambda x: x**k, a[0], 0.0), _safe(lambda x: x**k, a[1], INF)
        low = 0.0 if math.isinf(a[1]) else _safe(lambda x: x**k, a[1], 0.0)
        return low, (INF if a[0] == 0.0 else a[0] ** k)

    return ends(exponent), times((exponent, exponent), ends(exponent - 1.0))


def _curve(name: str, a: Interval, constants: Floats) -> tuple[Interval, list[Interval]]:
    if name == "junction":
        size, width = float(constants[0]), float(constants[1])
        grown = _rising(_exp, (a[0] / width, a[1] / width))
        value = times((size, size), (grown[0] - 1.0, grown[1] - 1.0))
        return value, [times((size / width, size / width), grown)]
    count = int(constants[0])
    points = constants[1 : 1 + 2 * count].reshape(-1, 2)
    run, rise = np.diff(points[:, 0]), np.diff(points[:, 1])
    if np.any(run <= 0.0):
        return ALL, [ALL]
    touched = (points[1:, 0] >= a[0]) & (points[:-1, 0] <= a[1])
    slopes = list((rise / run)[touched])
    if a[0] <= points[0, 0] or a[1] >= points[-1, 0]:
        slopes.append(0.0)
    y = points[:, 1]
    return (float(y.min()), float(y.max())), [(float(min(slopes)), float(max(slopes)))]


__all__ = ["ALL", "INF", "Bounds", "Interval", "add", "bounds", "times"]
