"""The rows of a run as they are written, against the laws of the elements of the deck.

What engines leave for the certificate are their own points.  Here the table itself is judged at
every row, by laws that are made from the deck alone: Kirchhoff's current law where all currents are
known, sources and controlled sources, set-valued diodes and junctions as broken lines, switches
next to their controls, thyristors.  Elements whose voltages or currents are not among the columns,
and junctions with a charge, are left out.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ... import _core
from ...circuit import Circuit
from ...devices.device import Device
from ...devices.passive.resistor import Resistor
from ...devices.sources.controlled import Cccs, Ccvs, Vccs, Vcvs
from ...devices.sources.isource import CurrentSource
from ...devices.sources.vsource import VoltageSource
from ...devices.stamper import Conditions
from ...devices.switches.switch import CurrentSwitch, VoltageSwitch
from ..request.cards import Tran
from ..signals.curve import Floats
from .energy import worse
from .node_reach import NodeReach

#: part of the largest values to which a solution is known: the rounding of an elimination, or that
#: with which Newton's method ends
KNOWN, ITERATED = 1e-13, 1e-10
#: error of a law, relative, that a certificate grants
TOLERANCE = 1e-8
_Terms = list[tuple[int, float]]
_Waveform = tuple[str, tuple[float, ...], float, float, None]
_Form = tuple[list[float], bool]
_Line = tuple[_Form, list[_Form]]


class Violation(NamedTuple):
    """The worst error of a law, relative, and when."""

    error: float
    element: str
    time: float


def conditions_of(
    circuit: Circuit,
    analysis: Tran,
    temperature: float | None,
    values: Mapping[str, float] | None,
) -> Conditions:
    """Return the conditions under which a transient analysis reads the elements of a circuit."""
    own = circuit.islands[0].defaults if circuit.islands else Conditions()
    return Conditions(
        own.temperature if temperature is None else temperature,
        values or {},
        "tran",
        analysis.row_distance,
        analysis.stop,
        own.nominal,
    )


class WrittenRows:
    """Judges rows of a table.

    Parameters
    ----------
    circuit : Circuit
    columns : sequence of str
        Names of the signals behind the time.
    conditions : Conditions
    free : collection of str
        Sources that somebody sets during the run.
    """

    def __init__(
        self,
        circuit: Circuit,
        columns: Sequence[str],
        conditions: Conditions,
        free: Collection[str] = (),
    ) -> None:
        self._column = {name: 1 + k for k, name in enumerate(columns)}
        self._circuit, self._conditions, self._free = circuit, conditions, free
        self._devices = {device.name: device for device in circuit.devices}
        smooth = any(device.smooth for device in circuit.devices)
        self._sums: list[tuple[str, tuple[_Terms, float, bool]]] = []
        self._valves: list[tuple[str, tuple[_Terms, _Terms, list[_Line], tuple[float, float]]]] = []
        self._gates: list[tuple[str, tuple[int, _Terms, list[float], bool]]] = []
        self._sources: list[tuple[str, tuple[_Terms, list[_Waveform], bool]]] = []
        self.reach = NodeReach(circuit.devices, conditions)
        for device in circuit.devices:
            self._add(device)
        self._add_nodes(circuit.devices)
        self._core = _core.Rows(
            [name[0] == "i" for name in columns],
            ITERATED if smooth else KNOWN,
            self.reach.conductance,
            [law for _, law in self._sums],
            [law for _, law in self._valves],
            [law for _, law in self._gates],
            [law for _, law in self._sources],
        )

    def beside(self, columns: Sequence[str]) -> WrittenRows:
        """Return what judges rows of other columns, by the sizes of this table.

        Rows of the same columns are judged here: times before the last one are ignored.
        """
        if list(columns) == list(self._column):
            return self
        other = WrittenRows(self._circuit, columns, self._conditions, self._free)
        same = []
        for own, its in zip(other._laws, self._laws, strict=True):
            place = {name: k for k, (name, _) in enumerate(its)}
            same.append([(k, place[name]) for k, (name, _) in enumerate(own) if name in place])
        other._core.measure_as(self._core, same)
        return other

    @property
    def _laws(self) -> tuple[Sequence[tuple[str, object]], ...]:
        return self._sums, self._valves, self._gates, self._sources

    @property
    def counts(self) -> dict[str, int]:
        """How many laws are judged, by their kind."""
        kinds = ("sums", "set-valued elements", "controls of switches", "sources")
        return dict(zip(kinds, map(len, self._laws), strict=True))

    @property
    def left_out(self) -> tuple[str, ...]:
        """Set-valued elements whose law is not one of voltage and current in a row, by name."""
        judged = {name for name, _ in self._valves}
        return tuple(
            name for name, d in self._devices.items() if d.pair_count and name not in judged
        )

    def take(self, rows: Floats) -> None:
        """Take the next rows of the table."""
        self._core.take(np.ascontiguousarray(rows))

    def worst(
        self, sampled: Collection[str] | None = (), granted: float = TOLERANCE
    ) -> tuple[Violation, Violation]:
        """Return the worst errors of laws and of set-valued elements, in units of the tolerance.

        Switches that are ``sampled`` turn when they look at their controls; None for all.  Rows of
        steps with error control are interpolated: they are ``granted`` a larger part than others.
        """
        sums, valves, gates, sources = self._core.worst()
        looked = [
            ((f"the gate of {name}", law), found)
            for (name, law), found in zip(self._gates, gates, strict=True)
            if sampled is not None and name not in sampled
        ]
        laws = [
            *zip(self._sums, sums, strict=True),
            *looked,
            *zip(self._sources, sources, strict=True),
        ]
        pairs = list(zip(self._valves, valves, strict=True))
        part = min(TOLERANCE / granted, 1.0)
        law, pair = (
            found._replace(error=part * found.error) for found in (_worst(laws), _worst(pairs))
        )
        return law, pair

    # ------------------------------------------------------------------ columns

    def _voltage(self, nodes: Sequence[str], factor: float = 1.0) -> _Terms | None:
        """Return the voltage between two nodes, None if it is not known."""
        terms = []
        for node, sign in zip(nodes, (factor, -factor), strict=True):
            if node != "0":
                column = self._column.get(f"v({node})")
                if column is None:
                    return None
                terms.append((column, sign))
        return terms

    def _current(self, device: Device | None, factor: float = 1.0) -> _Terms | None:
        """Return the current into the first terminal, None if it is not known."""
        if device is None:
            return None
        column = self._column.get(f"i({device.name})")
        if column is not None:
            return [(column, factor)]
        if isinstance(device, Resistor):
            ohms = device.at(self._conditions) / device.m
            return self._voltage(device.nodes, factor / ohms) if ohms else None
        if isinstance(device, Vccs):
            return self._voltage(device.controls, factor * device.gain)
        if isinstance(device, Cccs):
            return self._current(self._devices.get(device.controls[0]), factor * device.gain)
        return None

    # ------------------------------------------------------------------ laws

    def _add(self, device: Device) -> None:
        """Add the laws of an element."""
        if len(device.nodes) != 2:
            return
        voltage, column = self._voltage(device.nodes), self._column.get(f"i({device.name})")
        if isinstance(device, VoltageSource | CurrentSource):
            amperes, terms = isinstance(device, CurrentSource), voltage
            if isinstance(device, CurrentSource):
                terms = None if column is None else [(column, 1.0 / device.m)]
            waveforms = device.waveforms(self._conditions)
            fixed = device.name not in self._free and all(w.handed is None for w in waveforms)
            if terms is not None and fixed:
                spec: list[_Waveform] = [
                    (w.kind, w.values, w.repeat, w.scale, None) for w in waveforms
                ]
                self._sources.append((device.name, (terms, spec, amperes)))
        elif isinstance(device, Vcvs | Ccvs) and voltage is not None:
            sensed = (
                self._voltage(device.controls, -device.gain)
                if isinstance(device, Vcvs)
                else self._current(self._devices.get(device.controls[0]), -device.gain)
            )
            if sensed is not None:
                self._sums.append((device.name, ([*voltage, *sensed], 0.0, False)))
        elif voltage is not None and column is not None:
            lines = list(_lines(device, self._conditions))
            if lines:
                law = (voltage, [(column, 1.0)], lines, self.reach.at(device.nodes))
                self._valves.append((device.name, law))
                self._add_gate(device)

    def _add_gate(self, device: Device) -> None:
        """Add what opens and closes a switch that has just been added."""
        if not isinstance(device, VoltageSwitch | CurrentSwitch):
            return
        control = (
            self._voltage(device.controls)
            if isinstance(device, VoltageSwitch)
            else self._current(self._devices.get(device.controls[0]))
        )
        if control is not None:
            law = device.law
            edges = [law.on_above, law.off_below]
            gate = (len(self._valves) - 1, control, edges, law.inverted)
            self._gates.append((device.name, gate))

    def _add_nodes(self, devices: Sequence[Device]) -> None:
        """Add Kirchhoff's current law of the nodes at which all currents are known."""
        sums: Mapping[str, _Terms] = defaultdict(list)
        unknown = {"0"}
        for device in devices:
            if device.letter == "k":
                continue
            current = self._current(device) if len(device.nodes) == 2 else None
            if current is None:
                unknown.update(device.nodes)
                continue
            for node, sign in zip(device.nodes, (1.0, -1.0), strict=True):
                sums[node] += [(column, sign * factor) for column, factor in current]
        for node, terms in sums.items():
            if node not in unknown:
                self._sums.append((f"node {node}", (terms, self.reach.at([node])[1], True)))


