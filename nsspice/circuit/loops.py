"""Loops of voltage sources: sources around a loop must add up to zero at all times."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..devices.device import Device, Edge
from ..devices.sources.controlled import Vcvs
from ..errors import Diagnostic
from .source_sums import WaveSum
from .union_find import UnionFind

if TYPE_CHECKING:
    from .topology import Mode

#: all elements with their branches
Graph = Sequence[tuple[Device, tuple[Edge, ...]]]
Finding = tuple[Diagnostic, list[str]]


class _Forest:
    """The voltage branches that closed no loop so far, with their voltages."""

    def __init__(self) -> None:
        self.number: dict[str, int] = {}
        self.links: dict[str, list[tuple[str, Device, WaveSum, float]]] = {}
        self.sets = UnionFind(0)

    def index(self, node: str) -> int:
        """Return the number of a node, new ones in a set of their own."""
        k = self.number.get(node)
        if k is None:
            k = self.number[node] = len(self.number)
            self.sets.parent.append(k)
        return k

    def joined(self, a: str, b: str) -> bool:
        """Return whether two nodes are joined by voltage branches."""
        return a == b or self.sets.find(self.index(a)) == self.sets.find(self.index(b))

    def add(self, device: Device, a: str, b: str, voltage: WaveSum) -> None:
        """Add a branch with the voltage ``va - vb``."""
        self.sets.union(self.index(a), self.index(b))
        self.links.setdefault(a, []).append((b, device, voltage, 1.0))
        self.links.setdefault(b, []).append((a, device, voltage, -1.0))

    def path(self, a: str, b: str) -> tuple[list[Device], WaveSum]:
        """Return the elements between two joined nodes and the voltage ``va - vb``."""
        total = WaveSum()
        if a == b:
            return [], total
        came: dict[str, tuple[str, Device, WaveSum, float]] = {}
        queue = deque([a])
        while b not in came:
            here = queue.popleft()
            for there, device, voltage, sign in self.links.get(here, []):
                if there != a and there not in came:
                    came[there] = (here, device, voltage, sign)
                    queue.append(there)
        elements: list[Device] = []
        node = b
        while node != a:
            node, device, voltage, sign = came[node]
            total.merge(voltage, sign)
            elements.append(device)
        return elements[::-1], total


def check_loops(graph: Graph, mode: Mode) -> Iterator[Finding]:
    """Yield an error for each independent loop of sources that contradict each other.

    Parameters
    ----------
    graph : sequence of (Device, tuple of Edge)
    mode : Mode
        What the sources do; at DC inductors are shorts.
    """
    forest = _Forest()
    pending: list[Vcvs] = []
    shorts: list[Device] = []
    for device, edges in graph:
        for edge in edges:
            if edge.kind == "V":
                voltage = WaveSum()
                for waveform in mode.waveforms.get(device.name, ()):
                    voltage.add(waveform, 1.0)
                yield from _place(forest, device, voltage, mode)
            elif edge.kind == "E" and isinstance(device, Vcvs):
                pending.append(device)
            elif edge.kind == "L" and mode.dc:
                shorts.append(device)
    yield from _controlled(forest, pending, mode)
    for device in shorts:
        yield from _place(forest, device, WaveSum(), mode)


def _controlled(forest: _Forest, pending: list[Vcvs], mode: Mode) -> Iterator[Finding]:
    """Place the controlled sources whose controlling voltage is given by sources."""
    progress = True
    while pending and progress:
        left: list[Vcvs] = []
        for device in pending:
            c, d = device.controls[0], device.controls[1]
            if forest.joined(c, d):
                voltage = WaveSum()
                voltage.merge(forest.path(c, d)[1], device.gain)
                yield from _place(forest, device, voltage, mode)
            else:
                left.append(device)
        progress = len(left) < len(pending)
        pending = left


def _place(forest: _Forest, device: Device, voltage: WaveSum, mode: Mode) -> Iterator[Finding]:
    """Add a branch, or compare it with the path that it closes to a loop."""
    a, b = device.ends
    if not forest.joined(a, b):
        forest.add(device, a, b, voltage)
        return
    others, around = forest.path(a, b)
    total = WaveSum()
    total.merge(around, -1.0)
    total.merge(voltage, 1.0)
    if not total.vanishes():
        yield _conflict(device, others, voltage, around, mode)


def _conflict(
    device: Device, others: list[Device], voltage: WaveSum, around: WaveSum, mode: Mode
) -> Finding:
    """Return the error for a loop that does not add up to zero."""
    members = [*others, device]
    names = [d.name for d in members]
    listed = ", ".join(f"{d.name} (line {d.span.line})" for d in members)
    a, b = device.ends
    if not others:
        message = f"{listed} has both ends on node {a}, so its voltage of {voltage} V is shorted"
        return Diagnostic("NS2021", message, device.span, "correct one of its nodes"), names
    inductive = any(d.letter == "l" for d in members)
    if inductive and mode.dc:
        kept = around if device.letter == "l" else voltage
        message = (
            f"{mode.what} an inductor is a short circuit, and the loop {listed} between nodes "
            f"{a} and {b} "
            f"keeps {kept} V: the current would grow without bound"
        )
        hint = "add uic to .tran, or a resistor to the loop"
        return Diagnostic("NS2022", message, device.span, hint), names
    message = (
        f"the loop of voltage sources {listed} does not add up to zero: between nodes {a} and {b} "
        f"{device.name} gives {voltage} V, the others {around} V"
    )
    return Diagnostic("NS2021", message, device.span, "put a resistor in the loop"), names
