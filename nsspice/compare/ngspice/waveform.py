"""Sources for ngspice: complete argument lists, ideal edges as short ramps."""

from __future__ import annotations

import itertools
import math

from ...errors import Diagnostic, UsageError
from ...problems.descriptor import Waveform

#: a source that repeats is written out point by point, up to this many
_POINTS = 200_000
# ngspice takes a zero for "not given" in some places
_TINY = 1e-30


def source_text(waveform: Waveform, stop: float, edge: float) -> tuple[str, int]:
    """Return a source function as ngspice reads it, and how many kinds of edges became ramps.

    Parameters
    ----------
    waveform : Waveform
    stop : float
        End of the run [s].
    edge : float
        Length of a ramp that stands for an ideal edge [s].

    Examples
    --------
    >>> source_text(Waveform("pulse", (0., 5., 0., 1., 0., 2., 9., math.inf)), 20., 0.5)
    ('PULSE(0.0 5.0 0.0 1.0 0.002 2.0 9.0)', 1)
    """
    v = tuple(waveform.values)
    k = waveform.scale
    kind = waveform.kind
    if kind == "dc":
        return f"DC {v[0] * k!r}", 0
    if kind == "sin":
        return _sine(v, k), 0
    if kind == "pulse":
        return _pulse(v, k, stop, edge)
    if kind == "pwl":
        return _line(_unrolled(v, waveform.repeat, stop), k, edge)
    if kind == "exp":
        v1, v2, td1, tau1, td2, tau2 = v
        sharp = (tau1 == 0.0) + (tau2 == 0.0)
        times = (td1 or _TINY, tau1 or edge / 10.0, td2 or _TINY, tau2 or edge / 10.0)
        return f"EXP({_words(v1 * k, v2 * k, *times)})", sharp
    if kind == "sffm":
        offset, amplitude, carrier, index, signal = v
        return f"SFFM({_words(offset * k, amplitude * k, carrier or _TINY, index, signal)})", 0
    amplitude, offset, modulation, carrier, delay = v
    return f"AM({_words(amplitude * k, offset, modulation, carrier or _TINY, delay)})", 0


def _words(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)


def _sine(v: tuple[float, ...], k: float) -> str:
    offset, amplitude, frequency, delay, damping, phase = v
    if frequency == 0.0:
        level = offset + amplitude * math.sin(math.radians(phase))
        if damping == 0.0:
            return f"DC {level * k!r}"
        frequency = _TINY
    return f"SIN({_words(offset * k, amplitude * k, frequency, delay, damping, phase)})"


def _pulse(v: tuple[float, ...], k: float, stop: float, edge: float) -> tuple[str, int]:
    """Return a pulse; a limited number of pulses is written out."""
    v1, v2, delay, rise, fall, width, period, count = v
    sharp = (rise == 0.0) + (fall == 0.0)
    if math.isfinite(count) or period < (rise + width + fall) * (1 - 1e-12):
        points = _pulse_points(v, stop)
        return _line(points, k, edge)
    rise, width, fall = _lengths(rise, width, fall, period, edge)
    period = period if math.isfinite(period) else 10.0 * (delay + stop + rise + fall)
    width = min(width, 2.0 * (stop + abs(delay)) + edge)
    return f"PULSE({_words(v1 * k, v2 * k, delay, rise, fall, width, period)})", sharp


def _lengths(
    rise: float, width: float, fall: float, period: float, edge: float
) -> tuple[float, float, float]:
    """Return rise, width and fall of a pulse, none of them zero, with its corners left in place.

    Examples
    --------
    >>> _lengths(1.0, 0.0, 1.0, 3.0, 2**-10)  # a triangle keeps its top in the middle
    (0.99951171875, 0.0009765625, 0.99951171875)
    >>> _lengths(0.0, 1.0, 0.0, 2.0, 1e-9)[1]
    0.999999999
    """
    if width > 0.0:
        # a ramp begins at the edge, and is taken from the level behind it
        edge = min(edge, 1e-3 * width)
        width -= edge if rise == 0.0 else 0.0
    else:
        # ngspice takes a width of zero for one up to the end: what the top lasts is taken from the
        # ramps next to it, or the period would be too short for both
        width = edge = min(edge, *(1e-3 * span for span in (rise, fall, period) if span > 0.0))
        if rise > 0.0 and fall > 0.0:
            rise, fall = rise - 0.5 * edge, fall - 0.5 * edge
        elif rise > 0.0:
            rise -= edge
        elif fall > 0.0:
            fall -= 2.0 * edge
    lengths = [fall or edge, width, rise or edge]
    # ngspice loses all later corners where the ramp down ends with the period, but for rounding
    missing = edge - (period - sum(lengths))
    if missing > 0.0:
        lengths[lengths.index(max(lengths))] -= missing
    fall, width, rise = lengths
    return rise, width, fall


def _pulse_points(v: tuple[float, ...], stop: float) -> list[tuple[float, float]]:
    """Return a pulse as a broken line."""
    v1, v2, delay, rise, fall, width, period, count = v
    points = [(min(delay, 0.0), v1)]
    turns = 1.0 if math.isinf(period) else math.ceil(max(stop - delay, 0.0) / period)
    for turn in range(int(min(count, turns, _POINTS))):
        start = delay + (turn * period if turn else 0.0)
        end = start + period
        corners = [(start, v1), (start + rise, v2)]
        if math.isfinite(width):
            corners += [(start + rise + width, v2), (start + rise + width + fall, v1)]
        for (t0, y0), (t1, y1) in itertools.pairwise(corners):
            points.append((t0, y0))
            if t1 > end:  # cut off by the next pulse
                points.append((end, y0 + (y1 - y0) * (end - t0) / (t1 - t0)))
                break
        else:
            points.append(corners[-1])
    return points


def _unrolled(v: tuple[float, ...], repeat: float, stop: float) -> list[tuple[float, float]]:
    """Return the points of a broken line, its repetitions written out up to the end of the run."""
    points = list(zip(v[::2], v[1::2], strict=True))
    if math.isnan(repeat):
        return points
    last = points[-1][0]
    part = [(t, y) for t, y in points if t >= repeat]
    at = [y for t, y in points if t <= repeat]
    if part[0][0] > repeat and at:
        k = len(at)
        (t0, y0), (t1, y1) = points[k - 1], points[k]
        part.insert(0, (repeat, y0 + (y1 - y0) * (repeat - t0) / (t1 - t0)))
    period = last - repeat
    turns = math.ceil(max(stop - last, 0.0) / period)
    if turns * len(part) > _POINTS:
        raise UsageError(
            Diagnostic(
                "NS4014",
                f"a PWL source repeats {turns} times within the run, too many times to be "
                f"written out",
                hint="shorten the run, or use PULSE or SIN",
            )
        )
    for turn in range(1, turns + 1):
        points += [(t + turn * period, y) for t, y in part]
    return points


def _line(points: list[tuple[float, float]], k: float, edge: float) -> tuple[str, int]:
    """Return a PWL source; equal times are moved apart, which makes a ramp of a jump."""
    out: list[tuple[float, float]] = []
    sharp = 0
    for t, y in points:
        if out and t <= out[-1][0]:
            if y == out[-1][1]:
                continue
            sharp = 1
            t = out[-1][0] + edge
        out.append((t, y))
    if len(out) == 1:
        return f"DC {out[0][1] * k!r}", 0
    return f"PWL({' '.join(_words(t, y * k) for t, y in out)})", sharp
