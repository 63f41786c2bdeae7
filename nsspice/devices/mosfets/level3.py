"""SPICE's MOSFET of LEVEL=3: the semi-empirical channel of short transistors.

    i = beta f_g (v_g - v_th - (1 + F_b) v/2) v / (1 + v/v_c) / (1 - delta/L)
    v = min(v_ds, v_sat)
    v_th = vbi - sigma v_ds + gamma F_s sqrt(phi - v_b) + F_n (phi - v_b)

with the mobility in the field of the gate, ``f_g = 1/(1 + theta (v_g - v_th))``, the short-channel
effect ``F_s`` (``XJ``), the narrow one ``F_n`` (``DELTA``), static feedback ``sigma`` (``ETA``),
velocity saturation ``v_c = L VMAX/mu``, the shortening ``delta`` of the channel (``KAPPA``) and,
below the threshold, an exponential (``NFS``).  Junctions, resistances and charges are those of
LEVEL=1.

Reference: A. Vladimirescu, S. Liu, *The Simulation of MOS Integrated Circuits Using SPICE2*, Memo
UCB/ERL M80/7, 1980; the constants are those of SPICE3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...netlist.findings import Findings
from ..diodes.number_tape import LawTape, R
from ..effect import Effect, called_for
from ..parameter import Parameter, Table, inert
from ..stamper import Conditions
from ..temperature import CELSIUS, CHARGE, thermal_voltage
from .level1 import Level1
from .level1_card import CARD, EFFECTS, INTRINSIC, NEUTRAL_ZERO, checked
from .level1_law import Level1Law
from .level1_thermal import EPS0, gap

if TYPE_CHECKING:
    from ...netlist.deck import Model

_OWN = (
    Parameter("theta", "mobility reduction by the gate field", "1/V"),
    Parameter("eta", "static feedback of the drain voltage on the threshold"),
    Parameter("delta", "effect of the width on the threshold"),
    Parameter("vmax", "saturated velocity of carriers", "m/s"),
    Parameter("kappa", "channel length modulation factor", "", 0.2),
    Parameter("nfs", "density of fast surface states: current below threshold", "1/cm2"),
    Parameter("xj", "depth of the junctions: short channels", "m"),
    Parameter("tox", "thickness of the oxide", "m", 1e-7),
    inert("lambda", "parameter of LEVEL=1"),
)
_OTHERS = {p.name for p in _OWN}
CARD3 = Table(*_OWN, *(p for p in CARD.parameters if p.name not in _OTHERS))
_OWN_EFFECTS = tuple((p.name, p.meaning.partition(":")[0], p.unit) for p in _OWN[:7])
#: silicon [F/m]
_SILICON = 11.7 * EPS0
#: polynomial of the depletion of a cylindrical junction
_CYLINDER = (0.0631353, 0.8013292, -0.01110777)
#: below what follows the channel is not shortened [m2]: a millionth of an atom
_NOTHING = 1e-32
#: least conductance of saturation [S], as in SPICE3
_LEAST = 1e-12


def check_card(model: Model, findings: Findings) -> dict[str, float] | None:
    """Return the given parameters of a model card, or None after reporting what is wrong."""
    return checked(CARD3, model, findings)


class Level3(Level1):
    """A MOSFET of LEVEL=3 with the effects that its model card gives."""

    LEVEL = 3
    check = staticmethod(check_card)
    __slots__ = ()

    def listed(self) -> tuple[Effect, ...]:
        """Return the effects that the card calls for."""
        return (
            Effect(f"LEVEL=3 {'NMOS' if self.n else 'PMOS'}"),
            *called_for(self.card, (*EFFECTS, *_OWN_EFFECTS), NEUTRAL_ZERO | _OTHERS),
        )

    def parameters(self, conditions: Conditions) -> dict[str, float]:
        """Return the parameters at the temperature of the transistor."""
        card = {"tox": 1e-7, **self.card}
        if doped := card.get("nsub"):
            nominal = card.get("tnom", conditions.nominal) + CELSIUS
            card = {"phi": _surface(doped * 1e6, nominal), **card}
        p = self._at(card, conditions)
        own = {q.name: card.get(q.name, q.default or 0.0) for q in _OWN}
        length, cox = self.size["l"] - 2.0 * p["ld"], p["cox"]
        doping = card.get("nsub", 0.0) * 1e6
        alpha = 2.0 * _SILICON / (CHARGE * doping) if doping else 0.0
        return {
            **p,
            **{k: own[k] for k in ("theta", "vmax", "kappa", "xj")},
            "length": length,
            "alpha": alpha,
            "sigma": own["eta"] * 8.15e-22 / (cox * length**3),
            "narrow": own["delta"] * 0.5 * math.pi * _SILICON / cox / self.size["w"],
            "states": CHARGE * own["nfs"] * 1e4 / cox,
            "mobility": 1e-4 * p["u0"] * p["rise"],
        }

    def law(self, tape: LawTape[R], p: Mapping[str, float], v: Mapping[str, R]) -> Level1Law[R]:
        """Return the functions of the transistor on a tape."""
        return Level3Law(tape, p, v)


def _surface(doping: float, nominal: float) -> float:
    """Return the surface potential [V] in strong inversion of a body of that doping [1/m3].

    Here, not in LEVEL=1, SPICE lets the intrinsic density follow the nominal temperature [K].
    """
    exponent = 0.5 * gap(nominal) / thermal_voltage(1.0) * (1.0 / 300.0 - 1.0 / nominal)
    intrinsic = INTRINSIC * (nominal / 300.0) ** 1.5 * math.exp(exponent)
    return max(0.1, 2.0 * thermal_voltage(nominal) * math.log(doping / intrinsic))


class Level3Law(Level1Law[R]):
    """The registers of one transistor's functions; see ``Level1Law``."""

    def _threshold(self) -> R:
        tape, p, c = self.tape, self.p, self.tape.constant
        # the source is the end of the lower potential
        self.gate = tape.op("max", self.v["gs"], self.v["gd"])
        self.across = tape.op("abs", self.v["ds"])
        body = tape.op("max", self.v["bs"], self.v["bd"])
        root = self._root(body)
        gamma = c(p["gamma"])
        if p["xj"] and p["alpha"]:
            gamma = self._times(p["gamma"], self._short(root))
        depleted = tape.op("square", root)
        self.fbody = tape.op("div", self._times(0.25, gamma), root)
        bulk = tape.op("mul", gamma, root)
        if p["narrow"]:
            self.fbody = tape.op("add", self.fbody, c(p["narrow"]))
            bulk = tape.op("add", bulk, self._times(p["narrow"], depleted))
        threshold = tape.op("add", c(p["vbi"]), bulk)
        if p["sigma"]:
            threshold = tape.op("sub", threshold, self._times(p["sigma"], self.across))
        self.steep = None
        if p["states"]:
            swing = tape.op("div", self._times(0.5, bulk), depleted)
            self.steep = self._times(p["vt"], tape.op("add", c(1.0 + p["states"]), swing))
        self.threshold = threshold
        return threshold

    def _short(self, root: R) -> R:
        """Return the part of the body's charge that the gate has to hold in a short channel."""
        tape, p, c = self.tape, self.p, self.tape.constant
        width = self._times(math.sqrt(p["alpha"]) / p["xj"], root)
        beside = c(p["ld"] / p["xj"])
        square = self._times(_CYLINDER[2], tape.op("square", width))
        linear = tape.op("add", c(_CYLINDER[0]), self._times(_CYLINDER[1], width))
        reach = tape.op("add", tape.op("add", linear, square), beside)
        share = tape.op("div", width, tape.op("add", c(1.0), width))
        height = tape.op("sqrt", tape.op("sub", c(1.0), tape.op("square", share)))
        lost = tape.op("sub", tape.op("mul", reach, height), beside)
        return tape.op("sub", c(1.0), self._times(p["xj"] / p["length"], lost))

    def channel(self) -> R:
        """Return the current from drain to source."""
        tape, p, c = self.tape, self.p, self.tape.constant
        over = tape.op("sub", self.gate, self.threshold)
        # below what joins the exponential the channel is that of the joint
        over = tape.op("uramp", over) if self.steep is None else tape.op("max", over, self.steep)
        onfg = tape.op("add", c(1.0), self._times(p["theta"], over))
        factor = tape.op("add", c(1.0), self.fbody)
        saturation = tape.op("div", over, factor)
        critical: R | None = None
        if p["vmax"]:
            critical = self._times(p["length"] * p["vmax"] / p["mobility"], onfg)
            root = tape.op(
                "sqrt", tape.op("add", tape.op("square", saturation), tape.op("square", critical))
            )
            saturation = tape.op("sub", tape.op("add", saturation, critical), root)
        v = tape.op("min", self.across, saturation)
        drive = tape.op("sub", over, self._times(0.5, tape.op("mul", factor, v)))
        gain = tape.op("div", self._times(p["beta"], drive), onfg)
        if critical is not None:
            gain = tape.op("div", gain, tape.op("add", c(1.0), tape.op("div", v, critical)))
        if p["kappa"] and p["alpha"]:
            excess = tape.op("uramp", tape.op("sub", self.across, saturation))
            shortened = self._shortened(excess, tape.op("mul", gain, v), v, saturation, critical)
            gain = tape.op("div", gain, shortened)
        if self.steep is not None:
            below = tape.op("sub", self.gate, tape.op("add", self.threshold, self.steep))
            below = tape.op("min", below, c(0.0))
            gain = tape.op("mul", gain, tape.op("exp", tape.op("div", below, self.steep)))
        # v with the sign of v_ds, which is itself between both limits
        signed = tape.op("min", self.v["ds"], saturation)
        signed = tape.op("max", signed, tape.op("neg", saturation))
        return tape.op("mul", gain, signed)

    def _shortened(self, excess: R, current: R, v: R, saturation: R, critical: R | None) -> R:
        """Return ``1 - delta/L`` for the voltage beyond that of saturation."""
        tape, p, c = self.tape, self.p, self.tape.constant
        half = c(0.0)
        if critical is None:
            # from the linear region on, by the eighth power of v/v_sat: ngspice's joint of both
            ratio = tape.op("div", v, tape.op("max", saturation, c(_NOTHING)))
            power = tape.op("square", tape.op("square", tape.op("square", ratio)))
            early = self._times(0.125, tape.op("mul", saturation, power))
            excess = tape.op("add", excess, early)
        area = self._times(p["kappa"] * p["alpha"], excess)
        if critical is not None:
            # half the depletion that the field at the end of the channel makes
            past = tape.op("add", critical, v)
            slope = tape.op("div", tape.op("div", tape.op("mul", current, v), past), critical)
            slope = tape.op("max", slope, c(_LEAST))
            half = self._times(0.5 * p["kappa"] * p["alpha"] / p["length"], current)
            half = tape.op("div", half, slope)
        root = tape.op("add", tape.op("square", half), area)
        root = tape.op("sqrt", tape.op("max", root, c(_NOTHING)))
        delta = tape.op("sub", root, half)
        if critical is not None:
            # a difference that cancels near saturation
            delta = tape.op("div", area, tape.op("add", root, half))
        # punch-through: no more than half of the channel, and ever less beyond
        middle = 0.5 * p["length"]
        within = tape.op("min", delta, c(middle))
        far = tape.op("max", delta, c(middle))
        beyond = tape.op("sub", c(middle), tape.op("div", c(middle * middle), far))
        taken = self._times(1.0 / p["length"], tape.op("add", within, beyond))
        return tape.op("sub", c(1.0), taken)
