"""The straight-line law that stands for a junction: a forward drop and a resistance.

    i = is (exp((v - rs i) / n Vt) - 1)     becomes     v = Vfwd + Ron i

through the points of the curve at the largest current of the run's second half and at a quarter of
it.  Between both the two differ by 0.24 n Vt at most, 6 mV for silicon: a chord of the logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from ..circuit import Circuit
from ..circuit.build import default_conditions
from ..devices.diodes.junction_diode import JunctionDiode
from .edits import Edit

_PART = 0.25


def junction_diodes(circuit: Circuit) -> list[JunctionDiode]:
    """Return the diodes whose card is that of a smooth junction."""
    return [d for d in circuit.devices if isinstance(d, JunctionDiode)]


def straight(circuit: Circuit, largest: Mapping[str, float]) -> Iterator[Edit]:
    """Yield for each card of a junction the law by which a straight line replaces it.

    Parameters
    ----------
    circuit : Circuit
    largest : mapping of str to float
        Largest current of each diode in a run's second half [A]; those that do not conduct have no
        line.
    """
    elements = {e.name: e for e in circuit.deck.elements}
    conditions = default_conditions(circuit.deck)
    found: dict[str, tuple[float, JunctionDiode]] = {}
    for diode in junction_diodes(circuit):
        model = elements[diode.name].model
        current = largest.get(diode.name, 0.0) / diode.leg.parallel
        if model is not None and current > found.get(model.name, (0.0, diode))[0]:
            found[model.name] = current, diode
    for name, (current, diode) in found.items():
        junction = diode.law.at(conditions, None, 0.0)
        if current <= junction.current:
            continue

        def drop(i: float, at: float = junction.slope, of: float = junction.current) -> float:
            return at * math.log1p(i / of)

        rise = (drop(current) - drop(_PART * current)) / ((1.0 - _PART) * current)
        values = {"vfwd": drop(current) - rise * current, "ron": junction.resistance + rise}
        if diode.law.bv is not None:
            values["vrev"] = diode.law.bv
        text = " ".join(f"{key}={value:.3g}" for key, value in values.items())
        model = elements[diode.name].model
        assert model is not None
        effect = "curvature of the junction"
        yield Edit(f"model {name}", effect, text, "straight", name, model.span, text)
