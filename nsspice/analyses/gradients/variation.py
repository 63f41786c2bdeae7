"""How the equations of an island, and the numbers on cards, depend on a parameter.

Every entry of the assembled arrays is a product, quotient or sum of values of the deck.  Their
derivatives by a parameter are differences of two assemblies each, extrapolated once.  With steps of
the part h = 1/2048 of the value, and half of it, h^4/4 = 1e-14 is left of a quotient, of what is
linear in the parameter nothing; rounding adds 2 u/h = 5e-13 at most.  Nothing is run for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from ...circuit import Circuit, MnaSystem
from ...circuit.build import build
from ...circuit.mna import assemble
from ...devices.stamper import Conditions, Stamper
from ...errors import Diagnostic, NsspiceError, UsageError
from ...netlist.deck import Cond, Deck, Measure, PssCard, TranCard
from ...problems.descriptor import Waveform
from ..request.load import read_again
from ..request.targets import Target, nominal, target_of, with_model_values
from ..static.initial import initial_voltages

#: numbers by what they are: ``("E", row, column)``, ``("wave", source, place)`` ...
Numbers = Mapping[tuple[Any, ...], float]

#: part of the value by which it is changed
_STEP = 2.0**-11


@dataclass(frozen=True, slots=True)
class Parameter:
    """What is differentiated by.

    Parameters
    ----------
    target : Target
    value : float
    given : bool
        Whether the value of an element replaces that of the deck, and what it depends on.
    """

    target: Target
    value: float
    given: bool = False

    @classmethod
    def of(cls, circuit: Circuit, name: str) -> Parameter:
        """Return a parameter of a deck, an element's value, ``temp``, or ``model(parameter)``."""
        target = target_of(circuit, name)
        return cls(target, nominal(circuit, target))

    @property
    def steps(self) -> tuple[float, float]:
        """Steps of the differences, in units of the value."""
        size = _STEP * (abs(self.value) or 1.0)
        # exact sums: values that follow linearly differ by the step and nothing else
        wide = (self.value + size) - self.value
        return wide, 0.5 * wide


class Apart(Stamper):
    """A stamper that keeps sources apart: a parameter may change one of several that are equal."""

    def column(self, waveform: Waveform) -> int:
        """Return a column of its own."""
        self.waveforms.append(waveform)
        return len(self.waveforms) - 1


def apart(circuit: Circuit, home: int, mna: MnaSystem, conditions: Conditions) -> MnaSystem:
    """Return an island with the unknowns of a system, and a column for each source."""
    nodes = mna.layout.nodes
    tree = {node: mna.layout.before(node) for node, row in nodes.items() if row >= 0}
    island = circuit.islands[home]
    return assemble(island.devices, island.nodes, conditions, tree, Apart)


class Decks:
    """A circuit with other values of its parameters; each is read once."""

    def __init__(self, circuit: Circuit) -> None:
        self.circuit = circuit
        self._known: dict[tuple[str, float], Circuit] = {}

    def at(self, parameter: Parameter, value: float) -> Circuit:
        """Return the circuit with a value of a parameter of the deck or of a model."""
        target = parameter.target
        if target.kind not in ("param", "model"):
            return self.circuit
        found = self._known.get((target.name, value))
        if found is None:
            deck = self.circuit.deck
            if target.kind == "param":
                found = read_again(deck, {target.name: value})
            else:
                found = build(with_model_values(deck, {(target.model, target.key): value}))
            self._known[target.name, value] = found
        return found


def derivatives(parameter: Parameter, numbers: Callable[[float], Numbers]) -> dict[Any, float]:
    """Return the derivatives of numbers by a parameter, those that are not zero.

    Parameters
    ----------
    parameter : Parameter
    numbers : callable
        Returns them for a value of the parameter.

    Examples
    --------
    >>> from nsspice.analyses.request.targets import Target
    >>> r = Parameter(Target("r1", "element"), 50.0)
    >>> found = derivatives(r, lambda x: {("g",): 1.0 / x, ("r",): x, ("c",): 3.0})
    >>> {key[0]: round(value, 12) for key, value in found.items()}
    {'g': -0.0004, 'r': 1.0}
    """
    slopes = []
    for step in parameter.steps:
        above, below = numbers(parameter.value + step), numbers(parameter.value - step)
        found = {}
        for key in {**above, **below}:
            one, other = above.get(key, 0.0), below.get(key, 0.0)
            if one != other:
                found[key] = (one - other) / (2.0 * step)
        slopes.append(found)
    wide, fine = slopes
    return {key: (4.0 * fine.get(key, 0.0) - wide.get(key, 0.0)) / 3.0 for key in {**wide, **fine}}


