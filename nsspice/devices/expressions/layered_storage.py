"""Capacitors and inductors whose charge or flux is a broken line: :mod:`.stored_curve` stamped."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import ZERO, num, var
from ...problems.descriptor import Functional
from ..device import NO_VALUES, Device, Edge, EdgeKind
from ..diodes.diode_branch import Voltage
from ..effect import Effect
from ..outputs import plus, scaled
from ..stamper import Layout, Stamper, Stated
from .comparators import Comparator
from .expression_nodes import InnerNodes
from .piecewise import Limiter, value_of
from .stand_in import StandIn
from .stored_curve import Layer, StoredCurve, X

if TYPE_CHECKING:
    from .stored import Stored


class Layered(StandIn["Stored"]):
    """Base of both: a linear element, and one with two limits for each layer.

    Parameters
    ----------
    origin : Stored
        The same element on the tape.
    curve : StoredCurve
        Of one of ``m`` equal elements.
    conditions : sequence of Comparator
        What its gates read.
    """

    stores_energy = True
    __slots__ = ("curve", "ic", "inner", "m", "whole")

    def __init__(
        self, origin: Stored, curve: StoredCurve, conditions: Sequence[Comparator] = ()
    ) -> None:
        super().__init__(origin)
        self.m, self.ic = origin.m, origin.ic
        self.curve = curve
        self.inner = InnerNodes(self.name, conditions, origin.expression)
        #: that of all of them together
        self.whole = self._together(curve)
        places = dict.fromkeys(limit for layer in curve.layers for limit, _ in layer.limits)
        kinks = (Effect(f"a kink at {place:g} {self._UNIT}") for place in sorted(places))
        gates = [layer.gate for layer in curve.layers if layer.gate is not None]
        switching = InnerNodes(self.name, gates, origin.expression).effects()
        self.effects = (*origin.effects, *kinks, *switching)

    _UNIT = ""

    @abstractmethod
    def _together(self, curve: StoredCurve) -> StoredCurve:
        """Return the curve of all elements in parallel or in series."""

    def written(self, pairs: bool) -> Device:
        """Return the element with its kinks as pairs, or on the tape."""
        return self if pairs else self.origin

    @property
    def pair_count(self) -> int:
        """Return the number of limits and of gates."""
        return self.inner.pair_count + sum(map(_pairs_of, self.curve.layers))

    def stands_in(self, layout: Layout) -> bool:
        """Return whether a system has the layers: elements that read the current ask the origin."""
        return self._names()[0][0] in layout.branches

    def _names(self) -> list[tuple[str, Layer]]:
        return [
            (layer.gate.signal[2:-1] if layer.gate else f"{self.name}#l{k}", layer)
            for k, layer in enumerate(self.whole.layers, start=1)
        ]

    def inner_edges(self) -> tuple[Edge, ...]:
        """Return the stored part of each layer and its limits."""
        kind: EdgeKind = "C" if self.letter == "c" else "L"
        edges: list[Edge] = []
        for name, layer in self._names():
            edges += [Edge("P", "0", name)] * _pairs_of(layer)
            edges += [Edge(kind, name, "0"), Edge("E", name, "0")]
        return (*self.inner.edges(), *edges)

    def _limit(self, stamper: Stamper, name: str, y: int, row: int, layer: Layer) -> None:
        """Keep an unknown between two limits by what they add to a row."""
        for limit, ceiling in layer.limits:
            sign = 1.0 if ceiling else -1.0
            pair = len(stamper.q)
            stamper.pair(f"{name}.{'ceiling' if ceiling else 'floor'}", self.name, "0", "0",
                         sign * limit, 0.0)  # fmt: skip
            stamper.A.add(row, pair, sign)
            stamper.B.add(pair, y, sign)
            stamper.layout.pairs[self.name] = (*stamper.layout.pairs.get(self.name, ()), pair)

    def _state(
        self, layout: Layout, signal: str, value: Functional, currents: Mapping[str, Functional]
    ) -> None:
        """Leave the curve for those who check what the layers have made of it."""
        expression = Expression(self.whole.tree(signal), self.span)
        layout.stated.append(Stated(self.name, expression, value, currents))

    def initial_energy(self, layout: Layout, voltage: Voltage) -> float:
        """Return the energy from which a run with ``uic`` starts [J]."""
        return self.whole.energy(self._start(voltage), self._signals(layout, voltage))

    def _signals(self, layout: Layout, voltage: Voltage) -> dict[str, float]:
        """Return what gates read at the start; nodes that sources hold have their voltages."""
        signals = {"time": 0.0, "temper": layout.conditions.temperature}
        for name in self.origin.expression.variables() - set(signals):
            signals[name] = 0.0
            if name[0] == "v":
                for node, sign in zip(name[2:-1].split(","), (1.0, -1.0), strict=False):
                    signals[name] += sign * layout.driven.get(node, voltage(node))
        for condition in self.inner.nodes:
            signals[condition.signal] = value_of(condition, signals)
        return signals

    @abstractmethod
    def _start(self, voltage: Voltage) -> float:
        """Return the voltage or current from which a run with ``uic`` starts."""


def _pairs_of(layer: Layer) -> int:
    return len(layer.limits) + (layer.gate is not None)


class ChargeLayers(Layered):
    """A capacitor: linear ones in parallel, of which some follow its voltage between limits."""

    KIND = "capacitor"
    _UNIT = "V"
    __slots__ = ()

    def _together(self, curve: StoredCurve) -> StoredCurve:
        return curve.times(self.m)

    def keep_current(self) -> None:
        """Let the linear capacitor be a layer without limits, whose current is an unknown."""
        value, layers = self.whole
        if value:
            self.whole = StoredCurve(0.0, (Layer(value, -math.inf, math.inf), *layers))

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one capacitive branch."""
        return (Edge("C", *self.ends),)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the voltage and the current of each layer, and the nodes that gates read."""
        self.inner.reserve(stamper)
        for name, _ in self._names():
            stamper.internal_node(name, self.name)
            stamper.branch(name, element=self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write the linear capacitor, and ``C y' - j = 0``, ``y - (va - vb) = 0`` of each layer."""
        a, b = self.ends
        layout = stamper.layout
        if self.whole.value:
            stamper.capacitance(a, b, self.whole.value)
        value = Functional(z=layout.voltage(a, b, self.whole.value))
        for name, layer in self._names():
            y, row = layout.nodes[name], layout.branches[name]
            stamper.capacitance(name, "0", layer.value)
            value = plus(value, Functional(z=((y, layer.value),)))
            across = var(f"v({a},{b})")
            if layer.gate is not None:
                self._gate(stamper, y, row, layer.gate)
                own = {X: across, ZERO: ZERO}
                gate = layer.gate
                layout.inner.append(gate._replace(low=own[gate.low], high=own[gate.high]))
                continue
            stamper.connect(row, a, b)
            stamper.connect(row, "0", name)
            self._limit(stamper, name, y, row, layer)
            low, high = (num(x) if math.isfinite(x) else None for x in (layer.low, layer.high))
            layout.inner.append(Limiter(f"v({name})", across, low, high))
        if any(layer.gate for layer in self.whole.layers):
            self.inner.write(stamper, self.origin.sources, self.m)
            self.inner.state(stamper, scaled(value, 1.0 / self.m), self.origin.sources, self.m)
        else:
            self._state(layout, f"v({a},{b})", value, {})

    def _gate(self, stamper: Stamper, y: int, row: int, gate: Comparator) -> None:
        """Let the voltage of a layer be that of the element or none, as a switch says."""
        across = stamper.layout.voltage(*self.ends)
        for index, sign in across:
            stamper.G.add(index, row, sign)
        stamper.G.add(y, row, -1.0)
        # open: y is the one end
        stamper.G.add(row, y, 1.0)
        if gate.low is X:
            for index, sign in across:
                stamper.G.add(row, index, -sign)
        # closed: the slack, its distance from the other end, is zero
        pair = stamper.pair(gate.signal[2:-1], self.name, "0", "0", 0.0, 0.0)
        stamper.A.add(row, pair, 1.0)
        stamper.B.add(pair, y, 1.0)
        if gate.high is X:
            for index, sign in across:
                stamper.B.add(pair, index, -sign)
        stamper.layout.pairs[self.name] = (*stamper.layout.pairs.get(self.name, ()), pair)
        self.inner.switch(stamper, self.origin.sources, pair, gate, self.m)

    def current(self, layout: Layout) -> Functional:
        """Return what flows into the linear capacitor and into the layers."""
        layers = tuple((layout.branches[name], 1.0) for name, _ in self._names())
        return Functional(z=layers, dz=layout.voltage(*self.ends, self.whole.value))

    def _start(self, voltage: Voltage) -> float:
        a, b = self.ends
        return voltage(a) - voltage(b) if self.ic is None else self.ic

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charges from which a run with ``uic`` starts."""
        x, signals = self._start(voltage), self._signals(layout, voltage)
        stored = [
            (layout.nodes[name], layer.value * layer.at(x, signals))
            for name, layer in self._names()
        ]
        return [*layout.voltage(*self.ends, self.whole.value * x), *stored]


class FluxLayers(Layered):
    """An inductor: linear ones in series, of which some follow its current between limits."""

    KIND = "nonlinear inductor"
    _UNIT = "A"
    shows_current = True
    __slots__ = ()

    def _together(self, curve: StoredCurve) -> StoredCurve:
        return curve.wider(self.m)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one inductive branch."""
        return (Edge("L", *self.ends),)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current, and the current and the voltage of each layer."""
        stamper.branch(self.name)
        for name, _ in self._names():
            stamper.branch(name, element=self.name)
            stamper.internal_node(name, self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``L i' + sum u - (va - vb) = 0``; ``L y' - u = 0``, ``y - i = 0`` of layers."""
        layout = stamper.layout
        branch = layout.branches[self.name]
        stamper.connect(branch, *self.ends)
        if self.whole.value:
            stamper.E.add(branch, branch, self.whole.value)
        value = Functional(z=((branch, self.whole.value),))
        for name, layer in self._names():
            y, row = layout.branches[name], layout.nodes[name]
            stamper.E.add(y, y, layer.value)
            for index, sign in ((branch, 1.0), (y, -1.0)):
                stamper.G.add(index, row, sign)
                stamper.G.add(row, index, -sign)
            self._limit(stamper, name, y, row, layer)
            value = plus(value, Functional(z=((y, layer.value),)))
        self._state(layout, "i", value, {"i": layout.branch(self.name)})

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current."""
        return layout.branch(self.name)

    def _start(self, voltage: Voltage) -> float:
        return 0.0 if self.ic is None else self.ic * self.m

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the fluxes from which a run with ``uic`` starts."""
        x = self._start(voltage)
        stored = [
            (layout.branches[name], layer.value * layer.at(x)) for name, layer in self._names()
        ]
        return [(layout.branches[self.name], self.whole.value * x), *stored]
