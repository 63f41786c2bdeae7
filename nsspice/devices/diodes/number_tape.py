"""Laws that are written on a tape, evaluated at once: numbers in place of registers.

A law that asks no more of its tape than ``constant`` and ``op`` can be written on a `NumberTape`
as well: the results are then values at one point, for the charges from which a run starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol, TypeVar

from .junction import depletion_charge

R = TypeVar("R")


class LawTape(Protocol[R]):
    """What a law needs of a tape."""

    def constant(self, value: float) -> R:
        """Return the register of a constant."""

    def op(self, name: str, *registers: R, constants: tuple[float, ...] = ()) -> R:
        """Return the register of an instruction."""


class NumberTape:
    """A tape whose registers are numbers.

    Examples
    --------
    >>> tape = NumberTape()
    >>> tape.op("square", tape.op("uramp", 3.0))
    9.0
    >>> round(tape.op("softplus", 0.0, constants=(0.1,)), 6)
    0.069315
    """

    def constant(self, value: float) -> float:
        """Return the constant."""
        return value

    def op(self, name: str, *registers: float, constants: tuple[float, ...] = ()) -> float:
        """Return the value of an instruction."""
        return _OPS[name](*registers, *constants)


def softplus(x: float, k: float) -> float:
    """Return ``k ln(1 + exp(x/k))``."""
    return max(x, 0.0) + k * math.log1p(math.exp(-abs(x / k)))


def gate_drain(v: float, least: float, most: float, a: float) -> float:
    """Return the charge between gate and drain of a VDMOS [A s]."""
    s = (most - least) / (1.0 + 0.5 * math.pi)
    y, x = most - s, a * v
    if v > 0.0:
        return y * v + s * (x - math.log(2.0) + math.log1p(math.exp(-2.0 * x))) / a
    return y * v + s * (v * math.atan(x) - math.log1p(x * x) / (2.0 * a))


def body(v: float, phi: float) -> float:
    """Return ``sqrt(phi - v)``, along its tangent down to zero for positive v."""
    if v <= 0.0:
        return math.sqrt(phi - v)
    return max(math.sqrt(phi) - 0.5 * v / math.sqrt(phi), 0.0)


_OPS: dict[str, Callable[..., float]] = {
    "neg": lambda x: -x,
    "abs": abs,
    "uramp": lambda x: max(x, 0.0),
    "square": lambda x: x * x,
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y,
    "sqrt": math.sqrt,
    "exp": math.exp,
    "ln": math.log,
    "max": max,
    "min": min,
    "junction": lambda v, current, unit: current * math.expm1(min(v / unit, 300.0)),
    "depletion": depletion_charge,
    "softplus": softplus,
    "gate_drain": gate_drain,
    "body": body,
}
