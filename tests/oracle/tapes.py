"""A plain interpreter of tapes: values and gradients by forward accumulation, one float at a time.

Written from the meaning of the instructions, not from the core; references: Griewank and Walther,
*Evaluating Derivatives*, SIAM 2008, ch. 3; for ``depletion`` Antognetti and Massobrio,
*Semiconductor Device Modeling with SPICE*, 2nd ed., McGraw-Hill 1993, eq. (1-13).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from nsspice.problems.tape import OPS, Tape

NAMES = list(OPS)
INF = math.inf


def _safe(function: Callable[..., float], *args: float) -> float:
    try:
        return function(*args)
    except ValueError:
        return math.nan
    except OverflowError:
        return INF


def _exp(x: float) -> float:
    return math.exp(x) if x < 709.78 else (INF if x == x else math.nan)


def _div(a: float, b: float) -> float:
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def _pow(a: float, b: float) -> float:
    try:
        return math.pow(a, b)
    except OverflowError:
        return -INF if a < 0 and b % 2 == 1 else INF
    except ValueError:
        return INF if a == 0 else math.nan


def _ln(x: float) -> float:
    return math.log(x) if x > 0 else (-INF if x == 0 else math.nan)


def _sgn(x: float) -> float:
    return float(np.sign(x))


def _sinh(x: float) -> float:
    try:
        return math.sinh(x)
    except OverflowError:
        return math.copysign(INF, x)


def _depletion(v: float, c0: float, vj: float, m: float, fc: float) -> tuple[float, float]:
    """Charge and capacitance; above ``fc vj`` the capacitance goes on linearly."""

    def below(x: float) -> float:
        if m == 1.0:
            return -c0 * vj * math.log(1 - x / vj)
        return c0 * vj / (1 - m) * (1 - (1 - x / vj) ** (1 - m))

    edge = fc * vj
    if v < edge:
        return below(v), c0 * (1 - v / vj) ** -m
    c1 = c0 * (1 - fc) ** -m
    slope = c1 * m / (vj * (1 - fc))
    over = v - edge
    return below(edge) + c1 * over + slope * over * over / 2, c1 + slope * over


def _table(x: float, constants: Sequence[float]) -> tuple[float, float]:
    points = constants[1 : 1 + 2 * int(constants[0])]
    xs, ys = points[::2], points[1::2]
    value = ys[0] if x <= xs[0] else ys[-1]
    for k in range(1, len(xs)):
        if xs[k - 1] < x <= xs[k]:
            slope = (ys[k] - ys[k - 1]) / (xs[k] - xs[k - 1])
            value = ys[k - 1] + (x - xs[k - 1]) * slope
            break
    for k in range(len(xs) - 1):
        if xs[k] <= x < xs[k + 1]:
            return value, (ys[k + 1] - ys[k]) / (xs[k + 1] - xs[k])
    return value, 0.0


def _one(name: str, x: float, c: Sequence[float]) -> tuple[float, float]:
    """Return value and derivative of a function of one register."""
    e = math.exp
    if name == "junction":
        level = x / c[1]
        if level > 700:
            return INF, INF
        return c[0] * math.expm1(level), c[0] / c[1] * e(level)
    if name == "depletion":
        return _depletion(x, *c[:4])
    if name == "table":
        return _table(x, c)
    values: dict[str, Callable[[], tuple[float, float]]] = {
        "neg": lambda: (-x, -1.0),
        "inv": lambda: (_div(1.0, x), _div(-1.0, x * x)),
        "not": lambda: (float(x == 0.0), 0.0),
        "abs": lambda: (abs(x), 1.0 if x >= 0 else -1.0),
        "sqrt": lambda: (_safe(math.sqrt, x), _div(0.5, _safe(math.sqrt, x))),
        "exp": lambda: (_exp(x), _exp(x)),
        "expm1": lambda: (_safe(math.expm1, x), _exp(x)),
        "ln": lambda: (_ln(x), _div(1.0, x)),
        "log1p": lambda: (_safe(math.log1p, x), _div(1.0, 1.0 + x)),
        "log10": lambda: (
            math.log10(x) if x > 0 else _ln(x),
            _div(1.0, x * math.log(10)),
        ),
        "sin": lambda: (_safe(math.sin, x), _safe(math.cos, x)),
        "cos": lambda: (_safe(math.cos, x), -_safe(math.sin, x)),
        "tan": lambda: (_safe(math.tan, x), 1.0 + _safe(math.tan, x) ** 2),
        "asin": lambda: (_safe(math.asin, x), _div(1.0, _safe(math.sqrt, 1 - x * x))),
        "acos": lambda: (_safe(math.acos, x), -_div(1.0, _safe(math.sqrt, 1 - x * x))),
        "atan": lambda: (math.atan(x), 1.0 / (1.0 + x * x)),
        "sinh": lambda: (_sinh(x), _safe(math.cosh, x)),
        "cosh": lambda: (_safe(math.cosh, x), _sinh(x)),
        "tanh": lambda: (math.tanh(x), 1.0 - math.tanh(x) ** 2),
        "asinh": lambda: (math.asinh(x), 1.0 / math.hypot(1.0, x)),
        "acosh": lambda: (_safe(math.acosh, x), _div(1.0, _safe(math.sqrt, x * x - 1))),
        "atanh": lambda: (
            math.copysign(INF, x) if abs(x) == 1 else _safe(math.atanh, x),
            _div(1.0, 1.0 - x * x),
        ),
        "floor": lambda: (float(np.floor(x)), 0.0),
        "ceil": lambda: (float(np.ceil(x)), 0.0),
        "nint": lambda: (float(np.rint(x)), 0.0),
        "int": lambda: (float(np.trunc(x)), 0.0),
        "sgn": lambda: (_sgn(x), 0.0),
        "u": lambda: (float(np.heaviside(x, 0.5)), 0.0),
        "u2": lambda: (min(max(x, 0.0), 1.0), float(0 <= x < 1)),
        "uramp": lambda: (max(x, 0.0), float(x >= 0)),
        "buf": lambda: (float(x > 0.5), 0.0),
        "square": lambda: (x * x, 2 * x),
    }
    return values[name]()


def _two(name: str, a: float, b: float) -> tuple[float, float, float]:
    """Return value and both derivatives of a function of two registers."""
    if name == "add":
        return a + b, 1.0, 1.0
    if name == "sub":
        return a - b, 1.0, -1.0
    if name == "mul":
        return a * b, b, a
    if name == "div":
        return _div(a, b), _div(1.0, b), -_div(a, b * b)
    if name == "pow":
        by_base = b * _pow(a, b - 1) if b else 0.0
        return _pow(a, b), by_base, _pow(a, b) * _ln(a) if a > 0 else 0.0
    if name == "pwr":
        size = _pow(abs(a), b) if a else 0.0
        slope = b * _pow(abs(a), b - 1) if b else 0.0
        return _sgn(a) * size, slope, _sgn(a) * size * _ln(abs(a)) if a else 0.0
    if name in ("min", "max"):
        if math.isnan(a) or math.isnan(b):
            return math.nan, 0.0, 0.0
        first = a <= b if name == "min" else a >= b
        return (a, 1.0, 0.0) if first else (b, 0.0, 1.0)
    if name == "atan2":
        square = a * a + b * b
        return math.atan2(a, b), _div(b, square), -_div(a, square)
    if name == "hypot":
        size = math.hypot(a, b)
        return size, _div(a, size), _div(b, size)
    truth = {
        "lt": a < b,
        "le": a <= b,
        "gt": a > b,
        "ge": a >= b,
        "eq": a == b,
        "ne": a != b,
        "and": a != 0 and b != 0,
        "or": a != 0 or b != 0,
    }
    return float(truth[name]), 0.0, 0.0


def run(
    tape: Tape, z: Sequence[float], u: Sequence[float] = (), t: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the values (p,) and the Jacobian (p, n) of a tape's functions."""
    with np.errstate(all="ignore"):
        return _run(tape, z, u, t)


