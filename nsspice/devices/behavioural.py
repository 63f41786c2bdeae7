"""Laws given by an expression: ``B``, ``R V=``, and ``E F G H`` with VALUE, TABLE or POLY.

The expression may hold voltages, currents of other elements, the element's own current (``R``), the
time and the temperature.  One that is linear in them is stamped as linear elements are; any other
is a smooth law, whose value is a function on the tape of the system.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..netlist.expression import Expression
from ..netlist.node import num
from ..problems.descriptor import Functional, Waveform
from .behaviour import Compiler, linear_form
from .device import NO_VALUES, Context, Device, Edge, check_flags
from .effect import Effect
from .outputs import plus, scaled
from .parameter import Parameter, Table, inert, refused
from .stamper import Layout, Stamper

if TYPE_CHECKING:
    from ..errors import Span
    from ..netlist.deck import Element

_SHARED = (
    refused("tc1", "linear temperature coefficient", "write it into the expression: temper"),
    refused("tc2", "quadratic temperature coefficient", "write it into the expression: temper"),
    inert("temp", "temperature of this element", "C"),
    inert("dtemp", "temperature difference", "K"),
    inert("ic", "initial value (nothing is stored)"),
    refused("r", "series resistance", "put a resistor in series", "Ohm"),
    refused("rpar", "parallel resistance", "put a resistor in parallel", "Ohm"),
    refused("cpar", "parallel capacitance", "put a capacitor in parallel", "F"),
)
_VOLTAGE = Table(inert("m", "number of equal sources in parallel"), *_SHARED)
_CURRENT = Table(Parameter("m", "number of equal sources in parallel", "", 1.0), *_SHARED)


class Reading(Device):
    """Base of the laws that read signals: which ones, and their registers on the tape."""

    late = True
    __slots__ = ("expression", "form", "smooth", "sources")

    def __init__(self, element: Element, expression: Expression) -> None:
        super().__init__(element)
        self.expression = expression
        #: constant and factors of a linear expression, None for a smooth law
        self.form = linear_form(expression.node)
        self.smooth = self.form is None
        #: elements whose currents are read, set by the circuit once all names are known
        self.sources: dict[str, Device] = {}

    @property
    def control_nodes(self) -> tuple[str, ...]:
        """Return the nodes whose voltages are read."""
        return tuple(voltages(self.expression))

    @property
    def control_elements(self) -> tuple[str, ...]:
        """Return the elements whose currents are read."""
        return tuple(currents(self.expression))

    def control_span(self, name: str) -> Span:
        """Return the place of the expression."""
        return self.expression.span or self.span

    def signal(self, layout: Layout, name: str) -> Functional:
        """Return a signal of a linear expression as a combination of unknowns."""
        if name == "i":
            return layout.branch(self.name)
        if name[0] == "v":
            a, b = (*name[2:-1].split(","), "0")[:2]
            return Functional(z=layout.voltage(a, b))
        return self.sources[name[2:-1]].current(layout)

    def linear(self, layout: Layout, parallel: float = 1.0) -> Functional:
        """Return a linear expression as a combination of unknowns and of the constant.

        Parameters
        ----------
        layout : Layout
        parallel : float
            Of how many equal elements the own current is the sum.
        """
        assert self.form is not None
        constant, factors = self.form
        total = Functional()
        for name, value in factors.items():
            share = value / parallel if name == "i" else value
            total = plus(total, scaled(self.signal(layout, name), share))
        if constant:
            total = plus(total, Functional(u=((layout.columns[self.name], 1.0),)))
        return total

    def prepare(self, stamper: Stamper) -> None:
        """Give the constant of a linear expression a column among the sources."""
        if self.form is not None and self.form[0]:
            column = stamper.column(Waveform("dc", (self.form[0],)))
            stamper.layout.columns[self.name] = column


class Behavioural(Reading):
    """``B a b V={...}`` or ``I={...}``, and E, F, G, H given by an expression."""

    KIND = "behavioural source"
    INSTANCE = _CURRENT
    __slots__ = ("keeps", "m", "quantity", "shows_current")

    def __init__(self, element: Element, expression: Expression, m: float) -> None:
        super().__init__(element, expression)
        self.quantity = element.quantity
        self.m = m
        #: a current source whose current others read has it as an unknown
        self.keeps = False
        self.shows_current = self.quantity == "v"
        what = "voltage" if self.quantity == "v" else "current"
        self.effects = (Effect(f"{what} {shown(expression)}"),)

    @classmethod
    def read(cls, element: Element, context: Context) -> Behavioural | None:
        """Return the source of an element line, or None after reporting why not."""
        findings = context.findings
        check_flags(cls, element, findings)
        table = _CURRENT if element.quantity == "i" else _VOLTAGE
        given = table.read(element.params, element.name, findings)
        m = given.get("m", 1.0)
        return cls(element, as_expression(element), m)

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
        a, b = self.ends
        row = stamper.layout.branches.get(self.name)
        if self.quantity == "v":
            assert row is not None
            stamper.connect(row, a, b)
            self._add(stamper, row, 1.0)
        elif row is not None:
            stamper.G.add(row, row, 1.0)
            self._add(stamper, row, -self.m)
            stamper.inject(a, b, stamper.layout.branch(self.name))
        else:
            for node, sign in stamper.layout.voltage(a, b, self.m):
                self._add(stamper, node, sign)

    def _add(self, stamper: Stamper, row: int, factor: float) -> None:
        """Add a multiple of the expression to a row."""
        if self.form is not None:
            stamper.add(row, self.linear(stamper.layout), factor)
            return
        function = function_of(stamper, self.expression, self.sources)
        stamper.layout.functions[self.name] = function
        stamper.F.add(row, function, factor)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown, the function, or the linear combination that is the current."""
        if self.name in layout.branches:
            return layout.branch(self.name)
        if self.form is not None:
            return scaled(self.linear(layout), self.m)
        function = layout.functions.get(self.name)  # none with both ends on one node
        return Functional() if function is None else Functional(f=((function, self.m),))


