"""What a picture shows, and in which panels: signals of one unit that can be seen together."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..analyses.signals.signal_names import unit

if TYPE_CHECKING:
    from ..analyses.solution.solution import Floats, Solution

#: more curves than this are a picture of the whole, in one panel
CROWD = 12
_PANELS = 8  # panels of signals without a unit
_STILL = 1e-9  # part of a peak: a millionth of a pixel
_SCALE = 25.0  # a signal that swings through less than this part of a panel is a flat line in it
_SCALES = 3  # panels of one unit at most
_MOST = 4  # signals of one unit in a picture for which nobody has chosen


def chosen(
    solution: Solution, columns: Sequence[str | Sequence[str]] | None
) -> tuple[list[str | Sequence[str]], Sequence[str]]:
    """Return what is drawn, and which of the signals are gates."""
    if columns is not None:
        return list(columns), ()
    view = solution.view
    if view is not None and solution.axis_name == "time" and view.shown:
        return list(view.shown), view.gates
    shown: list[str | Sequence[str]] = list(solution.columns if view is None else view.shown)
    # of a circuit what has a unit; other systems have none, and a panel for each signal
    return [name for name in shown if unit(str(name))] or list(solution.columns), ()


def flat(columns: Sequence[str | Sequence[str]]) -> list[str]:
    """Return the names of signals and of groups of signals in one list."""
    return [n for item in columns for n in ([item] if isinstance(item, str) else item)]


def default_shown(solution: Solution, most: int = _MOST) -> list[str]:
    """Return the signals of a default picture that change, at most ``most`` of a unit."""
    all_ = flat(chosen(solution, None)[0])
    moving = [n for n in all_ if moves(solution[n])]
    units = {unit(n) for n in moving}
    # an output that does not move is shown if nothing else has its unit
    still = [n for n in all_ if "out" in n and unit(n) not in units]
    found = [n for n in all_ if n in moving or n in still] or all_
    return [n for k, n in enumerate(found) if [unit(m) for m in found[:k]].count(unit(n)) < most]


def panels_of(
    solution: Solution, names: Sequence[str | Sequence[str]]
) -> list[tuple[str, list[str]]]:
    """Return the signals of each panel with their unit: one panel for each unit and scale.

    A group of names is a panel as it is.  Signals that would be flat next to larger ones of the
    same unit have a panel of their own.
    """
    panels: list[tuple[str, list[str]]] = []
    loose = [n for n in names if isinstance(n, str)]
    for group in names:
        if not isinstance(group, str):
            units = {unit(n) for n in group}
            panels.append((units.pop() if len(units) == 1 else "", list(group)))
    for symbol in ("V", "A", "W"):
        members = [n for n in loose if unit(n) == symbol]
        panels += [(symbol, part) for part in _by_scale(solution, members)]
    panels += [("", [n]) for n in loose[:_PANELS] if not unit(n)]
    return panels


def _by_scale(solution: Solution, members: list[str]) -> list[list[str]]:
    """Return signals in groups in which each can be seen to move, the largest swing first.

    A constant joins a panel whose range contains its value.
    """
    if len(members) > CROWD or len(members) < 2:
        return [members] if members else []
    ends = {name: limits(solution[name]) for name in members}
    swing = {name: ends[name][1] - ends[name][0] for name in members}
    groups: list[list[str]] = []
    for name in sorted(members, key=lambda n: -swing[n]):
        still = not moves(solution[name])
        for group in groups:
            low = min(ends[n][0] for n in (*group, name))
            high = max(ends[n][1] for n in (*group, name))
            least = min((swing[n] for n in group if moves(solution[n])), default=0.0)
            if not still:
                least = min(least, swing[name])
            within = min(ends[n][0] for n in group) <= ends[name][0]
            within = within and ends[name][1] <= max(ends[n][1] for n in group)
            if within if still else least * _SCALE >= high - low:
                group.append(name)
                break
        else:
            if len(groups) < _SCALES:
                groups.append([name])
            else:
                groups[-1].append(name)
    return [sorted(group, key=members.index) for group in groups]


def swept_unit(name: str) -> str:
    """Return the unit of an axis; that of a swept source or resistor follows from its letter."""
    return unit(name) or {"v": "V", "i": "A", "r": "Ω"}.get(name.split(".")[-1][:1], "")


def pieces_of(axis: Floats) -> list[slice]:
    """Return the runs of an axis: one for a transient, one per curve of a nested sweep.

    Examples
    --------
    >>> pieces_of(np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0]))
    [slice(0, 3, None), slice(3, 6, None)]
    """
    steps = np.sign(np.diff(axis))
    # the first two rows may be both sides of a jump
    direction = steps[np.flatnonzero(steps)[:1]].sum()
    breaks = [0, *(np.flatnonzero(steps == -direction) + 1).tolist(), int(axis.size)]
    return [slice(a, b) for a, b in pairwise(breaks)]


def moves(values: Floats) -> bool:
    """Return whether a signal varies by more than its rounding, which cannot be seen."""
    low, high = limits(values)
    return high - low > _STILL * max(abs(low), abs(high))


def limits(values: Floats) -> tuple[float, float]:
    """Return lowest and highest of the finite values, zeros without any."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)


def axis_limits(low: float, high: float) -> tuple[float, float]:
    """Return the range of a panel: with a margin, and with zero where that hides nothing.

    Zero is part of the picture if the values come near it; a ripple on a large mean has the panel
    for itself.  Rounding noise of a constant does not fill it.

    Examples
    --------
    >>> axis_limits(1.0, 9.0), axis_limits(11.9, 12.1)
    ((-0.45, 9.45), (11.89, 12.11))
    """
    peak = max(abs(low), abs(high))
    if high - low <= _STILL * peak or peak == 0.0:
        margin = 0.1 * peak or 1.0
        return low - margin, high + margin
    if high - low > 0.4 * peak:
        low, high = min(low, 0.0), max(high, 0.0)
    margin = 0.05 * (high - low)
    return float(f"{low - margin:.12g}"), float(f"{high + margin:.12g}")
