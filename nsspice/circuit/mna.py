"""Assembly of the non-smooth modified nodal analysis (MNA) system of one island.

Unknowns: the node voltages in order of appearance, then one current for each voltage source,
controlled voltage source, inductor and short, and one voltage for each node inside an element, in
deck order (currents that are sensed by late laws last).  The names of unknowns, rows and pairs lead
back to elements, nodes and lines.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import NamedTuple, TypeVar

import numpy as np

from ..devices.device import Device
from ..devices.passive.capacitor import Capacitor
from ..devices.passive.coupling import Coupling
from ..devices.passive.inductor import Inductor
from ..devices.stamper import Conditions, Layout, Stamper, Triplets
from ..problems.csc import Csc, Floats
from ..problems.descriptor import DescriptorSystem, Functional, SmoothTerms
from ..problems.elements import Elements
from .signals import owner, parse_signal, unknown_signal
from .spanning import spanning_tree

StamperT = TypeVar("StamperT", bound=Stamper)


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
        before = [-1] * n
        for name, k in self.layout.nodes.items():
            if k >= 0:
                before[k] = self.layout.nodes[self.layout.before(name)]
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
            elements=Elements(stamper.capacitors, stamper.conductors, before),
        )
        branches = len(stamper.branch_names)
        self.unknowns: list[str] = [self._voltage_name(node) for node in nodes]
        self.unknowns += stamper.branch_names
        self.pairs: list[str] = stamper.pair_names
        self.pair_elements: list[str] = stamper.pair_elements
        self.row_elements: list[str | None] = [None] * count + list(stamper.branch_elements)
        self.row_nodes: list[str | None] = nodes + [None] * branches
        self._by_name = {device.name: device for device in devices}
        self._functionals: dict[str, Functional] = {}

    def without_lines(self) -> DescriptorSystem | None:
        """Return the system without junctions that are broken lines, None if it has none.

        Each is a rising function of its own voltage, current and charge alike.  Next to a passive
        rest a step has one solution then.
        """
        if not self.layout.broken:
            return None
        nodes = [node for node in self.row_nodes if node is not None]
        stamper_of = partial(Stamper, junctions=False)
        return assemble(self.devices, nodes, self.layout.conditions, stamper_of=stamper_of).system

    def _voltage_name(self, node: str) -> str:
        before = self.layout.before(node)
        return f"v({node})" if before == "0" else f"v({node},{before})"

    def with_layout(self, devices: Sequence[Device], layout: Layout) -> MnaSystem:
        """Return a system whose signals are those of other values of the elements."""
        other = copy.copy(self)
        other.devices, other.layout = devices, layout
        other._by_name = {device.name: device for device in devices}
        other._functionals = {}
        return other

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

    @property
    def largest_source(self) -> float:
        """The largest value that a source has at t = 0, 1 if there is none."""
        sizes = (abs(w.values[0] * w.scale) for w in self.system.waveforms if w.values)
        return float(max(sizes, default=0.0)) or 1.0

    def function_elements(self, function: int) -> list[str]:
        """Return the elements whose law a smooth function is, else those around it."""
        named = [key.split("#")[0] for key, k in self.layout.functions.items() if k == function]
        if named or self.system.smooth is None:
            return named
        F = self.system.smooth.F
        rows = [int(r) for r in F.indices[F.columns == function]]
        elements = [self.row_elements[r] for r in rows]
        if any(elements):
            return [e for e in elements if e is not None]
        nodes = {self.row_nodes[r] for r in rows}
        return [d.name for d in self.devices if d.smooth and nodes & set(d.ends)]

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
            if found is not None and found[0].letter != "k":
                device, terminal = found
                if terminal:
                    return device.terminal_current(self.layout, terminal)
                return device.current(self.layout)
        currents = [f"i({d})" for d in self._by_name]
        voltages = [f"v({node})" for node in self.layout.nodes if node != "0"]
        raise unknown_signal(name, voltages + currents)

    def voltage(self, node: str, z: Floats) -> float:
        """Return the potential of a node [V] at unknowns z (n,)."""
        return float(sum(sign * z[k] for k, sign in self.layout.voltage(node, "0")))

    def values(self, z: Floats) -> dict[str, float]:
        """Return the potentials of all nodes [V] and the branch currents [A] at unknowns z (n,)."""
        nodes = [node for node, row in self.layout.nodes.items() if row >= 0]
        found = {f"v({node})": self.voltage(node, z) for node in nodes}
        currents = enumerate(self.unknowns)
        return found | {name: float(z[j]) for j, name in currents if self.row_nodes[j] is None}

    def initial_charges(self, ic: Mapping[str, float] | None = None) -> Floats:
        """Return ``E z0`` from the initial values of the deck, shape (n,).

        Charges [C] are in the KCL rows and fluxes [Vs] in the inductor rows, so that a loop of
        capacitors with unequal initial voltages keeps its total charge.

        Parameters
        ----------
        ic : mapping of str to float, optional
            Node voltages [V] of ``.ic`` by node; ``i(l1)`` gives a current [A].  ``IC=`` of an
            element goes before them; everything else starts at 0.
        """
        return self.initial_state(ic or {})[0]

    def initial_state(self, ic: Mapping[str, float]) -> tuple[Floats, float]:
        """Return the charges and fluxes of :meth:`initial_charges`, and their energy [J].

        It may exceed that of the charges at the nodes: capacitors in parallel with unequal voltages
        lose the difference when they are joined.  Smooth laws take no part in it.
        """
        result, energy = self.stored(ic)
        return self._with_controls(np.array(result)), energy

    def stored(self, ic: Mapping[str, float]) -> tuple[list[float], float]:
        """Return :meth:`initial_state` without rows whose sources read the rate of a store."""
        layout = self.layout
        result, energy = [0.0] * self.system.n, 0.0
        for device in self.devices:
            # to ask for an abstract class takes longer than all that follows
            if not device.stores_energy and device.letter != "k":
                continue
            if isinstance(device, Capacitor):
                voltage = _initial_voltage(device, ic)
                charge = voltage * device.capacitance(layout)
                energy += 0.5 * voltage * charge
                for index, share in device.charged(layout, charge):
                    result[index] += share
            elif isinstance(device, Inductor):
                current = _current(ic, device)
                flux = device.inductance(layout) * current
                energy += 0.5 * current * flux
                result[layout.branches[device.name]] += flux
            elif isinstance(device, Coupling):
                for one, two, mutual in device.mutual(layout):
                    first, second = _current(ic, one), _current(ic, two)
                    energy += mutual * first * second
                    result[layout.branches[one.name]] += mutual * second
                    result[layout.branches[two.name]] += mutual * first
            else:
                voltage_of = partial(_node_voltage, ic)
                energy += device.initial_energy(layout, voltage_of)
                for index, share in device.initial_charges(layout, voltage_of):
                    result[index] += share
        return result, energy

    def initial_voltages(self, ic: Mapping[str, float]) -> dict[str, float]:
        """Return the voltage with which each capacitor begins by ``IC=`` or ``.ic`` [V]."""
        capacitors = (d for d in self.devices if isinstance(d, Capacitor))
        return {device.name: _initial_voltage(device, ic) for device in capacitors}

    def _with_controls(self, charges: Floats) -> Floats:
        """Return charges and fluxes with those of rows whose sources read the rate of a store.

        What is stored says where the unknowns are, up to a kernel that no element reads.  Both
        sides of the equations are scaled by the elements: picofarads next to henries keep their
        digits.
        """
        E, storage = self.system.E, self.system.storage
        if np.array_equal(storage.data, E.data):
            return charges
        diagonal = storage.dense().diagonal()
        scale = np.where(
            diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0
        )
        unit = scale[:, None] * storage.dense() * scale
        z = scale * np.linalg.lstsq(unit, scale * charges, rcond=unit.shape[0] * 2.0**-52)[0]
        return np.asarray(charges + (E.dot(z) - storage.dot(z)))


def _current(ic: Mapping[str, float], inductor: Inductor) -> float:
    """Return the initial current of an inductor, of all ``m`` together."""
    if inductor.ic is not None:
        return inductor.ic * inductor.m
    return ic.get(f"i({inductor.name})", 0.0)


def _node_voltage(ic: Mapping[str, float], node: str) -> float:
    """Return the initial voltage of a node, by its name or as ``v(node)``."""
    return ic.get(node, ic.get(f"v({node})", 0.0))


def _initial_voltage(device: Capacitor, ic: Mapping[str, float]) -> float:
    """Return the voltage with which a capacitor begins: its own, or that of its nodes."""
    a, b = device.nodes
    own = device.ic
    return own if own is not None else _node_voltage(ic, a) - _node_voltage(ic, b)


def _smooth(stamper: Stamper, n: int) -> SmoothTerms:
    """Return the tape of the smooth laws and where its functions enter."""
    tape = stamper.tape.finish()
    shape = (n, tape.outputs.size)
    return SmoothTerms(tape, _csc(shape, stamper.F), _csc(shape, stamper.Q))


def _csc(shape: tuple[int, int], entries: Triplets) -> Csc:
    return Csc.from_triplets(shape, entries.rows, entries.cols, entries.data)


def assemble(
    devices: Sequence[Device],
    nodes: Sequence[str],
    conditions: Conditions,
    tree: Mapping[str, str] | None = None,
    stamper_of: Callable[[Layout], Stamper] = Stamper,
) -> MnaSystem:
    """Return the MNA system of an island.

    Parameters
    ----------
    devices : sequence of Device
        With their references resolved.
    nodes : sequence of str
        All nodes but ground.
    conditions : Conditions
        Temperature, swept values, and which value sources have.
    tree : mapping of str to str, optional
        For each node the one against which its voltage is an unknown: that of
        :func:`spanning_tree` by default, ground for nodes that are left out.
    stamper_of : callable
        Makes what the laws write on.
    """
    if tree is None:
        tree = spanning_tree(devices, conditions)
    return MnaSystem(devices, stamped(devices, stamper_of(Layout(list(nodes), conditions, tree))))


def stamped(devices: Sequence[Device], stamper: StamperT) -> StamperT:
    """Let all laws of an island write on a stamper, which is returned."""
    late = [device for device in devices if device.late]
    for device in devices:
        if device.late:
            device.allocate(stamper)
        else:
            device.stamp(stamper)
    for device in late:
        device.stamp(stamper)
    return stamper
