"""Sources of a steady state as broken lines: where they change, and what they are between."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...problems.descriptor import Waveform
from ..gradients.carried import Carried, Lost

#: nearer than this part of the period two instants of the middle may be one
_TOGETHER = 1e-9
#: and are one if they differ by the rounding of some sums and products
_ROUNDING = 1e-14


def period_of(waveforms: Sequence[Waveform], stop: float) -> float:
    """Return the period, which may depend on parameters [s].

    Raises
    ------
    Lost
        If the sources do not agree on it for all parameters.
    """
    found: list[float] = []
    for wave in waveforms:
        if wave.kind == "pulse":
            own = wave.values[6]
            found.append(own * round(stop / float.__add__(own, 0.0)))
    for other in found[1:]:
        if _apart(found[0] - other) > _ROUNDING * stop:
            raise Lost("sources have periods that differ within the box")
    return found[0] if found else stop


def edges(waveforms: Sequence[Waveform], stop: float) -> list[float]:
    """Return the instants in [0, stop) at which a source has a breakpoint, sorted, each once [s].

    Raises
    ------
    Lost
        If a source is neither constant nor a pulse.
    """
    found: list[float] = []
    for wave in waveforms:
        if wave.kind not in ("dc", "pulse"):
            raise Lost(f"a {wave.kind} source has no enclosure: constants and pulses have")
        if wave.kind == "pulse":
            _, _, delay, rise, fall, width, period, _ = wave.values
            first, one = _middle(delay), _middle(period)
            for lap in range(math.floor(-first / one) - 1, math.ceil((stop - first) / one) + 1):
                begin = delay + lap * period
                corners = [begin]
                for part in (rise, width, fall):
                    if part != 0.0:
                        corners.append(corners[-1] + part)
                found += [t for t in corners if -_TOGETHER * stop < _middle(t) < stop]
    found.sort(key=_middle)
    kept: list[float] = []
    for t in found:
        if _middle(t) < (1.0 - _TOGETHER) * stop:
            if not kept or _middle(t) - _middle(kept[-1]) > _TOGETHER * stop:
                kept.append(t)
            elif _apart(t - kept[-1]) > _ROUNDING * stop:
                raise Lost("two edges meet at the middle of the box, and part elsewhere")
    return kept


def line_of(wave: Waveform, at: float) -> tuple[float, float]:
    """Return value at time 0 and slope of the line on which a source moves around an instant."""
    scale = wave.scale
    if wave.kind == "dc":
        return wave.values[0] * scale, 0.0
    v1, v2, delay, rise, fall, width, period, _ = wave.values
    lap = math.floor((at - _middle(delay)) / _middle(period))
    begin = delay + lap * period
    since = at - _middle(begin)
    up, down = _middle(rise), _middle(rise) + _middle(width)
    if since < up:
        slope = (v2 - v1) / rise * scale
        return v1 * scale - slope * begin, slope
    if since < down:
        return v2 * scale, 0.0
    if since < down + _middle(fall):
        slope = (v1 - v2) / fall * scale
        return v2 * scale - slope * (begin + rise + width), slope
    return v1 * scale, 0.0


def _apart(difference: float) -> float:
    if isinstance(difference, Carried):
        return float(difference.model.bound())
    return abs(difference)


def _middle(value: float) -> float:
    """Return the value in the middle of the box."""
    return float.__add__(value, 0.0)
