"""How sources depend on their numbers: as functions of time, and in their ideal edges.

The derivative of a source by one of its numbers, at a fixed instant, is again a source: of a pulse
by the end of its width a pulse while it falls.  An ideal edge has none; what its instant does is
the business of the instants at which it ends a segment.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...problems.descriptor import Waveform
from ..request.periodic_sources import period_of
from ..signals.curve import Floats


class NotDifferentiable(Exception):
    """A source has no derivative by one of its numbers; the text says why."""


class Edges(NamedTuple):
    """Ideal edges of a source.

    Parameters
    ----------
    times : ndarray
        [s]
    by : dict of int to ndarray
        Derivatives of the times by the numbers of the source.
    """

    times: Floats
    by: Mapping[int, Floats]


def edges(wave: Waveform, stop: float) -> list[Edges]:
    """Return the ideal edges of a source from 0 to an instant [s]."""
    if wave.kind == "pulse":
        return list(_edges_of_pulse(wave, stop))
    if wave.kind == "pwl":
        times = wave.values[::2]
        both = [k for k, (a, b) in enumerate(pairwise(times)) if a == b]
        if both and not math.isnan(wave.repeat):
            raise NotDifferentiable("it repeats, and jumps")
        return [Edges(np.array([times[k]]), {2 * k: np.ones(1)}) for k in both]
    return []


def _edges_of_pulse(wave: Waveform, stop: float) -> Iterator[Edges]:
    v1, v2, td, tr, tf, pw, per, count = wave.values
    if v1 == v2:
        return
    for place, (length, delay, by) in enumerate(
        ((tr, td, (2,)), (tf, td + tr + pw, (2, 3, 5)))  # which numbers delay each edge
    ):
        if length > 0.0:
            continue
        numbers = np.zeros(1)
        if not math.isfinite(per):
            times = np.full(1, delay)
        else:
            last = math.floor((stop - delay) / per + 1e-9)
            numbers = np.arange(max(0.0, math.ceil(-delay / per - 1e-9)), last + 1.0)
            numbers = numbers[numbers < count]
            times = delay + numbers * per
        inside = (times >= -1e-12 * stop) & (times <= stop * (1.0 + 1e-12))
        times, numbers = times[inside], numbers[inside]
        if times.size and (place == 0 or pw > 0.0 or tr > 0.0):
            yield Edges(times, {**{j: np.ones(times.size) for j in by}, 6: numbers})


def slope_by(wave: Waveform, place: int, stop: float) -> list[Waveform]:
    """Return the derivative of a source by one of its numbers as a sum of sources up to an instant.

    Raises
    ------
    NotDifferentiable
        If it is none.

    Examples
    --------
    >>> slope_by(Waveform("dc", (5.0,)), 0, 1.0)[0].values
    (1.0,)
    >>> pulse = Waveform("pulse", (0.0, 2.0, 0.0, 0.0, 1e-6, 5e-6, 1e-5, math.inf))
    >>> slope_by(pulse, 5, 1.0)[0].values
    (0.0, 2000000.0, 5e-06, 0.0, 0.0, 1e-06, 1e-05, inf)
    """
    if wave.kind == "pulse" and place == 6:
        return [Waveform("pwl", v, scale=wave.scale) for v in _by_period(wave.values, stop)]
    rule = {"dc": _of_dc, "pulse": _of_pulse, "sin": _of_sin, "pwl": _of_polygon, "exp": _of_exp}
    if wave.kind not in rule:
        raise NotDifferentiable(f"a source {wave.kind} is not differentiated")
    found = rule[wave.kind](wave.values, place)
    return [
        Waveform(kind, tuple(values), wave.repeat if kind == "pwl" else math.nan, wave.scale)
        for kind, values in found
    ]


_Parts = list[tuple[str, tuple[float, ...]]]


def _of_dc(values: tuple[float, ...], place: int) -> _Parts:
    return [("dc", (1.0,))]


def _of_pulse(values: tuple[float, ...], place: int) -> _Parts:
    v1, v2, td, tr, tf, pw, *again = values
    if tr + pw + tf > again[0]:
        raise NotDifferentiable("the pulse does not fit into its period")
    if place == 0:
        return [("pulse", (1.0, 0.0, *values[2:]))]
    if place == 1:
        return [("pulse", (0.0, 1.0, *values[2:]))]
    if v1 == v2:
        return []
    high, fall = v2 - v1, td + tr + pw
    # while it rises, and while it falls
    rising = [("pulse", (0.0, -high / tr, td, 0.0, 0.0, tr, *again))] if tr > 0.0 else []
    falling = [("pulse", (0.0, high / tf, fall, 0.0, 0.0, tf, *again))] if tf > 0.0 else []
    if place == 2:
        return rising + falling
    if place == 3:
        if tr == 0.0:
            raise NotDifferentiable("its edge is ideal: a rise time can only become longer")
        return [("pulse", (0.0, -high / tr, td, tr, 0.0, 0.0, *again)), *falling]
    if place == 4:
        if tf == 0.0:
            raise NotDifferentiable("its edge is ideal: a fall time can only become longer")
        return [("pulse", (0.0, high / tf, fall, tf, 0.0, 0.0, *again))]
    if place == 5:
        return falling
    raise NotDifferentiable("the number of pulses is not differentiated")


def _by_period(values: tuple[float, ...], stop: float) -> list[tuple[float, ...]]:
    """Return the derivative of a pulse by its period: each edge comes later by its number."""
    v1, v2, td, tr, tf, pw, per, count = values
    points: list[tuple[float, float]] = [(min(td, 0.0), 0.0)]
    last = min((stop - td) / per, count - 1.0)
    for number in range(max(1, math.ceil(-td / per) - 1), math.floor(last) + 1):
        for delay, length, rate in ((td, tr, v1 - v2), (td + tr + pw, tf, v2 - v1)):
            if length > 0.0:
                start, value = delay + number * per, number * rate / length
                end = start + length
                points += [(start, 0.0), (start, value), (end, value), (end, 0.0)]
    return [tuple(x for point in points for x in point)] if len(points) > 1 else []


def _of_sin(values: tuple[float, ...], place: int) -> _Parts:
    _, amplitude, frequency, delay, damping, phase = values
    if place == 0:
        return [("dc", (1.0,))]
    if place == 1:
        return [("sin", (0.0, 1.0, frequency, delay, damping, phase))]
    if place == 5:
        turn = amplitude * math.pi / 180.0
        return [("sin", (0.0, turn, frequency, delay, damping, phase + 90.0))]
    raise NotDifferentiable("a sine is differentiated by offset, amplitude and phase only")


def _of_exp(values: tuple[float, ...], place: int) -> _Parts:
    if place == 0:
        return [("exp", (1.0, 0.0, *values[2:]))]
    if place == 1:
        return [("exp", (0.0, 1.0, *values[2:]))]
    raise NotDifferentiable("an exponential source is differentiated by its levels only")


def _of_polygon(values: tuple[float, ...], place: int) -> _Parts:
    times, levels = values[::2], values[1::2]
    k = place // 2
    if place % 2:
        hat = [0.0] * len(levels)
        hat[k] = 1.0
        return [("pwl", tuple(x for pair in zip(times, hat, strict=True) for x in pair))]
    # next to a point that is moved, what is left of the value that it had
    points: list[tuple[float, float]] = [(times[0], 0.0)]
    for a, b in ((k - 1, k), (k, k + 1)):
        if a >= 0 and b < len(times) and times[a] < times[b]:
            slope = (levels[b] - levels[a]) / (times[b] - times[a])
            ends = (0.0, -slope) if b == k else (-slope, 0.0)
            points += [(times[a], 0.0), (times[a], ends[0]), (times[b], ends[1]), (times[b], 0.0)]
    points.append((times[-1], 0.0))
    # of the points at one time only both limits count
    near = zip([None, *points], points, [*points[1:], None], strict=False)
    kept = [p for a, p, b in near if not (a and b and a[0] == p[0] == b[0])]
    return [("pwl", tuple(x for pair in kept for x in pair))]


def period_by(waveforms: Sequence[Waveform], change: Mapping[Any, float], period: float) -> float:
    """Return the derivative of the common period of sources by a parameter.

    Parameters
    ----------
    waveforms : sequence of Waveform
    change : mapping
        Derivatives of their numbers by the parameter.
    period : float
        [s]

    Raises
    ------
    NotDifferentiable
        If only some of them depend on it.
    """
    found = []
    for source, wave in enumerate(waveforms):
        own = period_of(wave)
        if own is not None:
            by = change.get(("wave", source, 6 if wave.kind == "pulse" else 2), 0.0)
            found.append(period * (by / own if wave.kind == "pulse" else -by * own))
    if found and max(found) - min(found) > 1e-9 * max(map(abs, found)):
        raise NotDifferentiable("only some of the periods depend on it")
    return found[0] if found else 0.0
