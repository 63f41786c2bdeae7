"""Linear expressions of signals in the rows of a system: columns of constants, time and sines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ...problems.descriptor import Functional, Waveform
from ..outputs import plus, scaled
from ..waves import is_wave, wave_values, waveform_of

if TYPE_CHECKING:
    from ..carrier import Carrier
    from ..stamper import Layout, Stamper

#: constant and factors of signals, of ``linear_form``
Form = tuple[float, dict[str, float]]

#: end of the clock [s]
_LONGEST = 1e9


def constant_column(stamper: Stamper, form: Form, name: str) -> None:
    """Give the constant of a linear expression a column among the sources."""
    if form[0]:
        stamper.layout.columns[name] = stamper.column(Waveform("dc", (form[0],)))


def time_columns(stamper: Stamper, form: Form) -> None:
    """Give the time, and sines of it, columns among the sources: at 0 in a DC solution."""
    still = stamper.layout.conditions.analysis == "dc"
    for signal in form[1]:
        if is_wave(signal):
            begin = float(wave_values(signal, np.zeros(1))[0])
            moving = waveform_of(signal)
        elif signal == "time":
            begin = 0.0
            moving = Waveform("pwl", (0.0, 0.0, _LONGEST, _LONGEST))
        else:
            continue
        waveform = Waveform("dc", (begin,)) if still else moving
        stamper.layout.columns[signal] = stamper.column(waveform)


def linear_output(
    layout: Layout,
    form: Form,
    sources: Mapping[str, Carrier],
    name: str,
    parallel: float = 1.0,
) -> Functional:
    """Return a linear expression as a combination of unknowns and of the constant.

    Parameters
    ----------
    layout : Layout
    form : tuple
        Constant and factors, of ``linear_form``.
    sources : mapping of str to Carrier
        Elements whose currents are read.
    name : str
        Of the branch whose current is ``i``, and of the column of the constant.
    parallel : float
        Of how many equal elements the own current is the sum.
    """
    constant, factors = form
    total = Functional()
    for signal, value in factors.items():
        if signal == "i":
            term = scaled(layout.branch(name), 1.0 / parallel)
        elif signal == "time" or is_wave(signal):
            term = Functional(u=((layout.columns[signal], 1.0),))
        elif signal[0] == "v":
            a, b = (*signal[2:-1].split(","), "0")[:2]
            term = Functional(z=layout.voltage(a, b))
        else:
            term = sources[signal[2:-1]].current(layout)
        total = plus(total, scaled(term, value))
    if constant:
        total = plus(total, Functional(u=((layout.columns[name], 1.0),)))
    return total
