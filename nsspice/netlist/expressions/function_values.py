"""The values of functions, on floats and on numpy arrays.

Outside its domain a function gives nan, beyond the range of doubles inf, on floats as on arrays:
the circuit, not the expression, decides whether that matters.  numpy is imported when the first
array comes, so that reading a deck does without it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

INF = math.inf
NAN = math.nan


def guarded(function: Callable[[float], float]) -> Callable[[float], float]:
    """Return a function of ``math`` that gives nan or inf where that one raises."""

    def safe(x: float) -> float:
        try:
            return function(x)
        except ValueError:
            return NAN
        except OverflowError:
            return INF

    return safe


def exp(x: float) -> float:
    """Return e to the x, inf beyond the range of doubles."""
    return math.exp(x) if x < 709.782712893384 else (INF if x == x else NAN)


def ln(x: float) -> float:
    """Return the natural logarithm, -inf at zero, nan below."""
    return math.log(x) if x > 0.0 else (-INF if x == 0.0 else NAN)


def log10(x: float) -> float:
    """Return the logarithm to base 10, -inf at zero, nan below."""
    return math.log10(x) if x > 0.0 else (-INF if x == 0.0 else NAN)


def sinh(x: float) -> float:
    """Return the hyperbolic sine, infinite beyond the range of doubles."""
    try:
        return math.sinh(x)
    except OverflowError:
        return math.copysign(INF, x)


def atanh(x: float) -> float:
    """Return the inverse hyperbolic tangent, infinite at -1 and 1."""
    if abs(x) == 1.0:
        return math.copysign(INF, x)
    return math.atanh(x) if abs(x) < 1.0 else NAN


def sgn(x: float) -> float:
    """Return the sign, 0 at 0."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else (0.0 if x == 0.0 else NAN))


def step(x: float) -> float:
    """Return the unit step, one half at 0 as in ngspice."""
    return 1.0 if x > 0.0 else (0.0 if x < 0.0 else (0.5 if x == 0.0 else NAN))


def whole(function: Callable[[float], float]) -> Callable[[float], float]:
    """Return a rounding function that lets inf and nan pass, and a zero keep its sign."""
    return lambda x: (float(function(x)) or math.copysign(0.0, x)) if math.isfinite(x) else x


def divide(a: float, b: float) -> float:
    """Return a/b with the infinities of IEEE 754."""
    if b != 0.0:
        return a / b
    if a == 0.0 or a != a:
        return NAN
    return math.copysign(INF, a) * math.copysign(1.0, b)


def real_power(a: float, b: float) -> float:
    """Return a to the b; nan for a negative base and a broken exponent."""
    try:
        return math.pow(a, b)
    except OverflowError:
        return -INF if a < 0.0 and b % 2.0 == 1.0 else INF
    except ValueError:
        return INF if a == 0.0 else NAN


def signed_power(a: float, b: float) -> float:
    """Return sgn(a) |a|^b, the ``pwr`` of SPICE."""
    return sgn(a) * real_power(abs(a), b) if a != 0.0 else 0.0


def clamp(x: float, a: float, b: float) -> float:
    """Return x held between two bounds given in either order."""
    low, high = (a, b) if a <= b else (b, a)
    return low if x < low else (high if x > high else x)


def broken_line(x: float, *points: float) -> float:
    """Return the piecewise-linear function through the points; end values beyond the ends."""
    if not x > points[0]:
        return points[1] if x == x else NAN
    for k in range(2, len(points) - 1, 2):
        if x <= points[k]:
            x0, y0, x1, y1 = points[k - 2 : k + 2]
            return y0 + (x - x0) * ((y1 - y0) / (x1 - x0)) if x1 > x0 else y1
    return points[len(points) - 1]


def staircase(x: float, *pairs: float) -> float:
    """Return the constant y of the interval: x1, y1, x2, y2 ... xn; zero outside.

    The derivative of ``broken_line``: y_k holds on (x_k, x_k+1], the last x closes the range.
    """
    if not x > pairs[0]:
        return 0.0 if x == x else NAN
    for k in range(2, len(pairs), 2):
        if x <= pairs[k]:
            return pairs[k - 1]
    return 0.0


