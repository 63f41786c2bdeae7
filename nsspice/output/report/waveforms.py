"""Curves for a page: engine points, thinned to exact envelopes where there are too many."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...analyses.signals.signal_names import unit
from ...analyses.solution.plot_points import drawn
from ...analyses.solution.solution import part_of
from ..bode import smooth

if TYPE_CHECKING:
    from ...analyses.solution.solution import Solution

Floats = npt.NDArray[np.float64]

#: points of one signal that a page holds; more are thinned, so that no extreme is lost
POINTS = 40_000
#: bytes of the curves of a page with one run, and with several; base64 makes them a third more
ALONE, TOGETHER = 12_000_000, 820_000
#: signals of each of several runs; fewer where they would leave too few points
_SIGNALS = 12
_LEAST = 1200  # points of a run, for which signals are left out


def curves(
    solution: Solution, wanted: Sequence[str], runs: int = 1, alone: int = ALONE
) -> dict[str, Any]:
    """Return axis and signals as base64 text of little-endian numbers.

    The axis has 8 bytes a number, signals 4: seven digits are more than a screen shows.

    Parameters
    ----------
    solution : Solution
    wanted : sequence of str
        Signals that must not be left out.
    runs : int
        Runs that share the page.
    alone : int
        Largest size of the curves of a single run [bytes].

    Returns
    -------
    dict
        ``axis``, ``points``, ``thinned``, ``left_out`` (a number of signals), and ``signals``, a
        list of ``name``, ``unit`` and ``values``; if thinned also ``mean`` and ``square``, averages
        of signal and square over the interval from each second point to the next.
    """
    names, axis, values, units = _table(solution, wanted, runs)
    room = alone if runs == 1 else TOGETHER // runs
    kept = min(axis.size, POINTS, room // (8 + 8 * max(1, len(names))))
    thin, pairs, averages = thinned(axis, values, max(200, kept))
    signals = []
    for k, name in enumerate(names):
        one = {"name": name, "unit": units[k], "values": encode(pairs[k], "<f4")}
        if averages is not None:
            one |= {"mean": encode(averages[0][k], "<f4"), "square": encode(averages[1][k], "<f4")}
        signals.append(one)
    return {
        "axis": encode(thin, "<f8"),
        "points": int(thin.size),
        "thinned": averages is not None,
        "left_out": max(0, len([n for n in solution.columns if unit(n)]) - len(names)),
        "signals": signals,
    }


def _table(
    solution: Solution, wanted: Sequence[str], runs: int
) -> tuple[list[str], Floats, Floats, list[str]]:
    """Return names, axis, values and units of what is drawn of a run."""
    if solution.axis_name == "frequency":
        return _responses(solution)
    names = [name for name in solution.columns if unit(name)] or list(solution.columns)
    if runs > 1:
        most = max(len(wanted), min(_SIGNALS, (TOGETHER // runs // _LEAST - 8) // 8))
        ordered = [*wanted, *(n for n in names if n not in wanted)]
        names = [n for n in ordered if n in names][:most]
    full = drawn(solution, names)
    values = np.array([full[name] for name in names]) if names else np.zeros((0, full.axis.size))
    return names, full.axis, values, [unit(n) for n in names]


def _responses(solution: Solution) -> tuple[list[str], Floats, Floats, list[str]]:
    """Return decibels and degrees of complex signals, or densities of noise, at f > 0."""
    kept = solution.axis > 0.0
    axis = solution.axis[kept]
    known = [name[3:-1] for name in solution.columns if name.startswith("re(")]
    if not known:
        names = list(solution.columns)
        values = np.array([solution[name][kept] for name in names])
        units = ["A/√Hz" if name == "inoise_current" else "V/√Hz" for name in names]
        return names, axis, values, units
    rows, names, units = [], [], []
    for name in known:
        response = np.asarray(solution[name][kept], dtype=np.complex128)
        if np.any(np.abs(response) > 0.0):  # what does not respond has no decibels
            rows += [np.maximum(part_of(response, "db"), -400.0), part_of(response, "p")]
            names += [name, name]
            units += ["dB", "°"]
    if all(np.isfinite(row).all() for row in rows):  # else curves have no points in common
        through = [smooth(axis, row) for row in rows]
        rows = [row for _, row in through]
        axis = through[0][0] if through else axis
    return names, axis, np.array(rows).reshape(len(rows), axis.size), units


def encode(values: Floats, kind: str) -> str:
    """Return numbers as base64 text.

    Examples
    --------
    >>> encode(np.array([1.0]), "<f4")
    'AACAPw=='
    """
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def thinned(
    axis: Floats, values: Floats, most: int
) -> tuple[Floats, Floats, tuple[Floats, Floats] | None]:
    """Return at most ``most`` columns that keep first, last, lowest and highest of each cell.

    All signals share one axis, so each cell gives two columns, at its ends, which hold the extremes
    of every signal in the order in which they occur.

    Parameters
    ----------
    axis : ndarray, shape (k,)
    values : ndarray, shape (n, k)
    most : int

    Returns
    -------
    axis : ndarray, shape (c,)
    values : ndarray, shape (n, c)
    averages : pair of ndarray, shape (n, c / 2), or None
        Of each signal and of its square from the start of a cell to that of the next, None if
        nothing had to be thinned.

    Examples
    --------
    >>> y = np.zeros((1, 100_000)); y[0, 77_777] = 1.0
    >>> x, z, _ = thinned(np.arange(100_000.0), y, 1000)
    >>> x.size <= 1000, z.max()
    (True, np.float64(1.0))
    """
    count = axis.size
    if count <= most or values.shape[0] == 0:
        return axis, values, None
    size = -(-2 * count // most)
    first = np.arange(0, count, size)
    last = np.minimum(first + size, count) - 1
    low = np.minimum.reduceat(values, first, axis=1)
    high = np.maximum.reduceat(values, first, axis=1)
    rising = values[:, last] >= values[:, first]
    pairs = np.stack([np.where(rising, low, high), np.where(rising, high, low)], axis=2)
    kept = np.stack([axis[first], axis[last]], axis=1)
    return kept.ravel(), pairs.reshape(values.shape[0], -1), _averages(axis, values, first)


def _averages(axis: Floats, values: Floats, first: npt.NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Return the averages of signals and squares in each cell, with lines between the points."""
    length = np.append(np.diff(axis), 0.0)
    following = np.append(values[:, 1:], values[:, -1:], axis=1)
    whole = np.add.reduceat(0.5 * (values + following) * length, first, axis=1)
    squares = (values * values + values * following + following * following) / 3.0
    square = np.add.reduceat(squares * length, first, axis=1)
    width = np.add.reduceat(length, first)
    still = width == 0.0  # both sides of a jump, or the last point alone
    width = np.where(still, 1.0, width)
    alone = values[:, first]
    return (
        np.where(still, alone, whole / width),
        np.where(still, alone * alone, square / width),
    )
