"""Thinning of long waveforms for pictures, so that no peak is lost."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Flags = npt.NDArray[np.bool_]

#: parts of the picture that swing are a band if so many are side by side
_TOGETHER = 4
#: what varies by less than this part of its size is a constant with rounding noise
_STILL = 1e-9
#: what a curve covers in a part of the picture, as a multiple of its range there
_THERE_AND_BACK = 1.5


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


class Band(NamedTuple):
    """The part of a curve that oscillates too fast for the eye, and the points of the rest.

    Parameters
    ----------
    x, low, high : ndarray, shape (c,)
        Middle, minimum and maximum of each part of the picture.
    fast : ndarray of bool, shape (c,)
        Which parts are filled.
    slow : ndarray of bool, shape (k,)
        Which points of the curve are drawn as a line.
    """

    x: Floats
    low: Floats
    high: Floats
    fast: Flags
    slow: Flags


def band(x: Floats, y: Floats, columns: int = 200) -> Band | None:
    """Return the band that a fast oscillation fills, None for a curve that the eye can follow.

    A curve has one if within most of ``columns`` equal parts of the picture it swings through a
    tenth of its whole range, there and back: drawn as a line it would be a solid block that hides
    the others.  Where it is calm it stays a line: an oscillation that dies out has a tail.

    Examples
    --------
    >>> x = np.linspace(0.0, 1.0, 20001)
    >>> band(x, np.sin(2e4 * x)) is None, band(x, np.sin(20 * x)) is None
    (False, True)
    >>> found = band(x, np.where(x < 0.7, np.sin(2e4 * x), 0.2))
    >>> x[found.slow].min().round(3), found.x[found.fast].max().round(2)
    (np.float64(0.7), np.float64(0.7))
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
    still = _STILL * max(abs(float(high.max())), abs(float(low.min())))
    way = np.add.reduceat(np.abs(np.diff(y, prepend=y[0])), first)
    busy = (swings > 0.1 * total) & (way > _THERE_AND_BACK * swings)
    if not (float(busy.mean()) > 0.5 and total > still):
        return None
    # what goes there and back is a block, however small
    small = (swings > 0.01 * total) & (way > _THERE_AND_BACK * swings)
    fast = _together((swings > 0.1 * total) | small)
    middle = np.add.reduceat(x, first) / size
    middle[0], middle[-1] = x[0], x[-1]
    slow = ~np.repeat(fast, size)
    # the filled part reaches to the line
    reached = fast | np.append(fast[1:], False) | np.append(False, fast[:-1])
    # a part that is shorter than a period knows only some of the extremes
    low = np.where(fast, _beside(np.minimum, low), low)
    high = np.where(fast, _beside(np.maximum, high), high)
    return Band(middle, low, high, reached, slow)


def _beside(extreme: np.ufunc, values: Floats) -> Floats:
    """Return the extremes of each value and its two neighbours."""
    found: Floats = extreme(values, extreme(np.roll(values, 1), np.roll(values, -1)))
    found[[0, -1]] = extreme(values[[0, -1]], values[[1, -2]])
    return found


def _together(flags: Flags) -> Flags:
    """Return flags with those taken out in short runs: a single edge is not a band."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    kept = np.zeros(flags.size, dtype=bool)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        kept[begin:end] = end - begin >= _TOGETHER
    return kept
