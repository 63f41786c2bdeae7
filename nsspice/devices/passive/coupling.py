"""Coupled inductors ``K name L1 L2 [L3 ...] k``: v1 = L1 i1' + M i2' with M = k sqrt(L1 L2).

Perfect coupling, |k| = 1, is allowed: the inductance matrix is then singular and the windings form
an ideal transformer with a magnetising inductance.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...netlist.text.numbers import square_root
from ...problems.descriptor import Functional
from ..device import Context, Device, check_flags, number
from ..effect import Effect
from ..parameter import Table
from ..stamper import Layout, Stamper

if TYPE_CHECKING:
    from ...netlist.deck import Element
    from .inductor import Inductor


class Coupling(Device):
    """Magnetic coupling of two or more inductors; it has no branch of its own."""

    KIND = "coupling"
    INSTANCE = Table()
    late = True
    NOISE = ()
    __slots__ = ("coefficient", "inductors")

    def __init__(self, element: Element, coefficient: float) -> None:
        super().__init__(element)
        self.coefficient = coefficient
        #: set by the circuit once all names are known
        self.inductors: tuple[Inductor, ...] = ()

    @classmethod
    def read(cls, element: Element, context: Context) -> Coupling | None:
        """Return the coupling of an element line, or None after reporting why not."""
        findings = context.findings
        check_flags(cls, element, findings)
        cls.INSTANCE.read(element.params, element.name, findings)
        k = number(element, "coupling coefficient", findings)
        if k is None:
            return None
        if abs(k) > 1.0:
            findings.error(
                "NS2010",
                f"the coupling {element.name} = {k:g} is larger than 1",
                element.span,
                "a coupling is between -1 and 1; 1 is a perfect transformer",
            )
            return None
        if len(element.controls) < 2 or len(set(element.controls)) < len(element.controls):
            findings.error(
                "NS2010",
                f"{element.name} must couple at least two different inductors",
                element.span,
                "write K1 L1 L2 0.99",
            )
            return None
        device = cls(element, k)
        device.effects = (Effect("coupling", "k", k),)
        return device

    @property
    def control_elements(self) -> tuple[str, ...]:
        """Return the coupled inductors."""
        return self.controls

    def mutual(self, layout: Layout) -> Iterator[tuple[Inductor, Inductor, float]]:
        """Yield each coupled pair of inductors with its mutual inductance [H]."""
        for one, two in itertools.combinations(self.inductors, 2):
            product = one.inductance(layout) * two.inductance(layout)
            yield one, two, self.coefficient * square_root(product)

    def stamp(self, stamper: Stamper) -> None:
        """Write the mutual inductances."""
        layout = stamper.layout
        for one, two, value in self.mutual(layout):
            i, j = layout.branches[one.name], layout.branches[two.name]
            stamper.E.add(i, j, value)
            stamper.E.add(j, i, value)

    def current(self, layout: Layout) -> Functional:
        """Return nothing: a coupling carries no current."""
        return Functional()
