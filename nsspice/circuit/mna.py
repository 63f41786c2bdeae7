"""Assembly of the non-smooth modified nodal analysis (MNA) system of one island.

Unknowns: the node voltages in order of appearance, then one current for each voltage source,
controlled voltage source, inductor and short, and one voltage for each node inside an element, in
deck order (currents that are sensed by late laws last).  The names of unknowns, rows and pairs lead
back to elements, nodes and lines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..devices import Capacitor, Conditions, Coupling, Device, Inductor, Layout, Stamper
from ..devices.stamper import Triplets
from ..problems.csc import Csc, Floats
from ..problems.descriptor import DescriptorSystem, Functional, SmoothTerms
from ..problems.elements import Elements
from .signals import owner, parse_signal, unknown_signal


class Store(NamedTuple):
    """An energy store: name, its state (voltage or current) as an output, value, initial value."""

    name: str
    functional: Functional
    value: float
    ic: float | None


class MnaSystem:
    """The assembled system of one island with the names of everything in it.

    Parameters
    ----------
    devices : sequence of Device
    stamper : Stamper
        After all laws have stamped.

    Attributes
    ----------
    system : DescriptorSystem
    unknowns : list of str
        ``v(a)``, ``i(l1)``, length n.
    pairs, pair_elements : list of str
        ``d1``, ``z1.fwd``, ``s1`` and the elements they belong to, length m.
    row_elements, row_nodes : list of str or None
        Element of a branch row, node of a KCL row, length n.
    layout : Layout
        Numbers of nodes, branches, pairs and source columns by name.
    """

    def __init__(self, devices: Sequence[Device], stamper: Stamper) -> None:
        self.devices = devices
        self.layout = stamper.layout
        count = stamper.node_count
        nodes = [name for name, k in self.layout.nodes.items() if 0 <= k < count]
        n, m, p = stamper.size, len(stamper.q), len(stamper.waveforms)
        kinds = np.zeros(n, dtype=np.uint8)
        kinds[count:] = stamper.branch_kinds
        self.system = DescriptorSystem(
            E=_csc((n, n), stamper.E),
            G=_csc((n, n), stamper.G),
            A=_csc((n, m), stamper.A),
            B=_csc((m, n), stamper.B),
            D=_csc((m, m), stamper.D),
            q=np.asarray(stamper.q, dtype=np.float64),
            S=_csc((n, p), stamper.S),
            waveforms=tuple(stamper.waveforms),
            switches=tuple(stamper.switches),
            row_kind=kinds,
            smooth=_smooth(stamper, n) if stamper.smooth else None,
            elements=Elements(stamper.capacitors, stamper.conductors),
        )
        branches = len(stamper.branch_names)
        self.unknowns: list[str] = [f"v({node})" for node in nodes] + stamper.branch_names
        self.pairs: list[str] = stamper.pair_names
        self.pair_elements: list[str] = stamper.pair_elements
        self.row_elements: list[str | None] = [None] * count + list(stamper.branch_elements)
        self.row_nodes: list[str | None] = nodes + [None] * branches
        self._by_name = {device.name: device for device in devices}
        self._functionals: dict[str, Functional] = {}

    @cached_property
    def capacitors(self) -> list[Store]:
        """Capacitors with their voltage, capacitance [F] and ``ic`` [V]."""
        return [
            Store(
                d.name,
                Functional(z=self.layout.voltage(*d.ends)),
                d.capacitance(self.layout),
                d.ic,
            )
            for d in self.devices
            if isinstance(d, Capacitor)
        ]

    @cached_property
    def inductors(self) -> list[Store]:
        """Inductors with their current, inductance [H] and ``ic`` [A] (of all ``m`` together)."""
        return [
            Store(
                d.name,
                d.current(self.layout),
                d.inductance(self.layout),
                None if d.ic is None else d.ic * d.m,
            )
            for d in self.devices
            if isinstance(d, Inductor)
        ]

    def functional(self, name: str) -> Functional:
        """Return a signal as a linear combination of unknowns, multipliers, rates and sources.

        Parameters
        ----------
        name : str
            ``v(a)``, ``v(a,b)`` or ``i(element)``: the current into the first terminal; of a
            transistor into the collector, ``i(q1.b)`` and ``i(q1.e)`` into the others.

        Raises
        ------
        NetlistError
            NS2012 for a signal that this island does not have.
        """
        found = self._functionals.get(name)
        if found is None:
            found = self._functionals[name] = self._functional(name)
        return found

    def _functional(self, name: str) -> Functional:
        signal = parse_signal(name)
        if signal is not None and signal.kind == "v":
            a, b = (*signal.names, "0")[:2]
            if a in self.layout.nodes and b in self.layout.nodes:
                return Functional(z=self.layout.voltage(a, b))
        elif signal is not None and signal.kind == "i":
            found = owner(signal.names[0], self._by_name)
            if found is not None and not isinstance(found[0], Coupling):
                device, terminal = found
                if terminal:
                    return device.terminal_current(self.layout, terminal)
                return device.current(self.layout)
        currents = [f"i({d})" for d in self._by_name]
        voltages = [f"v({node})" for node in self.layout.nodes if node != "0"]
        raise unknown_signal(name, voltages + currents)

    def initial_charges(self, ic: Mapping[str, float] | None = None) -> Floats:
        """Return ``E z0`` from the initial values of the deck, shape (n,).

        Charges [C] stand in the KCL rows and fluxes [Vs] in the inductor rows, so that a loop of
        capacitors with unequal initial voltages keeps its total charge.

        Parameters
        ----------
        ic : mapping of str to float, optional
            Node voltages [V] of ``.ic`` by node; ``i(l1)`` gives a current [A].  ``IC=`` of an
            element goes before them; everything else starts at 0.
        """
        ic = ic or {}
        layout = self.layout
        result = np.zeros(self.system.n)
        currents: dict[str, float] = {}
        for device in self.devices:
            if isinstance(device, Capacitor):
                a, b = device.nodes
                voltage = device.ic
                if voltage is None:
                    voltage = _node_voltage(ic, a) - _node_voltage(ic, b)
                for index, charge in layout.voltage(a, b, voltage * device.capacitance(layout)):
                    result[index] += charge
            elif isinstance(device, Inductor):
                value = device.ic
                current = ic.get(f"i({device.name})", 0.0) if value is None else value * device.m
                currents[device.name] = current
                result[layout.branches[device.name]] += device.inductance(layout) * current
            elif isinstance(device, Coupling):
                for one, two, mutual in device.mutual(layout):
                    # couplings stand after their inductors or before; both currents are needed
                    for here, there in ((one, two), (two, one)):
                        start = there.ic * there.m if there.ic is not None else None
                        if start is None:
                            start = ic.get(f"i({there.name})", 0.0)
                        result[layout.branches[here.name]] += mutual * start
            elif device.smooth and device.stores_energy:
                for a, b, charge in device.initial_charges(
                    layout, lambda node: _node_voltage(ic, node)
                ):
                    for index, share in layout.voltage(a, b, charge):
                        result[index] += share
        return result


def _node_voltage(ic: Mapping[str, float], node: str) -> float:
    """Return the initial voltage of a node, by its name or as ``v(node)``."""
    return ic.get(node, ic.get(f"v({node})", 0.0))


def _smooth(stamper: Stamper, n: int) -> SmoothTerms:
    """Return the tape of the smooth laws and where its functions enter."""
    tape = stamper.tape.finish()
    shape = (n, tape.outputs.size)
    return SmoothTerms(tape, _csc(shape, stamper.F), _csc(shape, stamper.Q))


def _csc(shape: tuple[int, int], entries: Triplets) -> Csc:
    return Csc.from_triplets(shape, entries.rows, entries.cols, entries.data)


def assemble(devices: Sequence[Device], nodes: Sequence[str], conditions: Conditions) -> MnaSystem:
    """Return the MNA system of an island.

    Parameters
    ----------
    devices : sequence of Device
        With their references resolved.
    nodes : sequence of str
        All nodes but ground.
    conditions : Conditions
        Temperature, swept values, and which value sources have.
    """
    stamper = Stamper(Layout(list(nodes), conditions))
    late = [device for device in devices if device.late]
    for device in devices:
        if device.late:
            device.allocate(stamper)
        else:
            device.stamp(stamper)
    for device in late:
        device.stamp(stamper)
    return MnaSystem(devices, stamper)
