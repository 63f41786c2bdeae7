"""Laws given by an expression: ``B``, ``R V=``, and ``E F G H`` with VALUE, TABLE or POLY.

The expression may hold voltages, currents of other elements, the element's own current (``R``),
the time and the temperature.  Its comparisons become switches (``comparators``), its kinks pairs
where nothing else is nonlinear (``piecewise``).  What is left is stamped as linear elements are if
it is linear; anything else is a smooth law, whose value is a function on the tape of the system.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import TYPE_CHECKING, Self

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import Node, num
from ...problems.descriptor import Functional
from ..behaviour import linear_form
from ..carrier import Carrier
from ..coefficients import LINE, Coefficients
from ..device import NO_VALUES, Context, Device, Edge, check_flags, own_voltages
from ..effect import Effect
from ..outputs import scaled
from ..parameter import Parameter, Table, inert, refused
from ..signals import register_of, shown
from ..stamper import Layout, Stamper
from .broken_conductor import BrokenConductor, conduction_of
from .broken_line import broken_line
from .comparators import Comparator, split
from .expression_nodes import InnerNodes
from .linear_terms import constant_column, linear_output, time_columns
from .piecewise import Inner, piecewise

if TYPE_CHECKING:
    from ...netlist.deck import Element

_Law = tuple[Node, Sequence[Inner]]

#: parameters that all lines with an expression share
SHARED = (
    *LINE,
    inert("ic", "initial value (nothing is stored)"),
    refused("r", "series resistance", "put a resistor in series", "Ohm"),
)
_VOLTAGE = Table(inert("m", "number of equal sources in parallel"), *SHARED)
_CURRENT = Table(Parameter("m", "number of equal sources in parallel", "", 1.0), *SHARED)


class Reading(Device):
    """Base of the laws that are one expression."""

    late = True
    NOISE = ()
    __slots__ = (
        "coefficients", "expression", "form", "inner", "law", "pieces", "plain", "smooth",
        "sources",
    )  # fmt: skip

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element)
        #: the value is a multiple of the expression
        self.coefficients = Coefficients.of(given)
        self.expression = expression
        plain, pieces = self._laws(expression.node)
        #: the expression without jumps, and without kinks as well where that makes it linear
        self.plain, self.pieces = plain, pieces
        self._use(*(plain if pieces is None else pieces))
        self.sources: dict[str, Carrier] = {}

    def _laws(self, node: Node) -> tuple[_Law, _Law | None]:
        """Return a tree without jumps, and one without kinks if only that one is linear."""
        tree, comparators = split(node, self.name)
        found = None
        if linear_form(tree, timed=True) is None or not _linear(comparators):
            found = piecewise(node, self.name)
            if found is not None and not self.suits(*found):
                found = None
        return (tree, comparators), found

    def _use(self, node: Node, inner: Sequence[Inner]) -> None:
        self.inner = InnerNodes(self.name, inner, self.expression)
        #: the expression with its comparators in place of comparisons
        self.law = Expression(node, self.expression.span) if inner else self.expression
        #: constant and factors of a linear expression, None for a smooth law
        self.form = linear_form(node, timed=True)
        self.smooth = self.form is None or not _linear(inner)

    @property
    def kinked(self) -> bool:
        """Whether kinks may be pairs."""
        return self.pieces is not None

    def written(self, pairs: bool) -> Self:
        """Return the element with its kinks as pairs, or on the tape."""
        law = self.pieces if pairs and self.pieces is not None else self.plain
        if law[1] is self.inner.nodes:
            return self
        other = copy(self)
        other._use(*law)
        other.effects = other.described()
        return other

    def described(self) -> tuple[Effect, ...]:
        """Return the effects of the law as it is written."""
        return self.effects

    def suits(self, tree: Node, inner: Sequence[Inner]) -> bool:
        """Return whether a law may be written by these nodes."""
        return True

    @property
    def pair_count(self) -> int:
        """Return the number of pairs of the nodes inside."""
        return self.inner.pair_count

    def inner_edges(self) -> tuple[Edge, ...]:
        """Return pairs and a resistor for each node inside."""
        return self.inner.edges()

    def switching(self) -> tuple[Effect, ...]:
        """Return the effects of the nodes inside."""
        return self.inner.effects()

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Return the expression."""
        return (self.expression,)

    def linear(self, layout: Layout, parallel: float = 1.0) -> Functional:
        """Return a linear expression as a combination of unknowns and of the constant.

        Parameters
        ----------
        layout : Layout
        parallel : float
            Of how many equal elements the own current is the sum.
        """
        assert self.form is not None
        return linear_output(layout, self.form, self.sources, self.name, parallel)

    def prepare(self, stamper: Stamper) -> None:
        """Reserve what the nodes inside need, and the column of a constant."""
        self.inner.reserve(stamper)
        if self.form is not None:
            constant_column(stamper, self.form, self.name)
            time_columns(stamper, self.form)

    def control(self, stamper: Stamper, parallel: float = 1.0) -> None:
        """Write what the nodes inside follow."""
        self.inner.write(stamper, self.sources, parallel)

    def state(self, stamper: Stamper, parallel: float = 1.0) -> None:
        """Leave the expression for the certificate."""
        if self.form is not None:
            value = self.linear(stamper.layout, parallel)
            self.inner.state(stamper, value, self.sources, parallel)


