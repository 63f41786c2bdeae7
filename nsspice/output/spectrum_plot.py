"""Spectra of ``.four`` as stems, in decades below the largest line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..analyses.signals.signal_names import unit
from .axes import decades
from .si import number, prefix

if TYPE_CHECKING:
    from ..analyses.results.spectrum import Spectrum

#: part of the largest line below which lines are not drawn
_LEAST = 1e-5
_DEPTH = 1e-2  # of the axis below the largest line, at least


def draw_spectrum(panel: Any, spectrum: Spectrum) -> None:
    """Draw the harmonics of a signal over the frequency."""
    amplitudes = np.array(spectrum.amplitudes[1:])
    orders = np.arange(1, amplitudes.size + 1)
    top = float(amplitudes.max(initial=0.0))
    seen = amplitudes >= max(_LEAST * top, np.finfo(float).tiny)
    seen &= np.array([spectrum.has_line(a) for a in amplitudes], dtype=bool)
    factor, letter = prefix(spectrum.frequency * max(1, orders.size))
    symbol = unit(spectrum.signal)
    decades(panel.yaxis, symbol or "V")
    if seen.any():
        least = min(float(amplitudes[seen].min()) / 1.5, top * _DEPTH)
        floor = 10.0 ** np.floor(np.log10(least))
        x = orders[seen] * spectrum.frequency / factor
        panel.vlines(x, floor, amplitudes[seen], color="#0072B2", linewidth=1.6)
        panel.plot(x, amplitudes[seen], "o", color="#0072B2", markersize=3.5)
        panel.set_ylim(floor, 3.0 * top)
    panel.set_xlim(0.0, (orders.size + 0.5) * spectrum.frequency / factor)
    panel.set_xlabel(f"Frequency [{letter}Hz]")
    panel.set_ylabel(f"{spectrum.signal} [{symbol}]" if symbol else spectrum.signal)
    panel.grid(visible=True, color="0.9", linewidth=0.8)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    first = float(spectrum.coefficients[0].real)
    mean = number(first if spectrum.has_line(abs(first)) else 0.0, symbol, 4)
    thd = "" if np.isnan(spectrum.distortion) else f", THD {100 * spectrum.distortion:.3g} %"
    panel.set_title(f"harmonics of {spectrum.signal}: mean {mean}{thd}", fontsize="small")
