"""Thin strips of a picture: gates, and which element conducts when."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..analyses.signals.events import Events

if TYPE_CHECKING:
    from ..analyses.solution.solution import Floats, Solution

#: rows of a picture; the rest is counted in a line
MOST = 12
_COLUMNS = 700  # of a strip, a little more than a pixel each, so that none is left out
_FAINTEST = 0.3  # what is on for a moment is seen
_COARSE = 100  # of one that changes more often than the eye can follow: shares of many periods
_DENSE = 300  # changes of such a strip
_NEAR = 0.05  # part of the range within which a value is one of two levels
_OFTEN = 0.9  # part of the time that a logic signal spends there
GATE, CONDUCTS = (0.27, 0.27, 0.27), (0.0, 0.447, 0.698)


class Strip(NamedTuple):
    """A row: its name, how much of each column it is on, and its colour."""

    name: str
    shares: Floats
    colour: tuple[float, float, float]


def on_shares(times: Floats, on: Floats, edges: Floats) -> Floats:
    """Return the part of each cell between two edges during which something is on.

    Parameters
    ----------
    times : ndarray, shape (k + 1,)
        Bounds of the states, in order [s].
    on : ndarray, shape (k,)
        1 or 0 between two of them.
    edges : ndarray, shape (c + 1,)
        [s]

    Examples
    --------
    >>> on_shares(np.array([0.0, 1.5, 4.0]), np.array([1.0, 0.0]), np.arange(5.0)).tolist()
    [1.0, 0.5, 0.0, 0.0]
    """
    total = np.concatenate([[0.0], np.cumsum(on * np.diff(times))])
    shares: Floats = np.clip(np.diff(np.interp(edges, times, total)) / np.diff(edges), 0.0, 1.0)
    return shares


def conducting(solution: Solution, begin: float, end: float) -> list[Strip]:
    """Return a strip for each element that changes its state, in the order of their names."""
    events = solution.events
    if not len(events) or solution.axis_name != "time" or not end > begin:
        return []
    if not isinstance(events, Events):
        names = list(dict.fromkeys(e.element for e in events))
        numbers = np.array([names.index(e.element) for e in events], dtype=np.uintp)
        times = np.array([e.time for e in events])
        events = Events(times, numbers, np.array([e.change == "on" for e in events]), names)
    strips = []
    for k, name in enumerate(events.names):
        mine = events.numbers == k
        on = events.on[mine].astype(np.float64)
        if on.size:
            times = np.clip(events.times[mine], begin, end)
            bounds = np.concatenate([[begin], times, [end]])
            states = np.concatenate([[1.0 - on[0]], on])
            inside = np.count_nonzero((times > begin) & (times < end))
            edges = _cells(begin, end, int(inside))
            strips.append(Strip(name, on_shares(bounds, states, edges), CONDUCTS))
    return strips


def logic(solution: Solution, names: Sequence[str]) -> list[Strip]:
    """Return strips of the signals that have two levels; of others nothing."""
    x = solution.axis
    strips = []
    for name in names:
        y = solution[name]
        low, high = float(y.min()), float(y.max())
        near = np.minimum(y - low, high - y) < _NEAR * (high - low)
        length = np.diff(x)
        between = 0.5 * (y[:-1] + y[1:])
        settled = float(length[near[:-1] & near[1:]].sum())
        if high > low and settled > _OFTEN * float(x[-1] - x[0]):
            on = (between > 0.5 * (low + high)).astype(np.float64)
            edges = _cells(float(x[0]), float(x[-1]), int(np.count_nonzero(np.diff(on))))
            strips.append(Strip(name, on_shares(x, on, edges), GATE))
    return strips


def _cells(begin: float, end: float, changes: int) -> Floats:
    """Return the bounds of the cells of a strip."""
    return np.linspace(begin, end, 1 + (_COARSE if changes > _DENSE else _COLUMNS))


def draw_strips(panel: Any, strips: Sequence[Strip], begin: float, end: float) -> None:
    """Draw rows below each other: filled where they are on, paler where they are so for a while."""
    for row, strip in enumerate(strips):
        colours = np.ones((1, strip.shares.size, 4))
        colours[0, :, :3] = strip.colour
        seen = np.where(strip.shares > 0.0, np.maximum(strip.shares, _FAINTEST), 0.0)
        colours[0, :, 3] = seen * (0.85 if strip.colour == CONDUCTS else 1.0)
        extent = (begin, end, row + 0.36, row - 0.36)
        panel.imshow(colours, extent=extent, aspect="auto", interpolation="nearest")
        panel.axhline(row + 0.36, color="0.8", linewidth=0.6, zorder=0.5)
    panel.set_ylim(len(strips) - 0.4, -0.6)
    panel.set_yticks(range(len(strips)), [s.name for s in strips], fontsize="small")
    panel.tick_params(left=False, bottom=False)
    panel.spines[["top", "right", "left", "bottom"]].set_visible(False)
