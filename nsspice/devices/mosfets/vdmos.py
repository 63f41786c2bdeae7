"""The power MOSFET ``VDMOS``: its nodes, resistances, channel, body diode and charges.

Parameters that are not given add nothing: no resistance, no node, no charge.  The body diode lies
between the outer source and drain, its resistance ``Rb`` in series with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from ..device import NO_VALUES, Context, Edge
from ..diodes.diode_branch import JunctionBody, Voltage
from ..diodes.number_tape import NumberTape
from ..effect import Effect, called_for
from ..parameter import Table, inert
from ..stamper import Conditions, Layout, Stamper
from .mosfet import INITIAL, MULTIPLE, TEMPERATURES, Flow
from .smooth_mosfet import SmoothMosfet
from .vdmos_card import EFFECTS, NEUTRAL_ZERO, body_diode, check_card, is_n
from .vdmos_law import VdmosLaw, at_temperature

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model


class Vdmos(SmoothMosfet):
    """A power MOSFET with the effects that its model card gives."""

    INSTANCE = Table(
        MULTIPLE,
        *TEMPERATURES,
        *INITIAL,
        *(inert(name, "size") for name in ("w", "l", "ad", "as", "pd", "ps", "nrd", "nrs")),
    )
    CURRENTS = (("channel", "D", "S"),)
    CHARGES = (("gate-source charge", "G", "S"), ("gate-drain charge", "G", "D"))
    __slots__ = ("diode",)

    def __init__(
        self, element: Element, n: bool, card: dict[str, float], given: Mapping[str, float]
    ) -> None:
        super().__init__(element, n, card, given)
        # the body is the source: a fourth node is connected to nothing
        self.body = self.corners[2]
        self.nodes = self.corners
        self.diode = JunctionBody(body_diode(card), self.parallel, self.temp, self.dtemp)
        charged = any(card.get(key) for key in ("cgs", "cgdmin", "cgdmax"))
        self.stores_energy = charged or self.diode.stores_energy
        self.effects = (
            Effect(f"power {'NMOS' if n else 'PMOS'}"),
            *called_for(card, EFFECTS, NEUTRAL_ZERO),
        )

    @classmethod
    def of(cls, element: Element, model: Model, context: Context) -> Vdmos | None:
        """Return the transistor of an element line, or None after reporting why not."""
        findings = context.findings
        given = cls.INSTANCE.read(element.params, element.name, findings)
        card = context.card(model, check_card)
        if not given.get("m", 1.0) > 0.0:
            message = f"m of {element.name} must be positive"
            findings.error("NS2005", message, element.params["m"].span)
            return None
        if card is None:
            return None
        if len(element.nodes) > 3 and element.nodes[3] != element.nodes[2]:
            findings.warning(
                "NS2052",
                f"the fourth node of {element.name} is not connected: the body of a VDMOS is its "
                "source",
                element.node_spans[3],
            )
        return cls(element, is_n(model), card, given)

    def parameters(self, conditions: Conditions) -> dict[str, float]:
        """Return the parameters at the temperature of the transistor."""
        return at_temperature(self.card, self.n, conditions, self.temp, self.dtemp)

    def resistances(self, conditions: Conditions) -> dict[str, float]:
        """Return the resistance [Ohm] in series with each terminal that has one."""
        p = self.parameters(conditions)
        return {end: p[f"r{end}"] for end in ("d", "g", "s") if p[f"r{end}"]}

    @property
    def _diode_ends(self) -> tuple[str, str]:
        """Anode and cathode of the body diode."""
        d, _, s = self.corners
        return (s, d) if self.n else (d, s)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return channel, body diode and charges of the gate."""
        d, g, s = self.corners
        p = self.parameters(Conditions())
        found = [Edge("R", d, s)]
        found += [Edge("C", g, node) for key, node in (("cgs", s), ("cgdmax", d)) if p[key]]
        return tuple(found)

    def stamp(self, stamper: Stamper) -> None:
        """Write the resistances, the currents, the charges and the body diode."""
        conditions = stamper.layout.conditions
        p = self.parameters(conditions)
        held = {"d": bool(p["cgdmax"]), "s": bool(p["cgs"]), "g": bool(p["cgdmax"] or p["cgs"])}
        self._stamp_resistances(stamper, held)
        nodes = self.inside(conditions)
        voltages = {
            key: self._across(stamper, nodes, key[0].upper(), key[1].upper())
            for key in ("gs", "gd", "ds")
        }
        law = VdmosLaw(stamper.tape, p, voltages)
        self._stamp_functions(stamper, nodes, {"channel": law.channel(), **law.charges()})
        self.diode.stamp(stamper, f"{self.name}.diode", self.name, *self._diode_ends)
        if self._shunt:
            stamper.conductance(nodes["d"], nodes["s"], self._shunt)

    def flows(self, layout: Layout) -> Iterator[Flow]:
        """Yield the currents inside, and that of the body diode."""
        yield from super().flows(layout)
        begin, end = ("s", "d") if self.n else ("d", "s")
        current = self.diode.current(layout, f"{self.name}.diode", *self._diode_ends)
        yield Flow(current, begin, end)

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charges from which a run with ``uic`` starts; ``ic=`` goes first."""
        v = self._initial_voltages(voltage)
        across = {key: v[key[0]] - v[key[1]] for key in ("gs", "gd", "ds")}
        charges = VdmosLaw(NumberTape(), self.parameters(layout.conditions), across).charges()
        name, (a, k) = f"{self.name}.diode", self._diode_ends
        return [
            *self._charges_at(layout, charges),
            *layout.voltage(*self.diode.charge(layout, name, a, k, -v["d"])),
        ]