def _linear(inner: Sequence[Inner]) -> bool:
    """Return whether the nodes inside read nothing but linear combinations."""
    return all(
        not isinstance(n, Comparator) or linear_form(n.control, timed=True) is not None
        for n in inner
    )


class Behavioural(Reading):
    """``B a b V={...}`` or ``I={...}``, and E, F, G, H given by an expression."""

    KIND = "behavioural source"
    INSTANCE = _CURRENT
    __slots__ = ("conductor", "keeps", "m", "quantity", "shows_current")

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element, expression, given)
        self.quantity = element.quantity
        #: the same element as a resistance, None if it is not a rising line of its own voltage
        self.conductor: BrokenConductor | None = None
        self.m = given.get("m", 1.0)
        #: a current source whose current others read has it as an unknown
        self.keeps = False
        self.shows_current = self.quantity == "v"
        self.effects = self.described()
        own = own_voltages(element.nodes)
        if self.quantity == "i" and self.kinked and expression.variables() <= set(own):
            conduction = conduction_of(broken_line(expression.node, own))
            if conduction is not None:
                self.conductor = BrokenConductor(self, conduction)

    def written(self, pairs: bool) -> Device:  # type: ignore[override]
        """Return the element with its kinks as pairs, or on the tape."""
        if pairs and self.conductor is not None and not self.keeps:
            return self.conductor
        return super().written(pairs)

    def described(self) -> tuple[Effect, ...]:
        """Return the effects of the law as it is written."""
        what = "voltage" if self.quantity == "v" else "current"
        law = Effect(f"{what} {shown(self.expression)}")
        return (law, *self.switching(), *self.coefficients.effects)

    @classmethod
    def read(cls, element: Element, context: Context) -> Behavioural | None:
        """Return the source of an element line, or None after reporting why not."""
        findings = context.findings
        check_flags(cls, element, findings)
        table = _CURRENT if element.quantity == "i" else _VOLTAGE
        given = table.read(element.params, element.name, findings)
        device = cls(element, as_expression(element), given)
        device.coefficients.check(element, findings)
        return device

    def keep_current(self) -> None:
        """Make the current an unknown because another element reads it."""
        self.keeps = True

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one controlled branch."""
        return (Edge("E" if self.quantity == "v" else "G", *self.ends),)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current, which other sources may read."""
        self.prepare(stamper)
        if self.quantity == "v":
            stamper.branch(self.name)
        elif self.keeps:
            stamper.branch(self.name, kind=0)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-(va - vb) + V = 0``, or let the current flow from a through the source to b."""
        self.control(stamper)
        self.state(stamper)
        a, b = self.ends
        row = stamper.layout.branches.get(self.name)
        growth = self.coefficients.factor(stamper.layout.conditions)
        if self.quantity == "v":
            assert row is not None
            stamper.connect(row, a, b)
            self._add(stamper, row, growth)
        elif row is not None:
            stamper.G.add(row, row, 1.0)
            self._add(stamper, row, -self.m * growth)
            stamper.inject(a, b, stamper.layout.branch(self.name))
        else:
            for node, sign in stamper.layout.voltage(a, b, self.m * growth):
                self._add(stamper, node, sign)

    def _add(self, stamper: Stamper, row: int, factor: float) -> None:
        """Add a multiple of the expression to a row."""
        if self.form is not None:
            stamper.add(row, self.linear(stamper.layout), factor)
            return
        function = stamper.function(register_of(stamper, self.law, self.sources))
        stamper.layout.functions[self.name] = function
        stamper.F.add(row, function, factor)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown, the function, or the linear combination that is the current."""
        if self.name in layout.branches:
            return layout.branch(self.name)
        if self.conductor is not None and self.conductor.stands_in(layout):
            return self.conductor.current(layout)
        weight = self.m * self.coefficients.factor(layout.conditions)
        if self.form is not None:
            return scaled(self.linear(layout), weight)
        function = layout.functions.get(self.name)  # none with both ends on one node
        return Functional() if function is None else Functional(f=((function, weight),))


def as_expression(element: Element) -> Expression:
    """Return the value of an element line as an expression."""
    value = element.value
    if isinstance(value, Expression):
        return value
    assert value is not None
    return Expression(num(value), element.span)
