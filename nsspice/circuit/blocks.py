"""Blocks of an island that drive others through controls alone, and are not driven back.

What senses draws no current: an island in which one part only senses another falls into blocks that
can be solved one after the other.  It is split where that pays: the block that drives has closed
forms, and a smooth law in the driven one would take them away.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..devices.device import Device
from ..devices.passive.coupling import Coupling
from ..devices.sources.controlled import CurrentControlled
from ..devices.switches.switch import CurrentSwitch
from ..problems.descriptor import Handed
from .build import nodes_of
from .circuit import Circuit, Island
from .kink_form import written
from .problem_class import ProblemClass, classify
from .signals import owner
from .union_find import UnionFind

if TYPE_CHECKING:
    from ..devices.expressions.block_input import Sensed

#: What a block has to be to drive another one: something is stored in it, and nothing is smooth.
_EXACT = (ProblemClass.LINEAR_DAE, ProblemClass.DLCP)
_SMOOTH = (ProblemClass.GE, ProblemClass.DNCP)


@dataclass(frozen=True, slots=True)
class Link:
    """A signal of one block that drives another.

    Parameters
    ----------
    source, target : int
        Numbers of the blocks among the islands.
    signal : str
        ``v(b)`` or ``i(v1)``
    handed : Handed
        Through which it goes.
    """

    source: int
    target: int
    signal: str
    handed: Handed


@dataclass(frozen=True, slots=True)
class Blocks:
    """A circuit whose islands are split into blocks.

    Parameters
    ----------
    circuit : Circuit
        Its islands are the blocks, those that drive before those that they drive.
    links : tuple of Link
        What they hand on; empty if there is nothing to be split.
    """

    circuit: Circuit
    links: tuple[Link, ...] = ()

    def __bool__(self) -> bool:
        """Return whether anything has been split."""
        return bool(self.links)

    def drivers(self, island: int) -> tuple[int, ...]:
        """Return the numbers of the blocks that drive one."""
        return tuple(sorted({link.source for link in self.links if link.target == island}))


def blocks(circuit: Circuit, new: Callable[[], Handed]) -> Blocks:
    """Return a circuit with blocks that have closed forms apart from smooth ones that they drive.

    Parameters
    ----------
    circuit : Circuit
    new : callable
        Returns something through which a signal is handed on.

    Examples
    --------
    >>> import nsspice
    >>> from nsspice.solvers.polynomial import Polynomial
    >>> circuit = nsspice.read('''a rectifier, and a sensor that saturates smoothly
    ... V1 a 0 SIN(0 10 50)
    ... D1 a b
    ... C1 b 0 1m
    ... R1 b 0 10
    ... E1 c 0 VALUE={tanh(v(b))}
    ... R2 c d 1k
    ... C2 d 0 1u
    ... ''')
    >>> split = blocks(circuit, Polynomial)
    >>> [[d.name for d in island.devices] for island in split.circuit.islands]
    [['v1', 'd1', 'c1', 'r1'], ['e1', 'r2', 'c2', 'input.v(b)']]
    >>> [(link.source, link.target, link.signal) for link in split.links]
    [(0, 1, 'v(b)')]
    """
    islands: list[Island] = []
    links: list[Link] = []
    for island in circuit.islands:
        parts = _split(island) if island.problem_class in _SMOOTH else None
        if parts is None:
            islands.append(island)
            continue
        first = len(islands)
        islands += parts.exact
        for devices in parts.driven:
            driven, signals = _driven(devices, parts, new)
            number = len(islands)
            for signal, home, handed in signals:
                links.append(Link(first + home, number, signal, handed))
            islands.append(_island(driven, island))
    if not links:
        return Blocks(circuit)
    from ..devices.expressions.block_input import BlockInput

    node_home: dict[str, int] = {}
    element_home: dict[str, int] = {}
    for k, island in enumerate(islands):
        inputs = {d.ends[0] for d in island.devices if isinstance(d, BlockInput)}
        node_home |= {node: k for node in island.nodes if node not in inputs}
        element_home |= {d.name: k for d in island.devices if not isinstance(d, BlockInput)}
    chosen = {d.name: d for island in islands for d in island.devices}
    whole = Circuit(
        circuit.deck,
        [chosen[device.name] for device in circuit.devices],
        islands,
        circuit.warnings,
        {node: node_home[node] for node in circuit.node_island},
        {device.name: element_home[device.name] for device in circuit.devices},
    )
    return Blocks(whole, tuple(links))


@dataclass(frozen=True, slots=True)
class _Parts:
    """The blocks of one island."""

    exact: list[Island]
    driven: list[list[Device]]
    node_home: dict[str, int]
    home: dict[str, int]


def _split(island: Island) -> _Parts | None:
    """Return the blocks of an island, None if it is to stay whole."""
    graph = _Components(island.devices)
    smooth = {graph.of_device(d) for d in island.devices if d.smooth and not d.kinked}
    while True:
        downstream = graph.downstream(smooth)
        upstream = [d for d in island.devices if graph.of_device(d) not in downstream]
        exact, worse = [], set()
        for group in graph.groups(upstream):
            devices = written(group, nodes_of(group), island.defaults)
            kind, _ = classify(devices)
            if kind in _EXACT:
                exact.append(_island(devices, island))
            else:  # where nothing is stored, sources alone drive, as exactly in the driven block
                worse |= {graph.of_device(d) for d in group}
        if not worse:
            break
        smooth |= worse
    taken = {d.name for part in exact for d in part.devices}
    rest = [d for d in island.devices if d.name not in taken]
    if not exact or not rest:
        return None
    node_home = {node: k for k, part in enumerate(exact) for node in part.nodes}
    home = {d.name: k for k, part in enumerate(exact) for d in part.devices}
    return _Parts(exact, graph.groups(rest), node_home, home)


def _island(devices: list[Device], like: Island) -> Island:
    return Island(devices, nodes_of(devices), *classify(devices), like.defaults)


def _driven(
    devices: Sequence[Device], parts: _Parts, new: Callable[[], Handed]
) -> tuple[list[Device], list[tuple[str, int, Handed]]]:
    """Return the elements of a driven block with its inputs, and what these are."""
    from ..devices.expressions.block_input import BlockInput, Sensed

    inputs: dict[str, tuple[int, Handed, Device]] = {}

    def need(signal: str, home: int, device: Device) -> None:
        if signal not in inputs:
            inputs[signal] = home, new(), device

    kept: list[Device] = []
    for device in devices:
        for node in device.control_nodes:
            if node in parts.node_home:
                need(f"v({node})", parts.node_home[node], device)
        sensed = {}
        for name in device.control_elements:
            element = name if name in parts.home else name.rpartition(".")[0]
            if element in parts.home:
                need(f"i({name})", parts.home[element], device)
                sensed[name] = Sensed(name)
        kept.append(_sensing(device, sensed) if sensed else device)
    sources = [BlockInput(s, handed, d.span) for s, (_, handed, d) in inputs.items()]
    signals = [(signal, home, handed) for signal, (home, handed, _) in inputs.items()]
    return [*written(kept, nodes_of([*kept, *sources]), parts.exact[0].defaults), *sources], signals


def _sensing(device: Device, sensed: dict[str, Sensed]) -> Device:
    """Return an element that reads currents of another block."""
    other = copy(device)
    if isinstance(other, CurrentControlled | CurrentSwitch):
        other.control = next(iter(sensed.values()))
    else:
        other.sources = {**other.sources, **sensed}  # type: ignore[misc]  # a slot of its class
    return other


class _Components:
    """Parts of an island that are connected by currents, and which of them senses which."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self._number = {device.name: k for k, device in enumerate(devices)}
        by_name = {device.name: device for device in devices}
        nodes: dict[str, int] = {}
        for device in devices:
            for node in (*device.nodes, *device.control_nodes):
                if node != "0":
                    nodes.setdefault(node, len(devices) + len(nodes))
        self._sets = UnionFind(len(devices) + len(nodes))
        held = set()
        for device in devices:
            for node in device.nodes:
                if node != "0":
                    held.add(node)
                    self._sets.union(self._number[device.name], nodes[node])
            if isinstance(device, Coupling):
                for name in device.control_elements:
                    self._sets.union(self._number[device.name], self._number[name])
        self.drivers: dict[int, set[int]] = {}
        controls: list[tuple[Device, int]] = []
        for device in devices:
            for node in device.control_nodes:
                if node in held:
                    controls.append((device, nodes[node]))
                elif node != "0":  # nobody else has it
                    self._sets.union(self._number[device.name], nodes[node])
            for name in device.control_elements:
                found = owner(name, by_name)
                if found is not None:
                    controls.append((device, self._number[found[0].name]))
        for device, sensed in controls:
            mine, other = self.of_device(device), self._sets.find(sensed)
            if mine != other:
                self.drivers.setdefault(mine, set()).add(other)

    def of_device(self, device: Device) -> int:
        """Return the number of the component of an element."""
        return self._sets.find(self._number[device.name])

    def downstream(self, components: Iterable[int]) -> set[int]:
        """Return some components and all that depend on them."""
        found = set(components)
        more = True
        while more:
            reached = {mine for mine, others in self.drivers.items() if others & found}
            more = not reached <= found
            found |= reached
        return found

    def groups(self, devices: Sequence[Device]) -> list[list[Device]]:
        """Return some elements in groups, components that sense each other together."""
        here = {self.of_device(device) for device in devices}
        place = {component: k for k, component in enumerate(sorted(here))}
        sets = UnionFind(len(place))
        for mine in here:
            for other in self.drivers.get(mine, ()):
                if other in here:
                    sets.union(place[mine], place[other])
        found: dict[int, list[Device]] = {}
        for device in devices:
            found.setdefault(sets.find(place[self.of_device(device)]), []).append(device)
        return list(found.values())
