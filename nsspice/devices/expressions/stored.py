"""Storage given by an expression: ``C a b Q={expr(x)}`` and ``L a b Flux={expr(x)}`` of LTspice.

    i = d/dt Q(x),  x = va - vb            va - vb = d/dt Flux(x),  x = i

``x`` may appear with any other signal.  An expression that is a multiple of ``x`` makes a plain
capacitor or inductor; any other one is a smooth law, whose charge or flux is a function on the tape
of the system, so that it is kept in every step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import Node, neg, num, sub, var
from ...problems.descriptor import Functional
from ..behaviour import linear_form
from ..carrier import Carrier
from ..device import NO_VALUES, Context, Device, Edge, check_flags, own_signals
from ..diodes.diode_branch import Voltage
from ..effect import Effect
from ..parameter import Parameter, Table
from ..signals import own_current, register_of, shown
from ..stamper import Layout, Stamper
from .antiderivative import antiderivative
from .broken_line import broken_line
from .layered_storage import ChargeLayers, FluxLayers, Layered
from .stored_curve import curve_of, gated_curve

if TYPE_CHECKING:
    from ...netlist.deck import Element


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
    LAYERS: ClassVar[type[Layered]]
    NOISE = ()
    __slots__ = ("expression", "ic", "layers", "m", "sources")

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element)
        #: the same element without a tape, None if the expression is not a broken line
        self.layers: Layered | None = None
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
            from .. import law_of

            plain = replace(element, value=slope, quantity="")
            return law_of(element.letter).read(plain, context)
        assert isinstance(value, Expression)
        check_flags(cls, element, context.findings)
        given = cls.INSTANCE.read(element.params, element.name, context.findings)
        if given.get("m", 1.0) <= 0.0:
            message = f"m of {element.name} must be positive"
            context.findings.error("NS2005", message, element.params["m"].span)
            return None
        device = cls(element, value, given)
        device.layers = device._layers(own_signals(element))
        return device

    def _layers(self, signals: Mapping[str, float]) -> Layered | None:
        """Return the element without a tape; the signals are multiples of x."""
        curve = curve_of(broken_line(self.expression.node, signals), rates=False)
        return None if curve is None else self.LAYERS(self, curve)

    @property
    def kinked(self) -> bool:
        """Whether kinks may be pairs."""
        return self.layers is not None

    def written(self, pairs: bool) -> Device:
        """Return the element with its kinks as pairs, or on the tape."""
        return self.layers if pairs and self.layers is not None else self

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
    LAYERS = ChargeLayers
    __slots__ = ("keeps",)

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element, expression, given)
        #: the current is an unknown because another element reads it
        self.keeps = False

    def _layers(self, signals: Mapping[str, float]) -> Layered | None:
        found = super()._layers(signals)
        if found is None:
            gated = gated_curve(self.expression.node, signals, self.name)
            found = None if gated is None else ChargeLayers(self, *gated)
        return found

    def keep_current(self) -> None:
        """Make the current an unknown because another element reads it."""
        self.keeps = True
        if self.layers is not None:
            self.layers.keep_current()

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
        """Return the unknown, the rate of the charge, or what flows into the layers."""
        if self.layers is not None and self.layers.stands_in(layout):
            return self.layers.current(layout)
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
    LAYERS = FluxLayers
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


def stored_by(element: Element) -> Element | None:
    """Return an element whose value depends on its own signal with what it stores as value.

    That is the charge of a capacitance that depends on the voltage across it, or the flux of an
    inductance that depends on its current.  None stands for one that reads other signals, or whose
    integral is not known.

    Parameters
    ----------
    element : Element
        Its value is an expression [F] or [H].
    """
    value = element.value
    assert isinstance(value, Expression)
    own, (name, *others) = own_signals(element), sorted(value.variables())
    if others or name not in own or element.model:
        return None
    curve = curve_of(broken_line(value.node, {name: 1.0}), rates=True)
    stored = antiderivative(value.node, var(name)) if curve is None else curve.tree(name)
    start = math.nan if stored is None else Expression(stored).evaluate({name: 0.0})
    if stored is None or not math.isfinite(start):
        return None
    stored = sub(stored, num(start))
    if own[name] < 0.0:
        stored = neg(stored)
    if element.letter == "c":
        return replace(element, value=Expression(stored, value.span), quantity="q")
    return replace(
        element, value=Expression(_named(stored, name, "i"), value.span), quantity="flux"
    )


def _named(node: Node, old: str, new: str) -> Node:
    """Return a tree with another name for a signal."""
    if node.op == "var" and node.value == old:
        return var(new)
    return Node(node.op, tuple(_named(arg, old, new) for arg in node.args), node.value)


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
