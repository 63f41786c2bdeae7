"""What all D elements share: one leg between two nodes, area, flags, a drop in series."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar

from ...netlist.deck import Grid
from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import num
from ...netlist.findings import Findings
from ...problems.descriptor import Functional
from ..device import NO_VALUES, Device, Edge, number
from ..parameter import Parameter, inert
from ..stamper import Conditions, Layout, Stamper
from .characteristic import Characteristic
from .diode_branch import Body, Leg

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model

SIZE = (
    Parameter("area", "area factor", "", 1.0),
    Parameter("m", "number of equal elements in parallel", "", 1.0),
)
GEOMETRY = (
    inert("pj", "perimeter factor"),
    inert("w", "width of the junction", "m"),
    inert("l", "length of the junction", "m"),
)


class LegDevice(Device):
    """An element that is one leg between its two nodes."""

    KIND = "diode"
    FLAGS: ClassVar[tuple[str, ...]] = ("off",)
    shows_current = True
    __slots__ = ("late", "leg", "smooth", "sources", "stores_energy")

    def __init__(self, element: Element, leg: Leg) -> None:
        super().__init__(element)
        self.leg = leg
        self.effects = leg.effects
        self.smooth = leg.smooth
        self.stores_energy = leg.body.stores_energy
        #: a drop may read the current of any element
        self.late = leg.drop is not None
        self.sources = {}

    @property
    def parallel(self) -> float:
        """Number of equal elements."""
        return self.leg.parallel

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""
        return self.leg.body.pair_count

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Return the drop in series."""
        return () if self.leg.drop is None else (self.leg.drop,)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return the parallel branches of the body."""
        a, b = self.ends
        return tuple(Edge(kind, a, b) for kind in self.leg.body.kinds)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current of an element with a drop."""
        self.leg.allocate(stamper, self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write the leg."""
        self.leg.stamp(stamper, self.name, self.name, *self.ends, self.sources)

    def curve(self, conditions: Conditions) -> Characteristic | None:
        """Return voltage over current without the drop, None if that is not a broken line."""

    def bodies(self) -> Iterator[tuple[str, Body]]:
        """Yield the law of the leg."""
        yield self.name, self.leg.body

    def current(self, layout: Layout) -> Functional:
        """Return the current of the leg."""
        return self.leg.current(layout, self.name, *self.ends)


def size_of(element: Element, given: Mapping[str, float], findings: Findings) -> float | None:
    """Return area times multiplicity, or None after reporting that it is impossible."""
    area = given.get("area", 1.0)
    if element.value is not None and "area" not in given:
        bare = number(element, "area", findings)
        if bare is None:
            return None
        area = bare
    parallel = area * given.get("m", 1.0)
    if not 0.0 < parallel < math.inf:
        findings.error("NS2005", f"area and m of {element.name} must be positive", element.span)
        return None
    return parallel


def series_drop(
    element: Element | None, model: Model | None, findings: Findings
) -> Expression | None:
    """Return the drop ``V={expr(i)}`` of the element line, else of the model card."""
    for owner in (element, model):
        param = owner.params.get("v") if owner is not None else None
        if param is None:
            continue
        if isinstance(param.value, Expression):
            return param.value
        if isinstance(param.value, str | Grid):
            shown = param.value if isinstance(param.value, str) else "table(...)"
            findings.error(
                "NS2005",
                f"v={shown} is not a voltage",
                param.span,
                "write V={expression of i}",
            )
            return None
        return Expression(num(float(param.value)), param.span)
    return None
