"""What ideal edges of sources do to a run as their instants move with parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import Diagnostic, StepError
from ...problems.descriptor import Waveform
from ..signals.curve import Floats
from .sources import edges

#: of the length of a run: instants that are one
_SAME = 1e-12


def moved_instants(
    waveforms: Sequence[Waveform],
    changes: Sequence[Mapping[Any, float]],
    instants: Sequence[tuple[float, float]],
    stop: float,
    periodic: bool,
) -> Floats:
    """Return derivatives by parameters on which instants of ideal edges depend.

    Parameters
    ----------
    waveforms : sequence of Waveform
    changes : sequence of mapping
        Derivatives of all numbers by each parameter.
    instants : sequence of (float, float)
        Where sources end segments [s], and derivatives by these instants.
    stop : float
        Length of the run [s].
    periodic : bool
        Its end is its beginning.

    Raises
    ------
    StepError
        NS3068 if edges at one instant would move apart.
    """
    found = np.zeros(len(changes))
    moving = [{k[1:] for k in change if k[0] == "wave"} for change in changes]
    if not instants or not any(moving):
        return found
    times, slopes = (np.array(column) for column in zip(*instants, strict=True))
    # how far each edge at each instant moves, parameter by parameter, nan where there is no edge
    shifts: list[Floats] = []
    for source, wave in enumerate(waveforms):
        by = [
            {p: change[k] for k in change if k[:2] == ("wave", source) for p in k[2:]}
            for change in changes
        ]
        for group in edges(wave, stop):
            at, by_number = group.times, group.by
            if periodic:  # the end is the beginning
                kept = at < (1.0 - _SAME) * stop
                at, by_number = at[kept], {n: each[kept] for n, each in by_number.items()}
                at = np.where(at <= _SAME * stop, stop, at)
            place = np.searchsorted(times, at - _SAME * stop)
            there = place < times.size
            there &= np.abs(times[np.minimum(place, times.size - 1)] - at) <= _SAME * stop
            table = np.full((times.size, len(changes)), np.nan)
            moves = np.zeros((at.size, len(changes)))
            for number, each in by_number.items():
                moves += np.outer(each, [d.get(number, 0.0) for d in by])
            # an edge at the end acts on nothing that is left
            lost = ~there & (np.abs(at - stop) > _SAME * stop) & moves.any(axis=1)
            if lost.any():
                raise _apart(
                    float(at[lost][0]), "an edge moves into the run, or onto another event"
                )
            table[place[there]] = moves[there]
            shifts.append(table)
    if not shifts:
        return found
    stack = np.array(shifts)
    least, most = (
        np.nanmin(stack, axis=0, initial=np.inf),
        np.nanmax(stack, axis=0, initial=-np.inf),
    )
    differ = np.argwhere(
        np.isfinite(most)
        & (most - least > 1e-9 * np.abs(stack[np.isfinite(stack)]).max(initial=0.0))
    )
    if differ.size:
        raise _apart(float(times[differ[0][0]]), "ideal edges of several sources move apart")
    moves = np.where(np.isfinite(most), most, 0.0)
    blurred = np.isnan(slopes) & moves.any(axis=1)
    if blurred.any():
        what = "a measure is cut off at an edge that moves"
        raise _apart(float(times[blurred][0]), what)
    return np.asarray(np.where(np.isnan(slopes), 0.0, slopes) @ moves)


def _apart(time: float, what: str) -> StepError:
    return StepError(
        Diagnostic(
            "NS3068",
            f"a measure has no derivative: at t = {time:.9g} s {what}",
            hint="give the edges a rise time, or shift one of them slightly",
        ),
        time=time,
        residual=float("nan"),
    )
