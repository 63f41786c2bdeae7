r"""Currents that are rising broken lines of their own voltage: conductances and ideal diodes.

``B1 a b I={table(v(a,b), ...)}`` is a resistance, however it is written.  A line whose slope grows
to both sides of its flattest piece is a conductance in parallel with one pair for each kink
(:mod:`..diodes.characteristic`), whose currents are exactly zero where they block: the picoamperes
of a junction are not lost next to the slope of its steepest piece.  Where the line ends in
constants, as tables do, all of them see the voltage between two limits, a node inside the element.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from ...netlist.expressions.node import num, var
from ...problems.descriptor import Functional
from ..device import NO_VALUES, Device, Edge
from ..diodes.characteristic import Characteristic, Decomposition
from ..effect import Effect
from ..outputs import scaled
from ..stamper import Layout, Stamper, Stated
from .broken_line import ROUNDING, BrokenLine
from .expression_nodes import InnerNodes
from .piecewise import Limiter
from .stand_in import StandIn

if TYPE_CHECKING:
    from .behavioural import Behavioural


Terms = tuple[tuple[int, float], ...]


class Conduction(NamedTuple):
    """Parallel branches that see a voltage between two limits.

    Parameters
    ----------
    parts : Decomposition
    limits : tuple of (float, bool)
        Least or largest voltage [V], and whether it is the largest.
    places : tuple of float
        Where the line has kinks [V].
    """

    parts: Decomposition
    limits: tuple[tuple[float, bool], ...]
    places: tuple[float, ...]


def conduction_of(line: BrokenLine | None) -> Conduction | None:
    """Return a broken line of a voltage as branches, None if it is not such a current.

    Examples
    --------
    >>> line = BrokenLine((0.0, 1.0, 3.0), ((0.0, 0.0), (0.0, 2.0), (-3.0, 5.0), (12.0, 0.0)))
    >>> conduction_of(line).limits
    ((3.0, True),)
    >>> [pair.resistance for pair in conduction_of(line).parts.pairs]
    [0.5, 0.3333333333333333]
    """
    if line is None or not line.places or not line.continuous:
        return None
    # the fewest limits that make the rest a sum of branches
    for low, high in ((False, False), (False, True), (True, False), (True, True)):
        flat = (not low or line.slopes[0] == 0.0) and (not high or line.slopes[-1] == 0.0)
        if flat and low + high < len(line.laws):
            parts = _parts(line, int(low), len(line.laws) - high)
            if parts is not None:
                ends = ((line.places[0], False), (line.places[-1], True))
                limits = tuple(e for e, kept in zip(ends, (low, high), strict=True) if kept)
                return Conduction(parts, limits, line.places)
    return None


def _parts(line: BrokenLine, first: int, last: int) -> Decomposition | None:
    """Return some pieces of a line, of which the outer ones go on, as branches."""
    laws, places = list(line.laws[first:last]), line.places[first : last - 1]
    flattest = min(range(len(laws)), key=lambda k: laws[k][1])
    constant, slope = laws[flattest]
    reach = max(map(abs, line.places[max(first + flattest - 1, 0) : first + flattest + 1]))
    if abs(constant) <= ROUNDING * slope * reach:  # through the origin, but for its rounding
        laws[flattest] = constant, slope = 0.0, slope
    if not places and constant != 0.0:
        return None
    at = (k - 1 if k == flattest + 1 else k for k in range(1, len(laws)))
    vertices = tuple((laws[k][0] + laws[k][1] * v, v) for k, v in zip(at, places, strict=True))
    try:
        return Characteristic(vertices, tuple((s, 1.0) for _, s in laws)).decompose()
    except ValueError:  # it falls, or is flattest away from the origin
        return None


class BrokenConductor(StandIn["Behavioural"]):
    """A current source that is a resistance, as pairs.

    Parameters
    ----------
    origin : Behavioural
        The same element on the tape, or with nodes for its kinks.
    conduction : Conduction
        Of one of ``m`` equal elements.
    """

    KIND = "behavioural source"
    __slots__ = ("conduction", "inner")

    def __init__(self, origin: Behavioural, conduction: Conduction) -> None:
        super().__init__(origin)
        self.conduction = conduction
        bounds = {ceiling: num(place) for place, ceiling in conduction.limits}
        across = var(f"v({','.join(self.ends)})")
        limiter = Limiter(f"v({self.name}#1)", across, bounds.get(False), bounds.get(True))
        self.inner = InnerNodes(self.name, [limiter] if bounds else [], origin.expression)
        kinks = (Effect(f"a kink at {place:g} V") for place in conduction.places)
        self.effects = (*origin.effects, *kinks)

    def written(self, pairs: bool) -> Device:
        """Return the element with its kinks as pairs, or on the tape."""
        return self if pairs else self.origin.written(False)

    @property
    def pair_count(self) -> int:
        """Return the number of kinks and limits."""
        return len(self.conduction.parts.pairs) + self.inner.pair_count

    def stands_in(self, layout: Layout) -> bool:
        """Return whether a system has the branches: who reads the current asks the origin."""
        return self._own in layout.pairs

    @property
    def _own(self) -> str:
        """What the pairs of the line are kept under, apart from those of the limits."""
        return f"{self.name}#line"

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one controlled branch, as the source has."""
        return self.origin.edges(values)

    def inner_edges(self) -> tuple[Edge, ...]:
        """Return the branches of the line, and those of the limits."""
        parts, ends = self.conduction.parts, self.ends
        leakage = (Edge("R", *ends),) if parts.conductance else ()
        return (*self.inner.edges(), *leakage, *(Edge("P", *ends) for _ in parts.pairs))

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the node that the limits hold."""
        self.inner.reserve(stamper)

    def _weight(self, layout: Layout) -> float:
        return self.origin.m * self.origin.coefficients.factor(layout.conditions)

    def _seen(self, layout: Layout, factor: float = 1.0) -> Terms:
        """Return the voltage that the branches see."""
        if self.inner.nodes:
            return ((layout.nodes[f"{self.name}#1"], factor),)
        return layout.voltage(*self.ends, factor)

    def stamp(self, stamper: Stamper) -> None:
        """Write conductance and pairs, whose currents flow between the ends."""
        self.inner.write(stamper, {})
        layout, weight = stamper.layout, self._weight(stamper.layout)
        parts, ends = self.conduction.parts, layout.voltage(*self.ends)
        for row, sign in ends:
            for index, value in self._seen(layout, parts.conductance * weight):
                stamper.G.add(row, index, sign * value)
        own = []
        for k, law in enumerate(parts.pairs, start=1):
            way = 1.0 if law.forward else -1.0
            pair = stamper.pair(
                f"{self.name}.{k}", self.name, "0", "0", law.offset, law.resistance / weight
            )
            for row, sign in ends:
                stamper.A.add(row, pair, way * sign)
            for index, value in self._seen(layout, way):
                stamper.B.add(pair, index, value)
            own.append(pair)
        layout.pairs[self._own] = tuple(own)
        self._state(layout, scaled(self.current(layout), 1.0 / weight))

    def _state(self, layout: Layout, value: Functional) -> None:
        """Leave the expression for those who check what the branches have made of it."""
        layout.stated.append(Stated(self.name, self.origin.expression, value, {}))

    def current(self, layout: Layout) -> Functional:
        """Return what flows in the conductance and in the pairs."""
        parts = self.conduction.parts
        ways = (1.0 if law.forward else -1.0 for law in parts.pairs)
        return Functional(
            z=self._seen(layout, parts.conductance * self._weight(layout)),
            lam=tuple(zip(layout.pairs[self._own], ways, strict=True)),
        )
