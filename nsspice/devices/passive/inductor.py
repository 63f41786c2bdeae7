"""Inductor ``L a b value [ic=]``: v = L i'; its current is an unknown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional
from ..coefficients import CARD
from ..device import NO_VALUES, Context, Device, Edge
from ..effect import Effect
from ..parameter import Parameter, Table, refused
from ..stamper import Layout, Stamper
from .passive import SHARED, Passive, read_passive

if TYPE_CHECKING:
    from ...netlist.deck import Element


class Inductor(Passive):
    """A linear inductor; its current may be fixed by sources or other inductors."""

    KIND = "inductor"
    INSTANCE = Table(
        *SHARED,
        Parameter("ic", "initial current, used with uic", "A"),
        refused("nt", "number of turns", "write the inductance"),
    )
    MODEL = Table(*CARD, Parameter("l", "inductance", "H", aliases=("ind",)))
    MODEL_TYPES: ClassVar[tuple[str, ...]] = ("l", "ind")
    stores_energy = True
    shows_current = True
    NOISE = ()
    __slots__ = ()

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the inductor of an element line, or None after reporting why not."""
        if element.quantity or isinstance(element.value, Expression):
            from ..expressions.stored import Flux, stored_by

            stored = element if element.quantity else stored_by(element)
            if stored is not None:
                return Flux.read(stored, context)
        found = read_passive(cls, element, context, "l", "inductance")
        if found is None:
            return None
        device = cls(element, *found)
        if device.value < 0.0 or device.value == float("inf"):
            context.findings.error(
                "NS2005",
                f"{element.name} has the inductance {device.value:g} H",
                element.span,
                "give a positive value",
            )
            return None
        if device.value == 0.0:
            context.findings.warning(
                "NS2054", f"{element.name} has no inductance and is a short circuit", element.span
            )
        effects = [Effect("inductance", "value", device.value / device.m, "H")]
        if device.ic is not None:
            effects.append(Effect("initial current", "ic", device.ic, "A"))
        device.effects = (*effects, *device.coefficients.effects)
        return device

    def inductance(self, layout: Layout) -> float:
        """Return the whole inductance [H] under the conditions of a layout."""
        return self.at(layout.conditions) / self.m

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one inductive branch, a short for a zero inductance."""
        short = values.get(self.name, self.value) == 0.0
        return (Edge("V" if short else "L", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``L i' - (va - vb) = 0`` and the current into the KCL rows."""
        branch = stamper.branch(self.name)
        stamper.connect(branch, *self.ends)
        value = self.inductance(stamper.layout)
        if value:
            stamper.E.add(branch, branch, value)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current."""
        return layout.branch(self.name)
