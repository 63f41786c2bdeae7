"""Integrals of runs that have no closed form, along the polynomials of their steps.

A piece of a run is a polynomial of at most twelve points, and so is the product of two of degree at
most twelve: the formula of Gauss with twelve points is exact for it.  For a harmonic, pieces are
cut where its angle has advanced by one radian: the formula then errs by less than rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..signals.signal_function import Floats, Indices, Motion
from ..signals.signal_names import canonical
from .window_integrals import Complexes, WindowIntegrals

if TYPE_CHECKING:
    from ..solution.solution import Solution

_LEGENDRE, _WEIGHTS = np.polynomial.legendre.leggauss(12)
#: points of Gauss as parts of a cell
_PARTS = 0.5 + 0.5 * _LEGENDRE
_GAUSS = 0.5 * _WEIGHTS
#: cells at a time
_BLOCK = 1 << 14


@dataclass(slots=True)
class RecordedIntegrals(WindowIntegrals):
    """Integrals of signals over a window of a solution, by quadrature of its polynomials.

    Parameters
    ----------
    solution : Solution
        A transient or a periodic orbit that an engine can run once more.
    window : (float, float)
        [s]
    """

    solution: Solution
    window: tuple[float, float]

    @classmethod
    def of(cls, solution: Solution) -> RecordedIntegrals | None:
        """Return the integrals of a solution, None of one that is nothing but rows."""
        if solution.again is None or solution.axis.size < 2:
            return None
        window = float(solution.axis[0]), float(solution.axis[-1])
        return cls(solution, window)

    def over(self, window: tuple[float, float]) -> RecordedIntegrals:
        """Return the integrals over another window [s] of the same run."""
        return RecordedIntegrals(self.solution, window)

    def coefficients(self, names: Sequence[str], orders: Sequence[int]) -> dict[str, Complexes]:
        """Return Fourier coefficients of signals."""
        keys = list(dict.fromkeys(canonical(name) for name in names))
        motion = self.solution.motion(keys, *self.window)
        wanted = 2.0 * np.pi * self.frequency * np.array(orders, dtype=np.float64)
        found = np.zeros((len(keys), wanted.size), complex)
        fastest = float(np.abs(wanted).max(initial=0.0))
        for cells in _Cells.of(motion, self.window, fastest).blocks(max(wanted.size, 1)):
            signals, length = cells.values(motion), self.window[1] - self.window[0]
            angle = (cells.instants(motion) - self.window[0])[..., np.newaxis] * wanted
            turned = np.exp(-1j * angle) * (cells.weights(motion) / length)[..., np.newaxis]
            for k, key in enumerate(keys):
                found[k] += np.einsum("kp,kpo->o", signals[key], turned)
        return dict(zip(keys, found, strict=True))

    def product(self, one: str, two: str) -> float:
        """Return the average of the product of two signals."""
        return self.averages([(one, two)])[0]

    def powers(self, elements: Sequence[str]) -> list[float]:
        """Return the average powers [W] that elements take."""
        return self.averages([(f"p({name})", None) for name in elements])

    def squares(self, names: Sequence[str]) -> list[float]:
        """Return the mean squares of voltages and currents."""
        return self.averages([(name, name) for name in names])

    def averages(self, factors: Sequence[tuple[str, str | None]]) -> list[float]:
        """Return the averages of signals, and of products of two, from one recording."""
        pairs = [(canonical(one), two and canonical(two)) for one, two in factors]
        names = list(dict.fromkeys(name for pair in pairs for name in pair if name))
        motion = self.solution.motion(names, *self.window)
        found = np.zeros(len(pairs))
        for cells in _Cells.of(motion, self.window, 0.0).blocks(1):
            signals, weights = cells.values(motion), cells.weights(motion)
            for k, (one, two) in enumerate(pairs):
                values = signals[one] if two is None else signals[one] * signals[two]
                found[k] += float(np.vdot(weights, values))
        return [float(v) for v in found / (self.window[1] - self.window[0])]


@dataclass(frozen=True, slots=True)
class _Cells:
    """Parts of pieces, from ``low`` to ``high`` of the pieces ``index``: each shape (k,)."""

    index: Indices
    low: Floats
    high: Floats

    @classmethod
    def of(cls, motion: Motion, window: tuple[float, float], fastest: float) -> _Cells:
        """Return what lies in a window, in cells of at most a radian at ``fastest`` [1/s]."""
        pieces = motion.pieces
        index = np.flatnonzero((pieces.length > 0.0) & (pieces.end > window[0])
                               & (pieces.begin < window[1]))  # fmt: skip
        begin, length = pieces.begin[index], pieces.length[index]
        low = np.clip((window[0] - begin) / length, 0.0, 1.0)
        high = np.clip((window[1] - begin) / length, 0.0, 1.0)
        count = np.ceil((high - low) * length * fastest).astype(np.intp)
        count = np.maximum(count, 1)
        cell = np.repeat(np.arange(index.size), count)
        place = np.arange(cell.size) - np.repeat(np.cumsum(count) - count, count)
        width = ((high - low) / count)[cell]
        return cls(index[cell], low[cell] + width * place, low[cell] + width * (place + 1))

    def blocks(self, wide: int) -> Sequence[_Cells]:
        """Return the cells in blocks, fewer the more numbers each point has."""
        size = max(_BLOCK // wide, 1)
        return [
            _Cells(self.index[part], self.low[part], self.high[part])
            for part in (slice(k, k + size) for k in range(0, self.index.size, size))
        ]

    def parts(self) -> Floats:
        """Return the points of Gauss as parts of the pieces, shape (k, 12)."""
        return np.asarray(self.low[:, None] + (self.high - self.low)[:, None] * _PARTS)

    def values(self, motion: Motion) -> dict[str, Floats]:
        """Return the signals at the points of Gauss, shape (k, 12) each."""
        return motion.signals(self.index, self.parts())

    def instants(self, motion: Motion) -> Floats:
        """Return the points of Gauss [s], shape (k, 12)."""
        begin, length = (v[self.index, None] for v in (motion.pieces.begin, motion.pieces.length))
        return np.asarray(begin + self.parts() * length)

    def weights(self, motion: Motion) -> Floats:
        """Return the weights of the points [s], shape (k, 12)."""
        width = (self.high - self.low) * motion.pieces.length[self.index]
        return np.asarray(width[:, None] * _GAUSS)
