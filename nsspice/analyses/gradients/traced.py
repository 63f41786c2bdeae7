"""Derivatives of all numbers of an island by all parameters, from one assembly.

The deck is read with numbers that carry their dependence (:class:`Carried`).  Code that takes such
a number by its value alone is noticed: along one direction, in which all parameters move, the
derivatives are compared with a difference.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...circuit.build import build
from ...circuit.mna import stamped
from ...devices.stamper import Conditions, Layout
from ...errors import NsspiceError
from ...problems.taylor import Models, space
from ..request.load import read_again
from ..request.periodic_sources import continued
from ..request.targets import nominal, with_model_values
from .carried import Carried, Lost
from .variation import Apart, Numbers, Parameter, on_cards

#: part of the value over which conditions on a parameter must not change
_NEAR = 2.0**-24
#: part of the value by which all parameters move for the comparison, and what it may be off by:
#: the difference by the square of the step, and rounding over the step
_STEP, _AGREE = 2.0**-17, 1e-8


class Traced:
    """A circuit whose numbers depend on parameters.

    Parameters
    ----------
    circuit : Circuit
    parameters : sequence of Parameter

    Raises
    ------
    Lost
        If a parameter is a temperature.
    NsspiceError, ArithmeticError
        If the deck cannot be read so.
    """

    def __init__(self, circuit: Circuit, parameters: Sequence[Parameter]) -> None:
        self._circuit, self._parameters = circuit, parameters
        self._sizes = [abs(p.value) or 1.0 for p in parameters]
        home = space(len(parameters), 1)
        self._carried = self._with(
            [
                Carried(Models.variable(home, p.value, size * _NEAR, k))
                for k, (p, size) in enumerate(zip(parameters, self._sizes, strict=True))
            ]
        )
        self._moved = [
            self._with(
                [p.value + s * _STEP * x for p, x in zip(parameters, self._sizes, strict=True)]
            )
            for s in (1.0, -1.0)
        ]

    def _with(self, given: Sequence[float]) -> tuple[Circuit, dict[str, float]]:
        """Return the circuit with other values, and those of elements."""
        params: dict[str, float] = {}
        models: dict[tuple[str, str], float] = {}
        elements: list[tuple[Parameter, float]] = []
        for parameter, value in zip(self._parameters, given, strict=True):
            target = parameter.target
            if target.kind == "param":
                params[target.name] = value
            elif target.kind == "model":
                models[target.model, target.key] = value
            elif target.kind == "element":
                elements.append((parameter, value))
            else:
                raise Lost("a temperature")
        other = read_again(self._circuit.deck, params) if params else self._circuit
        if models:
            other = build(with_model_values(other.deck, models))
        # an element moves from the value that the parameters give it
        values = {
            p.target.name: nominal(other, p.target) + (value - p.value)
            if params and not p.given
            else value
            for p, value in elements
        }
        return other, values

    def of_island(
        self, home: int, mna: MnaSystem, names: Sequence[str], periodic: bool, charged: bool
    ) -> list[dict[Any, float]]:
        """Return the derivatives of an island's arrays, signals and initial charges by each.

        Raises
        ------
        Lost, Unbounded, NsspiceError
            If they are not known.
        """

        def numbers(at: tuple[Circuit, dict[str, float]]) -> Numbers:
            return _numbers(*at, home, mna, names, periodic, charged)

        return self._slopes(numbers(self._carried), *map(numbers, self._moved))

    def of_cards(self, analysis: str) -> list[dict[Any, float]]:
        """Return the derivatives of the numbers on an analysis' measures by each parameter."""
        return self.of_circuit(lambda circuit: on_cards(circuit.deck, analysis))

    def of_circuit(self, numbers: Callable[[Circuit], Numbers]) -> list[dict[Any, float]]:
        """Return the derivatives of some numbers of the circuit by each parameter."""
        return self._slopes(*(numbers(circuit) for circuit, _ in (self._carried, *self._moved)))

    def _slopes(self, numbers: Numbers, above: Numbers, below: Numbers) -> list[dict[Any, float]]:
        found: list[dict[Any, float]] = [{} for _ in self._parameters]
        for key in {**numbers, **above, **below}:
            value = numbers.get(key, 0.0)
            slopes, middle = np.zeros(len(self._parameters)), value
            if isinstance(value, Carried):
                slopes = value.model.coefficients[1:] / (np.array(self._sizes) * _NEAR)
                middle = float(value.model.middle)
            one, other = above.get(key, 0.0), below.get(key, 0.0)
            expected = 0.0 if one == other else (one - other) / (2.0 * _STEP)  # also of inf
            along = float(slopes @ self._sizes)
            most = float(np.abs(slopes) @ self._sizes) + abs(middle)
            if not abs(along - expected) <= _AGREE * most:
                raise Lost(f"how {key[0]} depends on a parameter")
            for row, slope in zip(found, slopes.tolist(), strict=True):
                if slope:
                    row[key] = slope
        return found


def _numbers(
    circuit: Circuit,
    values: Mapping[str, float],
    home: int,
    mna: MnaSystem,
    names: Sequence[str],
    periodic: bool,
    charged: bool,
) -> Numbers:
    """Return all numbers of an island as its elements write them."""
    conditions: Conditions = mna.layout.conditions
    conditions = replace(conditions, values={**conditions.values, **values})
    tree = {n: mna.layout.before(n) for n, row in mna.layout.nodes.items() if row >= 0}
    own = circuit.islands[home]
    stamper = stamped(own.devices, Apart(Layout(list(own.nodes), conditions, tree)))
    waveforms = [continued(w) for w in stamper.waveforms] if periodic else stamper.waveforms
    kinds = [(wave.kind, len(wave.values)) for wave in waveforms]
    if (
        stamper.smooth
        or stamper.pair_names != mna.pairs
        or stamper.size != mna.system.n
        or kinds != [(wave.kind, len(wave.values)) for wave in mna.system.waveforms]
    ):
        raise Lost("other values make other equations")
    found: dict[tuple[Any, ...], float] = {}
    for letter in "EGABDS":
        entries = getattr(stamper, letter)
        for row, column, value in zip(entries.rows, entries.cols, entries.data, strict=True):
            key = letter, row, column
            found[key] = found[key] + value if key in found else value
    found.update({("q", k): value for k, value in enumerate(stamper.q)})
    for k, switch in enumerate(stamper.switches):
        found["on", k], found["off", k] = switch.on_above, switch.off_below
        found.update({("control", k, j): factor for j, factor in switch.control})
    for k, wave in enumerate(waveforms):
        found["scale", k] = wave.scale
        found.update({("wave", k, place): value for place, value in enumerate(wave.values)})
        if wave.repeat == wave.repeat:
            found["repeat", k] = wave.repeat
    named = mna.with_layout(own.devices, stamper.layout)
    for name in names:
        functional = named.functional(name)
        for part in ("z", "lam", "dz", "u"):
            found.update({("out", name, part, j): f for j, f in getattr(functional, part)})
    if charged:
        from ..static.initial import initial_voltages

        stored = named.stored(initial_voltages(circuit, mna))
        found.update({("charge", j): value for j, value in enumerate(stored[0])})
    return found


def traced(circuit: Circuit, parameters: Sequence[Parameter]) -> Traced | None:
    """Return a circuit with its dependence on parameters, None if it cannot be had so."""
    try:
        return Traced(circuit, parameters) if parameters else None
    except (ArithmeticError, NsspiceError):
        return None
