"""Laws given by an expression: ``B``, ``R V=``, and ``E F G H`` with VALUE, TABLE or POLY.

The expression may hold voltages, currents of other elements, the element's own current (``R``),
the time and the temperature.  Its comparisons become switches (``comparators``).  What is left is
stamped as linear elements are if it is linear; anything else is a smooth law, whose value is a
function on the tape of the system.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..netlist.expression import Expression
from ..netlist.node import Node, num
from ..problems.descriptor import Functional, Switch, Waveform
from .behaviour import linear_form, wave_of
from .carrier import Carrier
from .coefficients import EXPONENTIAL, LINE, Coefficients
from .comparators import Comparator, split
from .device import NO_VALUES, Context, Device, Edge, check_flags
from .effect import Effect
from .outputs import plus, scaled
from .parameter import Parameter, Table, inert, refused
from .passive import read_given
from .resistor import Resistor
from .signals import own_current, register_of, shown
from .stamper import Compared, Layout, Stamper

if TYPE_CHECKING:
    from ..netlist.deck import Element

#: from the node of a comparator to ground [S]: a milliampere at 1 V
CONDUCTANCE = 1e-3
#: end of the clock [s]
_LONGEST = 1e9

_Terms = tuple[tuple[int, float], ...]

_SHARED = (
    *LINE,
    inert("ic", "initial value (nothing is stored)"),
    refused("r", "series resistance", "put a resistor in series", "Ohm"),
)
_VOLTAGE = Table(inert("m", "number of equal sources in parallel"), *_SHARED)
_CURRENT = Table(Parameter("m", "number of equal sources in parallel", "", 1.0), *_SHARED)


class Reading(Device):
    """Base of the laws that are one expression."""

    late = True
    __slots__ = ("coefficients", "comparators", "expression", "form", "law", "smooth", "sources")

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element)
        #: the value is a multiple of the expression
        self.coefficients = Coefficients.of(given)
        self.expression = expression
        node, self.comparators = split(expression.node, self.name)
        #: the expression with its comparators in place of comparisons
        self.law = Expression(node, expression.span) if self.comparators else expression
        #: constant and factors of a linear expression, None for a smooth law
        self.form = linear_form(node, timed=True)
        self.smooth = self.form is None or any(
            linear_form(c.control, timed=True) is None for c in self.comparators
        )
        self.sources: dict[str, Carrier] = {}

    @property
    def pair_count(self) -> int:
        """Return one for each comparator."""
        return len(self.comparators)

    def inner_edges(self) -> tuple[Edge, ...]:
        """Return a pair and a resistor for each comparator."""
        nodes = [comparator.signal[2:-1] for comparator in self.comparators]
        return tuple(edge for c in nodes for edge in (Edge("P", "0", c), Edge("R", c, "0")))

    def switching(self) -> tuple[Effect, ...]:
        """Return the effects of the comparators."""
        return tuple(Effect(f"switching, where {_short(c.control)} = 0") for c in self.comparators)

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
        """Reserve what comparators need, and the column of the constant of a linear expression."""
        pairs = []
        for comparator in self.comparators:
            node = stamper.internal_node(comparator.signal[2:-1], self.name)
            stamper.conductance(node, "0", CONDUCTANCE)
            pairs.append(stamper.pair(node, self.name, "0", node, -1.0, 0.0))
        if pairs:
            stamper.layout.pairs[self.name] = tuple(pairs)
        if self.form is not None:
            constant_column(stamper, self.form, self.name)
            time_columns(stamper, self.form)

    def control(self, stamper: Stamper) -> None:
        """Write the controls of the comparators."""
        pairs = stamper.layout.pairs.get(self.name, ())
        for pair, comparator in zip(pairs, self.comparators, strict=True):
            terms, threshold = self._control(stamper, comparator)
            closed = comparator.closed
            switch = Switch(pair, terms, threshold, threshold, closed, at_threshold=closed)
            stamper.switches.append(switch)
            self._note(stamper, comparator)

    def _note(self, stamper: Stamper, comparator: Comparator) -> None:
        """Leave a comparison for those who check what the switches have made of it."""
        layout = stamper.layout
        if comparator.written is None:
            return
        written = Expression(comparator.written, self.expression.span)
        own = {"i"} if self.name in layout.branches else set()
        names = {name for name in written.variables() if name[0] == "i"}
        if any(Expression(side).jumps() for side in comparator.written.args) or names - own - {
            f"i({source})" for source in self.sources
        }:
            return
        currents = {
            name: layout.branch(self.name)
            if name == "i"
            else self.sources[name[2:-1]].current(layout)
            for name in names
        }
        node = layout.nodes[comparator.signal[2:-1]]
        layout.compared.append(Compared(self.name, written, node, currents))

    def _control(self, stamper: Stamper, comparator: Comparator) -> tuple[_Terms, float]:
        """Return unknowns with factors, and above which value of their sum a comparator closes."""
        name = f"{comparator.signal[2:-1]}.control"
        form = linear_form(comparator.control, timed=True)
        if form is None:
            law = Expression(comparator.control, self.expression.span)
            function = stamper.function(register_of(stamper, law, self.sources))
            return stamper.of_unknowns(name, Functional(f=((function, 1.0),))), 0.0
        constant, factors = form
        time_columns(stamper, form)
        total = linear_output(stamper.layout, (0.0, factors), self.sources, self.name)
        return stamper.of_unknowns(name, total), -constant


def _short(node: Node) -> str:
    return shown(Expression(node))[1:-1]


def constant_column(stamper: Stamper, form: tuple[float, dict[str, float]], name: str) -> None:
    """Give the constant of a linear expression a column among the sources."""
    if form[0]:
        stamper.layout.columns[name] = stamper.column(Waveform("dc", (form[0],)))


def time_columns(stamper: Stamper, form: tuple[float, dict[str, float]]) -> None:
    """Give the time, and sines of it, columns among the sources: at 0 in a DC solution."""
    still = stamper.layout.conditions.analysis == "dc"
    for signal in form[1]:
        if wave := wave_of(signal):
            rate, phase = wave
            begin = math.sin(math.radians(phase))
            moving = Waveform("sin", (0.0, 1.0, rate / (2.0 * math.pi), 0.0, 0.0, phase))
        elif signal == "time":
            begin = 0.0
            moving = Waveform("pwl", (0.0, 0.0, _LONGEST, _LONGEST))
        else:
            continue
        waveform = Waveform("dc", (begin,)) if still else moving
        stamper.layout.columns[signal] = stamper.column(waveform)


def linear_output(
    layout: Layout,
    form: tuple[float, dict[str, float]],
    sources: Mapping[str, Carrier],
    name: str,
    parallel: float = 1.0,
) -> Functional:
    """Return a linear expression as a combination of unknowns and of the constant.

    Parameters
    ----------
    layout : Layout
    form : tuple
        Constant and factors, of ``linear_form``.
    sources : mapping of str to Carrier
        Elements whose currents are read.
    name : str
        Of the branch whose current is ``i``, and of the column of the constant.
    parallel : float
        Of how many equal elements the own current is the sum.
    """
    constant, factors = form
    total = Functional()
    for signal, value in factors.items():
        if signal == "i":
            term = scaled(layout.branch(name), 1.0 / parallel)
        elif signal == "time" or wave_of(signal):
            term = Functional(u=((layout.columns[signal], 1.0),))
        elif signal[0] == "v":
            a, b = (*signal[2:-1].split(","), "0")[:2]
            term = Functional(z=layout.voltage(a, b))
        else:
            term = sources[signal[2:-1]].current(layout)
        total = plus(total, scaled(term, value))
    if constant:
        total = plus(total, Functional(u=((layout.columns[name], 1.0),)))
    return total


class Behavioural(Reading):
    """``B a b V={...}`` or ``I={...}``, and E, F, G, H given by an expression."""

    KIND = "behavioural source"
    INSTANCE = _CURRENT
    __slots__ = ("keeps", "m", "quantity", "shows_current")

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element, expression, given)
        self.quantity = element.quantity
        self.m = given.get("m", 1.0)
        #: a current source whose current others read has it as an unknown
        self.keeps = False
        self.shows_current = self.quantity == "v"
        what = "voltage" if self.quantity == "v" else "current"
        self.effects = (
            Effect(f"{what} {shown(expression)}"),
            *self.switching(),
            *self.coefficients.effects,
        )

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
        weight = self.m * self.coefficients.factor(layout.conditions)
        if self.form is not None:
            return scaled(self.linear(layout), weight)
        function = layout.functions.get(self.name)  # none with both ends on one node
        return Functional() if function is None else Functional(f=((function, weight),))


class BehaviouralResistor(Reading):
    """``R a b V={expr(i)}`` or ``R={expr}``: its current is an unknown."""

    KIND = "resistor"
    MODEL = Resistor.MODEL
    INSTANCE = Table(
        Parameter("m", "number of equal resistors in parallel", "", 1.0),
        *_SHARED[:-1],
        EXPONENTIAL,
        inert("ac", "resistance for .ac only", "Ohm"),
        inert("noisy", "noise on or off"),
        inert("noise", "noise on or off"),
    )
    __slots__ = ("m", "ohmic")

    def __init__(
        self, element: Element, expression: Expression, given: Mapping[str, float]
    ) -> None:
        super().__init__(element, expression, given)
        self.m = given.get("m", 1.0)
        #: the expression is a resistance, not a voltage
        self.ohmic = element.quantity != "v"
        what = "resistance" if self.ohmic else "voltage"
        self.smooth = self.smooth or self.ohmic
        self.effects = (
            Effect(f"{what} {shown(expression)}"),
            *self.switching(),
            *self.coefficients.effects,
        )

    @classmethod
    def read(cls, element: Element, context: Context) -> BehaviouralResistor | None:
        """Return the resistor of an element line, or None after reporting why not."""
        found = read_given(cls, element, Resistor.MODEL_TYPES, context)
        return None if found is None else cls(element, as_expression(element), found[0])

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one resistive branch."""
        return (Edge("R", *self.ends),)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current, which the law itself and others read."""
        self.prepare(stamper)
        stamper.branch(self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-(va - vb) + V(i/m) = 0``."""
        self.control(stamper)
        layout = stamper.layout
        branch = layout.branches[self.name]
        stamper.connect(branch, *self.ends)
        growth = self.coefficients.factor(layout.conditions)
        if not self.smooth:
            stamper.add(branch, self.linear(layout, self.m), growth)
            return
        own = own_current(stamper, branch, self.m)
        register = register_of(stamper, self.law, self.sources, own)
        if self.ohmic:
            register = stamper.tape.op("mul", register, own)
        stamper.F.add(branch, stamper.function(register), growth)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current."""
        return layout.branch(self.name)


def as_expression(element: Element) -> Expression:
    """Return the value of an element line as an expression."""
    value = element.value
    if isinstance(value, Expression):
        return value
    assert value is not None
    return Expression(num(value), element.span)
