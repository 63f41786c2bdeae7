"""Thinning of long waveforms for pictures, so that no peak is lost."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


def _columns(x: Floats, count: int) -> Indices:
    """Return the first point in each of equal parts of a rising or falling axis that has any.

    Points may be as close as an engine needs them, and far apart elsewhere.
    """
    rising = x if x[-1] >= x[0] else -x
    edges = np.linspace(rising[0], rising[-1], count + 1)[:-1]
    return np.unique(np.searchsorted(rising, edges))


def envelope(x: Floats, y: Floats, columns: int = 2000) -> tuple[Floats, Floats]:
    """Return at most ``4 * columns`` points that draw like the whole curve.

    The axis is cut into equal columns; of each the first, lowest, highest and last point are kept,
    in their order.

    Examples
    --------
    >>> x = np.arange(100000.0)
    >>> y = np.zeros(100000); y[77777] = 1.0
    >>> u, v = envelope(x, y, 100)
    >>> u.size <= 400, v.max()
    (True, np.float64(1.0))
    """
    if x.size <= 4 * columns:
        return x, y
    first = _columns(x, columns)
    size = np.diff(np.append(first, x.size))
    column = np.repeat(np.arange(first.size), size)
    order = np.lexsort((y, column))  # within each column by value
    keep = np.unique(
        np.concatenate([first, first + size - 1, order[first], order[first + size - 1]])
    )
    return x[keep], y[keep]


def band(x: Floats, y: Floats, columns: int = 400) -> tuple[Floats, Floats, Floats] | None:
    """Return the band that a fast oscillation fills, None for a curve that the eye can follow.

    A curve is a band if it swings through a tenth of its whole range within most of ``columns``
    equal parts of the picture: drawn as a line it would be a solid block that hides the others.

    Returns
    -------
    (x, low, high) or None
        Middle, minimum and maximum of each part.

    Examples
    --------
    >>> x = np.linspace(0.0, 1.0, 20001)
    >>> band(x, np.sin(2e4 * x)) is None, band(x, np.sin(20 * x)) is None
    (False, True)
    """
    if x.size < 4 * columns or x[0] == x[-1]:
        return None
    first = _columns(x, columns)
    size = np.diff(np.append(first, x.size))
    if first.size < columns or float(np.median(size)) < 4.0:
        return None
    low, high = np.minimum.reduceat(y, first), np.maximum.reduceat(y, first)
    swings = high - low
    total = float(high.max() - low.min())
    if not float(np.median(swings)) > 0.1 * total > 0.0:
        return None
    middle = np.add.reduceat(x, first) / size
    middle[0], middle[-1] = x[0], x[-1]
    return middle, low, high
