"""Capacitor ``C a b value [ic=]``: i = C v'.

With ``Q={expr}``, or a capacitance that depends on its own voltage, it is a charge.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional
from ..coefficients import CARD
from ..device import NO_VALUES, Context, Device, Edge
from ..effect import Effect
from ..parameter import Parameter, Table
from ..stamper import Layout, Stamper
from .passive import SHARED, Passive, read_passive

if TYPE_CHECKING:
    from ...netlist.deck import Element


class Capacitor(Passive):
    """A linear capacitor; its voltage may be fixed by sources or other capacitors."""

    KIND = "capacitor"
    INSTANCE = Table(*SHARED, Parameter("ic", "initial voltage, used with uic", "V"))
    MODEL = Table(*CARD, Parameter("c", "capacitance", "F", aliases=("cap", "capacitance")))
    MODEL_TYPES: ClassVar[tuple[str, ...]] = ("c", "cap")
    stores_energy = True
    NOISE = ()
    __slots__ = ("late",)

    def __init__(self, element: Element, value: float, given: dict[str, float]) -> None:
        super().__init__(element, value, given)
        #: another element reads the current, which is an unknown then
        self.late = False

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the capacitor of an element line, or None after reporting why not."""
        if element.quantity or isinstance(element.value, Expression):
            from ..expressions.stored import Charge, stored_by

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
                "NS2054", f"{element.name} has no capacitance and is omitted", element.span
            )
        effects = [Effect("capacitance", "value", device.value * device.m, "F")]
        if device.ic is not None:
            effects.append(Effect("initial voltage", "ic", device.ic, "V"))
        device.effects = (*effects, *device.coefficients.effects)
        return device

    def capacitance(self, layout: Layout) -> float:
        """Return the whole capacitance [F] under the conditions of a layout."""
        return self.at(layout.conditions) * self.m

    def keep_current(self) -> None:
        """Make the current an unknown: as a rate in the laws of others it has no symmetric form."""
        self.late = True

    @property
    def _inner(self) -> str:
        return f"{self.name}#c"

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one capacitive branch, none for a zero capacitance."""
        if values.get(self.name, self.value) == 0.0:
            return ()
        return (Edge("C", *self.ends),)

    def inner_edges(self) -> tuple[Edge, ...]:
        """Return the equations of a capacitor whose current is an unknown."""
        if not self.late:
            return ()
        return (Edge("C", self._inner, "0"), Edge("E", self._inner, "0"))

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the voltage and the current, which other elements read."""
        stamper.internal_node(self._inner, self.name)
        stamper.branch(self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write the capacitance, or ``C y' - j = 0``, ``y - (va - vb) = 0`` with the current j."""
        if not self.late:
            stamper.capacitance(*self.ends, self.capacitance(stamper.layout))
            return
        row = stamper.layout.branches[self.name]
        stamper.capacitance(self._inner, "0", self.capacitance(stamper.layout))
        stamper.connect(row, *self.ends)
        stamper.connect(row, "0", self._inner)

    def current(self, layout: Layout) -> Functional:
        """Return ``C (va' - vb')``, or the unknown current."""
        if self.late:
            return layout.branch(self.name)
        return Functional(dz=layout.voltage(*self.ends, self.capacitance(layout)))

    def charged(self, layout: Layout, charge: float) -> tuple[tuple[int, float], ...]:
        """Return where a charge [C] is among those of the unknowns."""
        ends = (self._inner, "0") if self.late else self.ends
        return layout.voltage(*ends, charge)
