"""Integrals of runs that have no closed form, along the polynomials of their steps.

A piece of a run is a polynomial of at most twelve points, and so is the product of two of degree at
most twelve: the formula of Gauss with twelve points is exact for it.  For a harmonic, pieces are
cut where its angle has advanced by one radian: the formula then errs by less than rounding.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..signals.signal_function import Floats, Motion
from ..signals.signal_names import canonical
from ..signals.signal_statistics import GAUSS_POINTS, GAUSS_WEIGHTS, Cells
from .window_integrals import Complexes, WindowIntegrals

if TYPE_CHECKING:
    from ..solution.solution import Solution

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

    @property
    def _length(self) -> float:
        return self.window[1] - self.window[0]

    def coefficients(self, names: Sequence[str], orders: Sequence[int]) -> dict[str, Complexes]:
        """Return Fourier coefficients of signals."""
        keys = list(dict.fromkeys(canonical(name) for name in names))
        motion = self.solution.motion(keys, *self.window)
        wanted = 2.0 * np.pi * self.frequency * np.array(orders, dtype=np.float64)
        found = np.zeros((len(keys), wanted.size), complex)
        fastest = float(np.abs(wanted).max(initial=0.0))
        cells, length = _cut(Cells.of(motion.pieces, *self.window), motion, fastest), self._length
        for signals, weights in _points(motion, cells, max(wanted.size, 1)):
            angle = (signals[motion.axis] - self.window[0])[..., np.newaxis] * wanted
            turned = np.exp(-1j * angle) * (weights / length)[..., np.newaxis]
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
        for signals, weights in _points(motion, Cells.of(motion.pieces, *self.window), 1):
            for k, (one, two) in enumerate(pairs):
                values = signals[one] if two is None else signals[one] * signals[two]
                found[k] += float(np.vdot(weights, values))
        return [float(v) for v in found / self._length]


def _cut(cells: Cells, motion: Motion, fastest: float) -> Cells:
    """Return the cells in parts of at most a radian at ``fastest`` [1/s]."""
    span = cells.high - cells.low
    count = np.ceil(span * motion.pieces.length[cells.index] * fastest).astype(np.intp)
    count = np.maximum(count, 1)
    cell = np.repeat(np.arange(cells.index.size), count)
    place = np.arange(cell.size) - np.repeat(np.cumsum(count) - count, count)
    low, width = cells.low[cell], (span / count)[cell]
    return Cells(cells.index[cell], low + width * place, low + width * (place + 1))


def _points(motion: Motion, cells: Cells, wide: int) -> Iterator[tuple[dict[str, Floats], Floats]]:
    """Yield signals at the points of Gauss and their weights [s], (k, 12), a block at a time.

    A block has fewer cells the more numbers each point is to have.
    """
    size = max(_BLOCK // wide, 1)
    for first in range(0, cells.index.size, size):
        part = cells.chosen(np.arange(first, min(first + size, cells.index.size)))
        width = (part.high - part.low) * motion.pieces.length[part.index]
        yield motion.signals(part.index, part.at(GAUSS_POINTS)), width[:, None] * GAUSS_WEIGHTS
