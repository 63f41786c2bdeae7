"""Winding currents and voltages of a steady state, as tools that design magnetics read them.

The format is that of the Magnetic Agnostic Structure (MAS) of OpenMagnetics: an operating point has
the waveforms of one period for each winding, the first of which is the primary.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..analyses.signals.curve import Floats
from ..analyses.solution.plot_points import drawn
from ..analyses.solution.solution import Solution
from ..analyses.steady.steady_state import pss
from ..circuit import Circuit
from ..errors import Diagnostic, UsageError, suggest

#: how the file names its program, by which it may be replaced
MARK = "(by nsspice)"
#: what a point may be off a line through its neighbours, relative to the range of its signal
_FLAT = 1e-4


def operating_point(
    circuit: Circuit, windings: Sequence[str] = (), ambient: float = 25.0, **options: Any
) -> dict[str, Any]:
    """Return the operating point of the windings in the periodic steady state.

    Parameters
    ----------
    circuit : Circuit
    windings : sequence of str
        Names of inductors, the primary first; by default all, in the order of the deck.
    ambient : float
        Temperature around the part [C].
    **options
        As for :func:`nsspice.pss`.

    Returns
    -------
    dict
        JSON-ready: ``name``, ``conditions`` and ``excitationsPerWinding`` with ``frequency`` [Hz],
        ``current`` [A] and ``voltage`` [V]; times in seconds from the beginning of the period.

    Raises
    ------
    UsageError
        NS4005 for a name that is not an inductor of the deck, or if there is none.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''square wave across an inductor
    ... V1 a 0 PULSE(-1 1 0 0 0 5u 10u)
    ... R1 a b 1m
    ... L1 b 0 1m
    ... ''')
    >>> (winding,) = operating_point(circuit)["excitationsPerWinding"]
    >>> winding["name"], round(winding["frequency"])
    ('l1', 100000)
    >>> [round(x, 4) for x in winding["current"]["waveform"]["data"]]
    [-0.0025, 0.0025, -0.0025]
    """
    nodes = {e.name: e.nodes for e in circuit.deck.elements if e.letter == "l"}
    names = [name.lower() for name in windings] or list(nodes)
    for name in names:
        if name not in nodes:
            hint = suggest(name, nodes) or f"windings are inductors: {', '.join(nodes)}"
            raise UsageError(
                Diagnostic("NS4005", f"{name} is not an inductor of the deck", hint=hint)
            )
    if not names:
        message = "the deck has no inductor"
        hint = "a transformer is a pair of inductors and a K line"
        raise UsageError(Diagnostic("NS4005", message, hint=hint))
    pairs = [(f"i({name})", f"v({','.join(nodes[name])})") for name in names]
    solution = pss(circuit, **options, extra=[signal for pair in pairs for signal in pair])
    assert solution.periodic is not None
    fine = drawn(solution, [signal for pair in pairs for signal in pair])
    frequency = 1.0 / solution.periodic.period
    return {
        "name": f"{circuit.deck.title} {MARK}",
        "conditions": {"ambientTemperature": ambient},
        "excitationsPerWinding": [
            {
                "name": name,
                "frequency": frequency,
                "current": {"waveform": _waveform(fine, current)},
                "voltage": {"waveform": _waveform(fine, voltage)},
            }
            for name, (current, voltage) in zip(names, pairs, strict=True)
        ],
    }


def _waveform(solution: Solution, signal: str) -> dict[str, list[float]]:
    """Return a signal by as few of its points as lines between them need."""
    time, values = solution.axis - solution.axis[0], solution[signal]
    kept = _needed(time, values, _FLAT * float(np.ptp(values)))
    return {"time": time[kept].tolist(), "data": values[kept].tolist()}


def _needed(time: Floats, values: Floats, allowed: float) -> list[int]:
    """Return the points between which lines leave no other by more than is allowed.

    Douglas and Peucker's method: the point that is farthest off a line ends two shorter ones.
    """
    kept, open_ = {0, time.size - 1}, [(0, time.size - 1)]
    while open_:
        first, last = open_.pop()
        inner = slice(first + 1, last)
        if last - first < 2:
            continue
        length = time[last] - time[first]
        share = (time[inner] - time[first]) / length if length else np.zeros(last - first - 1)
        error = np.abs(values[inner] - values[first] - share * (values[last] - values[first]))
        worst = int(np.argmax(error))
        if error[worst] > allowed:
            middle = first + 1 + worst
            kept.add(middle)
            open_ += [(first, middle), (middle, last)]
    return sorted(kept)
