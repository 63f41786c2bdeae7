"""How junction parameters follow the temperature, as in SPICE3.

References: G. Massobrio, P. Antognetti, *Semiconductor Device Modeling with SPICE*, 2nd ed.,
McGraw-Hill 1993, sections 1.5 and 2.10; the constants of silicon are those of SPICE3.
"""

from __future__ import annotations

import math

from ..errors import Diagnostic, NetlistError
from ..netlist.expressions.functions import ABSOLUTE_ZERO, no_temperature
from .stamper import Conditions

BOLTZMANN = 1.380649e-23  # [J/K]
CHARGE = 1.602176634e-19  # [A s]
CELSIUS = -ABSOLUTE_ZERO  # [K]
_REFERENCE = 300.15  # [K]
_GAP = 1.1150877  # [eV] of silicon at the reference temperature
_EXPANSION = 4e-4  # [1/K] of the junction capacitance


def kelvin(conditions: Conditions, temperature: float | None = None, offset: float = 0.0) -> float:
    """Return the temperature of an element [K].

    Parameters
    ----------
    conditions : Conditions
    temperature : float, optional
        The element's own [degrees Celsius].
    offset : float
        Above the circuit's [K], if it has none of its own.
    """
    own = conditions.temperature + offset if temperature is None else temperature
    # dtemp= and expressions; what cards say is judged where it is read
    if why := no_temperature(own):
        message = f"an element has {own:g} degrees Celsius, which is {why}"
        raise NetlistError(Diagnostic("NS2005", message, None, "correct its temp= or dtemp="))
    return own + CELSIUS


def thermal_voltage(temperature: float) -> float:
    """Return ``k T / q`` [V].

    Examples
    --------
    >>> round(thermal_voltage(300.15), 6)
    0.025865
    """
    return BOLTZMANN * temperature / CHARGE


def saturation(
    current: float, n: float, gap: float, exponent: float, nominal: float, actual: float
) -> float:
    """Return a saturation current [A] at another temperature.

    Parameters
    ----------
    current : float
        At the nominal temperature [A].
    n : float
        Emission coefficient.
    gap : float
        Band gap ``EG`` [eV].
    exponent : float
        ``XTI``.
    nominal, actual : float
        [K]
    """
    if nominal == actual:
        return current
    ratio = actual / nominal
    return current * math.exp(
        ((ratio - 1.0) * gap / thermal_voltage(actual) + exponent * math.log(ratio)) / n
    )


def depletion(
    capacitance: float, potential: float, grading: float, nominal: float, actual: float
) -> tuple[float, float]:
    """Return junction capacitance [F] and potential [V] at another temperature.

    Parameters
    ----------
    capacitance, potential, grading : float
        ``CJO VJ M`` at the nominal temperature.
    nominal, actual : float
        [K]

    Examples
    --------
    >>> depletion(1e-12, 0.8, 0.5, 300.15, 300.15)
    (1e-12, 0.8)
    """
    if nominal == actual:
        return capacitance, potential
    at_reference = (potential - _shift(nominal)) / (nominal / _REFERENCE)
    scaled = _shift(actual) + actual / _REFERENCE * at_reference

    def growth(temperature: float, voltage: float) -> float:
        drift = (voltage - at_reference) / at_reference
        return 1.0 + grading * (_EXPANSION * (temperature - _REFERENCE) - drift)

    return capacitance * growth(actual, scaled) / growth(nominal, potential), scaled


def _shift(temperature: float) -> float:
    """Return the part of the junction potential that silicon itself gives [V]."""
    gap = 1.16 - 7.02e-4 * temperature * temperature / (temperature + 1108.0)
    level = -gap / (2.0 * thermal_voltage(temperature)) + _GAP / (2.0 * thermal_voltage(_REFERENCE))
    return -2.0 * thermal_voltage(temperature) * (1.5 * math.log(temperature / _REFERENCE) + level)
