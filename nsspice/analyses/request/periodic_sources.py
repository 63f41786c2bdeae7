"""Sources that repeat: their common period, and what they are in periodic steady state."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from ...problems.descriptor import Waveform
from .period import common


def period_of(waveform: Waveform) -> float | None:
    """Return the period of a source [s], None if it does not repeat for ever.

    Examples
    --------
    >>> period_of(Waveform("pulse", (0.0, 1.0, 0.0, 0.0, 0.0, 4e-6, 1e-5, math.inf)))
    1e-05
    >>> period_of(Waveform("dc", (1.0,))) is None
    True
    """
    values = waveform.values
    if waveform.kind == "pulse":
        period, count = values[6], values[7]
        return period if math.isfinite(period) and count == math.inf else None
    if waveform.kind == "sin":
        _, amplitude, frequency, _, damping, _ = values
        repeats = amplitude != 0.0 and frequency > 0.0 and damping == 0.0
        return 1.0 / frequency if repeats else None
    if waveform.kind in ("sffm", "am"):
        # carrier and signal, modulation and carrier
        both = (values[2], values[4]) if waveform.kind == "sffm" else (values[2], values[3])
        own = common([1.0 / f for f in both if f > 0.0])
        return own if own is not None and math.isfinite(own) else None
    if waveform.kind == "pwl" and math.isfinite(waveform.repeat):
        period = values[-2] - waveform.repeat
        return period if period > 0.0 else None
    return None


def common_period(waveforms: Iterable[Waveform]) -> float | None:
    """Return the shortest time after which all repeating sources repeat [s].

    None without a repeating source, nan if they have no common period.
    """
    return common([p for p in map(period_of, waveforms) if p is not None])


def continued(waveform: Waveform) -> Waveform:
    """Return a source as it is in periodic steady state.

    What repeats is continued into the past; what does not has the value with which it begins.

    Examples
    --------
    >>> continued(Waveform("sin", (0.0, 1.0, 50.0, 5e-3, 0.0, 0.0))).values
    (0.0, 1.0, 50.0, 0.0, 0.0, -90.0)
    >>> continued(Waveform("pulse", (2.0, 5.0, 1e-3, 0.0, 0.0, 1.0, math.inf, math.inf))).values
    (2.0,)
    """
    from ...devices.sources.waveform import initial_value

    period, values = period_of(waveform), waveform.values
    if waveform.kind == "dc":
        return waveform
    if period is None:
        return Waveform("dc", (initial_value(waveform) / waveform.scale,), scale=waveform.scale)
    if waveform.kind == "sffm":
        return waveform
    if waveform.kind in ("pulse", "am"):
        place = 2 if waveform.kind == "pulse" else 4
        delay = values[place]
        earlier = delay - period * math.ceil(delay / period) if delay > 0.0 else delay
        return replace(waveform, values=(*values[:place], earlier, *values[place + 1 :]))
    if waveform.kind == "sin":
        offset, amplitude, frequency, delay, damping, phase = values
        turned = phase - 360.0 * math.fmod(delay * frequency, 1.0) if delay > 0.0 else phase
        start = min(delay, 0.0)
        return replace(waveform, values=(offset, amplitude, frequency, start, damping, turned))
    # a repeated polygon: the part that repeats, laid so that it covers the beginning
    start = waveform.repeat
    shift = period * math.ceil(start / period) if start > 0.0 else 0.0
    points = list(zip(values[::2], values[1::2], strict=True))
    kept = [(t, v) for t, v in points if t >= start]
    if kept[0][0] > start:
        before = max((p for p in points if p[0] < start), default=kept[0])
        share = (start - before[0]) / (kept[0][0] - before[0])
        kept.insert(0, (start, before[1] + share * (kept[0][1] - before[1])))
    moved = [x for t, v in kept for x in (t - shift, v)]
    return replace(waveform, values=tuple(moved), repeat=start - shift)
