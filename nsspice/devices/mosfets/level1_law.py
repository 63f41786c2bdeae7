"""The equations of the LEVEL=1 MOSFET on a tape: square law, body effect, conserved charges.

With the overdrives at both ends of the channel, ``u = v_gs - v_on`` and ``w = v_gd - v_on``, the
current of H. Shichman and D. A. Hodges (IEEE J. Solid-State Circuits 3 (1968) 285-289) is

    i = beta/2 (u+^2 - w+^2) (1 + lambda |v_ds|),      x+ = max(x, 0),
    v_on = vbi + gamma sqrt(phi - v_b),                v_b = max(v_bs, v_bd),

in all regions and both directions: w+ vanishes in saturation, u+ as well below the threshold.

The oxide's charges are states, so that no charge is lost in a cycle; J. E. Meyer's capacitances
(RCA Review 32 (1971) 42-63), which SPICE integrates one by one, do not conserve it.  The gate has
Meyer's charge, 2/3 Cox (u+^2 + u+ w+ + w+^2)/(u+ + w+), beginning softly half a phi below the
threshold as in SPICE.  It is opposite to source and drain in shares that are Meyer's in
saturation, all at the source, and for u = w, one half each.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Generic

from ..diodes.number_tape import LawTape, R

#: sum of overdrives below which a share of nothing is asked for [V]: the charge there is less than
#: Cox times this
_NOTHING = 1e-12


class Level1Law(Generic[R]):
    """The registers of one transistor's functions.

    Parameters
    ----------
    tape : TapeBuilder or NumberTape
    p : mapping of str to float
        Parameters at the temperature of the transistor, see ``level1_thermal``.
    v : mapping of str to register
        Registers of the voltages ``gs gd ds bs bd gb``, counted as those of an n-channel one.
    """

    def __init__(self, tape: LawTape[R], p: Mapping[str, float], v: Mapping[str, R]) -> None:
        self.tape, self.p, self.v = tape, p, v
        threshold = self._threshold()
        #: overdrives at source and drain
        self.u = tape.op("sub", v["gs"], threshold)
        self.w = tape.op("sub", v["gd"], threshold)
        self.u_on, self.w_on = tape.op("uramp", self.u), tape.op("uramp", self.w)

    def _threshold(self) -> R:
        """Return the voltage from gate to source at which the channel begins."""
        tape, p = self.tape, self.p
        base = tape.constant(p["vbi"])
        if not p["gamma"]:
            return base
        # of the end that is the source: the higher of the two
        lower = tape.op("max", self.v["bs"], self.v["bd"])
        root = tape.op("body", lower, constants=(p["phi"],))
        return tape.op("add", base, tape.op("mul", tape.constant(p["gamma"]), root))

    def _root(self, body: R) -> R:
        """Return ``sqrt(phi - v)``, continued where the junction conducts as LEVEL=2 and 3 do."""
        tape, c, phi = self.tape, self.tape.constant, self.p["phi"]
        blocked = tape.op("sqrt", tape.op("sub", c(phi), tape.op("min", body, c(0.0))))
        ahead = self._times(0.5 / phi, tape.op("uramp", body))
        return tape.op("div", blocked, tape.op("add", c(1.0), ahead))

    def channel(self) -> R:
        """Return the current from drain to source."""
        tape, p = self.tape, self.p
        # u+^2 - w+^2 = (u+ - w+)(u+ + w+), whose first factor is v_ds itself where both are on:
        # near v_ds = 0 a difference of squares would drown the currents of blocking junctions
        across = tape.op("min", self.v["ds"], self.u_on)
        across = tape.op("max", across, tape.op("neg", self.w_on))
        difference = tape.op("mul", across, tape.op("add", self.u_on, self.w_on))
        beta = tape.constant(0.5 * p["beta"])
        if p["lambda"]:
            size = tape.op("abs", self.v["ds"])
            slope = tape.op("mul", tape.constant(0.5 * p["beta"] * p["lambda"]), size)
            beta = tape.op("add", beta, slope)
        return tape.op("mul", beta, difference)

    def junction(self, end: str) -> R | None:
        """Return the current from the body to drain or source, None without one."""
        current = self.p[f"is{end}"]
        if not current:
            return None
        return self.tape.op("junction", self.v[f"b{end}"], constants=(current, self.p["unit"]))

    def junction_charge(self, end: str) -> R | None:
        """Return the charge from the body to drain or source, None without one."""
        p = self.p
        parts = [
            self.tape.op("depletion", self.v[f"b{end}"], constants=(c, p["vj"], m, p["fc"]))
            for c, m in ((p[f"c{end}"], p["mj"]), (p[f"c{end}sw"], p["mjsw"]))
            if c
        ]
        current = self.junction(end) if p["tt"] else None
        if current is not None:
            parts.append(self._times(p["tt"], current))
        return self._sum(parts)

    def charges(self, apart: bool) -> dict[str, R | None]:
        """Return the charges by name; the body has none to the source unless it is ``apart``."""
        shares: dict[str, R | None] = dict.fromkeys(("gs", "gd", "gb"))
        if self.p["oxide"]:
            shares = {**self._channel_charges(), "gb": self._body_charge()}
        gs, gd, gb = (
            self._sum(part for part in (self._overlap(end), inner) if part is not None)
            for end, inner in shares.items()
        )
        return {
            "gate-source charge": gs,
            "gate-drain charge": gd,
            "gate-body charge": gb,
            "drain charge": self.junction_charge("d"),
            "source charge": self.junction_charge("s") if apart else None,
        }

    def _overlap(self, end: str) -> R | None:
        c = self.p[f"c{end}"]
        return self._times(c, self.v[end]) if c else None

    def _channel_charges(self) -> dict[str, R | None]:
        """Return the charge of the channel, shared by source and drain."""
        tape, u, w = self.tape, self.u_on, self.w_on
        size = 2.0 / 3.0 * self.p["oxide"]
        both = tape.op("add", u, w)
        least = tape.op("max", both, tape.constant(_NOTHING))
        # (u^2 + u w + w^2)/(u + w) = u + w - u w/(u + w)
        strong = tape.op("sub", both, tape.op("div", tape.op("mul", u, w), least))
        soft_u, soft_w = self._soft(self.u), self._soft(self.w)
        highest, above = tape.op("max", self.u, self.w), tape.op("max", u, w)
        begun = tape.op("sub", self._soft(highest), above)
        total = self._times(size, tape.op("add", strong, begun))
        # (U^2 + U W/2)/(U^2 + U W + W^2) at the source
        middle = self._times(0.5, tape.op("mul", soft_u, soft_w))
        source = tape.op("add", tape.op("square", soft_u), middle)
        drain = tape.op("add", tape.op("square", soft_w), middle)
        whole = tape.op("max", tape.op("add", source, drain), tape.constant(_NOTHING**2))
        return {
            "gs": tape.op("mul", total, tape.op("div", source, whole)),
            "gd": tape.op("mul", total, tape.op("div", drain, whole)),
        }

    def _soft(self, x: R) -> R:
        """Return x + phi/4 above zero, zero below -phi/2, and a parabola between."""
        tape, phi = self.tape, self.p["phi"]
        begun = tape.op("uramp", tape.op("add", x, tape.constant(0.5 * phi)))
        squares = tape.op("sub", tape.op("square", begun), tape.op("square", tape.op("uramp", x)))
        return self._times(1.0 / phi, squares)

    def _body_charge(self) -> R:
        """Return the charge from gate to body: of the oxide below the threshold.

        Its capacitance falls from that of the oxide to zero over the last phi before the threshold.
        """
        tape, p = self.tape, self.p
        threshold = p["vbi"] + p["gamma"] * p["phi"] ** 0.5
        below = tape.op("sub", tape.constant(threshold), self.v["gb"])
        near = tape.op("square", tape.op("uramp", below))
        far = tape.op("uramp", tape.op("sub", below, tape.constant(p["phi"])))
        squares = tape.op("sub", tape.op("square", far), near)
        return self._times(0.5 * p["oxide"] / p["phi"], squares)

    def _times(self, factor: float, register: R) -> R:
        return self.tape.op("mul", self.tape.constant(factor), register)

    def _sum(self, parts: Iterable[R]) -> R | None:
        total: R | None = None
        for part in parts:
            total = part if total is None else self.tape.op("add", total, part)
        return total
