"""Which voltages and currents of a network can have no impulse, for all states of its valves.

At a jump impulses of voltages leave charges finite, and those of currents fluxes; in a passive
network their power in resistances is all there is (Tellegen), so that it is zero.  So a node that
resistors, capacitors and sources join to ground has no impulse; neither has a current that no loop
of capacitors, sources and valves without resistance carries.

Reference: A. Opal, J. Vlach, "Consistent initial conditions of linear switched networks", IEEE
Trans. Circuits Syst. 37 (1990) 364.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ..devices.device import Device, Edge
from .mna import MnaSystem
from .signals import owner, parse_signal
from .union_find import UnionFind


class Impulses:
    """What may be impulsive in one island.

    Parameters
    ----------
    mna : MnaSystem
        Without smooth laws.

    Examples
    --------
    A switch that opens an inductor: its node has nothing else, the capacitor holds the other one.

    >>> import nsspice
    >>> mna = nsspice.read('''cut
    ... V1 a 0 1
    ... S1 a b g 0 SW
    ... VG g 0 PULSE(0 1 0 0 0 1u 2u)
    ... L1 b c 1m
    ... C1 c 0 1u
    ... R1 c 0 1
    ... .model SW SW(Ron=1m Vt=0.5)
    ... ''').islands[0].assemble()
    >>> impulses = Impulses(mna)
    >>> [signal for signal in ("v(b)", "v(c)", "i(l1)", "i(s1)", "i(c1)") if impulses.may(signal)]
    ['v(b)']
    """

    def __init__(self, mna: MnaSystem) -> None:
        self._by_name = {device.name: device for device in mna.devices}
        self._passive = mna.system.passive
        D = mna.system.D
        series = set(D.indices[(D.indices == D.columns) & (D.data > 0.0)].tolist())
        #: elements all of whose pairs have a resistance in series
        self._resistive = {*mna.pair_elements} - {
            element for k, element in enumerate(mna.pair_elements) if k not in series
        }
        self._held = self._held_nodes(mna.devices)
        self._looped = self._loops(mna.devices)

    def may(self, signal: str) -> bool:
        """Return whether a signal of the island, ``v(b)`` or ``i(v1)``, may have an impulse."""
        parsed = parse_signal(signal)
        if parsed is None:
            return True
        if parsed.kind == "v":
            return not self._held.issuperset(parsed.names)
        found = owner(parsed.names[0], self._by_name)
        return found is None or found[1] != "" or found[0].name in self._looped

    def _held_nodes(self, devices: Sequence[Device]) -> set[str]:
        """Return the nodes whose potentials are finite."""
        kinds = "VCR" if self._passive else "VC"
        edges = [(d, edge) for d in devices for edge in d.edges() if edge.kind in kinds + "E"]
        held, more = {"0"}, True
        while more:
            more = False
            for device, (kind, a, b) in edges:
                # a controlled voltage is as finite as what controls it
                finite = not device.control_elements and held.issuperset(device.control_nodes)
                if (a in held) != (b in held) and (kind != "E" or finite):
                    held |= {a, b}
                    more = True
        return held

    def _loops(self, devices: Sequence[Device]) -> Collection[str]:
        """Return the elements whose currents may have impulses."""
        carrying: list[tuple[str, Edge]] = []
        for device in devices:
            for edge in device.edges():
                if self._passive and (edge.kind == "R" or device.name in self._resistive):
                    continue
                if edge.kind not in "LI":
                    carrying.append((device.name, edge))
        while True:
            # what no loop closes carries nothing
            ends = [node for _, edge in carrying for node in (edge.a, edge.b)]
            kept = [e for e in carrying if ends.count(e[1].a) > 1 and ends.count(e[1].b) > 1]
            if len(kept) == len(carrying):
                break
            carrying = kept
        nodes = {node: k for k, node in enumerate(dict.fromkeys(ends))}
        sets = UnionFind(len(nodes))
        for _, edge in carrying:
            sets.union(nodes[edge.a], nodes[edge.b])
        storing = {sets.find(nodes[edge.a]) for _, edge in carrying if edge.kind == "C"}
        # laws of several terminals show some branches, or none, as controlled currents
        active = {sets.find(nodes[edge.a]) for _, edge in carrying if edge.kind in "EG"}
        return {n for n, edge in carrying if sets.find(nodes[edge.a]) in storing | active}
