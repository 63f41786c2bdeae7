r"""A junction as a broken line: pairs for its knots, one charge for all of them.

With the voltage v of the junction and ``lam`` of pair k, what v has beyond its knot,

.. math::

    i = \sum_k g_k \lambda_k + \dot q, \qquad q = C_0 v + \sum_k C_k \lambda_k, \qquad
    0 \le \lambda_k \perp \lambda_k + v_k - v \ge 0.

The charge is that of one capacitor inside the element, whose current is an unknown: however many
pieces there are, each mode has the same state, which is continuous where one piece follows another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

from ...problems.descriptor import Functional
from ..device import Context, EdgeKind
from ..effect import Effect
from ..stamper import Conditions, Layout, Stamper
from .characteristic import Characteristic
from .diode_branch import Body, JunctionBody
from .junction_lines import JunctionLines, Settings, junction_lines

if TYPE_CHECKING:
    from ...netlist.deck import Element

#: what the pairs are called that show that a line is left
BEYOND = "beyond"


class _Pair(NamedTuple):
    """One knot: 1 forward or -1, voltage in this direction, conductance and capacitance added.

    Beyond an ``end`` differences are not bounded.
    """

    way: float
    place: float
    conductance: float
    capacitance: float
    end: bool


@dataclass(frozen=True, slots=True)
class BrokenJunction:
    """A junction with its current and its charge as broken lines.

    Parameters
    ----------
    origin : JunctionBody
    settings : Settings
    conditions : Conditions
        Temperature of the deck.
    """

    origin: JunctionBody
    settings: Settings
    conditions: Conditions

    def lines(self, conditions: Conditions | None = None) -> JunctionLines:
        """Return the lines at a temperature, that of the deck by default."""
        origin = self.origin
        junction = origin.law.at(conditions or self.conditions, origin.temp, origin.dtemp)
        return junction_lines(junction, self.settings)

    def curve(self, conditions: Conditions) -> Characteristic:
        """Return voltage over current, ohmic resistance included, of a junction without charge."""
        line = self.lines(conditions).current
        junction = self.origin.law.at(conditions, self.origin.temp, self.origin.dtemp)
        ohms, count = junction.resistance, self.parallel
        behind, ahead = (
            list(accumulate((knot.slope for knot in knots), initial=line.slope))
            for knots in (line.reverse, line.forward)
        )
        slopes = (*reversed(behind), *ahead[1:])
        places = [knot.place for knot in (*reversed(line.reverse), *line.forward)]
        vertices = tuple((count * line.at(v), v + ohms * line.at(v)) for v in places)
        return Characteristic(vertices, tuple((count * g, 1.0 + ohms * g) for g in slopes))

    @property
    def parallel(self) -> float:
        """Number of equal junctions, or area."""
        return self.origin.parallel

    @property
    def pair_count(self) -> int:
        """Number of knots."""
        return len(list(_pairs(self.lines())))

    @property
    def smooth(self) -> bool:
        """Return False."""
        return False

    @property
    def stores_energy(self) -> bool:
        """Return whether the junction has a charge."""
        return self.origin.stores_energy

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Return what the model card called for, and how many pieces stand for it."""
        return (*self.origin.effects, Effect(f"broken lines with {self.pair_count} knots"))

    @property
    def temp(self) -> float | None:
        """Own temperature [degrees Celsius]."""
        return self.origin.temp

    @property
    def dtemp(self) -> float:
        """Temperature above the circuit's [K]."""
        return self.origin.dtemp

    def described(self) -> str:
        """Return how far the lines of one junction are from its laws, for people."""
        lines = self.lines()
        current, charge = lines.scales
        text = f"broken lines with {self.pair_count} knots, "
        text += f"current within {lines.current.error:.2g} of {current:.3g} A"
        if self.stores_energy:
            text += f", charge within {lines.error:.2g} of {charge:.3g} C"
        return f"{text}, or of itself where it is larger"

    def to_dict(self) -> dict[str, float | None]:
        """Return the same as a JSON-ready mapping."""
        lines = self.lines()
        return {
            "tolerance": self.settings.tolerance,
            "knots": self.pair_count,
            "current_error": lines.current.error,
            "current_scale": lines.scales[0],
            "charge_error": lines.error if self.stores_energy else None,
            "charge_scale": lines.scales[1] if self.stores_energy else None,
        }

    @property
    def kinds(self) -> tuple[EdgeKind, ...]:
        """Return one branch per pair, and a capacitive one."""
        pairs: tuple[EdgeKind, ...] = tuple("P" for _ in range(self.pair_count))
        return (*pairs, "C") if self.stores_energy else pairs

    def stamp(self, stamper: Stamper, name: str, element: str, a: str, b: str) -> None:
        """Write the pairs, and the charge with its current as an unknown."""
        layout, law, parallel = stamper.layout, self.origin.law, self.parallel
        lines = self.lines(layout.conditions)
        inner = a
        if law.rs:
            junction = law.at(layout.conditions, self.origin.temp, self.origin.dtemp)
            inner = f"{name}#internal"
            ohms = junction.resistance / parallel
            stamper.series_resistance(a, inner, element, ohms, held=bool(law.cjo))
        layout.broken.append(name)
        if not stamper.junctions:
            layout.pairs[name] = ()
            return
        pairs = list(_pairs(lines))
        across = layout.voltage(inner, b)
        layout.pairs[name] = tuple(
            self._knot(stamper, f"{name}.{BEYOND if pair.end else k}", element, pair, across)
            for k, pair in enumerate(pairs, start=1)
        )
        if not self.stores_energy:
            return
        unit = _unit(lines) * parallel
        node, share = f"{name}#charge", parallel / unit
        stamper.branch(node, element=element)
        stamper.internal_node(node, element)
        knots = zip(layout.pairs[name], pairs, strict=True)
        beyond = [(index, pair.way * pair.capacitance * share) for index, pair in knots]
        stamper.charge_with_knots(node, unit, across, lines.depletion.slope * share, beyond)

    def _knot(
        self,
        stamper: Stamper,
        name: str,
        element: str,
        pair: _Pair,
        across: tuple[tuple[int, float], ...],
    ) -> int:
        conductance, series = pair.conductance * self.parallel, 1.0
        if not self.stores_energy:  # lam is the current: the matrices of passive networks
            conductance, series = 1.0, 1.0 / conductance
        index = stamper.pair(name, element, "0", "0", pair.place, series)
        for row, sign in across:
            if conductance:
                stamper.A.add(row, index, pair.way * sign * conductance)
            stamper.B.add(index, row, pair.way * sign)
        return index

    def current(self, layout: Layout, name: str, a: str, b: str) -> Functional:
        """Return the current through the resistance, or what flows in the pairs and the charge."""
        law, conditions = self.origin.law, layout.conditions
        if law.rs:  # the same without the junction
            ohms = law.at(conditions, self.origin.temp, self.origin.dtemp).resistance
            return layout.series_current(a, f"{name}#internal", self.parallel / ohms)
        if not layout.pairs[name]:
            return Functional()
        pairs = zip(layout.pairs[name], _pairs(self.lines(conditions)), strict=True)
        if not self.stores_energy:
            return Functional(lam=tuple((k, p.way) for k, p in pairs))
        lam = ((k, p.way * p.conductance * self.parallel) for k, p in pairs if p.conductance)
        return Functional(z=((layout.branches[f"{name}#charge"], 1.0),), lam=tuple(lam))

    def charge(self, layout: Layout, name: str, a: str, b: str, v: float) -> tuple[str, str, float]:
        """Return the charge [A s] at a voltage and the nodes between which it is."""
        if not self.stores_energy:
            return a, b, 0.0
        return f"{name}#charge", "0", self.parallel * self.lines(layout.conditions).charge(v)