def _worst(
    laws: Sequence[tuple[tuple[str, object], tuple[float, float]]],
) -> Violation:
    """Return the worst of some laws."""
    out = Violation(0.0, "", 0.0)
    for (name, _), (error, time) in laws:
        if worse(error, out.error):
            out = Violation(error, name, time)
    return out


def _lines(device: Device, conditions: Conditions) -> Iterator[_Line]:
    """Return the lines on which voltage and current of a set-valued element lie.

    A form is ``v * volts + i * amperes - constant``, and whether it is a current.
    """
    if isinstance(device, VoltageSwitch | CurrentSwitch):
        for ohms in (device.law.ron / device.m, device.law.roff / device.m):
            if ohms <= 1.0:
                yield ([1.0, -ohms, 0.0], False), []
            else:
                yield ([-1.0 / ohms, 1.0, 0.0], True), []
    elif device.letter == "d":
        yield from _diode_lines(device, conditions)


def _diode_lines(device: Device, conditions: Conditions) -> Iterator[_Line]:
    """Return the lines of a diode or a latching thyristor."""
    from ...devices.diodes.leg_device import LegDevice
    from ...devices.switches.latching_thyristor import LatchingThyristor

    if isinstance(device, LegDevice):
        curve = device.curve(conditions)
        if curve is None or device.leg.drop is not None:
            return
        slopes = [math.inf if dv == 0.0 else di / dv for di, dv in curve.directions]
        flattest = slopes.index(min(slopes))
        for k, (di, dv) in enumerate(curve.directions):
            ends = [
                (curve.vertices[j], sign)
                for j, sign in ((k - 1, 1.0), (k, -1.0))
                if 0 <= j < len(curve.vertices)
            ]
            i0, v0 = ends[0][0]
            if k == flattest:
                g = di / dv
                law: _Form = ([-g, 1.0, i0 - g * v0], True)
                bounds: list[_Form] = [([s, 0.0, s * v], False) for (_, v), s in ends]
            else:
                r = dv / di
                law = ([1.0, -r, v0 - r * i0], False)
                bounds = [([0.0, s, s * i], True) for (i, _), s in ends]
            yield law, bounds
    elif isinstance(device, LatchingThyristor) and "vrev" not in device.card:
        ohms, drop = device.card.get("ron", 0.0) / device.parallel, device.card.get("vh", 0.0)
        yield ([1.0, -ohms, drop], False), [([0.0, 1.0, 0.0], True)]
        yield ([0.0, 1.0, 0.0], True), []
