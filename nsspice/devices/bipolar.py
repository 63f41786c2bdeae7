"""SPICE's smooth bipolar transistor: Ebers-Moll in its transport form, and what the card adds.

    I = (IF - IR)(1 - vbc/VAF - vbe/VAR) / (half + sqrt(quarter + IF/IKF + IR/IKR))
    IF = IS expm1(vbe / NF Vt),   IR = IS expm1(vbc / NR Vt)

flows from collector to emitter, ``IF/BF + ISE expm1(vbe / NE Vt)`` from base to emitter and
``IR/BR + ISC expm1(vbc / NC Vt)`` from base to collector; for PNP all signs are turned.  Parameters
that are not given add nothing: no Early effect, no resistance, no node, no charge.

Reference: H. K. Gummel, H. C. Poon, Bell Syst. Tech. J. 49 (1970) 827-852, in the form of SPICE
(Massobrio and Antognetti, *Semiconductor Device Modeling with SPICE*, 2nd ed., 1993, ch. 2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..problems.descriptor import Functional
from .bipolar_card import CARD, EFFECTS, NEUTRAL_ZERO, check_card
from .device import NO_VALUES, Context, Edge
from .effect import Effect
from .junction import depletion_charge
from .leg import Voltage
from .leg_device import size_of
from .outputs import plus, scaled
from .parameter import Parameter, Table
from .stamper import Conditions, Layout, Stamper
from .thermal import CELSIUS, depletion, kelvin, saturation, thermal_voltage
from .transistor import ELEMENT, Transistor

if TYPE_CHECKING:
    from ..netlist.deck import Element, Model


@dataclass(frozen=True, slots=True)
class _Constants:
    """What depends on the temperature."""

    vt: float
    is_: float
    bf: float
    br: float
    ise: float
    isc: float
    cje: tuple[float, float]
    cjc: tuple[float, float]


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
    smooth = True
    __slots__ = ("card", "dtemp", "ic", "stores_energy", "temp")

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
        self.temp = given.get("temp")
        self.dtemp = given.get("dtemp", 0.0)
        self.ic = given.get("ic"), given.get("icvce")
        self.stores_energy = any(card.get(key) for key in ("cje", "cjc", "tf", "tr"))
        self.effects = (
            Effect(f"smooth Ebers-Moll {'NPN' if npn else 'PNP'}"),
            *(
                Effect(name, key, card[key] * parallel**factor, unit)
                for key, name, unit, factor in EFFECTS
                if key in card and (card[key] or key not in NEUTRAL_ZERO)
            ),
        )

    @classmethod
    def of(cls, element: Element, model: Model, context: Context) -> Bipolar | None:
        """Return the transistor of an element line, or None after reporting why not."""
        findings = context.findings
        given = cls.INSTANCE.read(element.params, element.name, findings)
        parallel = size_of(element, given, findings)
        card = context.models.get(id(model))
        if card is None:
            read = check_card(model, findings)
            card = context.models[id(model)] = "wrong" if read is None else read
        if parallel is None or not isinstance(card, dict):
            return None
        return cls(element, model.type == "npn", card, given, parallel)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return the two junctions and the current between collector and emitter."""
        c, b, e = self.corners
        return (Edge("R", b, e), Edge("R", b, c), Edge("G", c, e))

    # the law ---------------------------------------------------------------------------------

    def _at(self, conditions: Conditions) -> _Constants:
        """Return what depends on the temperature."""
        get = self.card.get
        actual = kelvin(conditions, self.temp, self.dtemp)
        nominal = get("tnom", conditions.nominal) + CELSIUS
        gap, exponent = get("eg", 1.11), get("xti", 3.0)
        growth = math.pow(actual / nominal, get("xtb", 0.0))

        def leakage(key: str, n: float) -> float:
            return saturation(get(key, 0.0), n, gap, exponent, nominal, actual) / growth

        return _Constants(
            thermal_voltage(actual),
            saturation(get("is", 1e-16), 1.0, gap, exponent, nominal, actual),
            get("bf", 100.0) * growth,
            get("br", 1.0) * growth,
            leakage("ise", get("ne", 1.5)),
            leakage("isc", get("nc", 2.0)),
            depletion(get("cje", 0.0), get("vje", 0.75), get("mje", 0.33), nominal, actual),
            depletion(get("cjc", 0.0), get("vjc", 0.75), get("mjc", 0.33), nominal, actual),
        )

    def stamp(self, stamper: Stamper) -> None:
        """Write the resistances, the three currents and the two charges."""
        layout, get = stamper.layout, self.card.get
        inner = []
        for node, key, label in zip(
            self.corners, ("rc", "rb", "re"), ("collector", "base", "emitter"), strict=True
        ):
            ohm = get(key, 0.0)
            if ohm:
                inner.append(stamper.internal_node(f"{self.name}#{label}", self.name))
                if key != "rb" or not self._modulated:
                    stamper.conductance(node, inner[-1], self.parallel / ohm)
            else:
                inner.append(node)
        c, b, e = inner
        law = _Law(self, stamper, c, b, e)
        for name, (a, k), register in (
            ("transport", (c, e), law.transport),
            ("base-emitter", (b, e), law.base_emitter),
            ("base-collector", (b, c), law.base_collector),
        ):
            number = layout.functions[f"{self.name}#{name}"] = stamper.function(register)
            stamper.enter(*self._turned(a, k), number, self.parallel)
        for name, (a, k), charge in (
            ("emitter charge", (b, e), law.emitter_charge()),
            ("collector charge", (b, c), law.collector_charge()),
        ):
            if charge is not None:
                number = layout.functions[f"{self.name}#{name}"] = stamper.function(charge)
                stamper.enter_charge(*self._turned(a, k), number, self.parallel)
        if self._modulated:
            number = stamper.function(law.base_resistance(self.corners[1], b))
            layout.functions[f"{self.name}#base current"] = number
            stamper.enter(self.corners[1], b, number, self.parallel)

    @property
    def _modulated(self) -> bool:
        """True if the base resistance falls with the current."""
        rb, rbm = self.card.get("rb", 0.0), self.card.get("rbm")
        return bool(rb) and rbm is not None and rbm != rb

    def _turned(self, a: str, k: str) -> tuple[str, str]:
        """Return the ends of a branch in the direction of its current."""
        return (a, k) if self.npn else (k, a)

    # outputs ---------------------------------------------------------------------------------

    def terminal_current(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into a terminal."""
        if terminal == "b":
            return super().terminal_current(layout, terminal)
        node, key, label = {
            "c": (self.corners[0], "rc", "collector"),
            "e": (self.corners[2], "re", "emitter"),
        }[terminal]
        ohm = self.card.get(key, 0.0)
        if ohm:
            inner = f"{self.name}#{label}"
            return Functional(z=layout.voltage(node, inner, self.parallel / ohm))
        weight = self.parallel if self.npn else -self.parallel
        transport = Functional(f=((layout.functions[f"{self.name}#transport"], weight),))
        which = "base-collector" if terminal == "c" else "base-emitter"
        base = Functional(f=((layout.functions[f"{self.name}#{which}"], weight),))
        charge = layout.functions.get(f"{self.name}#{label} charge")
        if charge is not None:
            base = plus(base, Functional(df=((charge, weight),)))
        return plus(scaled(transport, 1.0 if terminal == "c" else -1.0), scaled(base, -1.0))

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[str, str, float]]:
        """Return the charges from which a run with ``uic`` starts; ``ic=vbe,vce`` goes first."""
        c, b, e = self.corners
        sign = 1.0 if self.npn else -1.0
        given, across = self.ic
        vbe = sign * (voltage(b) - voltage(e) if given is None else given)
        vce = sign * (voltage(c) - voltage(e) if across is None else across)
        at, get = self._at(layout.conditions), self.card.get
        fc = get("fc", 0.5)
        inner = [
            f"{self.name}#{label}" if get(key, 0.0) else node
            for node, key, label in zip(
                self.corners, ("rc", "rb", "re"), ("collector", "base", "emitter"), strict=True
            )
        ]
        found = []
        for end, v, n, transit, (cj, vj), grading in (
            (inner[2], vbe, get("nf", 1.0), get("tf", 0.0), at.cje, get("mje", 0.33)),
            (inner[0], vbe - vce, get("nr", 1.0), get("tr", 0.0), at.cjc, get("mjc", 0.33)),
        ):
            level = at.is_ * math.expm1(min(v / (n * at.vt), 300.0))
            charge = depletion_charge(v, cj, vj, grading, fc) + transit * level
            found.append((inner[1], end, sign * self.parallel * charge))
        return found


class _Law:
    """The registers of one transistor's functions."""

    def __init__(self, device: Bipolar, stamper: Stamper, c: str, b: str, e: str) -> None:
        self.stamper = stamper
        self.tape = tape = stamper.tape
        self.card = card = device.card
        self.at = at = device._at(stamper.layout.conditions)
        self.vbe = stamper.voltage_register(*device._turned(b, e))
        self.vbc = stamper.voltage_register(*device._turned(b, c))
        vt = at.vt
        self.forward = tape.op("junction", self.vbe, constants=(at.is_, card.get("nf", 1.0) * vt))
        self.reverse = tape.op("junction", self.vbc, constants=(at.is_, card.get("nr", 1.0) * vt))
        #: reciprocal of the normalised base charge, None for one
        self.share = self._base_share()
        self.transport = self._times(tape.op("sub", self.forward, self.reverse), self.share)
        self.base_emitter = self._base(self.forward, at.bf, self.vbe, at.ise, card.get("ne", 1.5))
        self.base_collector = self._base(self.reverse, at.br, self.vbc, at.isc, card.get("nc", 2.0))

    def _times(self, register: int, factor: int | None) -> int:
        return register if factor is None else self.tape.op("mul", register, factor)

    def _over(self, register: int, value: float) -> int:
        return self.tape.op("div", register, self.tape.constant(value))

    def _base(self, current: int, gain: float, v: int, leak: float, n: float) -> int:
        """Return the current of one junction into the base."""
        total = self._over(current, gain)
        if leak:
            extra = self.tape.op("junction", v, constants=(leak, n * self.at.vt))
            total = self.tape.op("add", total, extra)
        return total

    def _base_share(self) -> int | None:
        """Return Early effect and high injection as one factor."""
        tape, get = self.tape, self.card.get
        early: int | None = None
        for v, key in ((self.vbc, "vaf"), (self.vbe, "var")):
            if get(key):
                before = tape.constant(1.0) if early is None else early
                early = tape.op("sub", before, self._over(v, get(key, 1.0)))
        level: int | None = None
        for current, key in ((self.forward, "ikf"), (self.reverse, "ikr")):
            if get(key):
                part = self._over(current, get(key, 1.0))
                level = part if level is None else tape.op("add", level, part)
        if level is None:
            return early
        # 2 / (1 + sqrt(1 + 4 level)) = 1 / (1/2 + sqrt(1/4 + level)); IS/IK alone is far below 1/4
        inside = tape.op("max", tape.op("add", tape.constant(0.25), level), tape.constant(1e-12))
        root = tape.op("add", tape.constant(0.5), tape.op("sqrt", inside))
        return tape.op("div", tape.constant(1.0) if early is None else early, root)

    def base_resistance(self, outer: str, inner: str) -> int:
        """Return the current through a base resistance that falls from RB to RBM."""
        tape = self.tape
        rb, rbm = self.card["rb"], self.card["rbm"]
        share = tape.constant(1.0) if self.share is None else self.share
        ohm = tape.op("add", tape.constant(rbm), tape.op("mul", tape.constant(rb - rbm), share))
        return tape.op("div", self.stamper.voltage_register(outer, inner), ohm)

    def emitter_charge(self) -> int | None:
        """Return the charge of base and emitter, None without one."""
        tape, get = self.tape, self.card.get
        parts = []
        if get("cje"):
            shape = (*self.at.cje, get("mje", 0.33), get("fc", 0.5))
            parts.append(tape.op("depletion", self.vbe, constants=shape))
        if get("tf"):
            moved = self._times(self.forward, self.share)
            if get("xtf"):
                moved = tape.op("mul", moved, self._slower())
            parts.append(tape.op("mul", tape.constant(get("tf", 0.0)), moved))
        return self._sum(parts)

    def _slower(self) -> int:
        """Return the growth of the transit time with current and voltage."""
        tape, get = self.tape, self.card.get
        factor = tape.constant(get("xtf", 0.0))
        if get("itf"):
            ratio = tape.op(
                "div",
                self.forward,
                tape.op("add", self.forward, tape.constant(get("itf", 1.0))),
            )
            factor = tape.op("mul", factor, tape.op("square", ratio))
        if get("vtf"):
            level = self._over(self.vbc, 1.44 * get("vtf", 1.0))
            factor = tape.op("mul", factor, tape.op("exp", level))
        return tape.op("add", tape.constant(1.0), factor)

    def collector_charge(self) -> int | None:
        """Return the charge of base and collector, None without one."""
        tape, get = self.tape, self.card.get
        parts = []
        if get("cjc"):
            shape = (*self.at.cjc, get("mjc", 0.33), get("fc", 0.5))
            parts.append(tape.op("depletion", self.vbc, constants=shape))
        if get("tr"):
            parts.append(tape.op("mul", tape.constant(get("tr", 0.0)), self.reverse))
        return self._sum(parts)

    def _sum(self, parts: list[int]) -> int | None:
        if not parts:
            return None
        return parts[0] if len(parts) == 1 else self.tape.op("add", *parts)
