"""Resistors given by an expression: ``R a b V={expr(i)}`` and ``R={expr}``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import Node
from ...problems.descriptor import Functional
from ..behaviour import linear_form
from ..coefficients import EXPONENTIAL
from ..device import NO_VALUES, Context, Edge
from ..effect import Effect
from ..expressions.behavioural import SHARED, Reading, as_expression
from ..expressions.piecewise import Inner, slope
from ..parameter import Parameter, Table, inert, refused
from ..signals import own_current, register_of, shown
from ..stamper import Layout, Stamper
from .passive import read_given
from .resistor import Resistor

if TYPE_CHECKING:
    from ...netlist.deck import Element


class BehaviouralResistor(Reading):
    """``R a b V={expr(i)}`` or ``R={expr}``: its current is an unknown."""

    KIND = "resistor"
    MODEL = Resistor.MODEL
    INSTANCE = Table(
        Parameter("m", "number of equal resistors in parallel", "", 1.0),
        *SHARED[:-1],
        EXPONENTIAL,
        refused("ac", "resistance for small signals", "leave it out", "Ohm"),
        inert("noisy", "noise on or off"),
        inert("noise", "noise on or off"),
    )
    __slots__ = ("m", "ohmic")

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        #: the expression is a resistance, not a voltage
        self.ohmic = element.quantity != "v"
        super().__init__(element, expression, given)
        self.m = given.get("m", 1.0)
        self.effects = self.described()

    def described(self) -> tuple[Effect, ...]:
        """Return the effects of the law as it is written."""
        law = Effect(f"{'resistance' if self.ohmic else 'voltage'} {shown(self.expression)}")
        return (law, *self.switching(), *self.coefficients.effects)

    @classmethod
    def read(cls, element: Element, context: Context) -> BehaviouralResistor | None:
        """Return the resistor of an element line, or None after reporting why not."""
        found = read_given(cls, element, Resistor.MODEL_TYPES, context)
        return None if found is None else cls(element, as_expression(element), found[0])

    def suits(self, tree: Node, inner: Sequence[Inner]) -> bool:
        """Return whether the voltage grows with the current: else the law may fold back."""
        form = linear_form(tree, timed=True)
        return not self.ohmic and form is not None and slope(form, inner, "i")[0] >= 0.0

    def _use(self, node: Node, inner: Sequence[Inner]) -> None:
        super()._use(node, inner)
        self.smooth = self.smooth or self.ohmic

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one resistive branch."""
        return (Edge("R", *self.ends),)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current, which the law itself and others read."""
        self.prepare(stamper)
        stamper.branch(self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-(va - vb) + V(i/m) = 0``."""
        self.control(stamper, self.m)
        layout = stamper.layout
        branch = layout.branches[self.name]
        stamper.connect(branch, *self.ends)
        growth = self.coefficients.factor(layout.conditions)
        if not self.smooth:
            stamper.add(branch, self.linear(layout, self.m), growth)
            self.state(stamper, self.m)
            return
        own = own_current(stamper, branch, self.m)
        register = register_of(stamper, self.law, self.sources, own)
        if self.ohmic:
            register = stamper.tape.op("mul", register, own)
        stamper.F.add(branch, stamper.function(register), growth)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current."""
        return layout.branch(self.name)
