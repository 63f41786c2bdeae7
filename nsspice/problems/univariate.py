"""Bounds of the slope of a function of one quantity, by interval arithmetic on its instructions.

A law such as ``if(i < 0, 8*i, 2 + 3*i - 4.5*i^2 + 1.75*i^3)`` is a function of one quantity x.  The
line of all x is cut at its kinks and refined between them; on each piece values and slopes are
enclosed (R. E. Moore, *Interval Analysis*, 1966).  A law that jumps has slopes without bound there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from .csc import Floats
from .enclosure import INF, Enclosure, enclosed
from .tape import OPS, WITH_CONSTANTS, Tape

_NONE = np.zeros(0)
_PIECES = 2048  # pieces of a bounded interval between kinks
_OCTAVES = 64  # pieces of an unbounded one, each twice as long as the one before
#: enclosures are widened by so much for the rounding of their ends: 2^13 operations of u each
_ROUNDING = 2.0**-40
_NAMES = list(OPS)
_COMPARISONS: dict[str, Callable[[Floats], npt.NDArray[np.bool_]]] = {
    "lt": lambda d: d < 0.0,
    "le": lambda d: d <= 0.0,
    "gt": lambda d: d > 0.0,
    "ge": lambda d: d >= 0.0,
    "eq": lambda d: d == 0.0,
    "ne": lambda d: d != 0.0,
}


class Unbounded(Exception):
    """An instruction has no enclosure here."""


def _constant(value: float, like: Floats) -> Enclosure:
    return Enclosure.of(np.full(like.shape, value))


@dataclass(slots=True)
class Law:
    """A register of a tape as a function of one quantity x.

    Parameters
    ----------
    tape : Tape
    affine : mapping of int to (float, float)
        Registers that are ``factor x + offset``, constants among them.
    """

    tape: Tape
    affine: Mapping[int, tuple[float, float]]
    _known: dict[int, tuple[Enclosure, Enclosure]] = field(default_factory=dict)

    def slope_bounds(self, register: int) -> tuple[float, float] | None:
        """Return bounds of the slope over all x, None where none are known."""
        kinks = sorted({k for k in self._kinks(register) if np.isfinite(k)})
        if not kinks:
            kinks = [0.0]
        try:
            return self._over_all(register, np.array(kinks))
        except Unbounded:
            return None

    def value(self, register: int) -> float | None:
        """Return the value of a register that is the same for all x, None if it is not known."""
        one = np.zeros(1)
        try:
            value, _ = self._evaluated(register, one, one, one)
        except Unbounded:
            return None
        middle = 0.5 * float(value.low[0] + value.high[0])
        return middle if np.isfinite(middle) else None

    def _over_all(self, register: int, kinks: Floats) -> tuple[float, float]:
        scale = max(float(np.abs(kinks).max()), 1.0)
        octaves = scale * 2.0 ** np.arange(_OCTAVES)
        inner = [np.linspace(a, b, _PIECES + 1)[:-1] for a, b in pairwise(kinks)]
        ends = np.concatenate(
            [[-INF], (kinks[0] - octaves)[::-1], *inner, [kinks[-1]], kinks[-1] + octaves, [INF]]
        )
        low, high = ends[:-1], ends[1:]
        inside = np.where(
            np.isinf(low), high - scale, np.where(np.isinf(high), low + scale, 0.5 * (low + high))
        )
        with np.errstate(all="ignore"):
            _, slope = self._evaluated(register, low, high, inside)
            least, most = float(slope.low.min()), float(slope.high.max())
            # both sides of each kink have to meet, else the law jumps up or down there
            places = np.searchsorted(ends, kinks)
            left, _ = self._evaluated(register, kinks, kinks, inside[places - 1])
            right, _ = self._evaluated(register, kinks, kinks, inside[places])
        gap = right - left
        size = np.maximum(left.size().high, right.size().high)
        if np.any(gap.high > _ROUNDING * size):
            most = INF
        if np.any(gap.low < -_ROUNDING * size):
            least = -INF
        return least - _ROUNDING * abs(least), most + _ROUNDING * abs(most)

    def _evaluated(
        self, register: int, low: Floats, high: Floats, inside: Floats
    ) -> tuple[Enclosure, Enclosure]:
        """Return enclosures of value and slope on pieces; `inside` says on which side of kinks."""
        self._known.clear()
        with np.errstate(all="ignore"):
            return self._at(register, Enclosure(low, high), inside)

    def _at(self, r: int, x: Enclosure, inside: Floats) -> tuple[Enclosure, Enclosure]:
        if r not in self._known:
            self._known[r] = self._compute(r, x, inside)
        return self._known[r]

    def _compute(self, r: int, x: Enclosure, inside: Floats) -> tuple[Enclosure, Enclosure]:
        if r in self.affine:
            factor, offset = self.affine[r]
            slope = _constant(factor, x.low)
            return x * slope + _constant(offset, x.low), slope
        name, args = _NAMES[int(self.tape.ops[r])], self.tape.args[r].tolist()
        zero = _constant(0.0, x.low)
        if name in _COMPARISONS:
            held = _COMPARISONS[name](self._sample(args[0], inside) - self._sample(args[1], inside))
            return _truth(held), zero
        if name in ("and", "or", "not"):
            parts = [self._at(a, x, inside)[0].low != 0.0 for a in args[: OPS[name]]]
            held = (
                ~parts[0]
                if name == "not"
                else parts[0] & parts[1]
                if name == "and"
                else parts[0] | parts[1]
            )
            return _truth(held), zero
        if name == "if":
            held = self._at(args[0], x, inside)[0].low != 0.0
            (v, dv), (w, dw) = (
                self._branch(a, x, inside, held == (k == 0)) for k, a in enumerate(args[1:])
            )
            return v.where(held, w), dv.where(held, dw)
        parts = [self._at(a, x, inside) for a in args[: OPS[name]]]
        if name in ("min", "max", "abs", "uramp", "u2"):
            return self._kinked(name, args, parts, inside)
        (v, dv), (w, dw) = parts[0], parts[-1]
        if name == "mul" and args[0] == args[1]:
            return v.square(), (v + v) * dv
        if name in ("pow", "pwr") and len(parts) == 2 and np.any(dw.high):
            raise Unbounded("an exponent that varies")
        constants = self.tape.constants[args[1] :] if name in WITH_CONSTANTS else _NONE
        found = enclosed(name, [value for value, _ in parts], constants)
        if found is None:
            raise Unbounded(name)
        value, partials = found
        if name == "div":  # what both slopes share is taken once
            return value, (dv - value * dw) * partials[0]
        slope = zero
        for partial, (_, inner) in zip(partials, parts, strict=True):
            slope = slope + partial * inner
        return value, slope

    def _branch(
        self, r: int, x: Enclosure, inside: Floats, wanted: npt.NDArray[np.bool_]
    ) -> tuple[Enclosure, Enclosure]:
        """Return a branch of a conditional, which counts only where it is taken."""
        if not wanted.any():
            zero = _constant(0.0, x.low)
            return zero, zero
        return self._at(r, x, inside)

    def _sample(self, r: int, inside: Floats) -> Floats:
        """Return an affine register inside of each piece, where its sign is that of the piece."""
        if r not in self.affine:
            raise Unbounded("a comparison of curves")
        factor, offset = self.affine[r]
        return factor * inside + offset

    def _kinked(
        self,
        name: str,
        args: list[int],
        parts: list[tuple[Enclosure, Enclosure]],
        inside: Floats,
    ) -> tuple[Enclosure, Enclosure]:
        """Minimum, maximum and what is made of them."""
        v, dv = parts[0]
        zero = _constant(0.0, v.low)
        if name == "u2":
            below, above = v.high <= 0.0, v.low >= 1.0
            if args[0] in self.affine:
                s = self._sample(args[0], inside)
                below, above = s < 0.0, s > 1.0
            inner = v.rising(lambda a: np.clip(a, 0.0, 1.0))
            slope = Enclosure.hull(zero.low, dv.low, dv.high)
            if args[0] in self.affine:
                slope = dv
            return inner, zero.where(below | above, slope)
        other = parts[1] if len(parts) == 2 else (zero, zero)
        if name == "abs":
            other = (-v, -dv)
        w, dw = other
        pick = np.minimum if name == "min" else np.maximum
        value = Enclosure(pick(v.low, w.low), pick(v.high, w.high))
        second = args[1] if len(parts) == 2 else None
        if args[0] in self.affine and (second is None or second in self.affine):
            a = self._sample(args[0], inside)
            b = (
                -a
                if name == "abs"
                else self._sample(second, inside)
                if second is not None
                else 0.0 * a
            )
            first = (a <= b) if name == "min" else (a >= b)
            return v.where(first, w), dv.where(first, dw)
        first, last = (v.high <= w.low, w.high <= v.low)
        if name != "min":
            first, last = last, first
        both = Enclosure.hull(dv.low, dv.high, dw.low, dw.high)
        return value, dv.where(first, dw.where(last, both))

    def _kinks(self, register: int) -> set[float]:
        """Return where the instructions below a register have kinks, as far as these are affine."""
        found: set[float] = set()
        waiting, seen = [register], set()
        while waiting:
            r = waiting.pop()
            if r in seen or r in self.affine:
                continue
            seen.add(r)
            name, args = _NAMES[int(self.tape.ops[r])], self.tape.args[r].tolist()
            inputs = args[: OPS[name]]
            waiting += inputs
            if not all(a in self.affine for a in inputs):
                continue
            levels: tuple[float, ...] = ()
            if name in _COMPARISONS or name in ("min", "max"):
                (f, a), (g, b) = (self.affine[k] for k in inputs)
                if f != g:
                    found.add((b - a) / (f - g))
            elif name in ("abs", "uramp", "pwr"):
                levels = (0.0,)
            elif name == "u2":
                levels = (0.0, 1.0)
            factor, offset = self.affine[inputs[0]] if inputs else (0.0, 0.0)
            if factor != 0.0:
                found |= {(level - offset) / factor for level in levels}
        return found


def _truth(held: npt.NDArray[np.bool_]) -> Enclosure:
    values = held.astype(np.float64)
    return Enclosure(values, values)


__all__ = ["Law", "Unbounded"]
