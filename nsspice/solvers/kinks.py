"""Slopes of smooth functions on all sides of their kinks: Clarke's generalised Jacobian.

At a kink the compiled core takes the slopes of one side.  Whether a solution there is regular
depends on all sides, and on everything between them (T. Roubal, R. Cibulka 2017, theorem 2.4;
A. F. Izmailov, *Strongly regular nonsmooth generalized equations*, Math. Programming 147, 2014).
For each side the instruction is replaced by the one that it is there: ``abs(x)`` by ``x`` or
``-x``, a comparison by its outcome.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np

from ..problems.csc import Floats
from ..problems.piecewise import Kinks
from ..problems.slopes import shapes
from ..problems.tape import CODES, OPS, Tape
from .moreau import function_slopes, function_values

_NAMES = list(OPS)
_COMPARISONS = frozenset({"lt", "le", "gt", "ge"})
_TWO = frozenset({"min", "max"}) | _COMPARISONS
_ONE = frozenset({"abs", "uramp", "u", "sgn", "pwr"})
_MOST = 6  # kinks at one point of which all sides are combined: 64 Jacobians
_PARALLEL = 1e-9  # directions that are one

#: an instruction in place of another one: name, arguments (-1 and -2: those of the old one)
_Side = tuple[str, tuple[int, ...], float]


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of the Jacobian around a point.

    Parameters
    ----------
    jacobians : ndarray, shape (sides, p, n)
        Their convex hull holds Clarke's Jacobian.
    jumps : tuple of int
        Functions that have no one limit of their values there.
    complete : bool
        False if there were too many kinks to combine their sides.
    directions : ndarray, shape (kinks, n)
        Along which each kink goes from its lower to its upper side; the sides of the last one
        are next to each other in ``jacobians``.
    sure : bool
        The signs of these directions are combined in the same ways as the sides are near the
        point: no kink inside another one, and where directions depend on each other they are those
        of linear functions.
    """

    jacobians: Floats
    jumps: tuple[int, ...] = ()
    complete: bool = True
    directions: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    sure: bool = True

    @property
    def kinks(self) -> Kinks:
        """What decides on regularity there."""
        return Kinks(self.jacobians, self.directions, self.sure)


def limits(tape: Tape, z: Floats, u: Floats, t: float, near: Floats) -> Limits:
    """Return the limits of the Jacobian of a tape at a point.

    Parameters
    ----------
    tape : Tape
    z, u, t : ndarray (n,), ndarray (s,), float
        The point.
    near : ndarray, shape (n,)
        Distances within which unknowns are at a kink.

    Examples
    --------
    >>> from nsspice.problems import TapeBuilder
    >>> builder = TapeBuilder()
    >>> _ = builder.output(builder.op("abs", builder.unknown(0)))
    >>> found = limits(builder.finish(), np.zeros(1), np.zeros(0), 0.0, np.zeros(1))
    >>> sorted(found.jacobians.ravel().tolist())
    [-1.0, 1.0]
    """
    point = z[None], u[None], np.array([t])
    kinks = _kinks(tape, point, near)
    plain = function_slopes(tape, *point)
    if not kinks:
        return Limits(plain)
    if len(kinks) > _MOST:
        return Limits(plain, complete=False)
    tapes = [
        _on_sides(tape, kinks, sides) for sides in itertools.product((0, 1), repeat=len(kinks))
    ]
    values = np.array([function_values(one, *point)[0] for one in tapes])
    jacobians = np.concatenate([function_slopes(one, *point) for one in tapes])
    # where a kink is within `near` but not at the point, values differ by what lies between
    reach = np.abs(jacobians).max(axis=0) @ near
    rounding = tape.ops.size * 2.0**-53 * np.abs(values).max(axis=0)
    apart = values.max(axis=0) - values.min(axis=0) > 4.0 * reach + rounding
    jumps = tuple(int(k) for k in np.flatnonzero(apart))
    directions = np.array([kink.direction for kink in kinks])
    return Limits(jacobians, jumps, directions=directions, sure=_sure(tape, kinks))


def _sure(tape: Tape, kinks: list[_Kink]) -> bool:
    """Return whether the combinations of sides are those of the directions, see `Limits`."""
    places = [(place[0], kink) for kink in kinks for place in kink.places]
    registers = {r for r, _ in places}
    inputs = [a for r in registers for a in tape.args[r].tolist()[: _count(tape, r)]]
    if registers & _below(tape, inputs):
        return False
    directions = np.array([kink.direction for kink in kinks])
    apart = np.linalg.matrix_rank(directions, tol=_PARALLEL) == len(kinks)
    same: dict[bytes, set[tuple[int, ...]]] = {kink.direction.tobytes(): set() for kink in kinks}
    for r, kink in places:
        same[kink.direction.tobytes()].add(tuple(tape.args[r].tolist()[: _count(tape, r)]))
    if apart and all(len(arguments) == 1 for arguments in same.values()):
        return True
    probe = replace(tape, outputs=np.array(inputs, dtype=np.int32))
    return all(shape is not None and not shape.ridges for shape in shapes(probe)[0])


def _below(tape: Tape, registers: list[int]) -> set[int]:
    """Return the registers that some are computed from, themselves among them."""
    found: set[int] = set()
    waiting = list(registers)
    while waiting:
        r = waiting.pop()
        if r not in found:
            found.add(r)
            waiting += tape.args[r].tolist()[: _count(tape, r)]
    return found


