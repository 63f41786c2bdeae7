"""SPICE's MOSFET of LEVEL=2: the geometric channel of D. Frohman-Bentchkowsky and A. S. Grove.

    i = beta f/(1 - delta/L) ((v_g - v_bin - eta v/2) v - 2/3 gamma_s (b^3 - a^3))
    v = min(v_ds, v_sat),   a = sqrt(phi - v_b),   b = sqrt(phi - v_b + v)
    v_bin = vbi + F (phi - v_b),   eta = 1 + F,   F = pi DELTA eps/(4 Cox W)

with the short-channel effect ``gamma_s`` (``XJ``), the mobility in the field of the gate, ``f =
(v_c/(v_g - v_th))^UEXP`` beyond ``v_c = UCRIT eps/Cox``, the shortening ``delta`` of the channel by
``LAMBDA`` or by the doping, and, below the threshold, an exponential (``NFS``).  Velocity
saturation (``VMAX``, by Baum's polynomial of fourth degree) is refused.  Junctions, resistances and
charges are those of LEVEL=1.

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
from ..parameter import Parameter, Table, inert, refused
from ..stamper import Conditions
from ..temperature import CHARGE
from .level1 import Level1
from .level1_card import CARD, EFFECTS, NEUTRAL_ZERO, checked
from .level1_law import Level1Law
from .level1_thermal import EPS0

if TYPE_CHECKING:
    from ...netlist.deck import Model

_OWN = (
    Parameter("delta", "effect of the width on the threshold"),
    Parameter("uexp", "exponent of the mobility in the gate field"),
    Parameter("ucrit", "field at which the mobility begins to fall", "V/cm", 1e4),
    Parameter("nfs", "density of fast surface states: current below threshold", "1/cm2"),
    Parameter("xj", "depth of the junctions: short channels", "m"),
    Parameter("tox", "thickness of the oxide", "m", 1e-7),
    refused("vmax", "velocity saturation of LEVEL=2", "use a card of LEVEL=3, or of LEVEL=1"),
    inert("utra", "SPICE leaves it out, too"),
    inert("neff", "of velocity saturation"),
)
_OTHERS = {p.name for p in _OWN}
CARD2 = Table(*_OWN, *(p for p in CARD.parameters if p.name not in _OTHERS))
_OWN_EFFECTS = tuple((p.name, p.meaning.partition(":")[0], p.unit) for p in _OWN[:5])
#: silicon [F/m]
_SILICON = 11.7 * EPS0
#: where nothing is doped the channel is not shorter than this [m]
_SHORTEST = 0.25e-6
#: voltage below which nothing depends on the ratio of two voltages that vanish together [V]
_NOTHING = 1e-12


def check_card(model: Model, findings: Findings) -> dict[str, float] | None:
    """Return the given parameters of a model card, or None after reporting what is wrong."""
    return checked(CARD2, model, findings)


class Level2(Level1):
    """A MOSFET of LEVEL=2 with the effects that its model card gives."""

    LEVEL = 2
    check = staticmethod(check_card)
    __slots__ = ()

    def listed(self) -> tuple[Effect, ...]:
        """Return the effects that the card calls for."""
        return (
            Effect(f"LEVEL=2 {'NMOS' if self.n else 'PMOS'}"),
            *called_for(self.card, (*EFFECTS, *_OWN_EFFECTS), NEUTRAL_ZERO | _OTHERS),
        )

    def parameters(self, conditions: Conditions) -> dict[str, float]:
        """Return the parameters at the temperature of the transistor."""
        card = {"tox": 1e-7, **self.card}
        p = self._at(card, conditions)
        own = {q.name: card.get(q.name, q.default or 0.0) for q in _OWN}
        cox, doping = p["cox"], card.get("nsub", 0.0) * 1e6
        depleted = math.sqrt(2.0 * _SILICON / (CHARGE * doping)) if doping else 0.0
        return {
            **p,
            "xj": own["xj"],
            "uexp": own["uexp"],
            "length": self.size["l"] - 2.0 * p["ld"],
            "depleted": depleted,
            "narrow": 0.25 * math.pi * own["delta"] * _SILICON / cox / self.size["w"],
            "states": CHARGE * own["nfs"] * 1e4 / cox,
            "critical": own["ucrit"] * 100.0 * _SILICON / cox,
            "shortest": depleted * math.sqrt(p["vj"]) if doping else _SHORTEST,
        }

    def law(self, tape: LawTape[R], p: Mapping[str, float], v: Mapping[str, R]) -> Level1Law[R]:
        """Return the functions of the transistor on a tape."""
        return Level2Law(tape, p, v)


class Level2Law(Level1Law[R]):
    """The registers of one transistor's functions; see ``Level1Law``."""

    def _threshold(self) -> R:
        tape, p, c = self.tape, self.p, self.tape.constant
        # the source is the end of the lower potential
        self.gate = tape.op("max", self.v["gs"], self.v["gd"])
        self.across = tape.op("abs", self.v["ds"])
        self.bulk = tape.op("max", self.v["bs"], self.v["bd"])
        self.root = self._root(self.bulk)
        self.base = c(p["vbi"])
        if p["narrow"]:
            over = tape.op("sub", c(p["phi"]), self.bulk)
            self.base = tape.op("add", self.base, self._times(p["narrow"], over))
        self.gamma = c(p["gamma"])
        slope = self._fall(self.root)
        swing = tape.op("neg", self._times(p["gamma"], slope))
        if p["xj"] and p["depleted"] and p["gamma"]:
            drain = self._root(tape.op("sub", self.bulk, self.across))
            lost = c(0.0)
            for end in (self.root, drain):
                wide = tape.op("sqrt", self._widened(end))
                part = self._times(0.5 * p["xj"] / p["length"], tape.op("sub", wide, c(1.0)))
                lost = tape.op("add", lost, part)
                falling = tape.op("div", self._fall(end), wide)
                falling = self._times(0.5 * p["gamma"] * p["depleted"] / p["length"], falling)
                swing = tape.op("add", swing, tape.op("mul", falling, self.root))
            self.gamma = self._times(p["gamma"], tape.op("sub", c(1.0), lost))
            # the slope of the threshold has that of the shortened charge, too
            swing = tape.op("add", swing, self._times(p["gamma"], tape.op("mul", lost, slope)))
        threshold = tape.op("add", self.base, tape.op("mul", self.gamma, self.root))
        self.steep: R | None = None
        if p["states"]:
            number = tape.op("add", c(1.0 + p["states"] + p["narrow"]), swing)
            self.steep = self._times(p["vt"], number)
        self.threshold = threshold
        return threshold

    def _fall(self, root: R) -> R:
        """Return the derivative of a root by the voltage: the smaller one of both in size."""
        tape, phi = self.tape, self.p["phi"]
        blocked = tape.op("div", tape.constant(-0.5), root)
        ahead = self._times(-0.5 * phi**-1.5, tape.op("square", root))
        return tape.op("max", blocked, ahead)

    def _widened(self, root: R) -> R:
        """Return ``1 + 2 w/xj`` with the width of the depletion below a root."""
        tape, p = self.tape, self.p
        return tape.op("add", tape.constant(1.0), self._times(2.0 * p["depleted"] / p["xj"], root))

    def channel(self) -> R:
        """Return the current from drain to source."""
        tape, p, c = self.tape, self.p, self.tape.constant
        eta = 1.0 + p["narrow"]
        begin = self.threshold
        if self.steep is not None:
            begin = tape.op("add", begin, self.steep)
        gate = tape.op("max", self.gate, begin) if self.steep is not None else self.gate
        over = tape.op("sub", gate, self.base)
        saturation = self._saturation(self._times(1.0 / eta, over))
        v = tape.op("min", self.across, saturation)
        drive = tape.op("sub", over, self._times(0.5 * eta, v))
        if p["gamma"]:
            charge = tape.op("mul", self.gamma, self._body(v))
            drive = tape.op("sub", drive, self._times(1.0 / 1.5, charge))
        gain = self._times(p["beta"], drive)
        if p["uexp"]:
            beyond = tape.op("sub", self.gate, begin)
            ratio = tape.op("div", tape.op("max", beyond, c(p["critical"])), c(p["critical"]))
            power = self._times(-p["uexp"], tape.op("ln", ratio))
            gain = tape.op("mul", gain, tape.op("exp", power))
        gain = tape.op("div", gain, self._shortened(saturation))
        if self.steep is not None:
            below = tape.op("min", tape.op("sub", self.gate, begin), c(0.0))
            gain = tape.op("mul", gain, tape.op("exp", tape.op("div", below, self.steep)))
        # v with the sign of v_ds, which is itself between both limits
        signed = tape.op("min", self.v["ds"], saturation)
        signed = tape.op("max", signed, tape.op("neg", saturation))
        return tape.op("mul", gain, signed)

    def _saturation(self, over: R) -> R:
        """Return the voltage of saturation, for the gate over the flat band."""
        tape, p, c = self.tape, self.p, self.tape.constant
        if not p["gamma"]:
            return tape.op("uramp", over)
        square = self._times((1.0 + p["narrow"]) ** -2, tape.op("square", self.gamma))
        inner = tape.op("add", over, tape.op("sub", c(p["phi"]), self.bulk))
        inner = tape.op("max", inner, c(0.0))
        # g^2/2 (1 - sqrt(1 + 4 x/g^2)) = -2 x/(1 + sqrt(1 + 4 x/g^2))
        ratio = self._times(4.0, tape.op("div", inner, square))
        root = tape.op("sqrt", tape.op("add", c(1.0), ratio))
        taken = tape.op("div", self._times(2.0, inner), tape.op("add", c(1.0), root))
        return tape.op("uramp", tape.op("sub", over, taken))

    def _body(self, v: R) -> R:
        """Return ``(b^3 - a^3)/v``: ``(a^2 + a b + b^2)/(a + b)`` times what b^2 - a^2 is of v."""
        tape, c, phi = self.tape, self.tape.constant, self.p["phi"]
        low = tape.op("sub", self.bulk, v)
        a, b = self.root, self._root(low)
        both = tape.op("add", a, b)
        mean = tape.op("sub", both, tape.op("div", tape.op("mul", a, b), both))

        def ahead(body: R) -> tuple[R, R]:
            on = tape.op("uramp", body)
            rest = tape.op("square", tape.op("add", c(1.0), self._times(0.5 / phi, on)))
            return on, tape.op("div", c(phi), rest)

        (on_a, left_a), (on_b, left_b) = ahead(self.bulk), ahead(low)
        # zero where the junction of the source blocks
        extra = tape.op("add", tape.op("sub", on_b, on_a), tape.op("sub", left_b, left_a))
        share = tape.op("div", extra, tape.op("max", v, c(_NOTHING)))
        return tape.op("mul", mean, tape.op("add", c(1.0), share))

    def _shortened(self, saturation: R) -> R:
        """Return ``1 - delta/L``, which does not fall to that of punch-through."""
        tape, p, c = self.tape, self.p, self.tape.constant
        if p["lambda"]:
            delta = self._times(p["lambda"], self.across)
        elif p["depleted"]:
            x = self._times(0.25, tape.op("sub", self.across, saturation))
            size = tape.op("sqrt", tape.op("add", c(1.0), tape.op("square", x)))
            reach = tape.op("sqrt", tape.op("add", x, size))
            delta = self._times(p["depleted"] / p["length"], reach)
        else:
            return c(1.0)
        least = p["shortest"] / p["length"]
        left = tape.op("max", tape.op("sub", c(1.0), delta), c(least))
        past = tape.op("uramp", tape.op("sub", delta, c(1.0 - least)))
        return tape.op("div", left, tape.op("add", c(1.0), self._times(1.0 / least, past)))
