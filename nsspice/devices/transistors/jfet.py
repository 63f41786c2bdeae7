"""JFET ``J d g s model [area]``: SPICE's square law with two gate junctions.

    i = BETA (u+^2 - w+^2) (1 + LAMBDA |v_ds|),   u = v_gs - VTO,  w = v_gd - VTO,  x+ = max(x, 0)

(H. Shichman, D. A. Hodges, IEEE J. Solid-State Circuits 3 (1968) 285-289), in both directions.  The
gate is a junction ``IS`` to each end of the channel, with the charges ``CGS`` and ``CGD``.  ``VTO``
is negative for both polarities.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...netlist.findings import Findings
from ..device import NO_VALUES, Context, Edge, check_flags, check_model
from ..diodes.diode_branch import Voltage
from ..diodes.junction import STEEPEST
from ..diodes.leg_device import size_of
from ..diodes.number_tape import LawTape, NumberTape, R
from ..effect import Effect, called_for
from ..mosfets.level1_law import Level1Law
from ..mosfets.mosfet import INITIAL, MULTIPLE, RATINGS, TEMPERATURES
from ..mosfets.smooth_mosfet import SmoothMosfet
from ..parameter import Parameter, Table, check_bounds, inert, limited, omitted, refused
from ..stamper import Conditions, Layout, Stamper
from ..temperature import CELSIUS, depletion, kelvin, thermal_voltage

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model

CARD = Table(
    Parameter("level", "model level", "", 1.0),
    Parameter("vto", "pinch-off voltage, negative", "V", -2.0, aliases=("vt0",)),
    Parameter("beta", "transconductance", "A/V2", 1e-4),
    Parameter("lambda", "channel length modulation", "1/V"),
    Parameter("rd", "drain resistance", "Ohm"),
    Parameter("rs", "source resistance", "Ohm"),
    Parameter("is", "saturation current of the gate junctions", "A", 1e-14),
    Parameter("n", "emission coefficient of the gate junctions", "", 1.0),
    Parameter("cgs", "gate-source capacitance at 0 V", "F"),
    Parameter("cgd", "gate-drain capacitance at 0 V", "F"),
    Parameter("pb", "potential of the gate junctions", "V", 1.0),
    Parameter("m", "grading of the gate junctions", "", 0.5),
    Parameter("fc", "forward capacitance coefficient", "", 0.5),
    Parameter("tcv", "fall of vto", "V/K", 0.0),
    Parameter("vtotc", "rise of vto, in place of tcv", "V/K"),
    Parameter("bex", "temperature exponent of beta", "", 0.0),
    Parameter("betatce", "exponential temperature coefficient of beta", "%/K"),
    Parameter("eg", "band gap", "eV", 1.11),
    Parameter("xti", "temperature exponent of is", "", 0.0),
    Parameter("tnom", "temperature at which parameters are given", "C", aliases=("tref",)),
    refused("b", "doping tail", "leave it out", neutral=(1.0,)),
    omitted("alpha", "ionisation", "1/V"),
    inert("vk", "ionisation", "V"),
    omitted("isr", "recombination in the gate junctions", "A"),
    inert("nr", "recombination"),
    inert("kf", "flicker noise"),
    inert("af", "flicker noise"),
    inert("nlev", "noise equation"),
    inert("gdsnoi", "noise"),
    *RATINGS,
)
_DEFAULTS = {p.name: p.default or 0.0 for p in CARD.parameters if p.status == "used"}
_EFFECTS = (
    ("vto", "pinch-off", "V"),
    ("beta", "transconductance", "A/V2"),
    ("lambda", "channel length modulation", "1/V"),
    ("rd", "drain resistance", "Ohm"),
    ("rs", "source resistance", "Ohm"),
    ("is", "gate junctions", "A"),
    ("cgs", "gate-source charge", "F"),
    ("cgd", "gate-drain charge", "F"),
)
#: zero means "no such effect"
_NEUTRAL_ZERO = frozenset({"lambda", "rd", "rs", "is", "cgs", "cgd"})
_POSITIVE = frozenset({"beta", "n", "pb"})
_FREE = frozenset({"level", "vto", "tcv", "vtotc", "bex", "betatce", "eg", "xti", "tnom"})


class Jfet(SmoothMosfet):
    """A JFET with the effects that its model card gives."""

    KIND = "JFET"
    INSTANCE = Table(
        MULTIPLE, Parameter("area", "area factor", "", 1.0), *TEMPERATURES, *INITIAL[:2]
    )
    MODEL = CARD
    CURRENTS = (("channel", "D", "S"), ("gate-source", "g", "S"), ("gate-drain", "g", "D"))
    CHARGES = (("gate-source charge", "g", "S"), ("gate-drain charge", "g", "D"))
    __slots__ = ()

    def __init__(
        self, element: Element, n: bool, card: Mapping[str, float], given: Mapping[str, float]
    ) -> None:
        super().__init__(element, n, card, given)
        self.stores_energy = bool(card.get("cgs") or card.get("cgd"))
        self.effects = (
            Effect(f"square law {'N' if n else 'P'} JFET"),
            *called_for(card, _EFFECTS, _NEUTRAL_ZERO),
        )

    @classmethod
    def read(cls, element: Element, context: Context) -> Jfet | None:
        """Return the transistor of an element line, or None after reporting why not."""
        if not check_model(element, ("njf", "pjf"), context, required=True):
            return None
        model = element.model
        assert model is not None
        check_flags(cls, element, context.findings)
        return cls.of(element, model, context)

    @classmethod
    def of(cls, element: Element, model: Model, context: Context) -> Jfet | None:
        """Return the transistor of an element line, or None after reporting why not."""
        findings = context.findings
        given = cls.INSTANCE.read(element.params, element.name, findings)
        parallel = size_of(element, given, findings)
        card = context.card(model, _check_card)
        if parallel is None or card is None:
            return None
        return cls(element, model.type == "njf", card, {**given, "m": parallel})

    def parameters(self, conditions: Conditions) -> dict[str, float]:
        """Return the parameters at the temperature of the transistor."""
        p = {**_DEFAULTS, **self.card}
        actual = kelvin(conditions, self.temp, self.dtemp)
        nominal = self.card.get("tnom", conditions.nominal) + CELSIUS
        rise, ratio = actual - nominal, actual / nominal
        p["vbi"] = p["vto"] + (p["vtotc"] if "vtotc" in self.card else -p["tcv"]) * rise
        growth = 1.01 ** (p["betatce"] * rise) if "betatce" in self.card else ratio ** p["bex"]
        # the square law of a MOSFET has the factor one half
        p["beta"], p["gamma"] = 2.0 * p["beta"] * growth, 0.0
        p["unit"] = p["n"] * thermal_voltage(actual)
        p["is"] *= math.exp((ratio - 1.0) * p["eg"] / p["unit"]) * ratio ** (p["xti"] / p["n"])
        potential = p["pb"]
        for key in ("cgs", "cgd"):
            p[key], p["pb"] = depletion(p[key], potential, p["m"], nominal, actual)
        return p

    def resistances(self, conditions: Conditions) -> dict[str, float]:
        """Return the resistance [Ohm] in series with each terminal that has one."""
        card = self.card
        return {end: card[f"r{end}"] for end in ("d", "s") if card.get(f"r{end}")}

    def flicker_factor(self) -> float:
        """Return one: a gate junction has no oxide."""
        return 1.0

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return channel and gate junctions."""
        d, g, s = self.corners
        return Edge("R", d, s), Edge("R", g, s), Edge("R", g, d)

    def stamp(self, stamper: Stamper) -> None:
        """Write the resistances, the currents and the charges."""
        p = self.parameters(stamper.layout.conditions)
        self._stamp_resistances(stamper, {"d": bool(p["cgd"]), "s": bool(p["cgs"])})
        nodes = self.inside(stamper.layout.conditions)
        v = {
            "gs": self._across(stamper, nodes, "g", "S"),
            "gd": self._across(stamper, nodes, "g", "D"),
            "ds": self._across(stamper, nodes, "D", "S"),
        }
        tape, registers = stamper.tape, _charges(stamper.tape, p, v)
        registers["channel"] = Level1Law(tape, p, v).channel()
        if p["is"]:
            for name, key in (("gate-source", "gs"), ("gate-drain", "gd")):
                registers[name] = tape.op("junction", v[key], constants=(p["is"], p["unit"]))
        self._stamp_functions(stamper, nodes, registers)

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charges from which a run with ``uic`` starts; ``ic=`` goes first."""
        at = self._initial_voltages(voltage)
        v = {"gs": at["g"], "gd": at["g"] - at["d"]}
        charges = _charges(NumberTape(), self.parameters(layout.conditions), v)
        return self._charges_at(layout, charges)


def _charges(tape: LawTape[R], p: Mapping[str, float], v: Mapping[str, R]) -> dict[str, R | None]:
    """Return the charges of the gate junctions by name."""
    return {
        f"gate-{name} charge": tape.op(
            "depletion", v[key], constants=(p[f"c{key}"], p["pb"], p["m"], p["fc"])
        )
        for name, key in (("source", "gs"), ("drain", "gd"))
        if p[f"c{key}"]
    }


def _check_card(model: Model, findings: Findings) -> dict[str, float] | None:
    """Return the given parameters of a model card, or None after reporting what is wrong."""
    owner = f"model {model.name}"
    before = len(findings.errors)
    given = CARD.read(model.params, owner, findings)
    if given.get("level", 1.0) != 1.0:
        message = f"{owner}: level {given['level']:g} of a JFET is not simulated"
        findings.error("NS2008", message, model.params["level"].span, "level 1 is")
    check_bounds(given, model, findings, positive=_POSITIVE, free=_FREE)
    limited(given, "m", STEEPEST, model, findings)
    return given if len(findings.errors) == before else None
