"""Linear controlled sources: E (v by v), G (i by v), F (i by i), H (v by i).

Those given by an expression (VALUE, TABLE, POLY) are behavioural sources.

F and H may read the current of any element that has one (not only of a voltage source): the
controlling current is a linear combination of unknowns, multipliers and their derivatives.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...problems.descriptor import Functional
from ..carrier import Carrier
from ..device import NO_VALUES, Context, Device, Edge, check_flags, number
from ..effect import Effect
from ..outputs import scaled
from ..parameter import Parameter, Table, inert, refused
from ..stamper import Layout, Stamper

if TYPE_CHECKING:
    from ...netlist.deck import Element


_SHARED = (
    refused("tc1", "linear temperature coefficient", "write the gain at this temperature"),
    refused("tc2", "quadratic temperature coefficient", "write the gain at this temperature"),
    inert("temp", "temperature of this element", "C"),
    inert("dtemp", "temperature difference", "K"),
    inert("ic", "initial value (nothing is stored)"),
)
_VOLTAGE = Table(inert("m", "number of equal sources in parallel"), *_SHARED)
_CURRENT = Table(Parameter("m", "number of equal sources in parallel", "", 1.0), *_SHARED)


class Controlled(Device):
    """Base of the four controlled sources."""

    KIND = "controlled source"
    UNIT = ""
    INSTANCE = _VOLTAGE
    NOISE = ()
    __slots__ = ("gain",)

    def __init__(self, element: Element, gain: float) -> None:
        super().__init__(element)
        self.gain = gain
        self.effects = (Effect("gain", "value", gain, self.UNIT),)

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the controlled source of an element line, or None after reporting why not."""
        findings = context.findings
        if "delay" in element.params:
            from .delayed import Delayed

            return Delayed.read(element, context)
        if element.quantity:
            from ..expressions.behavioural import Behavioural

            return Behavioural.read(element, context)
        check_flags(cls, element, findings)
        given = cls.INSTANCE.read(element.params, element.name, findings)
        gain = number(element, "gain", findings)
        if gain is None:
            return None
        if abs(gain) == float("inf"):
            findings.error("NS2005", f"the gain of {element.name} is infinite", element.span)
            return None
        return cls(element, gain * given.get("m", 1.0))

    @abstractmethod
    def sensed(self, layout: Layout) -> Functional:
        """Return the controlling voltage or current."""


class VoltageControlled(Controlled):
    """Base of E and G."""

    __slots__ = ()

    @property
    def control_nodes(self) -> tuple[str, ...]:
        """Return the two controlling nodes."""
        return self.controls

    def sensed(self, layout: Layout) -> Functional:
        """Return the controlling voltage."""
        return Functional(z=layout.voltage(self.controls[0], self.controls[1]))


class CurrentControlled(Controlled):
    """Base of F and H."""

    late = True
    __slots__ = ("control",)

    def __init__(self, element: Element, gain: float) -> None:
        super().__init__(element, gain)
        #: set by the circuit once all names are known
        self.control: Carrier | None = None

    @property
    def control_elements(self) -> tuple[str, ...]:
        """Return the element whose current is read."""
        return self.controls

    def sensed(self, layout: Layout) -> Functional:
        """Return the controlling current."""
        return Functional() if self.control is None else self.control.current(layout)


class _VoltageOutput(Controlled):
    """Base of E and H: a voltage source with an unknown current."""

    shows_current = True
    __slots__ = ()

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one voltage branch."""
        return (Edge("E", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-(va - vb) + gain x = 0`` for what is sensed."""
        branch = stamper.layout.branches.get(self.name)
        if branch is None:
            branch = stamper.branch(self.name)
        stamper.connect(branch, *self.ends)
        stamper.add(branch, self.sensed(stamper.layout), self.gain)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current."""
        return layout.branch(self.name)


class _CurrentOutput(Controlled):
    """Base of F and G: a current from a through the source to b."""

    INSTANCE = _CURRENT
    __slots__ = ()

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one controlled-current branch."""
        return (Edge("G", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write the controlled current into the KCL rows."""
        stamper.inject(*self.ends, self.sensed(stamper.layout), self.gain)

    def current(self, layout: Layout) -> Functional:
        """Return ``gain`` times what is sensed."""
        return scaled(self.sensed(layout), self.gain)


class Vcvs(VoltageControlled, _VoltageOutput):
    """``E a b c d gain``: va - vb = gain (vc - vd)."""

    KIND = "voltage-controlled voltage source"
    __slots__ = ()


class Vccs(VoltageControlled, _CurrentOutput):
    """``G a b c d gain``: the current gain (vc - vd) flows from a through the source to b."""

    KIND = "voltage-controlled current source"
    UNIT = "S"
    __slots__ = ()


class Cccs(CurrentControlled, _CurrentOutput):
    """``F a b vname gain``: the current gain i(vname) flows from a through the source to b."""

    KIND = "current-controlled current source"
    __slots__ = ()


class Ccvs(CurrentControlled, _VoltageOutput):
    """``H a b vname r``: va - vb = r i(vname)."""

    KIND = "current-controlled voltage source"
    UNIT = "Ohm"
    __slots__ = ()

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current, which other sources may read."""
        stamper.branch(self.name)
