"""Functions of the time inside linear expressions: sines, and the triangles that their arcs are.

``sin(w t + p)`` in a linear expression is a signal of its own, named ``sin(w,p)``: rate in rad/s,
phase in degrees.  ``asin(sin(w t + p))``, by which schematics draw carriers, is a triangle between
-pi/2 and pi/2, the signal ``tri(w,p)``: a PULSE source whose corners are known.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..problems.descriptor import Waveform

Floats = npt.NDArray[np.float64]


def wave_signal(rate: float, phase: float, kind: str = "sin") -> str:
    """Return the name of ``sin(rate t + phase)`` or ``asin(sin(rate t + phase))``.

    Parameters
    ----------
    rate : float
        [rad/s], positive.
    phase : float
        [degrees]
    kind : str
        ``sin`` or ``tri``.
    """
    return f"{kind}({rate!r},{phase!r})"


def is_wave(signal: str) -> bool:
    """Return whether a signal is a function of the time.

    Examples
    --------
    >>> is_wave(wave_signal(2.0, 90.0)), is_wave("v(a)")
    (True, False)
    """
    return signal[:4] in ("sin(", "tri(")


def waveform_of(signal: str) -> Waveform:
    """Return a wave as a source.

    Examples
    --------
    >>> waveform_of(wave_signal(6.283185307179586, 0.0, "tri")).values[2:7]
    (-0.25, 0.5, 0.5, 0.0, 1.0)
    """
    kind, rate, phase = _parts(signal)
    if kind == "sin":
        return Waveform("sin", (0.0, 1.0, rate / (2.0 * math.pi), 0.0, 0.0, phase))
    period, top = 2.0 * math.pi / rate, 0.5 * math.pi
    begin = -period * (((phase + 90.0) / 360.0) % 1.0)
    half = 0.5 * period
    return Waveform("pulse", (-top, top, begin, half, half, 0.0, period, math.inf))


def wave_values(signal: str, times: Floats, rates: bool = False) -> Floats:
    """Return a wave, or its rate, at some times [s]."""
    kind, rate, phase = _parts(signal)
    angle = rate * times + math.radians(phase)
    if kind == "sin":
        return np.asarray(rate * np.cos(angle) if rates else np.sin(angle))
    turns = (angle / (2.0 * math.pi) + 0.25) % 1.0  # from the lowest point on
    if rates:
        return np.where(turns < 0.5, rate, -rate)
    return np.asarray(math.pi * (0.5 - np.abs(2.0 * turns - 1.0)))


def _parts(signal: str) -> tuple[str, float, float]:
    rate, phase = signal[4:-1].split(",")
    return signal[:3], float(rate), float(phase)
