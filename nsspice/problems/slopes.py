"""What can be proved of smooth functions without evaluating them: bounds of their slopes.

Most laws of circuits are sums of functions of one linear form each: a junction of a voltage, an
argsinh of a current.  Such a *ridge* ``phi(v . z)`` has, between any two points, a difference
``s (v . (z1 - z2))`` with a mean slope s between the bounds of phi'.  A system in which all
nonlinear functions are ridges is, as far as differences of solutions go, linear with uncertain
coefficients.  The bounds are known for the instructions themselves; for whole expressions of one
form they are found by :mod:`nsspice.problems.univariate`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .csc import Floats
from .enclosure import INF
from .tape import CODES, OPS, Tape
from .univariate import Law

#: bounds of the derivative over all arguments
_BOUNDS: dict[str, tuple[float, float]] = {
    "abs": (-1.0, 1.0),
    "sqrt": (0.0, INF),
    "exp": (0.0, INF),
    "expm1": (0.0, INF),
    "ln": (0.0, INF),
    "log1p": (0.0, INF),
    "log10": (0.0, INF),
    "sin": (-1.0, 1.0),
    "cos": (-1.0, 1.0),
    "asin": (1.0, INF),
    "acos": (-INF, -1.0),
    "atan": (0.0, 1.0),
    "sinh": (1.0, INF),
    "cosh": (-INF, INF),
    "tanh": (0.0, 1.0),
    "asinh": (0.0, 1.0),
    "acosh": (0.0, INF),
    "atanh": (1.0, INF),
    "u2": (0.0, 1.0),
    "uramp": (0.0, 1.0),
    "square": (-INF, INF),
    "depletion": (0.0, INF),
    "gate_drain": (0.0, INF),
    "softplus": (0.0, 1.0),
    "body": (-INF, 0.0),
}
#: their slopes are constant over whole intervals
_PIECEWISE = frozenset({"abs", "u2", "uramp", "table", "min", "max"})
_NAMES = list(OPS)
_SAME = 4.0 * 2.0**-53  # two products of rounded factors


@dataclass(frozen=True, slots=True)
class Ridge:
    """A function of one linear form.

    Parameters
    ----------
    direction : dict of int to float
        The form v, by unknown.
    low, high : float
        Bounds of the slope with respect to the form.
    closed : bool
        Mean slopes may reach the bounds, as those of a piecewise-linear function do.
    """

    direction: dict[int, float]
    low: float
    high: float
    closed: bool = False


@dataclass(slots=True)
class Shape:
    """A register as constant, linear part and multiples of ridges.

    Parameters
    ----------
    constant : float or None
        Its constant part; None if that depends on sources or the time.
    linear : dict of int to float
    ridges : dict of int to float
        Factor by number of the ridge.
    """

    constant: float | None = 0.0
    linear: dict[int, float] = field(default_factory=dict)
    ridges: dict[int, float] = field(default_factory=dict)

    @property
    def fixed(self) -> bool:
        """True if it does not depend on the unknowns."""
        return not self.linear and not self.ridges


def shapes(tape: Tape) -> tuple[list[Shape | None], list[Ridge]]:
    """Return the shape of each function, None where it is not a sum of ridges, and the ridges.

    Parameters
    ----------
    tape : Tape

    Examples
    --------
    >>> from nsspice.problems import TapeBuilder
    >>> builder = TapeBuilder()
    >>> difference = builder.op("sub", builder.unknown(0), builder.unknown(1))
    >>> _ = builder.output(builder.op("atan", difference))
    >>> (shape,), (ridge,) = shapes(builder.finish())
    >>> shape.ridges, ridge.direction, ridge.low, ridge.high
    ({0: 1.0}, {0: 1.0, 1: -1.0}, 0.0, 1.0)
    """
    ridges: list[Ridge] = []
    known: list[Shape | None] = []
    for r, (code, args) in enumerate(zip(tape.ops.tolist(), tape.args.tolist(), strict=True)):
        name = _NAMES[code]
        registers = [known[a] for a in args[: OPS[name]]]
        shape = _shape(name, args, registers, tape.constants, ridges)
        if shape is None and registers:
            shape = _of_one_form(tape, r, known, ridges)
        known.append(shape)
    return [known[r] for r in tape.outputs.tolist()], ridges


def _of_one_form(
    tape: Tape, register: int, known: Sequence[Shape | None], ridges: list[Ridge]
) -> Shape | None:
    """Return an expression of a single linear form as a ridge, None if it is not one."""
    below = _below(tape, register)
    forms: list[dict[int, float]] = []
    affine: dict[int, tuple[float, float]] = {}
    for r in sorted(below):
        shape = known[r] if r < register else None
        if shape is None or shape.ridges or shape.constant is None:
            if shape is not None and _NAMES[int(tape.ops[r])] in ("source", "time"):
                return None
            continue
        if not shape.linear:
            affine[r] = 0.0, shape.constant
            continue
        factor = _factor(shape.linear, forms[0]) if forms else 1.0
        if factor is None:
            continue
        if not forms:
            forms.append(dict(shape.linear))
        affine[r] = factor, shape.constant
    # every unknown below must be reached through registers that are multiples of the one form
    if not forms or not _covered(tape, register, affine):
        return None
    bounds = Law(tape, affine).slope_bounds(register)
    if bounds is None or bounds == (-INF, INF):
        return None
    ridges.append(Ridge(forms[0], *bounds, closed=True))
    return Shape(None, ridges={len(ridges) - 1: 1.0})


def _below(tape: Tape, register: int) -> set[int]:
    """Return the registers that one is computed from, itself among them."""
    found: set[int] = set()
    waiting = [register]
    while waiting:
        r = waiting.pop()
        if r not in found:
            found.add(r)
            waiting += tape.args[r].tolist()[: OPS[_NAMES[int(tape.ops[r])]]]
    return found


def _covered(tape: Tape, register: int, affine: dict[int, tuple[float, float]]) -> bool:
    """Return whether a register is a function of registers that are affine in one form."""
    waiting, seen = [register], set()
    while waiting:
        r = waiting.pop()
        if r in affine or r in seen:
            continue
        seen.add(r)
        name = _NAMES[int(tape.ops[r])]
        if name in ("unknown", "source", "time"):
            return False
        waiting += tape.args[r].tolist()[: OPS[name]]
    return True


def _factor(form: dict[int, float], base: dict[int, float]) -> float | None:
    """Return the factor by which a linear form is another one, None if it is not a multiple."""
    if form.keys() != base.keys():
        return None
    first = next(iter(base))
    factor = form[first] / base[first]
    same = all(abs(form[k] - factor * base[k]) <= _SAME * abs(form[k]) for k in base)
    return factor if same else None


def _shape(
    name: str,
    args: Sequence[int],
    registers: Sequence[Shape | None],
    constants: Floats,
    ridges: list[Ridge],
) -> Shape | None:
    if name == "constant":
        return Shape(float(constants[args[0]]))
    if name == "unknown":
        return Shape(linear={args[0]: 1.0})
    if name in ("source", "time"):
        return Shape(None)
    if any(r is None for r in registers):
        return None
    parts = [r for r in registers if r is not None]
    if name == "neg":
        return _sum([(parts[0], -1.0)])
    if name in ("add", "sub"):
        return _sum([(parts[0], 1.0), (parts[1], 1.0 if name == "add" else -1.0)])
    if all(part.fixed for part in parts):
        return Shape(_folded(name, args, [part.constant for part in parts], constants))
    if name == "mul":
        for part, other in (parts, parts[::-1]):
            if part.fixed and part.constant is not None:
                return _sum([(other, part.constant)])
        return None
    if name == "div":
        divisor = parts[1]
        if divisor.fixed and divisor.constant:
            return _sum([(parts[0], 1.0 / divisor.constant)])
        return None
    if name in ("min", "max") and not any(part.fixed for part in parts):
        return _extreme(name, parts, ridges)
    bounds = _bounds(name, args, parts, constants)
    if bounds is None:
        return None
    inner = next(p for p in parts if not p.fixed)
    return _compose(inner, bounds, name in _PIECEWISE, ridges)


def _folded(
    name: str, args: Sequence[int], values: Sequence[float | None], constants: Floats
) -> float | None:
    """Return an instruction of constants, None where a value depends on sources or the time."""
    known = [v for v in values if v is not None]
    if len(known) < len(values):
        return None
    count = len(known)
    code = [CODES["constant"]] * count + [CODES[name]]
    tape = Tape(
        ops=np.array(code, dtype=np.uint8),
        args=np.array([[0, 0, 0]] * count + [[*range(count), *args[count:3]]], dtype=np.int32),
        constants=constants,
        outputs=np.array([count], dtype=np.int32),
    )
    return Law(tape, {k: (0.0, v) for k, v in enumerate(known)}).value(count)


def _extreme(name: str, parts: Sequence[Shape], ridges: list[Ridge]) -> Shape | None:
    """Return ``max(a, b) = b + (a - b)^+`` or ``min(a, b) = a - (a - b)^+``."""
    difference = _sum([(parts[0], 1.0), (parts[1], -1.0)])
    if difference.fixed:
        return None
    part = _compose(difference, (0.0, 1.0), True, ridges)
    if part is None:
        return None
    return _sum(
        [(parts[1], 1.0), (part, 1.0)] if name == "max" else [(parts[0], 1.0), (part, -1.0)]
    )


def _bounds(
    name: str, args: Sequence[int], parts: Sequence[Shape], constants: Floats
) -> tuple[float, float] | None:
    """Return the slope bounds of an instruction of one varying argument, None if unknown."""
    if name == "junction":
        return (0.0, INF) if constants[args[1]] >= 0.0 else (-INF, 0.0)
    if name == "table":
        count = int(constants[args[1]])
        points = constants[args[1] + 1 : args[1] + 1 + 2 * count].reshape(-1, 2)
        run, rise = np.diff(points[:, 0]), np.diff(points[:, 1])
        if np.any(run <= 0.0):
            return None
        slopes = np.append(rise / run, 0.0)  # constant beyond the ends
        return float(slopes.min()), float(slopes.max())
    if len(parts) == 2:
        fixed = [p for p in parts if p.fixed]
        if len(fixed) != 1:
            return None
        if name in ("min", "max"):
            return 0.0, 1.0
        exponent = fixed[0].constant
        if name in ("pow", "pwr") and fixed[0] is parts[1] and exponent is not None:
            odd = name == "pwr" or (exponent % 2.0 == 1.0)
            return (0.0, INF) if odd and exponent >= 1.0 else None
        return None
    return _BOUNDS.get(name)


def _compose(
    inner: Shape, bounds: tuple[float, float], closed: bool, ridges: list[Ridge]
) -> Shape | None:
    """Return a function of a shape that is one linear form, or a multiple of one ridge."""
    low, high = bounds
    if not inner.ridges:
        ridges.append(Ridge(dict(inner.linear), low, high, closed))
    elif len(inner.ridges) == 1 and not inner.linear:
        ((number, factor),) = inner.ridges.items()
        before = ridges[number]
        ends = [_times(a, factor * b) for a in bounds for b in (before.low, before.high)]
        closed = closed or before.closed
        ridges.append(Ridge(before.direction, min(ends), max(ends), closed))
    else:
        return None
    return Shape(None, ridges={len(ridges) - 1: 1.0})


def _times(a: float, b: float) -> float:
    return 0.0 if a == 0.0 or b == 0.0 else a * b


def _sum(terms: Sequence[tuple[Shape, float]]) -> Shape:
    total = Shape()
    for shape, factor in terms:
        for source, target in ((shape.linear, total.linear), (shape.ridges, total.ridges)):
            for key, value in source.items():
                target[key] = target.get(key, 0.0) + factor * value
                if target[key] == 0.0:
                    del target[key]
    total.constant = None
    if all(s.constant is not None for s, _ in terms):
        total.constant = sum(f * (s.constant or 0.0) for s, f in terms)
    return total
