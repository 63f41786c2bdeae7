"""Parameters of the LEVEL=1 MOSFET: what the card leaves out, size and temperature, as in SPICE3.

    beta = KP W / (L - 2 LD),   Cox = 3.9 eps0 / TOX,   KP = U0 Cox   unless the card gives it
    phi = 2 kT/q ln(NSUB / ni),   gamma = sqrt(2 q eps_si NSUB) / Cox   unless it gives them

Over the temperature KP falls as T^-1.5, the threshold follows the band gap and phi, and saturation
currents follow the band gap (G. Massobrio, P. Antognetti, *Semiconductor Device Modeling with
SPICE*, 2nd ed., McGraw-Hill 1993, ch. 4; the constants are those of SPICE3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..stamper import Conditions
from ..temperature import CELSIUS, CHARGE, depletion, kelvin, thermal_voltage
from .level1_card import CARD, INTRINSIC

EPS0 = 8.854214871e-12  # [F/m], SPICE3's digits
_DEFAULTS = {p.name: p.default or 0.0 for p in CARD.parameters if p.status == "used"}
#: KP of a card without oxide [A/V2]
_KP = 2e-5


def gap(temperature: float) -> float:
    """Return the band gap of silicon [eV] at a temperature [K].

    Examples
    --------
    >>> round(gap(300.15), 6)
    1.115088
    """
    return 1.16 - 7.02e-4 * temperature * temperature / (temperature + 1108.0)


def completed(card: Mapping[str, float], n: bool, nominal: float) -> dict[str, float]:
    """Return the card with the parameters that oxide and doping give.

    Parameters
    ----------
    card : mapping of str to float
    n : bool
        n-channel.
    nominal : float
        [K]
    """
    p = {**_DEFAULTS, **card}
    sign = 1.0 if n else -1.0
    p["vto"] = sign * card.get("vto", 0.0)
    p["cox"] = cox = 3.9 * EPS0 / p["tox"] if p["tox"] else 0.0
    p["kp"] = card.get("kp", p["u0"] * cox * 1e-4 if cox else _KP)
    if cox and p["nsub"]:
        doping = p["nsub"] * 1e6
        if "phi" not in card:
            p["phi"] = max(0.1, 2.0 * thermal_voltage(nominal) * math.log(doping / INTRINSIC))
        # work functions of gate and body [V]; a gate of aluminium has 3.2
        gate = 3.2 if p["tpg"] == 0.0 else 3.25 + 0.5 * gap(nominal) * (1.0 - sign * p["tpg"])
        step = gate - (3.25 + 0.5 * gap(nominal) + 0.5 * sign * p["phi"])
        if "gamma" not in card:
            p["gamma"] = math.sqrt(2.0 * 11.7 * EPS0 * CHARGE * doping) / cox
        if "vto" not in card:
            flat = step - p["nss"] * 1e4 * CHARGE / cox
            p["vto"] = sign * flat + p["gamma"] * math.sqrt(p["phi"]) + p["phi"]
    return p


def at_temperature(
    card: Mapping[str, float],
    size: Mapping[str, float],
    n: bool,
    conditions: Conditions,
    temp: float | None,
    dtemp: float,
) -> dict[str, float]:
    """Return the parameters of one transistor, counted as those of an n-channel one.

    Parameters
    ----------
    card : mapping of str to float
        What the model card gives.
    size : mapping of str to float
        ``w l ad as pd ps nrd nrs``.
    n : bool
        n-channel.
    conditions : Conditions
    temp : float or None
        The transistor's own temperature [degrees Celsius].
    dtemp : float
        Above the circuit's [K].
    """
    actual = kelvin(conditions, temp, dtemp)
    nominal = card.get("tnom", conditions.nominal) + CELSIUS
    p = completed(card, n, nominal)
    sign = 1.0 if n else -1.0
    length = size["l"] - 2.0 * p["ld"]
    p["rise"] = (actual / nominal) ** -1.5
    p["beta"] = p["kp"] * p["rise"] * size["w"] / length
    phi = p["phi"]
    p["phi"] = depletion(0.0, phi, 0.5, nominal, actual)[1]
    p["vbi"] = (
        p["vto"] - p["gamma"] * math.sqrt(phi)
        + 0.5 * sign * (gap(nominal) - gap(actual)) + 0.5 * (p["phi"] - phi)
    )  # fmt: skip
    p["vt"] = thermal_voltage(actual)
    p["unit"] = p["n"] * p["vt"]
    growth = math.exp(gap(nominal) / thermal_voltage(nominal) - gap(actual) / p["vt"])
    dense = p["js"] and size["ad"] and size["as"]
    for end in ("d", "s"):
        p[f"is{end}"] = growth * (p["js"] * size[f"a{end}"] if dense else p["is"])
        own = p[f"cb{end}"] if f"cb{end}" in card else p["cj"] * size[f"a{end}"]
        p[f"c{end}"], p["vj"] = depletion(own, p["pb"], p["mj"], nominal, actual)
        side = p["cjsw"] * size[f"p{end}"]
        p[f"c{end}sw"] = depletion(side, p["pb"], p["mjsw"], nominal, actual)[0]
        p[f"r{end}"] = p[f"r{end}"] if f"r{end}" in card else p["rsh"] * size[f"nr{end}"]
    p["oxide"] = p["cox"] * length * size["w"]
    p["cgs"], p["cgd"] = p["cgso"] * size["w"], p["cgdo"] * size["w"]
    p["cgb"] = p["cgbo"] * length
    return p
