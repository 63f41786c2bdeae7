"""Capacitor ``C a b value [ic=]``: i = C v'.

With ``Q={expr}``, or a capacitance that depends on its own voltage, it is a charge.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from ..netlist.expression import Expression
from ..problems.descriptor import Functional
from .coefficients import CARD
from .device import NO_VALUES, Context, Device, Edge
from .effect import Effect
from .parameter import Parameter, Table
from .passive import SHARED, Passive, read_passive
from .stamper import Layout, Stamper

if TYPE_CHECKING:
    from ..netlist.deck import Element


class Capacitor(Passive):
    """A linear capacitor; its voltage may be fixed by sources or other capacitors."""

    KIND = "capacitor"
    INSTANCE = Table(*SHARED, Parameter("ic", "initial voltage, used with uic", "V"))
    MODEL = Table(*CARD, Parameter("c", "capacitance", "F", aliases=("cap", "capacitance")))
    MODEL_TYPES: ClassVar[tuple[str, ...]] = ("c", "cap")
    stores_energy = True
    __slots__ = ()

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the capacitor of an element line, or None after reporting why not."""
        if element.quantity or isinstance(element.value, Expression):
            from .stored import Charge, stored_by

            charged = element if element.quantity else stored_by(element)
            if charged is not None:
                return Charge.read(charged, context)
        found = read_passive(cls, element, context, "c", "capacitance")
        if found is None:
            return None
        device = cls(element, *found)
        if device.value < 0.0 or device.value == float("inf"):
            context.findings.error(
                "NS2005",
                f"{element.name} has the capacitance {device.value:g} F",
                element.span,
                "give a positive value",
            )
            return None
        if device.value == 0.0:
            context.findings.warning(
                "NS2054", f"{element.name} has no capacitance and is left out", element.span
            )
        effects = [Effect("capacitance", "value", device.value * device.m, "F")]
        if device.ic is not None:
            effects.append(Effect("initial voltage", "ic", device.ic, "V"))
        device.effects = (*effects, *device.coefficients.effects)
        return device

    def capacitance(self, layout: Layout) -> float:
        """Return the whole capacitance [F] under the conditions of a layout."""
        return self.at(layout.conditions) * self.m

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one capacitive branch, none for a zero capacitance."""
        if values.get(self.name, self.value) == 0.0:
            return ()
        return (Edge("C", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write the capacitance."""
        stamper.capacitance(*self.ends, self.capacitance(stamper.layout))

    def current(self, layout: Layout) -> Functional:
        """Return ``C (va' - vb')``."""
        return Functional(dz=layout.voltage(*self.ends, self.capacitance(layout)))