@dataclass(frozen=True, slots=True)
class _Kink:
    """Instructions that are at their kinks along one direction; each with its two sides."""

    direction: Floats
    #: register, replacement below and above zero of the direction
    places: list[tuple[int, _Side, _Side]]


def _kinks(tape: Tape, point: tuple[Floats, Floats, Floats], near: Floats) -> list[_Kink]:
    chosen = [
        r for r, op in enumerate(tape.ops.tolist()) if _NAMES[op] in _TWO | _ONE | {"u2", "table"}
    ]
    if not chosen:
        return []
    # the arguments of these instructions, as functions of their own
    inputs = [tape.args[r].tolist() for r in chosen]
    registers = sorted(
        {a for r, args in zip(chosen, inputs, strict=True) for a in args[: _count(tape, r)]}
    )
    probe = replace(tape, outputs=np.array(registers, dtype=np.int32))
    values = dict(zip(registers, function_values(probe, *point)[0], strict=True))
    slopes = dict(zip(registers, function_slopes(probe, *point)[0], strict=True))
    found: list[_Kink] = []
    for r, args in zip(chosen, inputs, strict=True):
        name = _NAMES[int(tape.ops[r])]
        value, slope = values[args[0]], slopes[args[0]]
        size = abs(value)
        if name in _TWO:
            value, slope = value - values[args[1]], slope - slopes[args[1]]
            size = max(size, abs(values[args[1]]))
        for level, below, above in _sides(tape, name, args):
            slack = float(np.abs(slope) @ near) + 4.0 * 2.0**-53 * max(size, abs(level))
            if slope.any() and np.all(np.isfinite(slope)) and abs(value - level) <= slack:
                _add(found, slope, (r, below, above))
    return found


def _count(tape: Tape, r: int) -> int:
    return OPS[_NAMES[int(tape.ops[r])]]


def _add(found: list[_Kink], slope: Floats, place: tuple[int, _Side, _Side]) -> None:
    """Add an instruction to the kink of its direction: both change sides together."""
    unit = slope / np.linalg.norm(slope)
    r, below, above = place
    for kink in found:
        if np.linalg.norm(unit - kink.direction) <= _PARALLEL:
            kink.places.append(place)
            return
        if np.linalg.norm(unit + kink.direction) <= _PARALLEL:
            kink.places.append((r, above, below))
            return
    found.append(_Kink(unit, [place]))


def _sides(tape: Tape, name: str, args: list[int]) -> list[tuple[float, _Side, _Side]]:
    """Return the kinks of an instruction: level of its argument, what it is below and above."""
    first, second = ("max", (-1, -1), 0.0), ("max", (-2, -2), 0.0)
    if name == "max":
        return [(0.0, second, first)]
    if name == "min":
        return [(0.0, first, second)]
    if name in _COMPARISONS:
        less = float(name in ("lt", "le"))
        return [(0.0, _fixed(less), _fixed(1.0 - less))]
    if name == "abs":
        return [(0.0, ("neg", (-1,), 0.0), first)]
    if name == "uramp":
        return [(0.0, _fixed(0.0), first)]
    if name == "u2":
        return [(0.0, _fixed(0.0), first), (1.0, first, _fixed(1.0))]
    if name == "u":
        return [(0.0, _fixed(0.0), _fixed(1.0))]
    if name == "sgn":
        return [(0.0, _fixed(-1.0), _fixed(1.0))]
    if name == "table":
        count = int(tape.constants[args[1]])
        points = tape.constants[args[1] + 1 : args[1] + 1 + 2 * count].reshape(-1, 2)
        return [(float(points[k, 0]), _line(points, k - 1), _line(points, k)) for k in range(count)]
    return []


def _fixed(value: float) -> _Side:
    return "constant", (), value


def _line(points: Floats, k: int) -> _Side:
    """Return the line between points k and k + 1 of a table; it is constant beyond its ends."""
    if not 0 <= k < len(points) - 1:
        return _fixed(float(points[0 if k < 0 else -1, 1]))
    return f"line {k}", (-1,), 0.0


def _on_sides(tape: Tape, kinks: list[_Kink], sides: tuple[int, ...]) -> Tape:
    """Return the tape in which each kink has become one of its sides."""
    ops, args, constants = tape.ops.copy(), tape.args.copy(), tape.constants.tolist()
    for kink, side in zip(kinks, sides, strict=True):
        for place in kink.places:
            r = place[0]
            name, inputs, value = place[2] if side else place[1]
            old = tape.args[r].tolist()
            new = [old[-1 - a] for a in inputs]
            if name == "constant":
                new, constants = [len(constants)], [*constants, value]
            elif name.startswith("line"):
                k, start = int(name.split()[1]), old[1] + 1
                (x0, y0), (x1, y1) = tape.constants[start + 2 * k : start + 2 * k + 4].reshape(2, 2)
                # the same line, so long that both of its ends lie within
                long = [2.0, 2 * x0 - x1, 2 * y0 - y1, 2 * x1 - x0, 2 * y1 - y0]
                name, new, constants = "table", [old[0], len(constants)], [*constants, *long]
            ops[r] = CODES[name]
            args[r] = [*new, 0, 0, 0][:3]
    return replace(tape, ops=ops, args=args, constants=np.array(constants, dtype=np.float64))


__all__ = ["Limits", "limits"]
