"""Waveforms for a page: engine points, thinned to exact envelopes where there are too many."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...analyses.signals.signal_names import unit
from ...analyses.solution.plot_points import drawn

if TYPE_CHECKING:
    from ...analyses.solution.solution import Solution

Floats = npt.NDArray[np.float64]

#: points of one signal that a page holds; more are thinned, so that no extreme is lost
POINTS = 40_000
#: numbers of all signals of a page: 4 bytes each
NUMBERS = 4_000_000


def waveforms(solution: Solution) -> dict[str, Any]:
    """Return axis and signals as base64 text of little-endian numbers.

    The axis has 8 bytes a number, signals 4: seven digits are more than a screen shows.

    Parameters
    ----------
    solution : Solution

    Returns
    -------
    dict
        ``axis``, and ``signals``, a list of ``name``, ``unit`` and ``values``.
    """
    names = [name for name in solution.columns if unit(name)]
    full = drawn(solution, names)
    most = max(2000, min(POINTS, NUMBERS // max(1, len(names))))
    values = np.array([full[name] for name in names]) if names else np.zeros((0, full.axis.size))
    axis, values = thinned(full.axis, values, most)
    return {
        "axis": encode(axis, "<f8"),
        "points": int(axis.size),
        "thinned": bool(axis.size < full.axis.size),
        "signals": [
            {"name": name, "unit": unit(name), "values": encode(row, "<f4")}
            for name, row in zip(names, values, strict=True)
        ],
    }


def encode(values: Floats, kind: str) -> str:
    """Return numbers as base64 text.

    Examples
    --------
    >>> encode(np.array([1.0]), "<f4")
    'AACAPw=='
    """
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def thinned(axis: Floats, values: Floats, most: int) -> tuple[Floats, Floats]:
    """Return at most ``most`` columns that keep first, last, lowest and highest of each cell.

    All signals share one axis, so each cell gives two columns, at its ends, which hold the extremes
    of every signal in the order in which they occur.

    Parameters
    ----------
    axis : ndarray, shape (k,)
    values : ndarray, shape (n, k)
    most : int

    Examples
    --------
    >>> y = np.zeros((1, 100_000)); y[0, 77_777] = 1.0
    >>> x, z = thinned(np.arange(100_000.0), y, 1000)
    >>> x.size <= 1000, z.max()
    (True, np.float64(1.0))
    """
    count = axis.size
    if count <= most or values.shape[0] == 0:
        return axis, values
    size = -(-2 * count // most)
    first = np.arange(0, count, size)
    last = np.minimum(first + size, count) - 1
    low = np.minimum.reduceat(values, first, axis=1)
    high = np.maximum.reduceat(values, first, axis=1)
    rising = values[:, last] >= values[:, first]
    pairs = np.stack([np.where(rising, low, high), np.where(rising, high, low)], axis=2)
    kept = np.stack([axis[first], axis[last]], axis=1)
    return kept.ravel(), pairs.reshape(values.shape[0], -1)
