"""Source waveforms evaluated the plain way, with a left and a right value at ideal edges.

Written from the meaning of the parameters listed at :class:`nsspice.problems.descriptor.Waveform`;
shares no code with the compiled core.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import Literal

from nsspice.problems.descriptor import Waveform

Side = Literal["left", "right"]


@dataclass(frozen=True)
class Corner:
    """A time [s] at which a waveform or its slope jumps.

    ``jump`` tells whether the value itself jumps.
    """

    time: float
    jump: bool


class Source:
    """One waveform on the window [start, stop].

    Parameters
    ----------
    waveform : Waveform
    start, stop : float
        Window [s] on which values may be asked; periodic curves are unrolled over it.

    Examples
    --------
    >>> s = Source(Waveform("pulse", (0.0, 5.0, 1.0, 0.0, 0.0, 2.0, math.inf, math.inf)), 0.0, 9.0)
    >>> s.value(1.0, "left"), s.value(1.0, "right"), [c.time for c in s.corners]
    (0.0, 5.0, [1.0, 3.0])
    """

    def __init__(self, waveform: Waveform, start: float, stop: float) -> None:
        self.waveform = waveform
        self.times: list[float] = []
        self.levels: list[float] = []
        if waveform.kind == "pulse":
            self._unroll_pulse(stop)
        elif waveform.kind == "pwl":
            self._unroll_pwl(stop)
        self.corners = [c for c in self._corners() if start <= c.time <= stop]

    def value(self, t: float, side: Side = "right") -> float:
        """Return the value at t [s]; ``side`` picks the limit at an ideal edge."""
        w = self.waveform
        v = w.values
        if w.kind == "dc":
            out = v[0]
        elif w.kind in ("pulse", "pwl"):
            out = self._polyline(t, side)
        elif w.kind == "sin":
            out = _sin(t, *v)
        elif w.kind == "exp":
            out = _exp(t, *v)
        elif w.kind == "sffm":
            offset, amplitude, carrier, index, signal = v
            phase = 2 * math.pi * carrier * t + index * math.sin(2 * math.pi * signal * t)
            out = offset + amplitude * math.sin(phase)
        elif w.kind == "am":
            amplitude, offset, modulation, carrier, delay = v
            s = t - delay
            envelope = offset + math.sin(2 * math.pi * modulation * s)
            out = amplitude * envelope * math.sin(2 * math.pi * carrier * s) if s > 0 else 0.0
        else:
            raise ValueError(f"unknown waveform kind {w.kind!r}")
        return out * w.scale

    def _polyline(self, t: float, side: Side) -> float:
        """Return the value of the unrolled polygon; constant before its start and after its end."""
        find = bisect_left if side == "left" else bisect_right
        k = find(self.times, t)
        if k == 0:
            return self.levels[0]
        if k == len(self.times):
            return self.levels[-1]
        ta, tb = self.times[k - 1], self.times[k]
        va, vb = self.levels[k - 1], self.levels[k]
        return va if va == vb else va + (vb - va) * ((t - ta) / (tb - ta))

    def _unroll_pulse(self, stop: float) -> None:
        low, high, delay, rise, fall, width, period, count = self.waveform.values
        k = 0
        while k < count and (k == 0 or delay + k * period <= stop):
            base = delay + k * period if k else delay
            top = base + rise
            back = top + width
            points = [(base, low), (top, high), (back, high), (back + fall, low)]
            for time, level in _cut(points, delay + (k + 1) * period):
                self.times.append(time)
                self.levels.append(level)
            k += 1
            if not math.isfinite(period):
                break

    def _unroll_pwl(self, stop: float) -> None:
        values = self.waveform.values
        times, levels = list(values[0::2]), list(values[1::2])
        self.times, self.levels = list(times), list(levels)
        repeat = self.waveform.repeat
        if math.isnan(repeat) or times[-1] <= repeat:
            return
        period = times[-1] - repeat
        first = bisect_left(times, repeat)
        k = 1
        # the first repetition starts with the curve's value at the repeat time
        start = Source(Waveform("pwl", values), repeat, repeat).value(repeat)
        while times[-1] + (k - 1) * period <= stop:
            self.times.append(times[-1] + (k - 1) * period)
            self.levels.append(start)
            for time, level in zip(times[first:], levels[first:], strict=True):
                if time > repeat:
                    self.times.append(time + k * period)
                    self.levels.append(level)
            k += 1

    def _corners(self) -> list[Corner]:
        """Return every corner in ascending order, equal times merged."""
        v = self.waveform.values
        if self.waveform.kind == "exp":
            return [Corner(t, False) for t in sorted({v[2], v[4]})]
        if self.waveform.kind == "sin":
            return [Corner(v[3], False)] if v[3] > 0 else []
        if self.waveform.kind == "am":
            return [Corner(v[4], False)] if v[4] > 0 else []
        out: list[Corner] = []
        for time in sorted(set(self.times)):
            first, last = bisect_left(self.times, time), bisect_right(self.times, time) - 1
            out.append(Corner(time, self.levels[first] != self.levels[last]))
        return out


def _cut(points: list[tuple[float, float]], end: float) -> list[tuple[float, float]]:
    """Return the polygon up to ``end``; a pulse longer than its period is cut off there."""
    out: list[tuple[float, float]] = []
    for time, level in points:
        if time > end:
            ta, va = out[-1]
            part = (end - ta) / (time - ta) if math.isfinite(time) else 0.0
            out.append((end, va + (level - va) * part))
            break
        if math.isfinite(time):
            out.append((time, level))
    return out


def _sin(
    t: float,
    offset: float,
    amplitude: float,
    frequency: float,
    delay: float,
    damping: float,
    phase_deg: float,
) -> float:
    s = max(t - delay, 0.0)
    angle = 2 * math.pi * frequency * s + math.radians(phase_deg)
    return offset + amplitude * math.exp(-damping * s) * math.sin(angle)


def _exp(t: float, v1: float, v2: float, td1: float, tau1: float, td2: float, tau2: float) -> float:
    out = v1
    if t > td1:
        out += (v2 - v1) * -math.expm1(-(t - td1) / tau1)
    if t > td2:
        out += (v1 - v2) * -math.expm1(-(t - td2) / tau2)
    return out


def merged_corners(sources: list[Source]) -> list[Corner]:
    """Return the corners of all sources in ascending order; a time jumps if any source does."""
    jumps: dict[float, bool] = {}
    for source in sources:
        for corner in source.corners:
            jumps[corner.time] = jumps.get(corner.time, False) or corner.jump
    return [Corner(t, jumps[t]) for t in sorted(jumps)]
