"""Source values once more: what the engines were driven by, against the waveforms of the deck."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..problems.csc import Floats
from ..problems.descriptor import Waveform
from .energy import worse

#: Instants looked at in one block of records.
_MOST = 256
#: An instant is known to this part of itself: beside an edge both of its sides are right.
_INSTANT = 64.0 * float(np.finfo(np.float64).eps)
#: Part of the largest value that is rounding wherever the instant is.
_SAME = 1e-13


def waveform_values(waveform: Waveform, t: Floats) -> Floats:
    """Return the values of a waveform at instants, those behind its edges where it jumps.

    Parameters
    ----------
    waveform : Waveform
    t : ndarray
        [s]

    Examples
    --------
    >>> pulse = Waveform("pulse", (0.0, 5.0, 1.0, 0.0, 2.0, 3.0, 10.0, math.inf))
    >>> waveform_values(pulse, np.array([0.5, 1.0, 3.9, 5.0, 8.0, 11.0])).tolist()
    [0.0, 5.0, 5.0, 2.5, 0.0, 5.0]
    """
    p = waveform.values
    return waveform.scale * _SHAPES[waveform.kind](p, t, waveform.repeat)


def _dc(p: tuple[float, ...], t: Floats, repeat: float) -> Floats:
    return np.full_like(t, p[0])


def _sine(turns: Floats) -> Floats:
    """Return the sine of so many turns."""
    return np.sin(2.0 * math.pi * np.fmod(turns, 1.0))


def _sin(p: tuple[float, ...], t: Floats, repeat: float) -> Floats:
    offset, amplitude, frequency, delay, damping, degrees = p
    s = np.maximum(t - delay, 0.0)
    swing = _sine(frequency * s + degrees / 360.0)
    if damping:
        swing = swing * np.exp(-damping * s)
    return offset + amplitude * swing


def _pulse(p: tuple[float, ...], t: Floats, repeat: float) -> Floats:
    low, high, delay, rise, fall, width, period, count = p
    s = t - delay
    lap = np.floor(s / period) if math.isfinite(period) else np.zeros_like(t)
    local = s - lap * period if math.isfinite(period) else s
    on = (s >= 0.0) & (lap < count)
    share = _edge(local, 0.0, rise) - _edge(local, rise + width, fall)
    return low + (high - low) * np.where(on, share, 0.0)


def _edge(t: Floats, begin: float, length: float) -> Floats:
    """Return how much of an edge is past."""
    if length > 0.0 and math.isfinite(begin):
        return np.clip((t - begin) / length, 0.0, 1.0)
    return np.where(t >= begin, 1.0, 0.0)


def _pwl(p: tuple[float, ...], t: Floats, repeat: float) -> Floats:
    times, values = np.array(p[::2]), np.array(p[1::2])
    if math.isfinite(repeat) and times[-1] > repeat:
        period = times[-1] - repeat
        t = np.where(t > repeat, repeat + np.mod(t - repeat, period), t)
    after = np.searchsorted(times, t, side="right")
    left, right = np.clip(after - 1, 0, None), np.clip(after, None, times.size - 1)
    length = times[right] - times[left]
    inside = (after > 0) & (length > 0.0)
    share = np.divide(t - times[left], length, out=np.zeros_like(t), where=inside)
    return np.asarray(values[left] + (values[right] - values[left]) * share)


def _exp(p: tuple[float, ...], t: Floats, repeat: float) -> Floats:
    first, second, td1, tau1, td2, tau2 = p
    share = np.zeros_like(t)
    for delay, tau, sign in ((td1, tau1, 1.0), (td2, tau2, -1.0)):
        s = np.maximum(t - delay, 0.0)
        share -= sign * (np.expm1(-s / tau) if tau > 0.0 else np.where(s > 0.0, -1.0, 0.0))
    return first + (second - first) * share


def _sffm(p: tuple[float, ...], t: Floats, repeat: float) -> Floats:
    offset, amplitude, carrier, index, signal = p
    return offset + amplitude * _sine(carrier * t + index / (2.0 * math.pi) * _sine(signal * t))


def _am(p: tuple[float, ...], t: Floats, repeat: float) -> Floats:
    amplitude, offset, modulation, carrier, delay = p
    s = t - delay
    swing = (offset + _sine(modulation * s)) * _sine(carrier * s)
    return np.where(s >= 0.0, amplitude * swing, 0.0)


_SHAPES = {
    "dc": _dc,
    "sin": _sin,
    "pulse": _pulse,
    "pwl": _pwl,
    "exp": _exp,
    "sffm": _sffm,
    "am": _am,
}


class SourceCheck:
    """Compares the source values of records with the waveforms of the deck.

    Parameters
    ----------
    waveforms : sequence of Waveform
    """

    def __init__(self, waveforms: Sequence[Waveform]) -> None:
        self._waveforms = waveforms
        self._largest = [0.0] * len(waveforms)
        #: worst relative error
        self.error = 0.0
        #: number of the waveform that is off most
        self.worst: int | None = None

    def take(self, time: Floats, u: Floats) -> None:
        """Compare values at instants: some of them, if they are many.

        Parameters
        ----------
        time : ndarray, shape (k,)
            [s]
        u : ndarray, shape (k, p)
        """
        if not self._largest or not time.size:
            return
        stride = -(-time.size // _MOST)
        time, u = time[::stride], u[::stride]
        for k, waveform in enumerate(self._waveforms):
            found = u[:, k]
            values = waveform_values(waveform, time)
            largest = self._largest[k] = max(self._largest[k], float(np.abs(values).max()))
            off = np.abs(found - values)
            error = float(off.max())  # nan is kept
            if error <= _SAME * largest:
                continue
            far = ~(off <= _SAME * largest)
            error = _outside(waveform, time[far], found[far])
            if error > 0.0 or error != error:
                error = error / largest if largest > 0.0 else math.inf
                if worse(error, self.error):
                    self.error, self.worst = error, k


def _outside(waveform: Waveform, time: Floats, found: Floats) -> float:
    """Return how far values are from those of a waveform around instants."""
    known = _INSTANT * np.abs(time) + np.finfo(np.float64).tiny
    values = waveform_values(waveform, np.stack((time - known, time, time + known)))
    low, high = values.min(axis=0), values.max(axis=0)
    # a line that is continued over the rounding of its end leaves its range by as much
    return float(np.max(np.maximum(low - found, found - high) - (high - low)))