def smallest(*values: float) -> float:
    """Return the minimum; nan if one is nan."""
    return NAN if any(v != v for v in values) else min(values)


def largest(*values: float) -> float:
    """Return the maximum; nan if one is nan."""
    return NAN if any(v != v for v in values) else max(values)


SCALAR: dict[str, Callable[..., float]] = {
    "abs": abs,
    "acos": guarded(math.acos),
    "acosh": guarded(math.acosh),
    "asin": guarded(math.asin),
    "asinh": math.asinh,
    "atan": math.atan,
    "atanh": atanh,
    "atan2": math.atan2,
    "buf": lambda x: 1.0 if x > 0.5 else 0.0,
    "ceil": whole(math.ceil),
    "cos": guarded(math.cos),
    "cosh": guarded(math.cosh),
    "exp": exp,
    "floor": whole(math.floor),
    "hypot": math.hypot,
    "int": whole(math.trunc),
    "inv": lambda x: 0.0 if x > 0.5 else 1.0,
    "limit": clamp,
    "ln": ln,
    "log10": log10,
    "max": largest,
    "min": smallest,
    "nint": whole(round),
    "pwl": broken_line,
    "pwr": signed_power,
    "sgn": sgn,
    "sin": guarded(math.sin),
    "sinh": sinh,
    "sqrt": guarded(math.sqrt),
    "square": lambda x: x * x,
    "steps": staircase,
    "tan": guarded(math.tan),
    "tanh": math.tanh,
    "u": step,
    "u2": lambda x: clamp(x, 0.0, 1.0),
    "uramp": lambda x: x if x > 0.0 else (0.0 if x == x else NAN),
}


@cache
def array_functions() -> dict[str, Callable[..., Any]]:
    """Return the same functions for numpy arrays."""
    import numpy as np

    def lookup(function: Callable[..., float]) -> Callable[..., Any]:
        def elementwise(x: Any, *points: Any) -> Any:
            return np.vectorize(function, otypes=[float])(x, *points)

        return elementwise

    def broken(x: Any, *points: Any) -> Any:
        if all(np.ndim(p) == 0 for p in points):
            xs, ys = np.array(points[0::2], float), np.array(points[1::2], float)
            if np.all(np.diff(xs) > 0.0):  # np.interp leaves the value at a jump open
                return np.interp(x, xs, ys)
        return lookup(broken_line)(x, *points)

    def reduce(function: Any) -> Callable[..., Any]:
        def many(first: Any, *rest: Any) -> Any:
            for value in rest:
                first = function(first, value)
            return first

        return many

    def hold(x: Any, a: Any, b: Any) -> Any:
        return np.clip(x, np.minimum(a, b), np.maximum(a, b))

    return {
        "abs": np.abs,
        "acos": np.arccos,
        "acosh": np.arccosh,
        "asin": np.arcsin,
        "asinh": np.arcsinh,
        "atan": np.arctan,
        "atanh": np.arctanh,
        "atan2": np.arctan2,
        "buf": lambda x: np.where(x > 0.5, 1.0, 0.0),
        "ceil": np.ceil,
        "cos": np.cos,
        "cosh": np.cosh,
        "exp": np.exp,
        "floor": np.floor,
        "hypot": np.hypot,
        "int": np.trunc,
        "inv": lambda x: np.where(x > 0.5, 0.0, 1.0),
        "limit": hold,
        "ln": np.log,
        "log10": np.log10,
        "max": reduce(np.maximum),
        "min": reduce(np.minimum),
        "nint": np.rint,
        "pwl": broken,
        "pwr": lambda a, b: np.sign(a) * np.power(np.abs(a), b),
        "sgn": np.sign,
        "sin": np.sin,
        "sinh": np.sinh,
        "sqrt": np.sqrt,
        "square": np.square,
        "steps": lookup(staircase),
        "tan": np.tan,
        "tanh": np.tanh,
        "u": lambda x: np.heaviside(x, 0.5),
        "u2": lambda x: np.clip(x, 0.0, 1.0),
        "uramp": lambda x: np.maximum(x, 0.0),
    }
