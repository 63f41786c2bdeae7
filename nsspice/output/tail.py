"""The last periods of a run that switches too often for one picture."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution

_OFTEN = 60  # periods that one picture cannot show
_PERIODS = 3
_POINTS = 30  # of a signal in these periods: fewer would be a polygon


def last_periods(solution: Solution) -> tuple[float, float] | None:
    """Return the window of the last periods of the element that switches most often.

    None if all periods can be seen in the whole picture.

    Parameters
    ----------
    solution : Solution
        Of a transient.
    """
    if solution.axis_name != "time" or not len(solution.events):
        return None
    on: dict[str, list[float]] = {}
    for event in solution.events:
        if event.change == "on":
            on.setdefault(event.element, []).append(event.time)
    times = max(on.values(), key=len, default=[])
    end = float(solution.axis[-1])
    # two turn-ons at one instant are not a period
    instants = np.unique(np.array(times))
    if instants.size < _OFTEN or end - instants[-1] > 0.05 * (end - float(solution.axis[0])):
        return None
    period = float(np.median(np.diff(instants[-2 * _PERIODS :])))
    return end - _PERIODS * period, end


def part(solution: Solution, begin: float, end: float) -> Solution | None:
    """Return the points of a window, None if they are too few to draw."""
    first = max(0, int(np.searchsorted(solution.axis, begin)) - 1)
    last = int(np.searchsorted(solution.axis, end, side="right"))
    if last - first < _POINTS:
        return None
    signals = {name: values[first:last] for name, values in solution.signals.items()}
    kept: dict[str, Any] = {"fine": None, "recording": None, "again": None, "more": None}
    return replace(solution, axis=solution.axis[first:last], signals=signals, **kept)
