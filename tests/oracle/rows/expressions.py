"""Values of behavioural expressions at all rows, by recursive descent over the text.

Where an expression compares, its value within rounding of the threshold is either of two: ``shift``
moves all thresholds by a share of the larger side, and a caller takes the better of both.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from .flat_deck import Unreadable, number
from .written import Floats

_TOKEN = re.compile(
    r"\s*(\d+\.?\d*(?:e[-+]?\d+)?[a-z]*|\.\d+(?:e[-+]?\d+)?[a-z]*|[a-z_]\w*"
    r"|\*\*|&&|\|\||[<>=!]=|[-+*/^<>?:(),&|!])"
)
_LEVELS = (("||", "|"), ("&&", "&"), ("==", "!=", "<=", ">=", "<", ">"), ("+", "-"), ("*", "/"))

Lookup = Callable[[str, list[str]], Floats]


class Expression:
    """One expression, evaluated at all rows.

    Parameters
    ----------
    text : str
    lookup : callable
        Gives ``v(a,b)``, ``i(e)`` and names without arguments, as arrays.
    shift : float
        Share of the larger side by which every comparison is moved.
    late : bool
        Comparisons are those of the row before.

    Examples
    --------
    >>> Expression("limit(3*x,-2,2)+(x>1 ? 1 : 0)", lambda n, a: np.array([0.5, 2.0])).value()
    array([1.5, 3. ])
    """

    def __init__(self, text: str, lookup: Lookup, shift: float = 0.0, late: bool = False) -> None:
        self.lookup, self.shift, self.late = lookup, shift, late
        self.tokens: list[str] = []
        at = 0
        text = text.strip().strip("{}").lower()
        while at < len(text.rstrip()):
            found = _TOKEN.match(text, at)
            if not found:
                raise Unreadable(f"expression {text!r} at {at}")
            self.tokens.append(found[1])
            at = found.end()
        self.at = 0

    def value(self) -> Floats:
        """Return the value at all rows."""
        out = self._choice()
        if self.at < len(self.tokens):
            raise Unreadable(f"expression: {self.tokens[self.at :]}")
        return out

    def _next(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def _take(self, *wanted: str) -> str:
        token = self._next()
        if wanted and token not in wanted:
            if len(wanted) == 1:
                raise Unreadable(f"expression: {token!r} for {wanted[0]!r}")
            return ""
        self.at += 1
        return token

    def _choice(self) -> Floats:
        condition = self._binary(0)
        if self._next() != "?":
            return condition
        self._take("?")
        yes = self._choice()
        self._take(":")
        return np.where(condition > 0.5, yes, self._choice())

    def _binary(self, level: int) -> Floats:
        if level == len(_LEVELS):
            return self._sign()
        left = self._binary(level + 1)
        while self._next() in _LEVELS[level]:
            sign = self._take()
            left = self._apply(sign, left, self._binary(level + 1))
        return left

    def _apply(self, sign: str, a: Floats, b: Floats) -> Floats:
        near = self.shift * np.maximum(np.abs(a).max(), np.abs(b).max())
        table: dict[str, Callable[[], ArrayLike]] = {
            "+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b, "/": lambda: a / b,
            ">": lambda: a - b > near, ">=": lambda: a - b >= near,
            "<": lambda: b - a > near, "<=": lambda: b - a >= near,
            "==": lambda: np.abs(a - b) <= near, "!=": lambda: np.abs(a - b) > near,
            "&": lambda: np.minimum(a > 0.5, b > 0.5), "|": lambda: np.maximum(a > 0.5, b > 0.5),
        }  # fmt: skip
        out = np.asarray(table[sign if sign not in ("&&", "||") else sign[0]](), dtype=float)
        if self.late and sign[0] in "<>=!" and out.ndim:
            out[1:] = out[:-1].copy()
        return out

    def _sign(self) -> Floats:
        if self._next() in ("-", "+", "!"):
            sign = self._take()
            inner = self._sign()
            return {"-": -inner, "+": inner, "!": 1.0 - inner}[sign]
        base = self._atom()
        if self._next() in ("^", "**"):
            self._take()
            return base ** self._sign()
        return base

    def _atom(self) -> Floats:
        token = self._take()
        if token == "(":
            inner = self._choice()
            self._take(")")
            return inner
        if token[:1].isdigit() or token[:1] == ".":
            return np.asarray(number(token))
        if token in ("v", "i"):
            return self.lookup(token, self._names())
        if self._next() != "(":
            return np.asarray(np.pi) if token == "pi" else self.lookup(token, [])
        self._take("(")
        arguments = [self._choice()]
        while self._next() == ",":
            self._take(",")
            arguments.append(self._choice())
        self._take(")")
        return self._call(token, arguments)

    def _names(self) -> list[str]:
        """Return the nodes or the element in the brackets of v() or i()."""
        self._take("(")
        out = [self._take()]
        while self._next() == ",":
            self._take(",")
            out.append(self._take())
        self._take(")")
        return out

    def _call(self, name: str, a: list[Floats]) -> Floats:
        zero = np.asarray(0.0)
        table: dict[str, Callable[[], Floats]] = {
            "limit": lambda: np.clip(a[0], np.minimum(a[1], a[2]), np.maximum(a[1], a[2])),
            "min": lambda: np.minimum.reduce(np.broadcast_arrays(*a)),
            "max": lambda: np.maximum.reduce(np.broadcast_arrays(*a)),
            "if": lambda: np.where(a[0] > 0.5, a[1], a[2]),
            "table": lambda: _table(a[0], a[1:]),
            "uramp": lambda: np.maximum(a[0], 0.0),
            "u": lambda: 0.5 * (self._apply(">", a[0], zero) + self._apply(">=", a[0], zero)),
        }  # fmt: skip
        if name in table:
            return np.asarray(table[name](), dtype=float)
        if name in ("abs", "sin", "cos", "tan", "tanh", "exp", "sqrt", "log", "sinh", "cosh"):
            return np.asarray(getattr(np, name)(a[0]), dtype=float)
        if name == "atan":
            return np.asarray(np.arctan(a[0]), dtype=float)
        raise Unreadable(f"function {name}")


def _table(x: Floats, points: list[Floats]) -> Floats:
    """Return a broken line at x, constant beyond its ends."""
    corners = np.array([float(p) for p in points])
    return np.asarray(np.interp(x, corners[::2], corners[1::2]))
