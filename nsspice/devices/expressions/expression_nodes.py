"""Nodes inside an element that stand for the kinks and jumps of its expression, as equations.

Every such node has a resistor to ground and a source that gives it the voltage of its base; a pair
or a switch that knows no resistance holds it at another voltage.  What they sense takes no current.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import Node
from ...problems.descriptor import Functional, Switch, Waveform
from ..behaviour import linear_form
from ..device import Edge
from ..effect import Effect
from ..signals import register_of, shown
from ..stamper import Compared, Stamper, Stated
from .comparators import Comparator
from .linear_terms import Form, linear_output, time_columns
from .piecewise import Inner, value_of

if TYPE_CHECKING:
    from ..carrier import Carrier
    from ..stamper import Layout

#: from a node to ground [S]: a milliampere at 1 V
CONDUCTANCE = 1e-3

_Terms = tuple[tuple[int, float], ...]


class _Bound(NamedTuple):
    """What a pair or a switch holds a node at, or keeps it above or below."""

    pair: str
    target: Node
    below: bool


def complete(layout: Layout, z: npt.NDArray[np.float64]) -> None:
    """Give nodes inside elements the voltages that follow from those of the others, in place.

    Parameters
    ----------
    layout : Layout
    z : ndarray, shape (n,)
        Unknowns; currents count as they are there, those that are none as zero.
    """
    for node in layout.inner:
        z[layout.nodes[_name(node)]] = asked(layout, node, z)


def asked(layout: Layout, node: Inner, z: npt.NDArray[np.float64]) -> float:
    """Return the voltage that the law of a node inside an element asks for.

    Parameters
    ----------
    layout : Layout
    node : Comparator or Limiter
    z : ndarray, shape (n,)
        Unknowns; currents that are none count as zero.
    """
    signals = {"time": 0.0}
    for part in node[1:]:
        if not isinstance(part, Node):
            continue
        for name in Expression(part).variables() - set(signals):
            terms: tuple[tuple[int, float], ...] = ()
            if name[0] == "v":
                a, b = (*name[2:-1].split(","), "0")[:2]
                terms = layout.voltage(a, b)
            elif name[2:-1] in layout.branches:
                terms = layout.branch(name[2:-1]).z
            signals[name] = sum(float(z[k]) * factor for k, factor in terms)
    return value_of(node, signals)


@dataclass(frozen=True, slots=True)
class InnerNodes:
    """The nodes inside an element.

    Parameters
    ----------
    element : str
    nodes : sequence of Comparator or Limiter
        None reads one that comes after it.
    expression : Expression
        What the deck says.
    """

    element: str
    nodes: Sequence[Inner]
    expression: Expression

    @property
    def pair_count(self) -> int:
        """Number of pairs, switches among them."""
        return sum(len(_bounds(node)) for node in self.nodes)

    def edges(self) -> tuple[Edge, ...]:
        """Return the branches of each node: pairs and a resistor."""
        edges: list[Edge] = []
        for node in self.nodes:
            name = _name(node)
            edges += [Edge("P", "0", name)] * len(_bounds(node))
            edges.append(Edge("R", name, "0"))
        return tuple(edges)

    def effects(self) -> tuple[Effect, ...]:
        """Return what the nodes are there for."""
        found = []
        for node in self.nodes:
            if isinstance(node, Comparator):
                found.append(Effect(f"switching, where {_short(node.control)} = 0"))
            else:
                limits = [n for n in (node.floor, node.ceiling) if n is not None]
                where = " and at ".join(map(_short, limits))
                found.append(Effect(f"a kink of {_short(node.base)} at {where}"))
        return tuple(dict.fromkeys(found))

    def reserve(self, stamper: Stamper) -> None:
        """Reserve unknowns, pairs and the columns of sources."""
        numbers: list[int] = []
        for node in self.nodes:
            name = stamper.internal_node(_name(node), self.element)
            stamper.conductance(name, "0", CONDUCTANCE)
            stamper.layout.inner.append(node)
            for bound in _bounds(node):
                form = linear_form(bound.target, timed=True)
                assert form is not None
                ends = (name, "0") if bound.below else ("0", name)
                offset = form[0] if bound.below else -form[0]
                numbers.append(stamper.pair(bound.pair, self.element, *ends, offset, 0.0))
                time_columns(stamper, form)
        if numbers:
            stamper.layout.pairs[self.element] = tuple(numbers)

    def write(
        self, stamper: Stamper, sources: Mapping[str, Carrier], parallel: float = 1.0
    ) -> None:
        """Write what the nodes follow, and what holds them there.

        Parameters
        ----------
        stamper : Stamper
        sources : mapping of str to Carrier
            Elements whose currents are read.
        parallel : float
            Of how many equal elements the own current is the sum.
        """
        writer = _Writer(stamper, sources, self.element, parallel)
        pairs = iter(stamper.layout.pairs.get(self.element, ()))
        for node in self.nodes:
            base = node.low if isinstance(node, Comparator) else node.base
            writer.follow(_name(node), base)
            for bound in _bounds(node):
                pair = next(pairs)
                writer.hold(pair, bound)
                if isinstance(node, Comparator):
                    self._switch(writer, pair, node)

    def switch(
        self,
        stamper: Stamper,
        sources: Mapping[str, Carrier],
        pair: int,
        comparator: Comparator,
        parallel: float = 1.0,
    ) -> None:
        """Write the control of a comparator whose pair is elsewhere."""
        self._switch(_Writer(stamper, sources, self.element, parallel), pair, comparator)

    def _switch(self, writer: _Writer, pair: int, comparator: Comparator) -> None:
        """Write the control of a comparator."""
        terms, threshold = writer.control(comparator, self.expression)
        closed = comparator.closed
        writer.stamper.switches.append(
            Switch(pair, terms, threshold, threshold, closed, at_threshold=closed)
        )
        if comparator.written is not None:
            written = Expression(comparator.written, self.expression.span)
            jumping = any(Expression(side).jumps() for side in comparator.written.args)
            currents = writer.currents(written)
            if not jumping and currents is not None:
                ends = None
                if not comparator.binary:
                    ends = writer.value(comparator.low), writer.value(comparator.high)
                node = writer.stamper.layout.nodes[_name(comparator)]
                compared = Compared(self.element, written, node, currents, ends)
                writer.stamper.layout.compared.append(compared)

    def state(
        self,
        stamper: Stamper,
        value: Functional,
        sources: Mapping[str, Carrier],
        parallel: float = 1.0,
    ) -> None:
        """Leave the expression for those who check what the nodes have made of it.

        Parameters
        ----------
        stamper : Stamper
        value : Functional
            What stands for the expression in the system.
        sources : mapping of str to Carrier
        parallel : float
        """
        writer = _Writer(stamper, sources, self.element, parallel)
        currents = writer.currents(self.expression)
        if self.nodes and currents is not None and not (value.dz or value.f or value.df):
            stamper.layout.stated.append(Stated(self.element, self.expression, value, currents))


@dataclass(slots=True)
class _Writer:
    """Writes linear combinations into the system."""

    stamper: Stamper
    sources: Mapping[str, Carrier]
    element: str
    parallel: float

    def follow(self, node: str, base: Node) -> None:
        """Let a node have the voltage of a linear expression, all else apart."""
        form = _form(base)
        time_columns(self.stamper, form)
        row = self.stamper.layout.nodes[node]
        self.stamper.add(row, self._output((0.0, form[1])), -CONDUCTANCE)
        if form[0]:
            column = self.stamper.column(Waveform("dc", (form[0],)))
            self.stamper.S.add(row, column, CONDUCTANCE)

    def hold(self, pair: int, bound: _Bound) -> None:
        """Let the slack of a pair be the distance from a linear expression."""
        factors = _form(bound.target)[1]
        terms = self._unknowns(f"{bound.pair}.limit", factors)
        for index, value in terms:
            self.stamper.B.add(pair, index, -value if bound.below else value)

    def control(self, comparator: Comparator, expression: Expression) -> tuple[_Terms, float]:
        """Return unknowns with factors, and above which value of their sum a comparator closes."""
        name = f"{_name(comparator)}.control"
        form = linear_form(comparator.control, timed=True)
        stamper = self.stamper
        if form is None:
            law = Expression(comparator.control, expression.span)
            function = stamper.function(register_of(stamper, law, self.sources))
            return stamper.of_unknowns(name, Functional(f=((function, 1.0),))), 0.0
        time_columns(stamper, form)
        return self._unknowns(name, form[1]), -form[0]

    def value(self, node: Node) -> tuple[Functional, float]:
        """Return a linear expression as an output and a constant."""
        form = _form(node)
        return self._output((0.0, form[1])), form[0]

    def currents(self, written: Expression) -> dict[str, Functional] | None:
        """Return the currents that an expression reads; None if some are unknown here."""
        layout, found = self.stamper.layout, dict[str, Functional]()
        for name in written.variables():
            if name == "i":
                if self.element not in layout.branches:
                    return None
                found[name] = self._output((0.0, {"i": 1.0}))
            elif name[0] == "i":
                if name[2:-1] not in self.sources:
                    return None
                found[name] = self.sources[name[2:-1]].current(layout)
                if found[name].dz or found[name].f or found[name].df:
                    return None
        return found

    def _output(self, form: Form) -> Functional:
        layout: Layout = self.stamper.layout
        return linear_output(layout, form, self.sources, self.element, self.parallel)

    def _unknowns(self, name: str, factors: dict[str, float]) -> _Terms:
        return self.stamper.of_unknowns(name, self._output((0.0, factors)))


def _bounds(node: Inner) -> list[_Bound]:
    name = _name(node)
    if isinstance(node, Comparator):
        return [_Bound(name, node.high, False)]
    limits = ((node.floor, False), (node.ceiling, True))
    names = {False: f"{name}.floor", True: f"{name}.ceiling"}
    return [_Bound(names[below], n, below) for n, below in limits if n is not None]


def _form(node: Node) -> Form:
    form = linear_form(node, timed=True)
    assert form is not None
    return form


def _name(node: Inner) -> str:
    return node.signal[2:-1]


def _short(node: Node) -> str:
    return shown(Expression(node))[1:-1]
