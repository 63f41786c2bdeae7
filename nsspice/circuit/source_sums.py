"""Sums of source waveforms, for the question whether sources cancel at all times."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ..problems.descriptor import Waveform


def constant_value(waveform: Waveform) -> float | None:
    """Return the value of a waveform that never changes, else None.

    Examples
    --------
    >>> constant_value(Waveform("pwl", (0.0, 5.0, 1.0, 5.0)))
    5.0
    """
    v = waveform.values
    level: float | None = None
    if waveform.kind == "dc" or (waveform.kind == "pulse" and v[0] == v[1]):
        level = v[0]
    elif waveform.kind == "pwl" and len(set(v[1::2])) == 1:
        level = v[1]
    elif (waveform.kind == "sin" and v[1] == 0.0) or (waveform.kind == "exp" and v[0] == v[1]):
        level = v[0]
    return None if level is None else level * waveform.scale


def _normal(waveform: Waveform) -> tuple[float, float, tuple[object, ...]]:
    """Return a waveform as offset plus amplitude times a shape, so that equal shapes cancel."""
    v, scale, kind = waveform.values, waveform.scale, waveform.kind
    if kind in ("sin", "sffm"):
        return v[0] * scale, v[1] * scale, (kind, v[2:])
    if kind in ("pulse", "exp"):
        return v[0] * scale, (v[1] - v[0]) * scale, (kind, v[2:])
    if kind == "am":
        return 0.0, v[0] * scale, (kind, v[1:])
    return 0.0, scale, (kind, v, repr(waveform.repeat))


@dataclass(slots=True)
class WaveSum:
    """A linear combination of waveforms: a constant plus multiples of varying ones.

    Examples
    --------
    >>> total = WaveSum()
    >>> total.add(Waveform("dc", (5.0,)), 1.0)
    >>> total.add(Waveform("dc", (3.0,)), -1.0)
    >>> total.vanishes(), str(total)
    (False, '2')
    """

    constant: float = 0.0
    size: float = 0.0
    varying: dict[tuple[object, ...], float] = field(default_factory=dict)
    known: bool = True

    def add(self, waveform: Waveform | None, factor: float) -> None:
        """Add a multiple of a waveform; None is one whose value is not known."""
        if waveform is None:
            self.known = False
            return
        level = constant_value(waveform)
        if level is not None:
            self.constant += factor * level
            self.size = max(self.size, abs(factor * level))
            return
        offset, amplitude, shape = _normal(waveform)
        self.constant += factor * offset
        self.size = max(self.size, abs(factor * offset), abs(factor * amplitude))
        self.varying[shape] = self.varying.get(shape, 0.0) + factor * amplitude

    def merge(self, other: WaveSum, factor: float) -> None:
        """Add a multiple of another sum."""
        self.constant += factor * other.constant
        self.size = max(self.size, abs(factor) * other.size)
        self.known = self.known and other.known
        for key, value in other.varying.items():
            self.varying[key] = self.varying.get(key, 0.0) + factor * value

    def vanishes(self) -> bool:
        """Return whether the sum is zero at all times, up to rounding (True if not known)."""
        if not self.known:
            return True
        return abs(self.constant) <= 1e-12 * self.size and all(
            abs(value) <= 1e-12 * self.size for value in self.varying.values()
        )

    def __str__(self) -> str:
        tiny = 1e-12 * self.size
        parts = [str(key[0]) for key, value in self.varying.items() if abs(value) > tiny]
        constant = 0.0 if math.isclose(self.constant, 0.0) else self.constant
        if constant or not parts:
            parts.insert(0, f"{constant:g}")
        return " + ".join(parts)
