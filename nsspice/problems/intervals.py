"""Bounds of the values and derivatives of a tape over a box: interval arithmetic.

Every register is enclosed by an interval for its value and one for each of its derivatives, by the
chain rule in interval arithmetic (A. Neumaier, *Interval Methods for Systems of Equations*, 1990,
ch. 1).  A box may be unbounded.  The result contains Clarke's generalised Jacobian, kinks included;
where a function jumps or has a pole, derivatives are unbounded, for any values on both sides.
Bounds are right to the rounding of their terms, to which the verdicts on matrices are right, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .csc import Floats
from .domain import gap
from .enclosure import INF, Enclosure, enclosed
from .tape import OPS, WITH_CONSTANTS, Tape

Interval = tuple[float, float]
ALL: Interval = (-INF, INF)
_ANY = Enclosure.of(*ALL)
_Partials = list[tuple[int, Enclosure]]
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
    >>> found = bounds(builder.finish(), [(-INF, INF)])
    >>> float(found.low[0, 0]), float(found.high[0, 0])
    (1.0, 2.0)
    """
    with np.errstate(all="ignore"):
        return _bounds(tape, box, time)


def _bounds(tape: Tape, box: Sequence[Interval], time: Interval) -> Bounds:
    n = len(box)
    values: list[Enclosure] = []
    partials: list[_Partials] = []  # of each register: argument, derivative
    inputs: dict[int, int] = {}  # registers that are unknowns, or the time (n)
    gaps: list[str] = []
    for k, (code, args) in enumerate(zip(tape.ops.tolist(), tape.args.tolist(), strict=True)):
        name = _NAMES[code]
        slopes: _Partials = []
        gaps.append("")
        if name == "constant":
            value = Enclosure.of(tape.constants[args[0]])
        elif name == "unknown":
            value = Enclosure.of(*box[args[0]])
            inputs[k] = args[0]
        elif name == "time":
            value = Enclosure.of(*time)
            inputs[k] = n
        elif name == "source":
            value = _ANY
        else:
            used = args[: OPS[name]]
            constants = tape.constants[args[1] :] if name in WITH_CONSTANTS else tape.constants[:0]
            inner = [values[a] for a in used]
            # jumps, poles and rarely used functions: nothing is claimed
            value, found = enclosed(name, inner, constants) or (_ANY, [_ANY] * len(used))
            below = next((gaps[a] for a in used if gaps[a]), "")
            gaps[-1] = below or gap(name, [_pair(v) for v in inner], constants)
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
        # both enclose: which is narrower depends on where terms cancel
        low[row] = np.maximum(forward[register].low, backward.low)
        high[row] = np.minimum(forward[register].high, backward.high)
    found_values = [ALL if gaps[r] else _pair(values[r]) for r in out]
    return Bounds(np.array(found_values).reshape(-1, 2), low, high, tuple(gaps[r] for r in out))


def _forward(partials: Sequence[_Partials], inputs: dict[int, int], n: int) -> list[Enclosure]:
    """Return the derivatives (n + 1,) of every register, by the chain rule from the unknowns on."""
    found: list[Enclosure] = []
    for k, slopes in enumerate(partials):
        own = np.zeros(n + 1)
        if k in inputs:
            own[inputs[k]] = 1.0
        row = Enclosure.of(own)
        for argument, slope in slopes:
            row = row + slope * found[argument]
        found.append(row)
    return found


def _backward(
    partials: Sequence[_Partials], inputs: dict[int, int], register: int, n: int
) -> Enclosure:
    """Return the derivatives (n + 1,) of one register, by the chain rule from the result back."""
    adjoints = {register: Enclosure.of(1.0)}
    low, high = np.zeros(n + 1), np.zeros(n + 1)
    for k in range(register, -1, -1):
        weight = adjoints.pop(k, None)
        if weight is None:
            continue
        if k in inputs:
            total = Enclosure.of(low[inputs[k]], high[inputs[k]]) + weight
            low[inputs[k]], high[inputs[k]] = _pair(total)
        for argument, slope in partials[k]:
            part = weight * slope
            adjoints[argument] = adjoints[argument] + part if argument in adjoints else part
    return Enclosure(low, high)


def _pair(x: Enclosure) -> Interval:
    return float(x.low), float(x.high)


__all__ = ["ALL", "INF", "Bounds", "Interval", "bounds"]
