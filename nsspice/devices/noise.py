"""Thermal and shot noise of elements, as currents between two nodes.

A resistance has :math:`4 k T / R`, a junction :math:`2 q |I|` [A^2/Hz], one-sided and white; a
bipolar transistor has those of its collector and base currents and of its resistances.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from .bipolar import Bipolar
from .junction_diode import JunctionDiode
from .leg import JunctionBody
from .resistor import Resistor
from .thermal import BOLTZMANN, CHARGE, kelvin

if TYPE_CHECKING:
    from .device import Device
    from .stamper import Layout


class NoiseSource(NamedTuple):
    """One source of white noise.

    Parameters
    ----------
    a, b : str
        Nodes between which its current flows.
    density : float
        [A^2/Hz], or of shot noise [A/Hz] times ``signal``.
    signal : str
        The current whose size at the operating point multiplies the density; empty without one.
    """

    a: str
    b: str
    density: float
    signal: str = ""


def noise_sources(device: Device, layout: Layout) -> Iterator[NoiseSource]:
    """Yield the sources of noise of a device; ideal elements have none."""
    conditions, name = layout.conditions, device.name
    if isinstance(device, Resistor):
        ohms = device.at(conditions)
        if 0.0 < ohms < float("inf"):
            yield _thermal(*device.ends, device.m / ohms, kelvin(conditions))
    elif isinstance(device, JunctionDiode):
        body, (a, b) = device.leg.body, device.ends
        assert isinstance(body, JunctionBody)
        if device.leg.drop is not None:
            a = f"{name}#drop"
        if device.law.rs:
            resistance = device.law.at(conditions, body.temp, body.dtemp).resistance
            inner = f"{name}#internal"
            temperature = kelvin(conditions, body.temp, body.dtemp)
            yield _thermal(a, inner, body.parallel / resistance, temperature)
            a = inner
        yield NoiseSource(a, b, 2.0 * CHARGE, f"i({name})")
    elif isinstance(device, Bipolar):
        c, b, e = device.inner
        temperature = kelvin(conditions, device.temp, device.dtemp)
        for node, inner, siemens in device.ohmic(conditions):
            yield _thermal(node, inner, siemens, temperature)
        yield NoiseSource(c, e, 2.0 * CHARGE, f"i({name})")
        yield NoiseSource(b, e, 2.0 * CHARGE, f"i({name}.b)")


def _thermal(a: str, b: str, siemens: float, temperature: float) -> NoiseSource:
    return NoiseSource(a, b, 4.0 * BOLTZMANN * temperature * siemens)
