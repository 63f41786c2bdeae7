"""Independent voltage source ``V a b ...``: va - vb is a given function of time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...problems.descriptor import Functional, Waveform
from ..device import NO_VALUES, Context, Device, Edge, check_flags
from ..effect import Effect
from ..parameter import Parameter, Table, inert, refused
from ..stamper import Conditions, Layout, Stamper
from .waveform import check_source, initial_value, source_waveforms

if TYPE_CHECKING:
    from ...netlist.deck import Element, Source


#: options that LTspice writes on source lines
SOURCE_SHARED = (
    refused("load", "the source acts as a load", "write a resistor or a diode"),
    refused("file", "a file of samples", "write the points as PWL"),
)


class VoltageSource(Device):
    """An independent voltage source; its current into the first terminal is an unknown."""

    KIND = "voltage source"
    INSTANCE = Table(
        inert("m", "number of equal sources in parallel"),
        Parameter("portnum", "number of the port, for .sp"),
        Parameter("z0", "impedance of the port, in series", "Ohm", 50.0),
        *SOURCE_SHARED,
    )
    shows_current = True
    NOISE = ()
    __slots__ = ("source",)

    def __init__(self, element: Element, source: Source) -> None:
        super().__init__(element)
        self.source = source
        self.effects = (Effect(f"{source.kind or 'dc'} voltage"),)

    @classmethod
    def read(cls, element: Element, context: Context) -> VoltageSource | None:
        """Return the source of an element line, or None after reporting why not."""
        found = read_source(cls, element, context)
        return None if found is None else cls(element, found[0])

    def waveforms(self, conditions: Conditions) -> tuple[Waveform, ...]:
        """Return the functions of time whose sum is the voltage."""
        return source_waveforms(self.source, conditions, self.name)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one voltage branch."""
        return (Edge("V", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-(va - vb) = -V``."""
        branch = stamper.branch(self.name)
        stamper.connect(branch, *self.ends)
        a, b = self.ends
        waveforms = self.waveforms(stamper.layout.conditions)
        if "0" in self.ends and a != b:
            begin = sum(initial_value(w) * w.scale for w in waveforms)
            stamper.layout.driven[a if b == "0" else b] = begin if b == "0" else -begin
        for waveform in waveforms:
            if waveform.kind != "dc" or waveform.values[0] != 0.0:
                column = stamper.column(waveform)
                stamper.layout.columns.setdefault(self.name, column)
                stamper.S.add(branch, column, -1.0)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current."""
        return layout.branch(self.name)


def read_source(
    law: type[Device], element: Element, context: Context
) -> tuple[Source, dict[str, float]] | None:
    """Return the checked source and the parameters of a V or I line, or None after reporting."""
    findings = context.findings
    check_flags(law, element, findings)
    given = law.INSTANCE.read(element.params, element.name, findings)
    if element.source is None:
        findings.error(
            "NS2004",
            f"{element.name} has no value",
            element.span,
            "write DC 5, or SIN(...), PULSE(...), PWL(...), EXP(...)",
        )
        return None
    if not check_source(element.source, element.name, findings):
        return None
    return element.source, given