def _pairs(lines: JunctionLines) -> Iterator[_Pair]:
    """Yield the pair of each knot."""
    current, depletion, transit = lines.current, lines.depletion, lines.transit
    for way, knots, share, store in (
        (1.0, current.forward, 1.0, transit),
        (1.0, depletion.forward, 0.0, 1.0),
        (-1.0, current.reverse, 1.0, 0.0),
        (-1.0, depletion.reverse, 0.0, 1.0),
    ):
        for place, slope, end in knots:
            yield _Pair(way, way * place, share * slope, store * slope, end)


def _unit(lines: JunctionLines) -> float:
    """Return the largest capacitance of the pieces but for the last one [F]."""
    diffusion = lines.transit * sum(knot.slope for knot in lines.current.forward[:-1])
    return diffusion + lines.depletion.slope + sum(k.slope for k in lines.depletion.forward)


def as_lines(smooth: JunctionBody, element: Element, context: Context) -> Body | None:
    """Return a junction as the deck asks for it, or None after reporting that it is not possible.

    Parameters
    ----------
    smooth : JunctionBody
    element : Element
        To which it belongs.
    context : Context
    """
    if context.lines is None:
        return smooth
    broken = BrokenJunction(smooth, context.lines, context.conditions)
    try:
        broken.lines()
    except ValueError:
        message = f"{context.lines.tolerance:g} asks for too many pieces of {element.name}"
        context.findings.error("NS1010", message, element.span, "allow a larger difference")
        return None
    key = smooth.law, smooth.temp, smooth.dtemp
    context.broken.setdefault(key, (broken, []))[1].append(element.name)
    return broken
