"""Resistor ``R a b value``: v = R i; 0 is an ideal short, ``inf`` is open.

With ``V={expr(i)}``, or a resistance that depends on signals, it is a behavioural resistor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional
from ..coefficients import CARD, EXPONENTIAL
from ..device import NO_VALUES, Context, Device, Edge
from ..effect import Effect
from ..noise import Flicker, NoiseSource, thermal_noise
from ..parameter import Parameter, Table, inert, refused
from ..stamper import Layout, Stamper
from ..temperature import kelvin
from .passive import SHARED, Passive, read_passive

if TYPE_CHECKING:
    from ...netlist.deck import Element


class Resistor(Passive):
    """A linear resistor; a short (0 Ohm) has its current as an unknown."""

    KIND = "resistor"
    INSTANCE = Table(
        *SHARED,
        EXPONENTIAL,
        Parameter(
            "ac", "resistance for small signals, other than that at the operating point", "Ohm"
        ),
        inert("ic", "initial value (a resistor stores nothing)"),
        Parameter("noisy", "0 without noise", "", aliases=("noise",)),
    )
    MODEL = Table(
        *CARD,
        EXPONENTIAL,
        Parameter("r", "resistance", "Ohm", aliases=("res", "resistance")),
        refused("rsh", "sheet resistance", "write the resistance on the element line", "Ohm"),
        inert("kf", "flicker noise"),
        inert("af", "flicker noise"),
    )
    MODEL_TYPES: ClassVar[tuple[str, ...]] = ("r", "res")
    NOISE = ("thermal",)
    __slots__ = ("small_signal",)
    small_signal: float | None

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the resistor of an element line, or None after reporting why not."""
        if element.quantity or isinstance(element.value, Expression):
            from .behavioural_resistor import BehaviouralResistor

            return BehaviouralResistor.read(element, context)
        found = read_passive(cls, element, context, "r", "resistance")
        if found is None:
            return None
        device = cls(element, *found)
        device.small_signal = found[1].get("ac")
        value = device.value
        if value < 0.0:
            context.findings.warning(
                "NS2053",
                f"{element.name} has a negative resistance ({value:g} Ohm): it supplies energy, "
                f"and "
                "the circuit may have several solutions or none",
                element.span,
            )
        resistance = Effect("resistance", "value", value / device.m, "Ohm")
        device.effects = (resistance, *device.coefficients.effects)
        return device

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return a voltage branch for a short, nothing for an open resistor."""
        value = values.get(self.name, self.value)
        if math.isinf(value):
            return ()
        return (Edge("V" if value == 0.0 else "R", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write the conductance, or the row ``-(va - vb) = 0`` of a short."""
        value = self.at(stamper.layout.conditions)
        if value == 0.0:
            stamper.connect(stamper.branch(self.name), *self.ends)
        elif not math.isinf(value):
            stamper.conductance(*self.ends, self.m / value)

    def current(self, layout: Layout) -> Functional:
        """Return ``(va - vb) / R``, or the unknown of a short."""
        if self.name in layout.branches:
            return layout.branch(self.name)
        value = self.at(layout.conditions)
        if math.isinf(value):
            return Functional()
        return Functional(z=layout.voltage(*self.ends, self.m / value))

    def noise(self, layout: Layout, flicker: Flicker) -> Iterator[NoiseSource]:
        """Yield the thermal noise; a short and an open resistor have none."""
        ohms = self.at(layout.conditions)
        if 0.0 < ohms < math.inf:
            yield thermal_noise(*self.ends, self.m / ohms, kelvin(layout.conditions))
