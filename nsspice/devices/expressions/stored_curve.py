r"""Charges and fluxes that are broken lines: one linear element, and others that are limited.

A charge q(v) whose slope is between 0 and some capacitance is a sum of layers,

.. math::

    q = C_0 v + \sum_k C_k y_k, \qquad y_k = \min(\max(v, a_k), b_k), \qquad C_k > 0,

each a capacitor whose voltage follows v between two limits.  With its current as an unknown,

.. math::

    C_k y_k' - j_k = 0, \qquad y_k - v - \lambda_1 + \lambda_2 = 0, \qquad
    0 \le \lambda_1 \perp y_k - a_k \ge 0, \qquad 0 \le \lambda_2 \perp b_k - y_k \ge 0,

what is stored is :math:`\tfrac12 C_0 v^2 + \sum \tfrac12 C_k y_k^2`: a quadratic form, in which
nothing is negative, so that charge and energy are kept in each mode and over each kink.  Fluxes are
the dual: inductors in series, whose current follows that of the element between two limits.
"""

from __future__ import annotations

import math
import sys
from bisect import bisect
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...netlist.expressions.node import ONE, ZERO, Node, add, call, choose, mul, num, sub, var
from ..behaviour import linear_form
from .broken_line import BrokenLine
from .comparators import Comparator
from .piecewise import piecewise, value_of

#: the voltage across the element, in the ends of a gate
X = var("x")
NO_SIGNALS: Mapping[str, float] = {}


class Layer(NamedTuple):
    """A part of a charge or a flux: ``value`` times a signal between two limits.

    With a gate it is the signal or nothing, as other signals say: then it jumps, and what is stored
    in all layers together is kept.
    """

    value: float
    low: float = -math.inf
    high: float = math.inf
    gate: Comparator | None = None

    def at(self, x: float, signals: Mapping[str, float] = NO_SIGNALS) -> float:
        """Return the signal between its limits, or what the gate makes of it."""
        if self.gate is not None:
            return value_of(self.gate, {**signals, "x": x})
        return min(max(x, self.low), self.high)

    @property
    def limits(self) -> list[tuple[float, bool]]:
        """The limits that there are, and whether each is a ceiling."""
        both = ((self.low, False), (self.high, True))
        return [(limit, ceiling) for limit, ceiling in both if math.isfinite(limit)]


class StoredCurve(NamedTuple):
    """A rising broken line through layers.

    Parameters
    ----------
    value : float
        Capacitance or inductance that acts everywhere [F or H].
    layers : tuple of Layer
        What acts besides, and where.

    Examples
    --------
    3 uF between -2 V and 2 V, 1 uF beyond:

    >>> from nsspice.netlist.expressions.expression import Expression
    >>> from nsspice.devices.expressions.broken_line import broken_line
    >>> line = broken_line(Expression.parse("1u*v(a) + 2u*limit(v(a), -2, 2)").node, {"v(a)": 1.0})
    >>> curve = StoredCurve.of(line.places, line.slopes)
    >>> curve.value, [(layer.low, layer.high) for layer in curve.layers]
    (1e-06, [(-2.0, 2.0)])
    """

    value: float
    layers: tuple[Layer, ...]

    @classmethod
    def of(cls, places: Sequence[float], slopes: Sequence[float]) -> StoredCurve | None:
        """Return the curve with such slopes before, between and after some places.

        None if a slope is negative, or all are alike.
        """
        if len(slopes) < 2 or not all(0.0 <= s < math.inf for s in slopes):
            return None
        ends = (-math.inf, *places, math.inf)
        slopes = _distinct(slopes)
        return cls(min(slopes), tuple(_layers(ends, slopes, min(slopes))))

    def times(self, factor: float) -> StoredCurve:
        """Return so many of them in parallel, as a charge."""
        layers = tuple(layer._replace(value=layer.value * factor) for layer in self.layers)
        return StoredCurve(self.value * factor, layers)

    def wider(self, factor: float) -> StoredCurve:
        """Return so many of them in parallel, as a flux of the common current."""
        layers = (Layer(v / factor, a * factor, b * factor) for v, a, b, _ in self.layers)
        return StoredCurve(self.value / factor, tuple(layers))

    def energy(self, x: float, signals: Mapping[str, float] = NO_SIGNALS) -> float:
        """Return what is stored at a voltage or a current, and at signals that gates read [J]."""
        parts = ((layer.value, layer.at(x, signals)) for layer in self.layers)
        return 0.5 * (self.value * x * x + sum(value * y * y for value, y in parts))

    def tree(self, signal: str) -> Node:
        """Return the charge or the flux as an expression of a signal."""
        x = var(signal)
        terms = [mul([num(self.value), x])] if self.value else []
        for value, low, high, _ in self.layers:
            part = x if math.isinf(low) else call("max", x, num(low))
            terms.append(
                mul([num(value), part if math.isinf(high) else call("min", part, num(high))])
            )
        return add(terms)


