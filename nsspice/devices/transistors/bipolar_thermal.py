"""How the parameters of the smooth bipolar transistor follow the temperature, as in SPICE3.

``ISS`` follows it as ``ISE`` does; ngspice 39 leaves its emission coefficient out, later ones do
not.

Where the card gives coefficients, a parameter follows them instead (PSpice, ngspice):

    P(T) = P (1 + TP1 dT + TP2 dT^2),    dT from the nominal temperature
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..stamper import Conditions
from ..temperature import CELSIUS, depletion, kelvin, saturation, thermal_voltage
from .bipolar_card import CARD, COEFFICIENTS, STEEPEST

#: what a parameter is if the card does not give it; 0 stands for an absent effect
_DEFAULTS = {p.name: p.default or 0.0 for p in CARD.parameters if p.status == "used"}


def at_temperature(
    card: Mapping[str, float], conditions: Conditions, temp: float | None, dtemp: float
) -> dict[str, float]:
    """Return all parameters at the temperature of a transistor, and ``vt``, its kT/q [V].

    Parameters
    ----------
    card : mapping of str to float
        What the model card gives.
    conditions : Conditions
    temp : float or None
        The transistor's own temperature [degrees Celsius].
    dtemp : float
        Above the circuit's [K].

    Examples
    --------
    >>> at_temperature({"rb": 10.0, "trb1": 1e-3}, Conditions(temperature=127.0), None, 0.0)["rb"]
    11.0
    """
    p = {**_DEFAULTS, **card}
    p["rbm"] = card.get("rbm", p["rb"])
    actual = kelvin(conditions, temp, dtemp)
    nominal = card.get("tnom", conditions.nominal) + CELSIUS
    rise = actual - nominal
    for key, first, second in COEFFICIENTS:
        p[key] *= 1.0 + p[first] * rise + p[second] * rise * rise
    growth = math.pow(actual / nominal, p["xtb"])
    for key, first, second in (("bf", "tbf1", "tbf2"), ("br", "tbr1", "tbr2")):
        if first not in card and second not in card:
            p[key] *= growth
    gap, exponent = p["eg"], p["xti"]
    p["is"] = saturation(p["is"], 1.0, gap, exponent, nominal, actual)
    for key, n in (("ise", "ne"), ("isc", "nc"), ("iss", "ns")):
        p[key] = saturation(p[key], p[n], gap, exponent, nominal, actual) / growth
    for c, v, m in (("cje", "vje", "mje"), ("cjc", "vjc", "mjc"), ("cjs", "vjs", "mjs")):
        p[m] = min(p[m], STEEPEST)
        p[c], p[v] = depletion(p[c], p[v], p[m], nominal, actual)
    p["vt"] = thermal_voltage(actual)
    return p
