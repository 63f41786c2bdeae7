"""Storage given by an expression: ``C a b Q={expr(x)}`` and ``L a b Flux={expr(x)}`` of LTspice.

    i = d/dt Q(x),  x = va - vb            va - vb = d/dt Flux(x),  x = i

``x`` may stand beside any other signal.  An expression that is a multiple of ``x`` makes a plain
capacitor or inductor; any other one is a smooth law, whose charge or flux is a function on the tape
of the system, so that it is kept in every step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ..netlist.expression import Expression
from ..netlist.node import neg, num, sub, var
from ..problems.descriptor import Functional
from .antiderivative import antiderivative
from .behaviour import linear_form
from .carrier import Carrier
from .device import NO_VALUES, Context, Device, Edge, check_flags
from .effect import Effect
from .leg import Voltage
from .parameter import Parameter, Table
from .signals import own_current, register_of, shown
from .stamper import Layout, Stamper

if TYPE_CHECKING:
    from ..netlist.deck import Element


class Stored(Device):
    """Base of both: an expression of signals that is stored."""

    late = True
    smooth = True
    stores_energy = True
    INSTANCE = Table(
        Parameter("m", "number of equal elements in parallel", "", 1.0),
        Parameter("ic", "initial voltage or current, used with uic"),
    )
    WHAT = ""
    __slots__ = ("expression", "ic", "m", "sources")

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element)
        self.expression = expression
        self.m = given.get("m", 1.0)
        self.ic = given.get("ic")
        self.sources: dict[str, Carrier] = {}
        self.effects = (Effect(f"{self.WHAT} {shown(expression)}"),)
        if self.ic is not None:
            self.effects += (Effect("initial value", "ic", self.ic),)

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the device of an element line, or None after reporting why not."""
        value = element.value
        slope = 0.0 if not isinstance(value, Expression) else _multiple(value, element.nodes)
        if slope is not None:  # a plain element
            from . import law_of

            plain = replace(element, value=slope, quantity="")
            return law_of(element.letter).read(plain, context)
        assert isinstance(value, Expression)
        check_flags(cls, element, context.findings)
        given = cls.INSTANCE.read(element.params, element.name, context.findings)
        if given.get("m", 1.0) <= 0.0:
            message = f"m of {element.name} must be positive"
            context.findings.error("NS2005", message, element.params["m"].span)
            return None
        return cls(element, value, given)

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Return the expression."""
        return (self.expression,)

    def _initial(self, layout: Layout, voltage: Voltage) -> float:
        """Return what one element stores at the start; ``ic=`` goes before node voltages."""
        a, b = self.ends
        values = {"time": 0.0, "temper": layout.conditions.temperature}
        for name in self.expression.variables() - set(values):
            if name[0] == "v":
                ends = (*name[2:-1].split(","), "0")[:2]
                values[name] = voltage(ends[0]) - voltage(ends[1])
                if self.ic is not None and set(ends) == {a, b}:
                    values[name] = self.ic if ends[0] == a else -self.ic
            else:
                values[name] = (self.ic or 0.0) if name == "i" else 0.0
        return float(self.expression.evaluate(values))


class Charge(Stored):
    """``C a b Q={expr}``: the rate of the charge flows from a to b."""

    KIND = "capacitor"
    WHAT = "charge"
    __slots__ = ("keeps",)

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element, expression, given)
        #: the current is an unknown because another element reads it
        self.keeps = False

    def keep_current(self) -> None:
        """Make the current an unknown because another element reads it."""
        self.keeps = True

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one capacitive branch."""
        return (Edge("C", *self.ends),)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current if others read it."""
        if self.keeps:
            stamper.branch(self.name, kind=0)

    def stamp(self, stamper: Stamper) -> None:
        """Let the rate of the charge flow, or write it into the row of the current."""
        charge = stamper.function(register_of(stamper, self.expression, self.sources))
        stamper.layout.functions[self.name] = charge
        if not self.keeps:
            stamper.enter_charge(*self.ends, charge, self.m)
            return
        row = stamper.layout.branches[self.name]
        stamper.G.add(row, row, 1.0)
        stamper.Q.add(row, charge, -self.m)
        stamper.inject(*self.ends, stamper.layout.branch(self.name))

    def current(self, layout: Layout) -> Functional:
        """Return the unknown, or the rate of the charge."""
        if self.keeps:
            return layout.branch(self.name)
        return Functional(df=((layout.functions[self.name], self.m),))

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charge from which a run with ``uic`` starts."""
        charge = self.m * self._initial(layout, voltage)
        if self.keeps:
            return [(layout.branches[self.name], -charge)]
        return list(layout.voltage(*self.ends, charge))


class Flux(Stored):
    """``L a b Flux={expr}``: the rate of the flux is the voltage; the current is an unknown."""

    KIND = "nonlinear inductor"
    WHAT = "flux"
    shows_current = True
    __slots__ = ()

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one inductive branch."""
        return (Edge("L", *self.ends),)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current, which the law itself and others read."""
        stamper.branch(self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``d/dt Flux(i/m) - (va - vb) = 0`` and the current into the KCL rows."""
        branch = stamper.layout.branches[self.name]
        stamper.connect(branch, *self.ends)
        own = own_current(stamper, branch, self.m)
        flux = stamper.function(register_of(stamper, self.expression, self.sources, own))
        stamper.layout.functions[self.name] = flux
        stamper.Q.add(branch, flux, 1.0)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current."""
        return layout.branch(self.name)

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the flux from which a run with ``uic`` starts."""
        return [(layout.branches[self.name], self._initial(layout, voltage))]


def charge_of(element: Element) -> Element | None:
    """Return a capacitor whose capacitance depends on its own voltage with its charge as value.

    None stands for one that reads other signals, or whose integral is not known.

    Parameters
    ----------
    element : Element
        Its value is an expression [F].
    """
    value = element.value
    assert isinstance(value, Expression)
    names = value.variables()
    name = min(names)
    ends = (*name[2:-1].split(","), "0")[:2]
    if len(names) > 1 or name[:2] != "v(" or set(ends) != set(element.nodes) or element.model:
        return None
    integral = antiderivative(value.node, var(name))
    start = math.nan if integral is None else Expression(integral).evaluate({name: 0.0})
    if integral is None or not math.isfinite(start):
        return None
    charge = sub(integral, num(start))
    if ends[0] != element.nodes[0]:
        charge = neg(charge)
    return replace(element, value=Expression(charge, value.span), quantity="q")


def _multiple(expression: Expression, nodes: tuple[str, ...]) -> float | None:
    """Return the factor of an expression that is a multiple of x plus a constant, else None."""
    form = linear_form(expression.node)
    if form is None:
        return None
    factors = form[1]
    if set(factors) <= {"i"}:
        return factors.get("i", 0.0)
    parts: dict[str, float] = {}
    for name, factor in factors.items():
        if name[0] != "v":
            return None
        for node, sign in zip((*name[2:-1].split(","), "0")[:2], (1.0, -1.0), strict=True):
            parts[node] = parts.get(node, 0.0) + sign * factor
    (a, b), parts["0"] = nodes, 0.0
    slope = parts.get(a, 0.0) if a != "0" else -parts.get(b, 0.0)
    parts[a], parts[b] = parts.get(a, 0.0) - slope, parts.get(b, 0.0) + slope
    return slope if not any(parts[node] for node in parts if node != "0") else None
