"""The equations of an island with all numbers as functions of the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...circuit.build import build
from ...circuit.mna import stamped
from ...devices.stamper import Layout, Triplets
from ...problems.descriptor import Functional, Switch, Waveform
from ...problems.taylor import Models, Space
from ..gradients.carried import Carried, Lost
from ..gradients.variation import Apart, Decks, Parameter, of_island
from ..request.load import read_again
from ..request.periodic_sources import continued
from ..request.restart_state import with_waveforms
from ..request.targets import with_model_values

#: relative difference of first derivatives from differences, whose errors are below 1e-11
_DIFFERENT = 1e-6


@dataclass(frozen=True, slots=True)
class Arrays:
    """An island's arrays as Taylor models; names as in ``DescriptorSystem``.

    Parameters
    ----------
    home : Space
    E, G, A, B, D, S, q : Models
    waveforms : list of Waveform
        Whose values may be :class:`Carried`.
    switches : list of Switch
    outputs : list of Functional
        Of the signals that are looked at.
    """

    home: Space
    E: Models
    G: Models
    A: Models
    B: Models
    D: Models
    S: Models
    q: Models
    waveforms: list[Waveform]
    switches: list[Switch]
    outputs: list[Functional]


def model_of(home: Space, value: float) -> Models:
    """Return a number of the deck as a Taylor model."""
    return value.model if isinstance(value, Carried) else Models.constant(home, value)


def traced(
    circuit: Circuit,
    mna: MnaSystem,
    island: int,
    given: Mapping[Parameter, Carried],
    names: Sequence[str],
    home: Space,
) -> Arrays:
    """Return the equations of an island for all parameters of a box.

    Parameters
    ----------
    circuit : Circuit
        With the values of the middle.
    mna : MnaSystem
        Its island as it was run; the order of unknowns is kept.
    island : int
    given : mapping of Parameter to Carried
    names : sequence of str
        Signals that are looked at.
    home : Space

    Raises
    ------
    Lost
        If a value depends on a parameter in a way that cannot be enclosed.
    Unbounded
        If the box holds values with other equations.
    """
    params = {p.target.name: v for p, v in given.items() if p.target.kind == "param"}
    models = {
        (p.target.model, p.target.key): v for p, v in given.items() if p.target.kind == "model"
    }
    values = {p.target.name: v for p, v in given.items() if p.target.kind == "element"}
    other = read_again(circuit.deck, params) if params else circuit
    if models:
        other = build(with_model_values(other.deck, models))
    conditions = mna.layout.conditions
    conditions = replace(conditions, values={**conditions.values, **values})
    tree = {n: mna.layout.before(n) for n, row in mna.layout.nodes.items() if row >= 0}
    own = other.islands[island]
    stamper = stamped(own.devices, Apart(Layout(list(own.nodes), conditions, tree)))
    n, m, sources = stamper.size, len(stamper.q), len(stamper.waveforms)
    if (n, m) != (mna.system.n, mna.system.m) or stamper.smooth:
        raise Lost("other values make other equations")
    named = mna.with_layout(own.devices, stamper.layout)

    def dense(shape: tuple[int, int], entries: Triplets) -> Models:
        found = Models.constant(home, np.zeros(shape))
        for row, column, value in zip(entries.rows, entries.cols, entries.data, strict=True):
            found[row, column] = found[row, column] + model_of(home, value)
        return found

    q = Models.constant(home, np.zeros(m))
    for k, value in enumerate(stamper.q):
        q[k] = model_of(home, value)
    result = Arrays(
        home,
        dense((n, n), stamper.E),
        dense((n, n), stamper.G),
        dense((n, m), stamper.A),
        dense((m, n), stamper.B),
        dense((m, m), stamper.D),
        dense((n, sources), stamper.S),
        q,
        [continued(w) for w in stamper.waveforms],
        stamper.switches,
        [named.functional(name) for name in names],
    )
    _check(result, circuit, mna, island, list(given), list(given.values()), names)
    return result


def _check(
    arrays: Arrays,
    circuit: Circuit,
    mna: MnaSystem,
    island: int,
    parameters: Sequence[Parameter],
    given: Sequence[Carried],
    names: Sequence[str],
) -> None:
    """Compare first derivatives with those by differences, which no code can lose.

    Raises
    ------
    Lost
        If some code on the way has taken a number by its value alone.
    """

    def periodic(other: MnaSystem) -> MnaSystem:
        return with_waveforms(other, [continued(w) for w in other.system.waveforms])

    decks = Decks(circuit)
    for k, (parameter, variable) in enumerate(zip(parameters, given, strict=True)):
        radius = float(variable.model.coefficients[1 + k])
        if not radius:
            continue
        found = of_island(decks, parameter, island, mna, names, periodic)
        for key, slope in found.items():
            value = _number(arrays, key, names)
            if value is None:
                continue
            own = value.model.coefficients[1 + k] / radius if isinstance(value, Carried) else 0.0
            scale = abs(slope) + abs(float(value.real)) / (abs(parameter.value) or 1.0)
            if abs(own - slope) > _DIFFERENT * scale:
                raise Lost(f"how {key[0]} depends on {parameter.target.name} is not traced")


def _number(arrays: Arrays, key: tuple[object, ...], names: Sequence[str]) -> float | None:
    """Return one of the numbers of the arrays, None of those that a steady state does not have."""
    match key:
        case ("E" | "G" | "A" | "B" | "D" as letter, int(row), int(column)):
            return Carried(getattr(arrays, letter)[row, column])
        case ("S", int(row), int(source)):
            return Carried(arrays.S[row, source])
        case ("q", int(pair)):
            return Carried(arrays.q[pair])
        case ("on", int(switch)):
            return arrays.switches[switch].on_above
        case ("off", int(switch)):
            return arrays.switches[switch].off_below
        case ("control", int(switch), int(j)):
            return _factor(arrays.switches[switch].control, j)
        case ("scale", int(source)):
            return arrays.waveforms[source].scale
        case ("wave", int(source), int(place)):
            return arrays.waveforms[source].values[place]
        case ("out", str(name), str(part), int(j)):
            return _factor(getattr(arrays.outputs[names.index(name)], part), j)
    return None


def _factor(terms: Sequence[tuple[int, float]], j: int) -> float:
    return sum((factor for index, factor in terms if index == j), 0.0)
