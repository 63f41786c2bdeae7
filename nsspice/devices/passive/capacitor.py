"""Capacitor ``C a b value [ic=]``: i = C v'.

With ``Q={expr}``, or a capacitance that depends on its own voltage, it is a charge.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from ...problems.descriptor import Functional
from ..coefficients import CARD
from ..device import NO_VALUES, Edge
from ..parameter import Parameter, Table
from ..stamper import Layout, Stamper
from .passive import SHARED, Storing

if TYPE_CHECKING:
    from ...netlist.deck import Element


class Capacitor(Storing):
    """A linear capacitor; its voltage may be fixed by sources or other capacitors."""

    KIND = "capacitor"
    INSTANCE = Table(*SHARED, Parameter("ic", "initial voltage, used with uic", "V"))
    MODEL = Table(*CARD, Parameter("c", "capacitance", "F", aliases=("cap", "capacitance")))
    MODEL_TYPES: ClassVar[tuple[str, ...]] = ("c", "cap")
    WHAT = ("capacitance", "F", "initial voltage", "V")
    NOTHING = "omitted"
    __slots__ = ("late",)

    def __init__(self, element: Element, value: float, given: dict[str, float]) -> None:
        super().__init__(element, value, given)
        #: another element reads the current, which is an unknown then
        self.late = False

    def of_all(self, value: float) -> float:
        """Return the value of all equal elements in parallel."""
        return value * self.m

    def capacitance(self, layout: Layout) -> float:
        """Return the whole capacitance [F] under the conditions of a layout."""
        return self.of_all(self.at(layout.conditions))

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
