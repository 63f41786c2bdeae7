"""Small-signal stimuli: the AC values of sources as sources of their own."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...devices.sources.isource import CurrentSource
from ...devices.sources.vsource import VoltageSource
from ...problems.csc import Csc
from ...problems.descriptor import DescriptorSystem, Functional, Waveform

#: rows and factors
Entries = Sequence[tuple[int, float]]
_NONE = (np.zeros(0), np.zeros(0), np.zeros(0))
#: a source that is always zero, and an input of its own all the same
NOTHING = Waveform("pwl", (0.0, 0.0))


def ac_values(circuit: Circuit) -> dict[str, complex]:
    """Return the AC value of each source that has one, by name [V or A]."""
    found = {}
    for device in circuit.devices:
        if isinstance(device, VoltageSource | CurrentSource) and device.source.ac is not None:
            size, phase = device.source.ac
            found[device.name] = cmath.rect(size, math.radians(phase))
    return found


@dataclass(frozen=True, slots=True)
class Stimulated:
    """A system with sources more, one for each stimulus, that are zero in time.

    Parameters
    ----------
    system : DescriptorSystem
    columns : dict of str to int
        Number of the added source by the name of the element.
    """

    system: DescriptorSystem
    columns: dict[str, int]

    def functional(self, mna: MnaSystem, name: str) -> Functional:
        """Return a signal of the island, with the stimulus of a current source as a part of it."""
        found = mna.functional(name)
        column = self.columns.get(name[2:-1]) if name.startswith("i(") else None
        device = None if column is None else _source(mna, name[2:-1])
        if column is None or not isinstance(device, CurrentSource):
            return found
        return replace(found, u=(*found.u, (column, device.m)))


def _source(mna: MnaSystem, name: str) -> object:
    return next((d for d in mna.devices if d.name == name), None)


def injection(node: str) -> str:
    """Return the name of the stimulus that is a current from ground into a node."""
    return f"into {node}"


def stimulated(mna: MnaSystem, system: DescriptorSystem, stimuli: Iterable[str]) -> Stimulated:
    """Return a system with the stimuli of an island as sources of their own.

    Parameters
    ----------
    mna : MnaSystem
        Names of the island.
    system : DescriptorSystem
        Its system, or one with more pairs.
    stimuli : iterable of str
        Names of sources, and of :func:`injection`; those of other islands are left out.
    """
    entries: dict[str, Entries] = {}
    devices = {device.name: device for device in mna.devices}
    for name in stimuli:
        device = devices.get(name)
        if isinstance(device, VoltageSource):
            entries[name] = ((mna.layout.branches[name], -1.0),)
        elif isinstance(device, CurrentSource):
            entries[name] = tuple(mna.layout.voltage(*device.ends, -device.m))
        elif name.startswith("into ") and mna.layout.nodes.get(name[5:], -1) >= 0:
            entries[name] = tuple(mna.layout.voltage(name[5:], "0"))
    return with_columns(system, entries)


def with_columns(system: DescriptorSystem, entries: Mapping[str, Entries]) -> Stimulated:
    """Return a system with sources more, which enter some rows.

    Parameters
    ----------
    system : DescriptorSystem
    entries : mapping of str to sequence of (int, float)
        Rows and factors of each stimulus by its name.
    """
    count = len(system.waveforms)
    columns = {name: count + k for k, name in enumerate(entries)}
    flat = [(row, columns[n], value) for n, terms in entries.items() for row, value in terms]
    rows, cols, data = (np.array(part) for part in zip(*flat, strict=True)) if flat else _NONE
    S = Csc.from_triplets(
        (system.n, count + len(columns)),
        np.concatenate([system.S.indices, rows.astype(np.int64)]),
        np.concatenate([system.S.columns, cols.astype(np.int64)]),
        np.concatenate([system.S.data, data.astype(np.float64)]),
    )
    waveforms = (*system.waveforms, *(NOTHING for _ in columns))
    return Stimulated(replace(system, S=S, waveforms=waveforms), columns)
