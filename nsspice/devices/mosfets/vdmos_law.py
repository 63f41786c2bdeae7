"""The equations of the VDMOS on a tape, and how its parameters follow the temperature.

With x = mtriode v_ds, the overdrives u and w at source and drain,

    u = k ln(1 + exp((v_gs - Vto - subshift)/k)),   k = ksubthres,   w the same of v_gd,
    i = Kp/2 (1 + lambda v_ds)/(1 + theta v_gs) (F(u, x+) - F(w, (-x)+)),
    F(u, x) = min(x, u) (2 u - min(x, u)),          x+ = max(x, 0),

which is ngspice's (its manual, section 11.3; the weak inversion is that of I. Hegglun, "Simple MOS
model with weak inversion", ngspice's source quotes it), also for a drain below the source.  The
gate has a constant capacitance to the source; that to the drain falls from Cgdmax to Cgdmin as
tanh(a v_gd) above and atan(a v_gd) below v_gd = 0 (LTspice's manual), and its charge is a state.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Generic

from ..diodes.number_tape import LawTape, R
from ..stamper import Conditions
from ..temperature import CELSIUS, kelvin
from .vdmos_card import CARD

_DEFAULTS = {p.name: p.default or 0.0 for p in CARD.parameters if p.status == "used"}
#: of 1 + theta v_gs, so far below the threshold that the channel is shut, and of 1 + lambda v_ds
_LEAST = 1e-3


class VdmosLaw(Generic[R]):
    """The registers of one transistor's functions.

    Parameters
    ----------
    tape : TapeBuilder or NumberTape
    p : mapping of str to float
        Parameters at the temperature of the transistor, see ``at_temperature``.
    v : mapping of str to register
        Registers of the voltages ``gs gd ds``, counted as those of an n-channel transistor.
    """

    def __init__(self, tape: LawTape[R], p: Mapping[str, float], v: Mapping[str, R]) -> None:
        self.tape, self.p, self.v = tape, p, v

    def channel(self) -> R:
        """Return the current from drain to source."""
        tape, p, v = self.tape, self.p, self.v
        across = self._times(p["mtriode"], v["ds"])
        forward = self._one_way(self._overdrive("gs"), across)
        backward = self._one_way(self._overdrive("gd"), tape.op("neg", across))
        total = self._times(0.5 * p["kp"], tape.op("sub", forward, backward))
        one = tape.constant(1.0)
        if p["lambda"]:
            factor = tape.op("add", one, self._times(p["lambda"], v["ds"]))
            # with the drain far below the source the current would change its sign
            total = tape.op("mul", total, tape.op("max", factor, tape.constant(_LEAST)))
        if p["theta"]:
            factor = tape.op("add", one, self._times(p["theta"], v["gs"]))
            total = tape.op("div", total, tape.op("max", factor, tape.constant(_LEAST)))
        return total

    def charges(self) -> dict[str, R | None]:
        """Return the charges by name, None without one."""
        p, v = self.p, self.v
        source = self._times(p["cgs"], v["gs"]) if p["cgs"] else None
        least, most = p["cgdmin"], p["cgdmax"]
        drain = None
        if most and most == least:
            drain = self._times(most, v["gd"])
        elif most:
            drain = self.tape.op("gate_drain", v["gd"], constants=(least, most, p["a"]))
        return {"gate-source charge": source, "gate-drain charge": drain}

    def _overdrive(self, end: str) -> R:
        tape, p = self.tape, self.p
        over = tape.op("sub", self.v[end], tape.constant(p["vto"] + p["subshift"]))
        return tape.op("softplus", over, constants=(p["ksubthres"],))

    def _one_way(self, overdrive: R, across: R) -> R:
        """Return F(u, x+)."""
        tape = self.tape
        inside = tape.op("min", tape.op("uramp", across), overdrive)
        double = tape.op("add", overdrive, overdrive)
        return tape.op("mul", inside, tape.op("sub", double, inside))

    def _times(self, factor: float, register: R) -> R:
        return self.tape.op("mul", self.tape.constant(factor), register)


def at_temperature(
    card: Mapping[str, float], n: bool, conditions: Conditions, temp: float | None, dtemp: float
) -> dict[str, float]:
    """Return the parameters of one transistor, counted as those of an n-channel one.

    Parameters
    ----------
    card : mapping of str to float
        What the model card gives.
    n : bool
        n-channel.
    conditions : Conditions
    temp : float or None
        The transistor's own temperature [degrees Celsius].
    dtemp : float
        Above the circuit's [K].

    Examples
    --------
    >>> p = at_temperature({"vto": -3.0, "tcvth": 4e-3}, False, Conditions(127.0), None, 0.0)
    >>> p["vto"]
    2.6
    """
    actual = kelvin(conditions, temp, dtemp)
    nominal = card.get("tnom", conditions.nominal) + CELSIUS
    rise = actual - nominal
    p = {**_DEFAULTS, **card}
    p["kp"] *= (actual / nominal) ** p["mu"]
    p["vto"] = p["vto"] * (1.0 if n else -1.0) - p["tcvth"] * rise
    for key in ("rd", "rs", "rg", "ksubthres"):
        p[key] *= 1.0 + p[f"t{key}1"] * rise + p[f"t{key}2"] * rise * rise
    if "texp0" in card:
        p["rd"] = card.get("rd", 0.0) * (actual / nominal) ** card["texp0"]
    # one that is not given is the other: a constant capacitance
    p["cgdmin"] = card.get("cgdmin", card.get("cgdmax", 0.0))
    p["cgdmax"] = card.get("cgdmax", card.get("cgdmin", 0.0))
    return p
