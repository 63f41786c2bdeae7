r"""A capacitor whose charge is a broken line, as one capacitor and a pair for each knot.

With the voltage v of the element and ``lam`` of pair k, what v has beyond its knot,

.. math::

    q = C_0 v + \sum_k C_k \lambda_k, \qquad i = \dot q, \qquad
    0 \le \lambda_k \perp \lambda_k + v_k - v \ge 0.

The charge is that of one capacitor inside the element, whose current is an unknown: however many
pieces there are, each mode has the same state, which is continuous where one piece follows another.
Next to a current that is a broken line of the same voltage, a junction written as tables, layers
would be joined at each knot by what rounding has left between them, and the picoamperes of the
reverse direction are less than what follows from that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import num, sub
from ...problems.descriptor import Functional
from ..device import Device, Edge
from ..diodes.diode_branch import Voltage
from ..stamper import Layout, Stamper, Stated
from .broken_conductor import BrokenConductor
from .layered_storage import ChargeLayers


class _Knot(NamedTuple):
    """1 above the origin or -1 below it, voltage in this direction, capacitance added."""

    way: float
    place: float
    capacitance: float


class KnottedCharge(ChargeLayers):
    """A capacitor with a knot for each kink of its charge."""

    __slots__ = ()

    @property
    def _pieces(self) -> list[tuple[float, float]]:
        """Where each piece begins, and its capacitance."""
        layers = self.whole.layers
        places = sorted({limit for layer in layers for limit, _ in layer.limits})
        begins = (-math.inf, *places)
        return [
            (begin, self.whole.value + sum(k.value for k in layers if k.low <= begin < k.high))
            for begin in begins
        ]

    @property
    def _knots(self) -> Iterator[_Knot]:
        """What each kink adds, away from the origin."""
        for (_, below), (place, above) in pairwise(self._pieces):
            way = 1.0 if place >= 0.0 else -1.0
            yield _Knot(way, way * place, way * (above - below))

    @property
    def _unit(self) -> float:
        """The largest capacitance [F]."""
        return max(capacitance for _, capacitance in self._pieces)

    @property
    def pair_count(self) -> int:
        """Return the number of knots."""
        return len(self._pieces) - 1

    @property
    def _node(self) -> str:
        return f"{self.name}#charge"

    def stands_in(self, layout: Layout) -> bool:
        """Return whether a system has the knots: who reads the current asks the origin."""
        return self._node in layout.branches

    def keep_current(self) -> None:
        """Do nothing: the current is an unknown."""

    def inner_edges(self) -> tuple[Edge, ...]:
        """Return the charge, and a pair for each knot."""
        pairs = (Edge("P", *self.ends) for _ in range(self.pair_count))
        return (Edge("C", self._node, "0"), Edge("E", self._node, "0"), *pairs)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the charge and its current."""
        stamper.internal_node(self._node, self.name)
        stamper.branch(self._node, element=self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write the charge, the knots and the current."""
        layout, unit = stamper.layout, self._unit
        layout.broken.append(self.name)
        if not stamper.junctions:
            return
        across = layout.voltage(*self.ends)
        at_origin = next(c for begin, c in reversed(self._pieces) if begin < 0.0)
        own, beyond = [], []
        for k, knot in enumerate(self._knots, start=1):
            pair = stamper.pair(f"{self.name}.{k}", self.name, "0", "0", knot.place, 1.0)
            for index, sign in across:
                stamper.B.add(pair, index, knot.way * sign)
            own.append(pair)
            beyond.append((pair, knot.way * knot.capacitance / unit))
        stamper.charge_with_knots(self._node, unit, across, at_origin / unit, beyond)
        layout.pairs[self.name] = tuple(own)
        a, b = self.ends
        tree = sub(self.whole.tree(f"v({a},{b})"), num(self._charge(0.0)))
        value = Functional(z=((layout.nodes[self._node], unit),))
        layout.stated.append(Stated(self.name, Expression(tree, self.span), value, {}))

    def _charge(self, x: float) -> float:
        layers = sum(layer.value * layer.at(x) for layer in self.whole.layers)
        return self.whole.value * x + layers

    def current(self, layout: Layout) -> Functional:
        """Return the unknown."""
        return layout.branch(self._node)

    def _stored(self, voltage: Voltage) -> float:
        return self._charge(self._start(voltage)) - self._charge(0.0)

    def initial_energy(self, layout: Layout, voltage: Voltage) -> float:
        """Return the energy of the capacitor inside from which a run with ``uic`` starts [J]."""
        return self._stored(voltage) ** 2 / (2.0 * self._unit)

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charge from which a run with ``uic`` starts."""
        return [(layout.nodes[self._node], self._stored(voltage))]


def as_junctions(devices: Sequence[Device]) -> list[Device]:
    """Return elements of which charges across the same nodes as a current have knots.

    Parameters
    ----------
    devices : sequence of Device
        Their expressions are written as pairs.
    """
    conducting = {frozenset(d.ends) for d in devices if isinstance(d, BrokenConductor)}
    return [
        _with_knots(d) if isinstance(d, ChargeLayers) and frozenset(d.ends) in conducting else d
        for d in devices
    ]


def _with_knots(layers: ChargeLayers) -> Device:
    """Return the same charge with knots, if it has several layers without gates."""
    curve = layers.curve
    several = len(curve.layers) > 1 and all(layer.gate is None for layer in curve.layers)
    if isinstance(layers, KnottedCharge) or not several:
        return layers
    knots = KnottedCharge(layers.origin, curve)
    layers.origin.layers = knots  # who reads the current asks the origin
    return knots
