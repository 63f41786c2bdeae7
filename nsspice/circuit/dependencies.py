"""The part of a circuit that some signals depend on.

A voltage depends on all elements that meet at its node, these on their other nodes and on what they
sense.  Nothing depends on what only senses: a controlled source is a buffer.  The potential of a
node that voltage sources hold against ground depends on these sources alone, and not on what else
they feed, as long as nobody asks for their currents.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..devices.device import Device
from ..devices.passive.coupling import Coupling
from ..devices.sources.controlled import Ccvs, Vcvs
from ..devices.sources.vsource import VoltageSource
from .build import circuit_of
from .circuit import Circuit
from .signals import owner, parse_signal


@dataclass(frozen=True, slots=True)
class Skipped:
    """Elements that are not simulated because nothing that is asked for depends on them.

    Parameters
    ----------
    elements : tuple of str
        In deck order.
    """

    elements: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self.elements)

    def __str__(self) -> str:
        names, more = ", ".join(self.elements[:6]), len(self.elements) - 6
        return names + (f" and {more} more" if more > 0 else "")


def needed(circuit: Circuit, signals: Iterable[str]) -> tuple[Circuit, Skipped]:
    """Return the part of a circuit that signals depend on, and what is left out.

    Parameters
    ----------
    circuit : Circuit
    signals : iterable of str
        Canonical names: ``v(a)``, ``v(a,b)``, ``i(r1)``, ``p(r1)``.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''a divider, a buffer and its load
    ... V1 a 0 1
    ... R1 a b 1
    ... R2 b 0 1
    ... E1 c 0 b 0 1
    ... R3 c 0 1
    ... ''')
    >>> part, skipped = needed(circuit, ["v(b)"])
    >>> [device.name for device in part.devices], str(skipped)
    (['v1', 'r1', 'r2'], 'e1, r3')
    >>> str(needed(circuit, ["i(e1)"])[1])
    ''
    """
    reach = _Reach(circuit.devices)
    for signal in signals:
        parsed = parse_signal(signal)
        if parsed is None:
            return circuit, Skipped()
        if parsed.kind == "v":
            reach.nodes(parsed.names)
            continue
        found = owner(parsed.names[0], reach.by_name)
        if found is None:
            return circuit, Skipped()
        reach.current(found[0])
    chosen = reach.closure()
    if not chosen or len(chosen) == len(circuit.devices):
        return circuit, Skipped()
    kept = [device for device in circuit.devices if device.name in chosen]
    left = tuple(device.name for device in circuit.devices if device.name not in chosen)
    return circuit_of(circuit.deck, kept), Skipped(left)


class _Reach:
    """Walks from what is asked for to what it depends on."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self.by_name = {device.name: device for device in devices}
        self._at: dict[str, list[Device]] = {}
        self._couplings: dict[str, list[Device]] = {}
        for device in devices:
            for node in dict.fromkeys(device.nodes):
                self._at.setdefault(node, []).append(device)
            if isinstance(device, Coupling):
                for name in device.controls:
                    self._couplings.setdefault(name, []).append(device)
        self._holds = _holding(devices)
        self._held_by = {device.name: node for node, device in self._holds.items()}
        self._chosen: dict[str, Device] = {}
        self._seen: set[str] = {"0"}
        self._summed: set[str] = set()
        self._nodes: list[str] = []
        self._todo: list[Device] = []

    def nodes(self, names: Iterable[str]) -> None:
        """Ask for the potentials of nodes."""
        self._nodes += names

    def current(self, device: Device) -> None:
        """Ask for the current of an element: a source that holds a node carries the others'."""
        self._todo.append(device)
        node = self._held_by.get(device.name)
        if node is None or node in self._summed:
            return
        self._summed.add(node)
        for other in self._at.get(node, []):
            if other is not device:
                self.current(other)

    def closure(self) -> dict[str, Device]:
        """Return all elements that what was asked for depends on."""
        while self._todo or self._nodes:
            while self._nodes:
                node = self._nodes.pop()
                if node in self._seen:
                    continue
                self._seen.add(node)
                source = self._holds.get(node)
                self._todo += self._at.get(node, []) if source is None else [source]
            if not self._todo:
                break
            device = self._todo.pop()
            if device.name in self._chosen:
                continue
            self._chosen[device.name] = device
            self._nodes += (*device.nodes, *device.control_nodes)
            for name in device.control_elements:
                found = owner(name, self.by_name)
                if found is not None:
                    if isinstance(device, Coupling):
                        self._todo.append(found[0])
                    else:
                        self.current(found[0])
            self._todo += self._couplings.get(device.name, [])
        return self._chosen


def _holding(devices: Sequence[Device]) -> dict[str, Device]:
    """Return the voltage source that holds each node whose potential sources alone decide."""
    sources = [
        d
        for d in devices
        if isinstance(d, VoltageSource | Vcvs | Ccvs)
        or (d.expressions and getattr(d, "quantity", "") == "v")
    ]
    found: dict[str, Device] = {}
    known = {"0"}
    more = True
    while more:
        more = False
        for device in sources:
            a, b = device.ends
            for one, other in ((a, b), (b, a)):
                if one in known and other not in known:
                    known.add(other)
                    found[other] = device
                    more = True
    return found
