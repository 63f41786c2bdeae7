"""Thinning of long waveforms for pictures, so that no peak is lost."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def envelope(x: Floats, y: Floats, columns: int = 2000) -> tuple[Floats, Floats]:
    """Return at most ``4 * columns`` points that draw like the whole curve.

    The axis is cut into columns of equally many rows; of each the first, lowest, highest and last
    row are kept, in their order.

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
    size = -(-x.size // columns)
    full = x.size // size
    blocks = y[: full * size].reshape(full, size)
    base = np.arange(full) * size
    picks = [base, base + blocks.argmin(axis=1), base + blocks.argmax(axis=1), base + size - 1]
    if full * size < x.size:
        tail = y[full * size :]
        start = full * size
        picks.append(np.array([start, start + tail.argmin(), start + tail.argmax(), x.size - 1]))
    keep = np.unique(np.concatenate(picks))
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
    size = x.size // columns
    if size < 4:
        return None
    blocks = y[: columns * size].reshape(columns, size)
    low, high = blocks.min(axis=1), blocks.max(axis=1)
    swings = high - low
    total = float(high.max() - low.min())
    if not float(np.median(swings)) > 0.1 * total > 0.0:
        return None
    middle = x[: columns * size].reshape(columns, size).mean(axis=1)
    middle[0], middle[-1] = x[0], x[-1]
    return middle, low, high
