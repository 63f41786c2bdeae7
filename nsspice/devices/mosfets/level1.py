"""SPICE's MOSFET of LEVEL=1: its nodes, resistances, channel, body junctions and charges.

Parameters that are not given add nothing: no body effect, no resistance, no node, no charge.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..device import NO_VALUES, Context, Edge
from ..diodes.diode_branch import Voltage
from ..diodes.number_tape import LawTape, NumberTape, R
from ..effect import Effect, called_for
from ..parameter import Parameter, Table
from ..stamper import Conditions, Layout, Stamper
from .level1_card import EFFECTS, NEUTRAL_ZERO, check_card
from .level1_law import Level1Law
from .level1_thermal import at_temperature
from .mosfet import INITIAL, MULTIPLE, TEMPERATURES
from .smooth_mosfet import SmoothMosfet

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model

_SIZES = (
    Parameter("w", "width of the channel, default DEFW or 100u", "m"),
    Parameter("l", "length of the channel, default DEFL or 100u", "m"),
    Parameter("ad", "area of the drain", "m2"),
    Parameter("as", "area of the source", "m2"),
    Parameter("pd", "perimeter of the drain", "m"),
    Parameter("ps", "perimeter of the source", "m"),
    Parameter("nrd", "squares of the drain, for rsh", "", 1.0),
    Parameter("nrs", "squares of the source, for rsh", "", 1.0),
)
#: SPICE's sizes of a line and a deck without any
_UNSAID = {"w": 1e-4, "l": 1e-4, "nrd": 1.0, "nrs": 1.0}


class Level1(SmoothMosfet):
    """A MOSFET of the square law with the effects that its model card gives."""

    INSTANCE = Table(MULTIPLE, *_SIZES, *TEMPERATURES, *INITIAL)
    CURRENTS = (("channel", "D", "S"), ("bd", "b", "D"), ("bs", "b", "S"))
    CHARGES = (
        ("gate-source charge", "G", "S"),
        ("gate-drain charge", "G", "D"),
        ("gate-body charge", "G", "b"),
        ("drain charge", "b", "D"),
        ("source charge", "b", "S"),
    )
    #: what reads the model card
    check = staticmethod(check_card)
    __slots__ = ("size",)

    def __init__(
        self,
        element: Element,
        n: bool,
        card: Mapping[str, float],
        given: Mapping[str, float],
        size: Mapping[str, float],
    ) -> None:
        super().__init__(element, n, card, given)
        self.size = size
        if self.body != self.corners[2]:
            self.terminals = ("d", "g", "s", "b")
        p = self.parameters(Conditions())
        stored = ("tt", "cd", "cdsw", "cs", "cssw", "cgs", "cgd", "cgb", "oxide")
        self.stores_energy = any(p[key] for key in stored)
        self.effects = self.listed()

    def listed(self) -> tuple[Effect, ...]:
        """Return the effects that the card calls for."""
        return (
            Effect(f"square law {'NMOS' if self.n else 'PMOS'}"),
            *called_for(self.card, EFFECTS, NEUTRAL_ZERO),
        )

    @classmethod
    def of(cls, element: Element, model: Model, context: Context) -> Level1 | None:
        """Return the transistor of an element line, or None after reporting why not."""
        findings = context.findings
        given = cls.INSTANCE.read(element.params, element.name, findings)
        card = context.card(model, cls.check)
        if card is None:
            return None
        size = {
            p.name: {**_UNSAID, **context.sizes, **card, **given}.get(p.name, 0.0) for p in _SIZES
        }
        length = size["l"] - 2.0 * card.get("ld", 0.0)
        least = min(given.get("m", 1.0), size["w"], length)
        if least <= 0.0 or min(size.values()) < 0.0:
            where = next((p.span for k, p in element.params.items() if k in "wlm"), element.span)
            findings.error(
                "NS2005",
                f"{element.name}: m, W and L - 2 LD must be positive, all sizes at least 0",
                where,
                "W and L are in metres: W=10u",
            )
            return None
        return cls(element, model.type == "nmos", card, given, size)

    def parameters(self, conditions: Conditions) -> dict[str, float]:
        """Return the parameters at the temperature of the transistor."""
        return self._at(self.card, conditions)

    def _at(self, card: Mapping[str, float], conditions: Conditions) -> dict[str, float]:
        return at_temperature(card, self.size, self.n, conditions, self.temp, self.dtemp)

    def law(self, tape: LawTape[R], p: Mapping[str, float], v: Mapping[str, R]) -> Level1Law[R]:
        """Return the functions of the transistor on a tape."""
        return Level1Law(tape, p, v)

    def resistances(self, conditions: Conditions) -> dict[str, float]:
        """Return the resistance [Ohm] in series with each terminal that has one."""
        p = self.parameters(conditions)
        return {end: p[f"r{end}"] for end in ("d", "g", "s") if p[f"r{end}"]}

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return channel, body junctions and charges of the gate."""
        d, g, s = self.corners
        found = [Edge("R", d, s), Edge("R", self.body, d)]
        if self.body != s:
            found.append(Edge("R", self.body, s))
        p = self.parameters(Conditions())
        ends = (("cgs", s), ("cgd", d), ("cgb", self.body))
        found += [Edge("C", g, node) for key, node in ends if p[key] or p["oxide"]]
        return tuple(found)

    def stamp(self, stamper: Stamper) -> None:
        """Write the resistances, the currents and the charges."""
        p = self.parameters(stamper.layout.conditions)
        charged = bool(p["oxide"])
        held = {end: charged or bool(p[f"c{end}"] or p[f"cg{end}"]) for end in ("d", "s")}
        held["g"] = charged or bool(p["cgs"] or p["cgd"] or p["cgb"])
        self._stamp_resistances(stamper, held)
        nodes = self.inside(stamper.layout.conditions)
        voltages = {
            key: self._across(stamper, nodes, "G" if key[0] == "g" else "b", end)
            for key, end in (("gs", "S"), ("gd", "D"), ("bs", "S"), ("bd", "D"), ("gb", "b"))
        }
        voltages["ds"] = self._across(stamper, nodes, "D", "S")
        law = self.law(stamper.tape, p, voltages)
        apart = nodes["b"] != nodes["S"]
        self._stamp_functions(
            stamper,
            nodes,
            {
                "channel": law.channel(),
                "bd": law.junction("d"),
                "bs": law.junction("s") if apart else None,
                **law.charges(apart),
            },
        )

        if self._shunt:
            stamper.conductance(nodes["d"], nodes["s"], self._shunt)

    def flicker_factor(self) -> float:
        """Return one over the channel's area and the square of the oxide's capacitance."""
        area = self.size["w"] * (self.size["l"] - 2.0 * self.card.get("ld", 0.0))
        return super().flicker_factor() / area

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charges from which a run with ``uic`` starts; ``ic=`` goes first."""
        p, v = self.parameters(layout.conditions), self._initial_voltages(voltage)
        across = {key: v[key[0]] - v[key[1]] for key in ("gs", "gd", "ds", "bs", "bd", "gb")}
        charges = self.law(NumberTape(), p, across).charges(apart=True)
        return self._charges_at(layout, charges)
