"""Which pairs of an element conduct as a switch or a diode whose switchings cost energy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

from .diodes.diode import Diode
from .mosfets.mosfet_switch import MosfetSwitch
from .switches.switch import _Switch
from .transistors.igbt import Igbt

if TYPE_CHECKING:
    from .device import Device
    from .diodes.diode_branch import Leg
    from .stamper import Layout


class Valve(NamedTuple):
    """A part of an element that turns on and off.

    Parameters
    ----------
    kind : str
        ``switch`` or ``diode``.
    pair : int
        Its complementarity pair.
    parallel : float
        How many equal ones it stands for.
    inverted : bool
        The pair conducts while the part is off (``RON`` above ``ROFF``).
    """

    kind: Literal["switch", "diode"]
    pair: int
    parallel: float = 1.0
    inverted: bool = False

    def conducts(self, active: Sequence[int]) -> bool:
        """Return whether the part is on, with these pairs conducting."""
        return (self.pair in active) != self.inverted


def valves(device: Device, layout: Layout) -> Iterator[Valve]:
    """Yield the parts of a device that turn on and off."""
    name, pairs = device.name, layout.pairs
    if isinstance(device, _Switch):
        for pair in pairs.get(name, ()):
            yield Valve("switch", pair, device.m, device.law.ron > device.law.roff)
    elif isinstance(device, Diode):
        yield from _diode(device.leg, name, layout)
    elif isinstance(device, MosfetSwitch):
        for pair in pairs.get(f"{name}.channel", ()):
            yield Valve("switch", pair, device.parallel)
        for terminal, leg in device.legs.items():
            yield from _diode(leg, f"{name}.b{terminal}", layout)
    elif isinstance(device, Igbt):
        for pair in pairs.get(f"{name}.channel", ()):
            yield Valve("switch", pair, device.parallel)
        if device.leg is not None:
            yield from _diode(device.leg, f"{name}.diode", layout)


def _diode(leg: Leg, name: str, layout: Layout) -> Iterator[Valve]:
    """Yield the forward pair of a set-valued diode."""
    parts = getattr(leg.body, "parts", None)
    if parts is not None:
        for pair, one in zip(layout.pairs.get(name, ()), parts.pairs, strict=True):
            if one.forward:
                yield Valve("diode", pair, leg.parallel)
