"""Noise of elements, as currents between two nodes.

A resistance has :math:`4 k T / R`, a junction :math:`2 q |I|`, the channel of a field-effect
transistor :math:`\\tfrac83 k T |g_m|` [A^2/Hz], one-sided and white; a bipolar transistor has those
of its collector and base currents and of its resistances.  With ``KF`` and ``AF`` diodes, base
currents and channels flicker: :math:`K_F |I|^{A_F} / f`, that of a MOSFET over
:math:`C_{ox}^2`, of level 1 over :math:`W L C_{ox}^2`, as in ngspice.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from .diodes.diode_branch import JunctionBody
from .diodes.junction_diode import JunctionDiode
from .diodes.thermal import BOLTZMANN, CHARGE, kelvin
from .mosfets.level1 import Level1
from .mosfets.smooth_mosfet import SmoothMosfet
from .mosfets.vdmos import Vdmos
from .passive.resistor import Resistor
from .transistors.bipolar import Bipolar
from .transistors.jfet import Jfet

if TYPE_CHECKING:
    from ..netlist.deck import Element, Param
    from .device import Device
    from .stamper import Layout


_EPS0 = 8.854214871e-12  # as SPICE has it [F/m]
_OXIDE = 1e-7  # thickness where the card has none [m]


class NoiseSource(NamedTuple):
    """One source of noise.

    Parameters
    ----------
    a, b : str
        Nodes between which its current flows.
    density : float
        [A^2/Hz], or what a power of a current or slope at the operating point multiplies.
    signal : str
        A current; empty without one.
    function : int or None
        A smooth function, a current.
    gate : str
        Node by whose voltage the function is differentiated; empty for its value.
    exponent : float
        Of the current or slope.
    flickers : bool
        The density is that at 1 Hz, and falls with the frequency.
    """

    a: str
    b: str
    density: float
    signal: str = ""
    function: int | None = None
    gate: str = ""
    exponent: float = 1.0
    flickers: bool = False


def flicker_of(element: Element | None) -> tuple[float, float, float]:
    """Return ``KF`` and ``AF`` of an element's model card, 0 and 1 if left out, and its ``M``."""
    cards = {} if element is None or element.model is None else element.model.params
    line = {} if element is None else element.params

    def number(params: Mapping[str, Param], key: str, default: float) -> float:
        value = params[key].value if key in params else default
        return float(value) if isinstance(value, int | float) else default

    return number(cards, "kf", 0.0), number(cards, "af", 1.0), number(line, "m", 1.0)


def noise_sources(
    device: Device, layout: Layout, element: Element | None = None
) -> Iterator[NoiseSource]:
    """Yield the sources of noise of a device of an element line; ideal elements have none."""
    conditions, name = layout.conditions, device.name
    kf, af, many = flicker_of(element)
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
        yield from _flicker(a, b, kf, af, many, signal=f"i({name})")
    elif isinstance(device, Bipolar):
        c, b, e = device.inner
        temperature = kelvin(conditions, device.temp, device.dtemp)
        for node, inner, siemens in device.ohmic(conditions):
            yield _thermal(node, inner, siemens, temperature)
        yield NoiseSource(c, e, 2.0 * CHARGE, f"i({name})")
        yield NoiseSource(b, e, 2.0 * CHARGE, f"i({name}.b)")
        yield from _flicker(b, e, kf, af, many, signal=f"i({name}.b)")
    elif isinstance(device, Level1 | Vdmos | Jfet):
        yield from _channel(device, layout, kf, af)


def _channel(device: SmoothMosfet, layout: Layout, kf: float, af: float) -> Iterator[NoiseSource]:
    """Yield the noise of a field-effect transistor."""
    conditions, many = layout.conditions, device.parallel
    temperature = kelvin(conditions, device.temp, device.dtemp)
    nodes = device.inside(conditions)
    for terminal, ohms in device.resistances(conditions).items():
        inner = nodes[terminal.upper()]
        yield _thermal(nodes[terminal], inner, many / ohms, temperature)
    number = layout.functions.get(f"{device.name}#channel")
    if number is None:
        return
    d, s = nodes["D"], nodes["S"]
    thermal = 8.0 / 3.0 * BOLTZMANN * temperature * many
    yield NoiseSource(d, s, thermal, function=number, gate=nodes["G"])
    if isinstance(device, Level1 | Vdmos):
        oxide = 3.9 * _EPS0 / (device.card.get("tox") or _OXIDE)
        kf /= oxide**2
    if isinstance(device, Level1):
        kf /= device.size["w"] * (device.size["l"] - 2.0 * device.card.get("ld", 0.0))
    # of one of equal parallel transistors
    yield from _flicker(d, s, kf * many, af, 1.0, function=number)


def _flicker(
    a: str, b: str, kf: float, af: float, many: float, signal: str = "", function: int | None = None
) -> Iterator[NoiseSource]:
    """Yield what flickers, of so many equal parallel elements that share a current."""
    if kf:
        density = kf * many ** (1.0 - af)
        yield NoiseSource(a, b, density, signal, function, exponent=af, flickers=True)


def _thermal(a: str, b: str, siemens: float, temperature: float) -> NoiseSource:
    return NoiseSource(a, b, 4.0 * BOLTZMANN * temperature * siemens)
