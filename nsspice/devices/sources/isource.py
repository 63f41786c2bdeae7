"""Independent current source ``I a b ...``: a given current flows from a through it to b.

With a table of the voltage across it, LTspice's ``TBL``, it is a behavioural source.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...problems.descriptor import Functional, Waveform
from ..device import NO_VALUES, Context, Device, Edge
from ..effect import Effect
from ..parameter import Parameter, Table
from ..stamper import Conditions, Layout, Stamper
from .vsource import SOURCE_SHARED, read_source
from .waveform import source_waveforms

if TYPE_CHECKING:
    from ...netlist.deck import Element, Source


class CurrentSource(Device):
    """An independent current source."""

    KIND = "current source"
    INSTANCE = Table(Parameter("m", "number of equal sources in parallel", "", 1.0), *SOURCE_SHARED)
    NOISE = ()
    __slots__ = ("m", "source")

    def __init__(self, element: Element, source: Source, m: float) -> None:
        super().__init__(element)
        self.source = source
        self.m = m
        self.effects = (Effect(f"{source.kind or 'dc'} current"),)

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the source of an element line, or None after reporting why not."""
        if element.quantity:
            from ..expressions.behavioural import Behavioural

            return Behavioural.read(element, context)
        found = read_source(cls, element, context)
        return None if found is None else cls(element, found[0], found[1].get("m", 1.0))

    def waveforms(self, conditions: Conditions) -> tuple[Waveform, ...]:
        """Return the functions of time whose sum is the current of one source, before ``m``."""
        return source_waveforms(self.source, conditions, self.name)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one current branch."""
        return (Edge("I", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write the current that leaves the first node."""
        for number, waveform in enumerate(self.waveforms(stamper.layout.conditions)):
            if waveform.kind != "dc" or waveform.values[0] != 0.0:
                column = stamper.column(waveform)
                stamper.layout.columns[f"{self.name}#end" if number else self.name] = column
                stamper.current_source(*self.ends, column, self.m)

    def current(self, layout: Layout) -> Functional:
        """Return the source's own value."""
        names = (self.name, f"{self.name}#end")
        return Functional(
            u=tuple((layout.columns[n], self.m) for n in names if n in layout.columns)
        )