def _run(
    tape: Tape, z: Sequence[float], u: Sequence[float], t: float
) -> tuple[np.ndarray, np.ndarray]:
    n = len(z)
    values: list[float] = []
    slopes: list[np.ndarray] = []
    for code, args in zip(tape.ops, tape.args, strict=True):
        name = NAMES[code]
        a, b, c = (int(k) for k in args)
        zero = np.zeros(n)
        if name == "constant":
            value, slope = float(tape.constants[a]), zero
        elif name == "unknown":
            value, slope = float(z[a]), np.eye(n)[a]
        elif name == "source":
            value, slope = float(u[a]), zero
        elif name == "time":
            value, slope = t, zero
        elif name == "if":
            chosen = b if values[a] != 0.0 else c
            value, slope = values[chosen], slopes[chosen]
        elif OPS[name] == 2:
            value, by_a, by_b = _two(name, values[a], values[b])
            slope = _times(by_a, slopes[a]) + _times(by_b, slopes[b])
        else:
            value, by_a = _one(name, values[a], tape.constants[b:].tolist())
            slope = _times(by_a, slopes[a])
        values.append(value)
        slopes.append(slope)
    out = [int(k) for k in tape.outputs]
    jacobian = np.array([slopes[k] for k in out]).reshape(len(out), n)
    return np.array([values[k] for k in out]), jacobian


def _times(factor: float, slope: np.ndarray) -> np.ndarray:
    """Return a product in which zero slopes stay zero, also times inf or nan."""
    return np.where(slope == 0.0, 0.0, factor * np.where(slope == 0.0, 1.0, slope))
