"""Inductor ``L a b value [ic=]``: v = L i'; its current is an unknown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...problems.descriptor import Functional
from ..coefficients import CARD
from ..device import NO_VALUES, Edge
from ..parameter import Parameter, Table, refused
from ..stamper import Layout, Stamper
from .passive import SHARED, Storing


class Inductor(Storing):
    """A linear inductor; its current may be fixed by sources or other inductors."""

    KIND = "inductor"
    INSTANCE = Table(
        *SHARED,
        Parameter("ic", "initial current, used with uic", "A"),
        refused("nt", "number of turns", "write the inductance"),
    )
    MODEL = Table(*CARD, Parameter("l", "inductance", "H", aliases=("ind",)))
    MODEL_TYPES: ClassVar[tuple[str, ...]] = ("l", "ind")
    WHAT = ("inductance", "H", "initial current", "A")
    NOTHING = "a short circuit"
    shows_current = True
    __slots__ = ()

    def of_all(self, value: float) -> float:
        """Return the value of all equal elements in parallel."""
        return value / self.m

    def inductance(self, layout: Layout) -> float:
        """Return the whole inductance [H] under the conditions of a layout."""
        return self.of_all(self.at(layout.conditions))

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
