"""Where an instruction of a tape has no value, or jumps: poles, logarithms of zero, comparisons.

A theorem that asks for a continuous function does not apply where the interval of an argument holds
a pole, however well the derivatives on both sides of it are bounded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from .csc import Floats

Interval = tuple[float, float]

#: least argument, and whether a function has a value there
_LEAST: dict[str, tuple[float, bool]] = {
    "sqrt": (0.0, True),
    "ln": (0.0, False),
    "log10": (0.0, False),
    "log1p": (-1.0, False),
    "acosh": (1.0, True),
}
#: where rounding to whole numbers jumps: at every number of this form, with k whole
_STEPS = {"floor": 0.0, "ceil": 0.0, "int": 0.0, "nint": 0.5}
#: where instructions jump
_LEVELS = {"sgn": 0.0, "u": 0.0, "not": 0.0, "buf": 0.5}
_COMPARED = frozenset({"lt", "le", "gt", "ge", "eq", "ne"})


def gap(name: str, inner: Sequence[Interval], constants: Floats) -> str:
    """Return why an instruction need not be continuous on a box, empty where it is.

    Parameters
    ----------
    name : str
        Of the instruction.
    inner : sequence of (float, float)
        Intervals of its arguments.
    constants : ndarray
        Those that it carries.

    Examples
    --------
    >>> import numpy as np
    >>> gap("inv", [(-1.0, 2.0)], np.zeros(0))
    'a division by 0'
    >>> gap("inv", [(1.0, 2.0)], np.zeros(0))
    ''
    """
    a = inner[0] if inner else (0.0, 0.0)
    if name in ("inv", "div"):
        return "a division by 0" if _holds(inner[-1], 0.0) else ""
    if name in _LEAST:
        least, closed = _LEAST[name]
        inside = a[0] >= least if closed else a[0] > least
        return "" if inside else f"{name} of {'' if closed else f'{least:g} or '}{_less(least)}"
    if name in ("asin", "acos", "atanh"):
        inside = a[0] >= -1.0 and a[1] <= 1.0 and (name != "atanh" or (a[0] > -1.0 and a[1] < 1.0))
        return "" if inside else f"{name} beyond -1 and 1"
    if name == "tan":
        return "a pole of tan" if _between(a, 0.5 * math.pi, math.pi) else ""
    if name in ("pow", "pwr"):
        return _power(name, a, inner[1])
    if name == "atan2":
        jumps = _holds(inner[0], 0.0) and inner[1][0] <= 0.0
        return "the jump of atan2" if jumps else ""
    return _jump(name, inner, constants)


def _less(least: float) -> str:
    return f"less than {least:g}"


def _jump(name: str, inner: Sequence[Interval], constants: Floats) -> str:
    a = inner[0] if inner else (0.0, 0.0)
    if name in _LEVELS:
        return f"a jump of {name}" if _holds(a, _LEVELS[name]) and a[0] != a[1] else ""
    if name in _STEPS:
        return f"jumps of {name}" if a[0] != a[1] and _between(a, _STEPS[name], 1.0) else ""
    if name in _COMPARED:
        b = inner[1]
        apart = a[1] < b[0] or b[1] < a[0] or (a[0] == a[1] == b[0] == b[1])
        return "" if apart else "a comparison"
    if name in ("and", "or"):
        mixed = any(_holds(x, 0.0) and x[0] != x[1] for x in inner)
        return "a condition" if mixed else ""
    if name == "if":
        return "a condition" if _holds(a, 0.0) and a[0] != a[1] else ""
    if name == "staircase":
        return "a staircase"
    if name == "table":
        count = int(constants[0])
        x = constants[1 : 1 + 2 * count : 2].tolist()
        rises = all(p < q for p, q in pairwise(x))
        return "" if rises else "a table that jumps"
    return ""


def _power(name: str, base: Interval, exponent: Interval) -> str:
    """Powers: of zero with a negative exponent, of a negative number with a broken one."""
    whole = exponent[0] == exponent[1] and float(exponent[0]).is_integer()
    if exponent[0] < 0.0 and _holds(base, 0.0):
        return "a negative power of 0"
    if name == "pow" and base[0] < 0.0 and not whole:
        return "a root of a negative number"
    if base[0] <= 0.0 and exponent[0] <= 0.0 and exponent[0] != exponent[1]:
        return "a power of 0"
    return ""


def _holds(a: Interval, x: float) -> bool:
    return a[0] <= x <= a[1]


def _between(a: Interval, first: float, period: float) -> bool:
    """Return whether one of the numbers ``first + k period`` lies in an interval."""
    if not math.isfinite(a[0]) or not math.isfinite(a[1]):
        return True
    # the ends are right to rounding: what touches counts as inside
    slack = 8.0 * 2.0**-53 * max(abs(a[0]), abs(a[1]), period)
    return math.floor((a[1] + slack - first) / period) >= math.ceil((a[0] - slack - first) / period)


__all__ = ["gap"]
