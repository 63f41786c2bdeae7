"""Piecewise-linear curves through the rows of a solution: values, windows, integrals, crossings.

Between two rows a waveform is the straight line that joins them; integrals of that line, and of its
square, are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Edge = Literal["rise", "fall", "cross"]


@dataclass(frozen=True, slots=True)
class Curve:
    """A curve y(x) given at rising or falling x (a falling sweep is turned round).

    Examples
    --------
    >>> c = Curve.of(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 0.0]))
    >>> c.at(2.0), c.integral(), c.crossings(1.0, "fall").tolist()
    (1.0, 3.0, [2.0])
    """

    x: Floats
    y: Floats

    @classmethod
    def of(cls, x: Floats, y: Floats) -> Curve:
        """Return the curve through the points; a scalar y is a constant."""
        y = np.broadcast_to(np.asarray(y, dtype=np.float64), x.shape)
        if x.size > 1 and x[-1] < x[0]:
            x, y = x[::-1], y[::-1]
        return cls(x, y)

    def at(self, x: float) -> float:
        """Return y at x, nan outside the curve."""
        if self.x.size == 0:
            return float("nan")
        slack = 1e-12 * max(abs(float(self.x[0])), abs(float(self.x[-1])))
        if not self.x[0] - slack <= x <= self.x[-1] + slack:
            return float("nan")
        return float(np.interp(x, self.x, self.y))

    def window(self, start: float | None, stop: float | None) -> Curve:
        """Return the part between two abscissae, ends interpolated."""
        if self.x.size == 0:
            return self
        low = float(self.x[0]) if start is None else max(start, float(self.x[0]))
        high = float(self.x[-1]) if stop is None else min(stop, float(self.x[-1]))
        if low > high:
            return Curve(self.x[:0], self.y[:0])
        first = int(np.searchsorted(self.x, low, "left"))
        if start is not None:  # of a jump at the start only the side that lies in the window
            first = max(first, int(np.searchsorted(self.x, low, "right")) - 1)
        last = int(np.searchsorted(self.x, high, "right"))
        x, y = self.x[first:last], self.y[first:last]
        if x.size == 0 or x[0] > low:
            x, y = np.append(low, x), np.append(self.at(low), y)
        if x[-1] < high:
            x, y = np.append(x, high), np.append(y, self.at(high))
        return Curve(x, y)

    @property
    def length(self) -> float:
        """Width of the abscissa."""
        return float(self.x[-1] - self.x[0]) if self.x.size else 0.0

    def integral(self) -> float:
        """Return the integral of y."""
        return float(np.dot(np.diff(self.x), self.y[1:] + self.y[:-1]) / 2.0)

    def mean(self) -> float:
        """Return integral / length; the value itself for a single point."""
        if self.x.size == 0:
            return float("nan")
        return self.integral() / self.length if self.length > 0.0 else float(self.y[0])

    def rms(self) -> float:
        """Return the root of the mean square."""
        if self.x.size == 0:
            return float("nan")
        if self.length == 0.0:
            return abs(float(self.y[0]))
        a, b = self.y[:-1], self.y[1:]
        return float(np.sqrt(np.dot(np.diff(self.x), a * a + a * b + b * b) / 3.0 / self.length))

    def slope(self, x: float) -> float:
        """Return the slope of the line at x; at a row the mean of both sides' slopes."""
        if self.x.size < 2 or np.isnan(self.at(x)):
            return float("nan")
        tiny = 1e-9 * self.length / self.x.size
        left = int(np.searchsorted(self.x, x - tiny, "right")) - 1
        right = int(np.searchsorted(self.x, x + tiny, "right")) - 1
        pieces = []
        for k in (left, right):
            j = min(max(k, 0), self.x.size - 2)
            width = self.x[j + 1] - self.x[j]
            if width > 0.0:
                pieces.append(float((self.y[j + 1] - self.y[j]) / width))
        return float(np.mean(pieces)) if pieces else float("nan")

    def crossings(self, level: float, edge: Edge = "cross") -> Floats:
        """Return the abscissae where y passes ``level``.

        A rise goes from below to at or above the level, a fall from above to at or below it.
        """
        s = self.y - level
        before, after = s[:-1], s[1:]
        rising = (before < 0.0) & (after >= 0.0)
        falling = (before > 0.0) & (after <= 0.0)
        chosen = {"rise": rising, "fall": falling, "cross": rising | falling}[edge]
        k = np.flatnonzero(chosen)
        return self.x[k] + (self.x[k + 1] - self.x[k]) * (before[k] / (before[k] - after[k]))
