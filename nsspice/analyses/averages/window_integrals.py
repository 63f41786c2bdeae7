"""What can be asked of a run's integrals over a window, however they are computed."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..signals.signal_names import canonical

Complexes = npt.NDArray[np.complex128]


class NoClosedForm(Exception):
    """A run is not one of closed forms throughout; the text says why."""


class WindowIntegrals(ABC):
    """Integrals of the signals of a circuit over a window.

    Parameters
    ----------
    window : (float, float)
        [s]; of a periodic steady state one period.
    """

    window: tuple[float, float]

    @property
    def frequency(self) -> float:
        """One over the length of the window [Hz]."""
        return 1.0 / (self.window[1] - self.window[0])

    @abstractmethod
    def over(self, window: tuple[float, float]) -> WindowIntegrals:
        """Return the integrals over another window [s] of the same run."""

    @abstractmethod
    def coefficients(self, names: Sequence[str], orders: Sequence[int]) -> dict[str, Complexes]:
        """Return Fourier coefficients ``1/T int e^(-i n w (t - t0)) y dt`` of signals.

        Parameters
        ----------
        names : sequence of str
            Voltages and currents.
        orders : sequence of int
            Multiples of the window's own frequency.
        """

    @abstractmethod
    def product(self, one: str, two: str) -> float:
        """Return the average of the product of two signals.

        Raises
        ------
        ValueError
            If it is not known.
        """

    @abstractmethod
    def powers(self, elements: Sequence[str]) -> list[float]:
        """Return the average powers [W] that elements take."""

    def mean(self, name: str) -> float:
        """Return the average of a signal; of a power ``p(r1)`` that of the product."""
        key = canonical(name)
        if key.startswith("p("):
            return self.powers([key[2:-1]])[0]
        return float(self.coefficients([key], [0])[key][0].real)

    def squares(self, names: Sequence[str]) -> list[float]:
        """Return the mean squares of voltages and currents."""
        return [self.product(name, name) for name in names]

    def rms(self, name: str) -> float:
        """Return the root of the mean square of a voltage or current."""
        return math.sqrt(max(self.product(name, name), 0.0))

    def distortion(self, name: str, order: int = 1) -> float:
        """Return the total harmonic distortion and the harmonic of an order, all others counted.

        It is the root of the power of all harmonics but this one and the mean, over that of this
        one.
        """
        key = canonical(name)
        mean, first = self.coefficients([key], [0, order])[key]
        own = 2.0 * abs(first) ** 2
        rest = self.product(key, key) - abs(mean) ** 2 - own
        return math.sqrt(max(rest, 0.0) / own) if own > 0.0 else math.nan
