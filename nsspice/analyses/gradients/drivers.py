"""Parameters as sources in a system: what acts where, and what it carries.

A parameter changes entries of the equations.  Times the unknowns they multiply, these changes are
what a source in the row would do: of a conductance ``-dG (va - vb)``, of a capacitance ``-dC v'``,
of a forward drop a voltage in the slack of its pair, of a threshold one next to the control.  Rows
are shared by all parameters, so that their number is that of the rows which any of them touches.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...circuit import MnaSystem
from ...problems.csc import Csc
from ...problems.descriptor import DescriptorSystem, Functional, Waveform
from ..steady.stimuli import NOTHING
from .sources import slope_by

_PARTS = ("z", "lam", "dz", "u", "f", "df")


@dataclass(slots=True)
class _Carried:
    """What a source in one row carries of one parameter: terms by part, and a constant."""

    terms: dict[str, dict[int, float]] = field(default_factory=lambda: {p: {} for p in _PARTS})
    constant: float = 0.0

    def add(self, part: str, index: int, factor: float) -> None:
        terms = self.terms[part]
        terms[index] = terms.get(index, 0.0) + factor

    def functional(self) -> Functional | None:
        found = {p: tuple((j, f) for j, f in t.items() if f) for p, t in self.terms.items()}
        return Functional(**found) if any(found.values()) else None


@dataclass(frozen=True, slots=True)
class Driven:
    """A system with sources in place of changes of parameters.

    Parameters
    ----------
    system : DescriptorSystem
        With the added sources, all of which are zero or act nowhere.
    outputs : list of Functional
        Signals first, then what is carried.
    stimuli : list of int
        Numbers of the sources that stand for rows.
    offsets : list of (int, int, float)
        Those in slacks and controls: row, source, factor.
    rows : list of (str, int)
        What each stimulus enters: ``row``, ``slack``, ``on``, ``off`` or ``out``, and its number.
    drivers : list of (int, int or None, int or None, float)
        Stimulus, output that it carries, charge or flux behind the rates in that, constant.
    owners : list of int
        Parameter of each driver.
    """

    system: DescriptorSystem
    outputs: list[Functional]
    stimuli: list[int]
    offsets: list[tuple[int, int, float]]
    rows: list[tuple[str, int]]
    drivers: list[tuple[int, int | None, int | None, float]]
    owners: list[int]


def driven(
    mna: MnaSystem,
    names: Sequence[str],
    changes: Sequence[Mapping[Any, float]],
    stop: float,
) -> Driven:
    """Return a system in which sources stand for parameters.

    Parameters
    ----------
    mna : MnaSystem
        As it is run.
    names : sequence of str
        Signals that a functional is made of.
    changes : sequence of mapping
        Derivatives of all numbers by each parameter (:func:`variation.of_island`).
    stop : float
        Length of the run [s].

    Raises
    ------
    NotDifferentiable
        If a source has no derivative by one of its numbers.
    """
    system = mna.system
    sources: list[Waveform] = []  # derivatives of sources
    known: dict[tuple[int, int], list[int]] = {}
    count = len(system.waveforms)

    def columns(source: int, place: int) -> list[int]:
        if (source, place) not in known:
            parts = slope_by(system.waveforms[source], place, stop)
            known[source, place] = [count + len(sources) + k for k in range(len(parts))]
            sources.extend(parts)
        return known[source, place]

    carried = [_carried(mna, names, change, columns) for change in changes]
    rows = list(dict.fromkeys(row for table in carried for row in table))
    first = count + len(sources)
    stimulus = {row: k for k, row in enumerate(rows)}
    entries = [(row[1], first + k) for row, k in stimulus.items() if row[0] == "row"]
    place = {"slack": 0, "on": system.m, "off": system.m + len(system.switches)}
    outputs = [mna.functional(name) for name in names]
    for (kind, index), k in stimulus.items():
        if kind == "out":
            outputs[index] = replace(outputs[index], u=(*outputs[index].u, (first + k, 1.0)))
    drivers, owners = [], []
    for owner, table in enumerate(carried):
        for row, what in table.items():
            functional, output, stored = what.functional(), None, None
            if functional is not None:
                output = len(outputs)
                outputs.append(functional)
                if functional.dz:
                    stored = len(outputs)
                    outputs.append(Functional(z=functional.dz))
            drivers.append((stimulus[row], output, stored, what.constant))
            owners.append(owner)
    return Driven(
        _with_sources(system, entries, [*sources, *(NOTHING for _ in rows)]),
        outputs,
        [first + k for k in range(len(rows))],
        [
            (place[kind] + index, first + k, 1.0)
            for (kind, index), k in stimulus.items()
            if kind in place
        ],
        rows,
        drivers,
        owners,
    )


def _carried(
    mna: MnaSystem,
    names: Sequence[str],
    change: Mapping[Any, float],
    columns: Any,
) -> dict[tuple[str, int], _Carried]:
    """Return what a source in each row that a parameter touches carries."""
    table: dict[tuple[str, int], _Carried] = {}

    def at(kind: str, index: int) -> _Carried:
        return table.setdefault((kind, index), _Carried())

    into: dict[int, list[tuple[int, float]]] = {}
    system = mna.system
    matrix = system.S
    for row, source, factor in zip(matrix.indices, matrix.columns, matrix.data, strict=True):
        into.setdefault(int(source), []).append((int(row), float(factor)))
    for key, d in change.items():
        match key:
            case ("E", row, j):
                at("row", row).add("dz", j, -d)
            case ("G", row, j):
                at("row", row).add("z", j, -d)
            case ("A", row, pair):
                at("row", row).add("lam", pair, -d)
            case ("F", row, function):
                at("row", row).add("f", function, -d)
            case ("Q", row, function):
                at("row", row).add("df", function, -d)
            case ("S", row, source):
                at("row", row).add("u", source, d)
            case ("B", pair, j):
                at("slack", pair).add("z", j, -d)
            case ("D", pair, other):
                at("slack", pair).add("lam", other, d)
            case ("q", pair):
                at("slack", pair).constant += d
            case ("on" | "off" as edge, switch):
                at(edge, switch).constant -= d
            case ("control", switch, j):
                at("on", switch).add("z", j, d)
                at("off", switch).add("z", j, d)
            case ("out", name, part, j):
                at("out", names.index(name)).add(part, j, d)
            case ("scale", source):
                factor = d / system.waveforms[source].scale
                for row, entry in into.get(source, ()):
                    at("row", row).add("u", source, factor * entry)
            case ("wave", source, place):
                for column in columns(source, place):
                    for row, entry in into.get(source, ()):
                        at("row", row).add("u", column, d * entry)
                    for k, name in enumerate(names):
                        for j, factor in mna.functional(name).u:
                            if j == source:
                                at("out", k).add("u", column, d * factor)
    return table


def _with_sources(
    system: DescriptorSystem, entries: Iterable[tuple[int, int]], sources: Sequence[Waveform]
) -> DescriptorSystem:
    """Return a system with sources more, and where these enter."""
    more = np.array(list(entries), dtype=np.int64).reshape(-1, 2)
    S = Csc.from_triplets(
        (system.n, len(system.waveforms) + len(sources)),
        np.concatenate([system.S.indices, more[:, 0]]),
        np.concatenate([system.S.columns, more[:, 1]]),
        np.concatenate([system.S.data, np.ones(len(more))]),
    )
    return replace(system, S=S, waveforms=(*system.waveforms, *sources))
