"""Currents and charges of SPICE's bipolar transistor as instructions of a tape.

    I = (IF - IR)(1 - vbc/VAF - vbe/VAR) / (1/2 + (1/4 + IF/IKF + IR/IKR)^(1/2))
    IF = IS expm1(vbe / NF Vt),   IR = IS expm1(vbc / NR Vt)

flows from collector to emitter, ``IF/BF + ISE expm1(vbe / NE Vt)`` from base to emitter and
``IR/BR + ISC expm1(vbc / NC Vt)`` from base to collector.  Parameters that are not given add
nothing.

References: H. K. Gummel, H. C. Poon, Bell Syst. Tech. J. 49 (1970) 827-852, in the form of SPICE
(Massobrio and Antognetti, *Semiconductor Device Modeling with SPICE*, 2nd ed., 1993, ch. 2).
"""

from __future__ import annotations

from collections.abc import Mapping

from ...problems.tape import TapeBuilder

#: base current over IRB below which the base resistance is RB, as in SPICE
_LEAST = 1e-9


class BipolarLaw:
    """The registers of one transistor's functions.

    Parameters
    ----------
    tape : TapeBuilder
    p : mapping of str to float
        Parameters at the temperature of the transistor, 0 for an absent effect.
    vbe, vbc : int
        Registers of the voltages across the junctions, counted as those of an NPN transistor.
    """

    def __init__(self, tape: TapeBuilder, p: Mapping[str, float], vbe: int, vbc: int) -> None:
        self.tape = tape
        self.p = p
        self.vbe, self.vbc = vbe, vbc
        self.forward = self.junction(vbe, "is", "nf")
        self.reverse = self.junction(vbc, "is", "nr")
        #: reciprocal of the normalised base charge, None for one
        self.share = self._base_share()
        self.transport = self._times(tape.op("sub", self.forward, self.reverse), self.share)
        self.base_emitter = self._base(self.forward, "bf", vbe, "ise", "ne")
        self.base_collector = self._base(self.reverse, "br", vbc, "isc", "nc")

    def junction(self, v: int, current: str, n: str) -> int:
        """Return the current of an exponential junction."""
        return self.tape.op("junction", v, constants=(self.p[current], self.p[n] * self.p["vt"]))

    def depletion(self, v: int, c: float, junction: str, bend: float) -> int:
        """Return the charge of a depletion layer, ``VJ`` and ``MJ`` of junction e, c or s."""
        shape = (c, self.p[f"vj{junction}"], self.p[f"mj{junction}"], bend)
        return self.tape.op("depletion", v, constants=shape)

    def base_resistance(self, v: int) -> int:
        """Return the current through a base resistance that falls from RB to RBM.

        It falls with the base charge, or if ``IRB`` is given with the base current, to half at IRB.
        """
        tape, p = self.tape, self.p
        share = self._crowding() if p["irb"] else self.share
        if share is None:
            share = tape.constant(1.0)
        span = tape.constant(p["rb"] - p["rbm"])
        ohm = tape.op("add", tape.constant(p["rbm"]), tape.op("mul", span, share))
        return tape.op("div", v, ohm)

    def emitter_charge(self) -> int | None:
        """Return the charge of base and emitter, None without one."""
        tape, p = self.tape, self.p
        parts = []
        if p["cje"]:
            parts.append(self.depletion(self.vbe, p["cje"], "e", p["fc"]))
        if p["tf"]:
            moved = self._times(self.forward, self.share)
            if p["xtf"]:
                moved = tape.op("mul", moved, self._slower())
            parts.append(tape.op("mul", tape.constant(p["tf"]), moved))
        return self._sum(parts)

    def collector_charge(self) -> int | None:
        """Return the charge of inner base and collector, None without one."""
        tape, p = self.tape, self.p
        parts = []
        if p["cjc"] * p["xcjc"]:
            parts.append(self.depletion(self.vbc, p["cjc"] * p["xcjc"], "c", p["fc"]))
        if p["tr"]:
            parts.append(tape.op("mul", tape.constant(p["tr"]), self.reverse))
        return self._sum(parts)

    def outer_charge(self, v: int) -> int | None:
        """Return the charge of outer base and collector, the share of CJC that XCJC leaves."""
        c = self.p["cjc"] * (1.0 - self.p["xcjc"])
        return self.depletion(v, c, "c", self.p["fc"]) if c else None

    def substrate_charge(self, v: int) -> int:
        """Return the charge of the substrate, a parabola in forward direction."""
        return self.depletion(v, self.p["cjs"], "s", 0.0)

    def _times(self, register: int, factor: int | None) -> int:
        return register if factor is None else self.tape.op("mul", register, factor)

    def _over(self, register: int, value: float) -> int:
        return self.tape.op("div", register, self.tape.constant(value))

    def _base(self, current: int, gain: str, v: int, leak: str, n: str) -> int:
        """Return the current of one junction into the base."""
        total = self._over(current, self.p[gain])
        if self.p[leak]:
            total = self.tape.op("add", total, self.junction(v, leak, n))
        return total

    def _base_share(self) -> int | None:
        """Return Early effect and high injection as one factor."""
        tape, p = self.tape, self.p
        early: int | None = None
        for v, key in ((self.vbc, "vaf"), (self.vbe, "var")):
            if p[key]:
                before = tape.constant(1.0) if early is None else early
                early = tape.op("sub", before, self._over(v, p[key]))
        level: int | None = None
        for current, key in ((self.forward, "ikf"), (self.reverse, "ikr")):
            if p[key]:
                part = self._over(current, p[key])
                level = part if level is None else tape.op("add", level, part)
        if level is None:
            return early
        # 2 / (1 + (1 + 4 level)^NK) = 1 / (1/2 + (1/4 + level)^NK 4^NK / 2); IS/IK alone is far
        # below 1/4
        half = tape.constant(0.5)
        inside = tape.op("max", tape.op("add", tape.constant(0.25), level), tape.constant(1e-12))
        if p["nk"] == 0.5:
            root = tape.op("sqrt", inside)
        else:
            power = tape.op("pow", inside, tape.constant(p["nk"]))
            root = tape.op("mul", tape.constant(0.5 * 4.0 ** p["nk"]), power)
        root = tape.op("add", half, root)
        return tape.op("div", tape.constant(1.0) if early is None else early, root)

    def _crowding(self) -> int:
        """Return which share of RB - RBM is left: 3 (tan z - z) / (z tan^2 z)."""
        tape = self.tape
        current = tape.op("add", self.base_emitter, self.base_collector)
        ratio = tape.op("max", self._over(current, self.p["irb"]), tape.constant(_LEAST))
        # z = (sqrt(1 + 14.59025 x) - 1) / (2.4317 sqrt(x)), SPICE's digits, without a difference
        root = tape.op("mul", tape.constant(14.59025), ratio)
        root = tape.op("sqrt", tape.op("add", tape.constant(1.0), root))
        z = tape.op("mul", tape.constant(14.59025 / 2.4317), tape.op("sqrt", ratio))
        z = tape.op("div", z, tape.op("add", tape.constant(1.0), root))
        tangent = tape.op("tan", z)
        rest = tape.op("mul", tape.constant(3.0), tape.op("sub", tangent, z))
        return tape.op("div", rest, tape.op("mul", z, tape.op("square", tangent)))

    def _slower(self) -> int:
        """Return the growth of the transit time with current and voltage."""
        tape, p = self.tape, self.p
        factor = tape.constant(p["xtf"])
        if p["itf"]:
            moved = tape.op("add", self.forward, tape.constant(p["itf"]))
            factor = tape.op("mul", factor, tape.op("square", tape.op("div", self.forward, moved)))
        if p["vtf"]:
            factor = tape.op("mul", factor, tape.op("exp", self._over(self.vbc, 1.44 * p["vtf"])))
        return tape.op("add", tape.constant(1.0), factor)

    def _sum(self, parts: list[int]) -> int | None:
        if not parts:
            return None
        return parts[0] if len(parts) == 1 else self.tape.op("add", *parts)
