"""Junctions as broken lines: what ``.options junctions=lines`` asks for, and scales of the deck.

The scale of a current is that at which a junction's ohmic resistance counts.  A card without one
has the largest source voltage over the geometric mean of all resistors: above the scale differences
are relative to the current itself, so that a scale that is too small costs pieces, no accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..devices.device import Device
from ..errors import Diagnostic, Span, UsageError
from ..netlist.deck import Deck, Param
from ..netlist.findings import Findings
from .gate_drives import extremes

if TYPE_CHECKING:
    from ..devices.diodes.junction_lines import Settings

#: largest difference of laws, unless the deck says another one
TOLERANCE = 0.05
_LEAST, _MOST = 1e-4, 0.5
#: [A], [V] and [Ohm] where a deck has no source or no resistor
_UNIT = 1.0
_HINT = f"write lines, or lines:0.02 for a difference of 2 %; {_LEAST:g} to {_MOST:g}"
#: what may be written instead of an element that is not replaced
_INSTEAD = {
    "m": ".options mosfet=switch reads MOSFETs as switches",
    "d": "remove its drop V=",
    "q": "a card of type Q(alphaN= alphaI= DE= DC=) has a diode for each junction",
}


def tolerance_of(text: object) -> float | None:
    """Return the tolerance that ``lines[:tolerance]`` asks for, nan if it is wrong.

    Examples
    --------
    >>> tolerance_of("lines"), tolerance_of("lines:0.02"), tolerance_of("model")
    (0.05, 0.02, None)
    """
    word, colon, number = str(text).lower().partition(":")
    if word == "model" and not colon:
        return None
    try:
        value = float(number) if colon else TOLERANCE
    except ValueError:
        return math.nan
    return value if word == "lines" and _LEAST <= value <= _MOST else math.nan


def with_junctions(deck: Deck, junctions: str) -> Deck:
    """Return a deck whose junctions are read as a caller says, instead of its options.

    Raises
    ------
    UsageError
        NS4005 if it is neither ``lines[:tolerance]`` nor ``model``.
    """
    value = tolerance_of(junctions)
    if value is not None and math.isnan(value):
        message = f"junctions cannot be {junctions!r}"
        raise UsageError(Diagnostic("NS4005", message, None, _HINT))
    param = Param("junctions", junctions, Span(deck.file, 1, 1))
    return replace(deck, options={**deck.options, "junctions": param})


def line_settings(deck: Deck, findings: Findings) -> Settings | None:
    """Return how the junctions of a deck become lines, None if they stay smooth."""
    asked = deck.options.get("junctions")
    tolerance = None if asked is None else tolerance_of(asked.value)
    if asked is None or tolerance is None:
        return None
    if math.isnan(tolerance):
        message = f"option junctions cannot be {asked.value!r}"
        findings.error("NS1010", message, asked.span, _HINT)
        return None
    sources = {"v": 0.0, "i": 0.0}
    resistors = []
    for element in deck.elements:
        if element.letter in sources and element.source is not None:
            # voltages may add up
            sources[element.letter] += max(map(abs, extremes(element.source)))
        elif element.letter == "r" and isinstance(element.value, int | float) and element.value:
            resistors.append(abs(float(element.value)))
    volts = sources["v"] or _UNIT
    ohms = math.exp(sum(map(math.log, resistors)) / len(resistors)) if resistors else _UNIT
    current = volts / ohms if sources["v"] else sources["i"] or _UNIT
    from ..devices.diodes.junction_lines import Settings

    return Settings(tolerance, current, volts)


def refuse_others(devices: Sequence[Device], findings: Findings) -> None:
    """Report semiconductors that are smooth although lines are asked for."""
    for device in devices:
        if device.smooth and device.letter in "dmqjz":
            findings.error(
                "NS2066",
                f"{device.name} cannot be read as broken lines: its current is not a function "
                "of one voltage",
                device.span,
                _INSTEAD.get(device.letter, "remove junctions=lines"),
            )