def curve_of(line: BrokenLine | None, rates: bool) -> StoredCurve | None:
    """Return the curve of a charge, or of a capacitance that is constant between its places.

    Parameters
    ----------
    line : BrokenLine or None
    rates : bool
        The line is the capacitance or the inductance, not the charge or the flux.
    """
    if line is None:
        return None
    if not rates:
        return StoredCurve.of(line.places, line.slopes) if line.continuous else None
    if any(line.slopes):
        return None
    return StoredCurve.of(line.places, [value for value, _ in line.laws])


def gated_curve(
    node: Node, signals: Mapping[str, float], name: str
) -> tuple[StoredCurve, list[Comparator]] | None:
    """Return a charge that is x times what comparisons of other signals choose.

    Parameters
    ----------
    node : Node
    signals : mapping of str to float
        Signals that are multiples of x.
    name : str
        Of the element, whose gates and comparators are the nodes ``name#1``, ``name#2`` ...

    Returns
    -------
    (StoredCurve, list of Comparator) or None
        Layers with gates, and the comparators that these read; None if it is not such a charge.
    """
    found = piecewise(_summed(node), name)
    form = None if found is None else linear_form(found[0])
    if found is None or form is None:
        return None
    base = sum(form[1].pop(signal, 0.0) * factor for signal, factor in signals.items())
    conditions: list[Comparator] = []
    layers: list[Layer] = []
    for part in found[1]:
        if not isinstance(part, Comparator) or _signals(part.control) & {
            *signals, *(layer.gate.signal for layer in layers if layer.gate)
        }:  # fmt: skip
            return None
        if part.binary:
            conditions.append(part)
            continue
        factor, high = form[1].pop(part.signal, 0.0), linear_form(part.high)
        if part.low is not ZERO or high is None or high[0] or not set(high[1]) <= set(signals):
            return None
        value = factor * sum(f * signals[signal] for signal, f in high[1].items())
        ends = (ZERO, X) if value >= 0.0 else (X, ZERO)
        base += min(value, 0.0)
        gate = part._replace(low=ends[0], high=ends[1])
        layers.append(Layer(abs(value), gate=gate))
    if any(form[1].values()) or base < 0.0 or not layers:
        return None
    return StoredCurve(base, tuple(layers)), conditions


def _summed(node: Node) -> Node:
    """Return a tree in which a choice is the one law, plus the difference where it is the other."""
    args = tuple(map(_summed, node.args))
    if node.op != "if":
        return Node(node.op, args, node.value)
    condition, then, other = args
    return add([other, mul([choose(condition, ONE, ZERO), sub(then, other)])])


def _signals(node: Node) -> set[str]:
    found = {str(node.value)} if node.op == "var" else set()
    return found.union(*map(_signals, node.args))


def _distinct(slopes: Sequence[float]) -> list[float]:
    """Return slopes of which none differ by rounding alone, each lowered to the next one.

    A slope is the sum of as many terms as there are kinks, each rounded by a part of the largest.
    What rounding leaves between two slopes that should be alike would be a layer of 1e-18 H.

    Examples
    --------
    >>> _distinct([0.0, 2e-4, 0.05, 2e-4 + 2e-18, 1e-19])
    [0.0, 0.0002, 0.05, 0.0002, 0.0]
    """
    rounding = len(slopes) * sys.float_info.epsilon * max(slopes)
    levels = [0.0]
    for slope in sorted(slopes):
        if slope > levels[-1] + rounding:
            levels.append(slope)
    return [levels[bisect(levels, slope) - 1] for slope in slopes]


def _layers(ends: Sequence[float], slopes: Sequence[float], ground: float) -> list[Layer]:
    """Return the layers above a ground: what the least slope of each hill has in common first."""
    found: list[Layer] = []
    begin = 0
    while begin < len(slopes):
        if slopes[begin] <= ground:
            begin += 1
            continue
        end = begin
        while end < len(slopes) and slopes[end] > ground:
            end += 1
        least = min(slopes[begin:end])
        found.append(Layer(least - ground, ends[begin], ends[end]))
        found += _layers(ends[begin : end + 1], slopes[begin:end], least)
        begin = end
    return found