class BehaviouralResistor(Reading):
    """``R a b V={expr(i)}`` or ``R={expr}``: its current is an unknown."""

    KIND = "resistor"
    INSTANCE = Table(
        Parameter("m", "number of equal resistors in parallel", "", 1.0),
        *_SHARED[:5],
        inert("ac", "resistance for .ac only", "Ohm"),
        inert("noisy", "noise on or off"),
        inert("noise", "noise on or off"),
    )
    __slots__ = ("m", "ohmic")

    def __init__(self, element: Element, expression: Expression, m: float) -> None:
        super().__init__(element, expression)
        self.m = m
        #: the expression is a resistance, not a voltage
        self.ohmic = element.quantity != "v"
        what = "resistance" if self.ohmic else "voltage"
        self.smooth = self.smooth or self.ohmic
        self.effects = (Effect(f"{what} {shown(expression)}"),)

    @classmethod
    def read(cls, element: Element, context: Context) -> BehaviouralResistor | None:
        """Return the resistor of an element line, or None after reporting why not."""
        findings = context.findings
        check_flags(cls, element, findings)
        given = cls.INSTANCE.read(element.params, element.name, findings)
        m = given.get("m", 1.0)
        if m <= 0.0:
            span = element.params["m"].span
            findings.error("NS2005", f"m of {element.name} must be positive", span)
            return None
        return cls(element, as_expression(element), m)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one resistive branch."""
        return (Edge("R", *self.ends),)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current, which the law itself and others read."""
        self.prepare(stamper)
        stamper.branch(self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-(va - vb) + V(i/m) = 0``."""
        branch = stamper.layout.branches[self.name]
        stamper.connect(branch, *self.ends)
        if not self.smooth:
            stamper.add(branch, self.linear(stamper.layout, self.m))
            return
        stamp_drop(stamper, branch, self.expression, self.sources, self.m, self.ohmic)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current."""
        return layout.branch(self.name)


def stamp_drop(
    stamper: Stamper,
    branch: int,
    expression: Expression,
    sources: Mapping[str, Device],
    parallel: float = 1.0,
    ohmic: bool = False,
) -> None:
    """Add the voltage ``expr(i)`` of a branch's own current to its row.

    Parameters
    ----------
    stamper : Stamper
    branch : int
        Unknown current of all parallel elements together, and its row.
    expression : Expression
        A voltage, or with ``ohmic`` a resistance, of one element.
    sources : mapping of str to Device
        Elements whose currents are read.
    parallel : float
        Number of equal elements.
    ohmic : bool
    """
    tape = stamper.tape
    own = tape.unknown(branch)
    if parallel != 1.0:
        own = tape.op("div", own, tape.constant(parallel))
    register = register_of(stamper, expression, sources, own)
    if ohmic:
        register = tape.op("mul", register, own)
    stamper.F.add(branch, stamper.function(register), 1.0)


def register_of(
    stamper: Stamper,
    expression: Expression,
    sources: Mapping[str, Device],
    own: int | None = None,
) -> int:
    """Return the register of an expression.

    Parameters
    ----------
    stamper : Stamper
    expression : Expression
    sources : mapping of str to Device
        Elements whose currents it reads.
    own : int, optional
        Register of the element's own current ``i``.
    """
    tape, layout = stamper.tape, stamper.layout

    def signal(name: str) -> int:
        if name == "time":
            # a DC solution is that of the time 0; sweeps count their points by the time
            dc = layout.conditions.analysis == "dc"
            return tape.constant(0.0) if dc else tape.time()
        if name == "temper":
            return tape.constant(layout.conditions.temperature)
        if name == "i":
            assert own is not None
            return own
        if name[0] == "v":
            return stamper.voltage_register(*name[2:-1].split(","))
        element = name[2:-1]
        return stamper.register(element, sources[element].current(layout))

    return Compiler(tape, signal).compile(expression.node)


def function_of(stamper: Stamper, expression: Expression, sources: Mapping[str, Device]) -> int:
    """Return the number of an expression among the functions of the system."""
    return stamper.function(register_of(stamper, expression, sources))


def voltages(expression: Expression) -> list[str]:
    """Return the nodes whose voltages an expression reads, ground left out.

    Examples
    --------
    >>> voltages(Expression.parse("v(b,a) + i(v1)"))
    ['a', 'b']
    """
    names = {n for v in expression.variables() if v[:2] == "v(" for n in v[2:-1].split(",")}
    return sorted(names - {"0"})


def currents(expression: Expression) -> list[str]:
    """Return the elements whose currents an expression reads.

    Examples
    --------
    >>> currents(Expression.parse("v(b,a) + i(v1)"))
    ['v1']
    """
    return sorted(v[2:-1] for v in expression.variables() if v[:2] == "i(")


def as_expression(element: Element) -> Expression:
    """Return the value of an element line as an expression."""
    value = element.value
    if isinstance(value, Expression):
        return value
    assert value is not None
    return Expression(num(value), element.span)


def shown(expression: Expression, length: int = 50) -> str:
    """Return an expression for a listing, shortened."""
    text = " ".join(expression.text.split())
    return "{" + (text if len(text) <= length else text[: length - 3] + "...") + "}"
