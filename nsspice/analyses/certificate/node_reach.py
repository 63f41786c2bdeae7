"""What rounding of the currents at a node makes of its voltage, and the other way round.

Elimination leaves each law off by a part of its terms.  At a node where the largest resistance is
``R``, currents ``I`` that are known to a part ``u`` leave the voltage known to ``u R I``; where the
largest conductance is ``G``, voltages ``V`` leave the currents known to ``u G V`` (N. J. Higham,
Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, section 9.2).  Capacitors,
voltage sources and ideal elements hand a current on as it is, so that the nodes which they join
count together.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ...devices.device import Device
from ...devices.passive.resistor import Resistor
from ...devices.sources.controlled import Vccs
from ...devices.stamper import Conditions
from ...devices.switches.switch import CurrentSwitch, VoltageSwitch
from ..signals.curve import Floats

#: letters of elements that hand a current on: capacitors, and sources of voltages
_HANDS_ON = frozenset("cveh")


class NodeReach:
    """Largest resistance at each node [Ohm], and largest conductance of the nodes joined to it [S].

    Parameters
    ----------
    devices : iterable of Device
    conditions : Conditions
    """

    def __init__(self, devices: Iterable[Device], conditions: Conditions) -> None:
        self._ohms: dict[str, float] = defaultdict(float)
        siemens: dict[str, float] = defaultdict(float)
        self._joined: dict[str, str] = {}
        self._nodes: dict[str, Sequence[str]] = {}
        #: the largest conductance of what conducts at all times [S]
        self.conductance = 0.0
        for device in devices:
            self._nodes[device.name] = device.nodes
            found = [r for r in _resistances(device, conditions) if 0.0 < r < math.inf]
            if isinstance(device, Resistor | Vccs) and found:
                self.conductance = max(self.conductance, 1.0 / min(found))
            for node in device.nodes if found else ():
                self._ohms[node] = max(self._ohms[node], *found)
                siemens[node] += 1.0 / min(found)
            if len(device.nodes) == 2 and (device.letter in _HANDS_ON or _ideal(device)):
                self._join(*device.nodes)
        self._siemens: dict[str, float] = defaultdict(float)
        for node, value in siemens.items():
            root = self._root(node)
            self._siemens[root] = max(self._siemens[root], value)

    def at(self, nodes: Sequence[str]) -> tuple[float, float]:
        """Return the largest resistance [Ohm] and conductance [S] at some nodes but ground."""
        inner = [node for node in nodes if node != "0"]
        return (
            max((self._ohms[node] for node in inner), default=0.0),
            max((self._siemens[self._root(node)] for node in inner), default=0.0),
        )

    def _root(self, node: str) -> str:
        """Return the node that stands for all that are joined."""
        while node in self._joined:
            node = self._joined[node]
        return node

    def _join(self, a: str, b: str) -> None:
        """Let two nodes count together, unless one is ground."""
        if "0" not in (a, b) and self._root(a) != self._root(b):
            self._joined[self._root(a)] = self._root(b)

    def of_columns(self, names: Sequence[str]) -> tuple[Floats, Floats]:
        """Return both for the nodes of each voltage ``v(n)`` and of each current ``i(d)``."""
        pairs = [
            self.at([name[2:-1]] if name[0] == "v" else self._nodes.get(name[2:-1], ()))
            for name in names
        ]
        ohms, siemens = np.array(pairs, dtype=float).reshape(-1, 2).T
        return ohms, siemens


def _ideal(device: Device) -> bool:
    """Return whether an element conducts without a resistance."""
    if isinstance(device, VoltageSwitch | CurrentSwitch):
        return not device.law.ron
    if device.letter != "d":
        return False
    from ...devices.diodes.diode import Diode

    return isinstance(device, Diode) and not device.law.ron


def _resistances(device: Device, conditions: Conditions) -> Iterator[float]:
    """Return the resistances that an element may have [Ohm]."""
    if isinstance(device, Resistor):
        yield abs(device.at(conditions)) / device.m
    elif isinstance(device, VoltageSwitch | CurrentSwitch):
        yield from (device.law.ron / device.m, device.law.roff / device.m)
    elif isinstance(device, Vccs) and device.gain:
        yield 1.0 / abs(device.gain)
    elif device.letter == "d":
        from ...devices.diodes.leg_device import LegDevice
        from ...devices.switches.latching_thyristor import LatchingThyristor

        if isinstance(device, LegDevice):
            curve = device.curve(conditions)
            yield from (dv / di for di, dv in curve.directions if di) if curve else ()
        elif isinstance(device, LatchingThyristor):
            yield device.card.get("ron", 0.0) / device.parallel
