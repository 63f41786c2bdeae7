"""SPICE's smooth bipolar transistor: its nodes, resistances, junctions and charges.

Parameters that are not given add nothing: no Early effect, no resistance, no node, no charge.  The
substrate, a fourth node or ground, meets the collector, or the base of a lateral transistor (every
PNP, unless ``SUBS=1``; ngspice's rule), in a charge ``CJS`` and a junction ``ISS``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from ...problems.descriptor import Functional
from ..device import NO_VALUES, Context, Edge, EdgeKind
from ..diodes.diode_branch import Voltage
from ..diodes.junction import depletion_charge
from ..diodes.leg_device import size_of
from ..effect import Effect
from ..noise import Flicker, NoiseSource, shot_noise, thermal_noise
from ..parameter import Parameter, Table
from ..stamper import Conditions, Layout, Stamper
from ..temperature import kelvin
from .bipolar_card import CARD, COEFFICIENTS, EFFECTS, NEUTRAL_ZERO, check_card
from .bipolar_law import BipolarLaw
from .bipolar_thermal import at_temperature
from .transistor import ELEMENT, Transistor

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model

_OHMIC = ("rc", "rb", "re")
_LABELS = ("collector", "base", "emitter")
#: currents and charges of an NPN transistor with the ends between which they are
_FLOWS = (
    ("transport", "c", "e"),
    ("base-emitter", "b", "e"),
    ("base-collector", "b", "c"),
    ("emitter charge", "b", "e"),
    ("collector charge", "b", "c"),
    ("outer charge", "o", "c"),
)
_CHARGES = ("emitter charge", "collector charge", "outer charge", "substrate charge")


class Bipolar(Transistor):
    """A smooth transistor with the effects that its model card gives."""

    INSTANCE = Table(
        *ELEMENT,
        Parameter("temp", "temperature of this transistor", "C"),
        Parameter("dtemp", "temperature above the circuit's", "K", 0.0),
        Parameter("ic", "initial base-emitter voltage, used with uic", "V"),
        Parameter("icvce", "initial collector-emitter voltage", "V"),
    )
    MODEL = CARD
    NOISE = ("thermal", "shot", "flicker")
    smooth = True
    __slots__ = (
        "card", "dtemp", "ic", "lateral", "stores_energy", "substrate", "temp", "terminals",
    )  # fmt: skip

    def __init__(
        self,
        element: Element,
        npn: bool,
        card: Mapping[str, float],
        given: Mapping[str, float],
        parallel: float,
    ) -> None:
        super().__init__(element, npn, parallel)
        self.card = card
        self.temp = given.get("temp", card.get("t_abs"))
        self.dtemp = given.get("dtemp", 0.0)
        self.ic = given.get("ic"), given.get("icvce")
        self.stores_energy = any(card.get(key) for key in ("cje", "cjc", "tf", "tr", "cjs"))
        coupled = bool(card.get("cjs") or card.get("iss"))
        self.terminals = ("c", "b", "e", "s") if coupled else ("c", "b", "e")
        self.substrate = element.nodes[3] if len(element.nodes) > 3 else "0"
        self.lateral = card.get("subs", 1.0 if npn else -1.0) < 0.0
        self.effects = (
            Effect(f"smooth Ebers-Moll {'NPN' if npn else 'PNP'}"),
            *(
                Effect(name, key, card[key] * parallel**factor, unit)
                for key, name, unit, factor in EFFECTS
                if key in card and (card[key] or key not in NEUTRAL_ZERO)
            ),
        )
        rising = [key for _, *keys in COEFFICIENTS for key in keys if card.get(key)]
        if rising:
            self.effects += (Effect("temperature coefficients", " ".join(rising)),)

    @classmethod
    def of(cls, element: Element, model: Model, context: Context) -> Bipolar | None:
        """Return the transistor of an element line, or None after reporting why not."""
        findings = context.findings
        given = cls.INSTANCE.read(element.params, element.name, findings)
        parallel = size_of(element, given, findings)
        card = context.card(model, check_card)
        if parallel is None or card is None:
            return None
        return cls(element, model.type == "npn", card, given, parallel)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return the junctions, the current between collector and emitter, the substrate."""
        c, b, e = self.corners
        found = (Edge("R", b, e), Edge("R", b, c), Edge("G", c, e))
        if "s" not in self.terminals:
            return found
        kind: EdgeKind = "R" if self.card.get("iss") else "C"
        return (*found, Edge(kind, self.substrate, b if self.lateral else c))

    # the law ---------------------------------------------------------------------------------

    def _at(self, conditions: Conditions) -> dict[str, float]:
        """Return the parameters at the temperature of the transistor."""
        return at_temperature(self.card, conditions, self.temp, self.dtemp)

    def _inner(self) -> tuple[str, str, str]:
        """Return collector, base and emitter behind their resistances."""
        c, b, e = (
            f"{self.name}#{label}" if self.card.get(key) else node
            for node, key, label in zip(self.corners, _OHMIC, _LABELS, strict=True)
        )
        return c, b, e

    def _flows(self) -> Iterator[tuple[str, str, str]]:
        """Yield currents and charges with the ends between which they are, see ``_nodes``."""
        for name, a, k in _FLOWS:
            yield (name, a, k) if self.npn else (name, k, a)
        inner = "b" if self.lateral else "c"
        # the substrate of an NPN and of a lateral PNP transistor is p
        a, k = ("s", inner) if self.npn != self.lateral else (inner, "s")
        yield "substrate", a, k
        yield "substrate charge", a, k

    def _nodes(self) -> dict[str, str]:
        """Return the nodes of collector, base and emitter, outer base and substrate."""
        nodes = dict(zip("cbe", self._inner(), strict=True))
        return {**nodes, "o": self.corners[1], "s": self.substrate}

    def stamp(self, stamper: Stamper) -> None:
        """Write the resistances, the currents and the charges."""
        p = self._at(stamper.layout.conditions)
        nodes = self._nodes()
        held = p["cje"] > 0.0 and p["cjc"] > 0.0
        for node, end, key in zip(self.corners, "cbe", _OHMIC, strict=True):
            if nodes[end] == node:
                continue
            if key == "rb" and self._modulated:
                stamper.internal_node(nodes[end], self.name, node)
            else:
                ohms = p[key] / self.parallel
                stamper.series_resistance(node, nodes[end], self.name, ohms, held=held)
        flows = {name: (nodes[a], nodes[k]) for name, a, k in self._flows()}

        def across(name: str) -> int:
            return stamper.voltage_register(*flows[name])

        law = BipolarLaw(stamper.tape, p, across("base-emitter"), across("base-collector"))
        registers = {
            "transport": law.transport,
            "base-emitter": law.base_emitter,
            "base-collector": law.base_collector,
            "emitter charge": law.emitter_charge(),
            "collector charge": law.collector_charge(),
        }
        if p["xcjc"] < 1.0:
            registers["outer charge"] = law.outer_charge(across("outer charge"))
        if p["iss"]:
            registers["substrate"] = law.junction(across("substrate"), "iss", "ns")
        if p["cjs"]:
            registers["substrate charge"] = law.substrate_charge(across("substrate charge"))
        for name, register in registers.items():
            if register is not None:
                number = stamper.function(register)
                stamper.layout.functions[f"{self.name}#{name}"] = number
                enter = stamper.enter_charge if name in _CHARGES else stamper.enter
                enter(*flows[name], number, self.parallel)
        if self._modulated:
            ends = (nodes["o"], nodes["b"]) if self.npn else (nodes["b"], nodes["o"])
            number = stamper.function(law.base_resistance(stamper.voltage_register(*ends)))
            stamper.enter(*ends, number, self.parallel)

    @property
    def _modulated(self) -> bool:
        """True if the base resistance falls with the current."""
        get = self.card.get
        rb = get("rb", 0.0), get("trb1", 0.0), get("trb2", 0.0)
        return rb[0] > 0.0 and rb != (get("rbm", rb[0]), get("trm1", 0.0), get("trm2", 0.0))

    # outputs ---------------------------------------------------------------------------------

    def noise(self, layout: Layout, flicker: Flicker) -> Iterator[NoiseSource]:
        """Yield the noise of constant resistances and of collector and base current."""
        p, (c, b, e) = self._at(layout.conditions), self._inner()
        temperature = kelvin(layout.conditions, self.temp, self.dtemp)
        for node, inner, key in zip(self.corners, (c, b, e), _OHMIC, strict=True):
            if inner != node and not (key == "rb" and self._modulated):
                yield thermal_noise(node, inner, self.parallel / p[key], temperature)
        yield shot_noise(c, e, f"i({self.name})")
        yield shot_noise(b, e, f"i({self.name}.b)")
        yield from flicker.sources(b, e, f"i({self.name}.b)")

    def current_into(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into a terminal other than the base."""
        inner = self._nodes()[terminal]
        for node, end, key in zip(self.corners, "cbe", _OHMIC, strict=True):
            if end == terminal and inner != node:
                conductance = self.parallel / self._at(layout.conditions)[key]
                return layout.series_current(node, inner, conductance)
        f: list[tuple[int, float]] = []
        df: list[tuple[int, float]] = []
        for name, a, k in self._flows():
            number = layout.functions.get(f"{self.name}#{name}")
            if number is not None and terminal in (a, k):
                weight = self.parallel if terminal == a else -self.parallel
                (df if name in _CHARGES else f).append((number, weight))
        return Functional(f=tuple(f), df=tuple(df))

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charges from which a run with ``uic`` starts; ``ic=vbe,vce`` goes first."""
        c, b, e = self.corners
        sign = 1.0 if self.npn else -1.0
        given, across = self.ic
        vbe = sign * (voltage(b) - voltage(e) if given is None else given)
        vce = sign * (voltage(c) - voltage(e) if across is None else across)
        p, nodes, vbc = self._at(layout.conditions), self._nodes(), vbe - vce
        inner = p["cjc"] * p["xcjc"]
        outside = {"s": self.substrate, "c": c, "b": b}
        found: list[tuple[int, float]] = []
        for name, a, k in self._flows():
            if name == "emitter charge":
                charge = self._charge(p, vbe, p["cje"], "e", p["fc"])
                charge += p["tf"] * p["is"] * math.expm1(min(vbe / (p["nf"] * p["vt"]), 300.0))
            elif name == "collector charge":
                charge = self._charge(p, vbc, inner, "c", p["fc"])
                charge += p["tr"] * p["is"] * math.expm1(min(vbc / (p["nr"] * p["vt"]), 300.0))
            elif name == "outer charge":
                charge = self._charge(p, vbc, p["cjc"] - inner, "c", p["fc"])
            elif name == "substrate charge":
                v = voltage(outside[a]) - voltage(outside[k])
                charge = self._charge(p, v, p["cjs"], "s", 0.0)
            else:
                continue
            found += layout.voltage(nodes[a], nodes[k], self.parallel * charge)
        return found

    @staticmethod
    def _charge(p: Mapping[str, float], v: float, c: float, junction: str, bend: float) -> float:
        """Return the charge of a depletion layer [A s]."""
        return depletion_charge(v, c, p[f"vj{junction}"], p[f"mj{junction}"], bend)
