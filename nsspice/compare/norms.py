"""Distances between waveforms, exact for the lines that join their rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analyses.signals.curve import Curve, Floats


@dataclass(frozen=True, slots=True)
class Distance:
    """How far two curves lie apart where both are known.

    Parameters
    ----------
    maximum, l1, rms : float
        Largest absolute difference, its mean over the window, and the root of the mean square.
    span : float
        Range of the reference (its largest magnitude if it is constant).
    length : float
        Width of the common window; 0 if the curves have no common abscissa.

    Examples
    --------
    >>> x = np.array([0.0, 1.0])
    >>> distance(Curve(x, np.array([0.0, 1.0])), Curve(x, np.array([1.0, 0.0])))
    Distance(maximum=1.0, l1=0.5, rms=0.5773502691896257, span=1.0, length=1.0)
    """

    maximum: float
    l1: float
    rms: float
    span: float
    length: float

    def by_name(self, norm: str) -> float:
        """Return ``max``, ``l1`` or ``rms``."""
        return {"max": self.maximum, "l1": self.l1, "rms": self.rms}[norm]


def distance(
    curve: Curve, reference: Curve, start: float | None = None, stop: float | None = None
) -> Distance:
    """Return the distance of a curve from a reference over a window.

    The difference is formed on the rows of both, so that no corner of either is missed.
    """
    a, b = curve.window(start, stop), reference.window(start, stop)
    if a.x.size == 0 or b.x.size == 0 or a.x[-1] < b.x[0] or b.x[-1] < a.x[0]:
        nan = float("nan")
        return Distance(nan, nan, nan, nan, 0.0)
    low, high = max(a.x[0], b.x[0]), min(a.x[-1], b.x[-1])
    x = np.union1d(a.x, b.x)
    x = x[(x >= low) & (x <= high)]
    d = np.interp(x, a.x, a.y) - np.interp(x, b.x, b.y)
    if not np.all(np.isfinite(d)):
        d = np.where(np.isfinite(d), d, np.inf)
    maximum = float(np.max(np.abs(d)))
    inside = b.y[(b.x >= low) & (b.x <= high)]
    span = float(np.ptp(inside)) or float(np.max(np.abs(inside), initial=0.0))
    length = float(high - low)
    if length == 0.0:
        return Distance(maximum, maximum, maximum, span, 0.0)
    if not np.isfinite(maximum):
        return Distance(maximum, maximum, maximum, span, length)
    return Distance(maximum, _absolute(x, d) / length, Curve(x, d).rms(), span, length)


def _absolute(x: Floats, d: Floats) -> float:
    """Return the integral of the absolute value of a piecewise-linear curve."""
    h, p, q = np.diff(x), d[:-1], d[1:]
    same = p * q >= 0.0
    size = np.abs(p) + np.abs(q)
    # a line through zero makes two triangles
    area = np.where(same, size / 2.0, (p * p + q * q) / np.where(same, 1.0, 2.0 * size))
    return float(np.dot(h, area))