def of_island(
    decks: Decks,
    parameter: Parameter,
    home: int,
    mna: MnaSystem,
    names: Sequence[str],
    changed: Callable[[MnaSystem], MnaSystem],
) -> dict[Any, float]:
    """Return the derivatives of an island's arrays, signals and initial charges.

    Parameters
    ----------
    decks : Decks
    parameter : Parameter
    home : int
        Number of the island.
    mna : MnaSystem
        As it was run; its unknowns are kept.
    names : sequence of str
        Signals of the island.
    changed : callable
        What was done to the system after it had been assembled.

    Raises
    ------
    UsageError
        NS4042 if another value makes other equations.
    """

    def numbers(value: float) -> Numbers:
        circuit, other = with_value(decks, parameter, value, home, mna, changed)
        return _numbers(circuit, other, names)

    try:
        return derivatives(parameter, numbers)
    except (IndexError, NsspiceError) as problem:
        if isinstance(problem, UsageError) and problem.diagnostics[0].code == "NS4042":
            raise
        raise other_equations(parameter) from problem


def with_value(
    decks: Decks,
    parameter: Parameter,
    value: float,
    home: int,
    mna: MnaSystem,
    changed: Callable[[MnaSystem], MnaSystem],
) -> tuple[Circuit, MnaSystem]:
    """Return circuit and island with another value of a parameter; arguments as `of_island`.

    Raises
    ------
    UsageError
        NS4042 if it makes other equations.
    """
    target, conditions = parameter.target, mna.layout.conditions
    circuit = decks.at(parameter, value)
    if target.kind == "element":
        conditions = replace(conditions, values={**conditions.values, target.name: value})
    elif target.kind == "temp":
        conditions = replace(conditions, temperature=value)
    other = changed(apart(circuit, home, mna, conditions))
    if _structure(other) != _structure(mna):
        raise other_equations(parameter)
    return circuit, other


def _structure(mna: MnaSystem) -> tuple[Any, ...]:
    kinds = [(wave.kind, len(wave.values)) for wave in mna.system.waveforms]
    smooth = mna.system.smooth
    return mna.unknowns, mna.pairs, kinds, 0 if smooth is None else smooth.tape.outputs.size


def other_equations(parameter: Parameter) -> UsageError:
    """Return the error of a parameter another value of which makes other equations."""
    name, value = parameter.target.name, parameter.value
    return UsageError(
        Diagnostic(
            "NS4042",
            f"there is no derivative by {name} at {value:g}: other values near it make other "
            "equations",
            hint="give it a value at which the circuit has the same elements on both sides",
        )
    )


def _numbers(circuit: Circuit, mna: MnaSystem, names: Sequence[str]) -> Numbers:
    """Return all numbers of an assembled island."""
    system = mna.system
    found: dict[tuple[Any, ...], float] = {}
    matrices = [(letter, getattr(system, letter)) for letter in "EGABDS"]
    if system.smooth is not None:
        matrices += [("F", system.smooth.F), ("Q", system.smooth.Q)]
    for letter, matrix in matrices:
        entries = zip(
            matrix.indices.tolist(), matrix.columns.tolist(), matrix.data.tolist(), strict=True
        )
        found.update({(letter, row, column): value for row, column, value in entries})
    found.update({("q", k): value for k, value in enumerate(system.q.tolist())})
    for k, switch in enumerate(system.switches):
        found["on", k], found["off", k] = switch.on_above, switch.off_below
        found.update({("control", k, j): factor for j, factor in switch.control})
    for k, wave in enumerate(system.waveforms):
        found["scale", k] = wave.scale
        found.update({("wave", k, place): value for place, value in enumerate(wave.values)})
        if not math.isnan(wave.repeat):
            found["repeat", k] = wave.repeat
    for name in names:
        functional = mna.functional(name)
        for part in ("z", "lam", "dz", "u", "f", "df"):
            found.update({("out", name, part, j): f for j, f in getattr(functional, part)})
    charges, _ = mna.initial_state(initial_voltages(circuit, mna))
    found.update({("charge", j): value for j, value in enumerate(charges.tolist())})
    return found


def of_cards(decks: Decks, parameter: Parameter, analysis: str) -> dict[Any, float]:
    """Return the derivatives of the numbers on an analysis' measures, and of its ``stop``."""
    if parameter.target.kind != "param":
        return {}
    found = partial(on_cards, analysis=analysis)
    return derivatives(parameter, lambda x: found(decks.at(parameter, x).deck))


def on_cards(deck: Deck, analysis: str) -> Numbers:
    """Return the numbers on an analysis' measures, and its ``stop``."""
    found: dict[tuple[Any, ...], float] = {}

    def note(card: Measure | Cond, fields: Sequence[str], *key: str) -> None:
        for field in fields:
            value = getattr(card, field)
            if value is not None:
                found[(*key, field)] = value

    for card in deck.measures:
        if card.analysis == analysis:
            note(card, ("start", "stop", "at"), card.name)
            for side in ("first", "second"):
                if getattr(card, side) is not None:
                    note(getattr(card, side), ("value", "at"), card.name, side)
    for analysis_card in deck.analyses:
        if isinstance(analysis_card, TranCard) and analysis == "tran":
            found["stop",] = analysis_card.tstop
        elif isinstance(analysis_card, PssCard) and analysis_card.period and analysis == "pss":
            found["stop",] = analysis_card.period
        elif isinstance(analysis_card, PssCard) and analysis_card.trigger and analysis == "pss":
            found["level",] = analysis_card.level
    return found
