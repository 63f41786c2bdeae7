"""The output of ``delay(x, td)``: what a voltage was some time ago; without time, what it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, cast

from ...problems.descriptor import Handed, Waveform
from ..device import NO_VALUES, Context, Device, Edge
from ..effect import Effect
from ..stamper import Layout, Stamper
from .controlled import Vcvs, VoltageControlled

if TYPE_CHECKING:
    from ...netlist.deck import Element


class Delayed(VoltageControlled):
    """A voltage source whose value a run hands on; at an operating point a gain of one.

    Parameters
    ----------
    element : Element
        With a parameter ``delay`` [s].
    """

    KIND = "delay"
    __slots__ = ("delay",)

    def __init__(self, element: Element) -> None:
        super().__init__(element, 1.0)
        #: [s]
        self.delay = float(cast("float", element.params["delay"].value))
        self.effects = (Effect("delay", "delay", self.delay, "s"),)

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the delay."""
        return cls(element)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one voltage branch."""
        return (Edge("V", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-v = -u``, or ``-v + x = 0``."""
        conditions = stamper.layout.conditions
        handed: object = conditions.values.get(self.name)
        if handed is None or conditions.analysis == "dc":
            Vcvs.stamp(self, stamper)  # type: ignore[arg-type]
            return
        branch = stamper.branch(self.name)
        stamper.connect(branch, *self.ends)
        waveform = Waveform("polynomial", (), handed=cast("Handed", handed))
        stamper.S.add(branch, stamper.column(waveform), -1.0)

    def delayed_part(self, layout: Layout) -> tuple[int, tuple[tuple[int, float], ...]]:
        """Return the row of the gain of one, and what of it is late."""
        return layout.branches[self.name], self.sensed(layout).z

    current = Vcvs.current
