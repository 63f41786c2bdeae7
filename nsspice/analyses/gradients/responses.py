"""Derivatives of small-signal responses about an operating point, and of what is measured of them.

With :math:`M x = r` at a frequency and a signal :math:`y = c^T x`, the adjoint
:math:`M^T \\lambda = c` gives the derivative by every parameter,

.. math::

    dy = dc^T x + \\lambda^T (dr - dM\\, x) .

Measures are functions of the responses at all frequencies; along their derivatives they are
differentiated by differences, for which nothing is solved.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...circuit import Circuit
from ...devices.passive.resistor import Resistor
from ...devices.sources.delayed import Delayed
from ...devices.sources.isource import CurrentSource
from ...errors import NsspiceError
from ...netlist.deck import LoopCard, Measure, PssCard
from ...problems.descriptor import Functional
from ..request.measured_signals import measured_signals
from ..request.request import Request
from ..signals.curve import Floats
from ..solution.solution import Solution
from ..steady.adjoint import adjoint
from ..steady.linearised import Complexes, Point, operating_point, solutions
from ..steady.loop_gain import tian
from ..steady.stimuli import ac_values, injection
from ..transient.measure import evaluate_measures
from .refusals import undone
from .traced import traced
from .variation import Decks, Numbers, Parameter, derivatives, other_equations

#: part of a parameter by which responses move along their derivatives: what is left of the square
#: is 6e-11, and rounding over the step 3e-11
_STEP = 2.0**-17
#: what a ``.loop`` card measures
MARGINS = ("phase_margin", "gain_margin", "crossover")


@dataclass(frozen=True, slots=True)
class Slopes:
    """Responses of a signal, and their derivatives.

    Parameters
    ----------
    values : ndarray of complex, shape (k,)
    by : ndarray of complex, shape (parameters, k)
    by_s : ndarray of complex, shape (k,)
        By the complex frequency.
    """

    values: Complexes
    by: Complexes
    by_s: Complexes


class Responses:
    """The responses of a circuit about its operating point, with derivatives by parameters.

    Parameters
    ----------
    circuit : Circuit
    request : Request
        With the temperature and values of elements.
    parameters : sequence of Parameter
    decks : Decks

    Raises
    ------
    UsageError
        NS4041 about a periodic steady state.
    """

    def __init__(
        self, circuit: Circuit, request: Request, parameters: Sequence[Parameter], decks: Decks
    ) -> None:
        if any(isinstance(card, PssCard) for card in circuit.deck.analyses):
            raise undone("responses about a steady state are not differentiated", ".pss")
        late = next((d.name for d in circuit.devices if isinstance(d, Delayed)), None)
        if late is not None:
            raise undone("responses of circuits with delays are not differentiated", late)
        self.circuit, self.parameters = circuit, parameters
        self._request, self._decks = request, decks
        self._traced = traced(circuit, parameters)

    def of(
        self, names: Sequence[str], stimuli: Mapping[str, complex], s: Complexes
    ) -> dict[str, Slopes]:
        """Return responses of signals to stimuli at complex frequencies (k,) [1/s]."""
        shape = (len(self.parameters), s.size)
        parts = {name: self.circuit.parts(name) for name in names}
        found = {n: Slopes(*(np.zeros(m, complex) for m in (s.size, shape, s.size))) for n in names}
        for home, island in enumerate(self.circuit.islands):
            if not any(_owner(self.circuit, name) == home for name in stimuli):
                continue
            local = list(dict.fromkeys(n for t in parts.values() for h, n, _ in t if h == home))
            if not local:
                continue
            point = operating_point(self.circuit, island, stimuli, self._request)
            changes = self._changes(home, point, local, stimuli)
            x = solutions(point, s, stimuli)
            u = point.sources(stimuli)
            for part in local:
                one = _slopes(point, part, s, x, u, changes)
                for name, terms in parts.items():
                    for factor in (f for h, n, f in terms if (h, n) == (home, part)):
                        whole = found[name]
                        for total, own in (
                            (whole.values, one.values),
                            (whole.by, one.by),
                            (whole.by_s, one.by_s),
                        ):
                            total += factor * own
        return found

    def by_weights(self) -> tuple[dict[str, complex], list[dict[str, complex]]]:
        """Return the AC values of sources, and their derivatives by each parameter."""
        given = ac_values(self.circuit)

        def numbers(circuit: Circuit) -> Numbers:
            return {
                (name, place): circuit.device(name).source.ac[place]  # type: ignore[attr-defined]
                for name in given
                for place in (0, 1)
            }

        changes = None
        if self._traced is not None:
            try:
                changes = self._traced.of_circuit(numbers)
            except ArithmeticError:
                changes = None
        if changes is None:
            changes = [
                derivatives(p, lambda x, p=p: numbers(self._decks.at(p, x)))  # type: ignore[misc]
                for p in self.parameters
            ]
        found: list[dict[str, complex]] = []
        for change in changes:
            row: dict[str, complex] = {}
            for (name, place), slope in change.items():
                phase = self.circuit.device(name).source.ac[1]  # type: ignore[attr-defined]
                unit = cmath.rect(1.0, math.radians(phase))
                turned = given[name] * 1j * math.radians(1.0)
                row[name] = row.get(name, 0.0) + slope * (turned if place else unit)
            found.append(row)
        return given, found

    def _changes(
        self, home: int, point: Point, names: Sequence[str], stimuli: Mapping[str, complex]
    ) -> list[Mapping[Any, float]]:
        """Return the derivatives of the numbers of an island's equations by each parameter."""
        if self._traced is not None and _plain(point, stimuli):
            try:
                found = self._traced.of_island(home, point.mna, names, False, False)
                return [_placed(point, change) for change in found]
            except (ArithmeticError, IndexError, NsspiceError):
                pass  # differences know, or say why not
        return [self._by_differences(p, home, point, names, stimuli) for p in self.parameters]

    def _by_differences(
        self,
        parameter: Parameter,
        home: int,
        point: Point,
        names: Sequence[str],
        stimuli: Mapping[str, complex],
    ) -> Mapping[Any, float]:
        """Return the same by one parameter from operating points next to it."""
        target, request = parameter.target, self._request
        if target.kind == "element" and self.circuit.element_island[target.name] != home:
            return {}

        def numbers(value: float) -> Numbers:
            circuit, own = self._decks.at(parameter, value), request
            if target.kind == "element":
                own = replace(request, values={**request.values, target.name: value})
            elif target.kind == "temp":
                own = replace(request, temperature=value)
            other = operating_point(circuit, circuit.islands[home], stimuli, own)
            if other.mna.unknowns != point.mna.unknowns or list(other.active) != list(point.active):
                raise other_equations(parameter)
            return _numbers(other, names, stimuli)

        return derivatives(parameter, numbers)


def _owner(circuit: Circuit, stimulus: str) -> int | None:
    if stimulus.startswith("into "):
        return circuit.node_island.get(stimulus[5:])
    return circuit.element_island.get(stimulus)


def _plain(point: Point, stimuli: Mapping[str, complex]) -> bool:
    """Return whether the equations are those of the assembly, and stimuli are not multiplied."""
    return not any(
        (isinstance(device, CurrentSource) and device.name in stimuli and device.m != 1.0)
        or (isinstance(device, Resistor) and device.small_signal is not None)
        for device in point.mna.devices
    )


def _placed(point: Point, change: Mapping[Any, float]) -> dict[Any, float]:
    """Return derivatives of an island's arrays as those of its equations of active pairs."""
    n = point.system.n
    place = {int(pair): n + k for k, pair in enumerate(point.active)}
    found: dict[Any, float] = {}
    for key, slope in change.items():
        match key:
            case ("E", row, column):
                found["rate", row, column] = slope
            case ("G", row, column):
                found["value", row, column] = slope
            case ("A", row, pair) if pair in place:
                found["value", row, place[pair]] = slope
            case ("B", pair, column) if pair in place:
                found["value", place[pair], column] = -slope
            case ("D", pair, other) if pair in place and other in place:
                found["value", place[pair], place[other]] = slope
            case ("out", name, "z", column):
                found["out", name, "value", column] = slope
            case ("out", name, "dz", column):
                found["out", name, "rate", column] = slope
            case ("out", name, "lam", pair) if pair in place:
                found["out", name, "value", place[pair]] = slope
    return found


def _numbers(point: Point, names: Sequence[str], stimuli: Mapping[str, complex]) -> Numbers:
    """Return all numbers of the equations about an operating point."""
    found: dict[tuple[Any, ...], float] = {}
    for kind, matrix in zip(("value", "rate"), point.matrices(), strict=True):
        entries = zip(matrix.indices, matrix.columns, matrix.data.tolist(), strict=True)
        found.update({(kind, int(row), int(column)): value for row, column, value in entries})
    for stimulus in point.stimulated.columns:
        drive = point.drive({n: float(n == stimulus) for n in stimuli})
        for kind, vector in zip(("value", "rate"), drive, strict=True):
            rows = enumerate(vector.real.tolist())
            found.update({("drive", stimulus, kind, row): f for row, f in rows if f})
    for name in names:
        functional = _signal(point, name)
        for kind, read in zip(("value", "rate"), point.row(functional), strict=True):
            columns = enumerate(read.tolist())
            found.update({("out", name, kind, column): f for column, f in columns if f})
        for kind, direct in zip(("direct", "direct rate"), _direct(point, functional), strict=True):
            for stimulus, column in point.stimulated.columns.items():
                found["out", name, kind, stimulus] = float(direct[column])
    return found


def _signal(point: Point, name: str) -> Functional:
    return point.stimulated.functional(point.mna, name)


def _direct(point: Point, signal: Functional) -> tuple[Floats, Floats]:
    """Return what a signal reads of the sources themselves, of values and of rates."""
    value, rate = np.zeros((2, len(point.system.waveforms)))
    for column, factor in signal.u:
        value[column] += factor
    for f, factor in signal.f:
        value += factor * point.source_slopes[f]
    for f, factor in signal.df:
        rate += factor * point.source_slopes[f]
    return value, rate


def _slopes(
    point: Point,
    name: str,
    s: Complexes,
    x: Complexes,
    u: Complexes,
    changes: Sequence[Mapping[Any, float]],
) -> Slopes:
    """Return the responses of one signal of an island with their derivatives."""
    signal = _signal(point, name)
    y = adjoint(point, signal, s)
    driven = {n: u[column] for n, column in point.stimulated.columns.items()}
    by = np.zeros((len(changes), s.size), complex)
    for row, change in zip(by, changes, strict=True):
        for key, slope in change.items():
            match key:
                case ("value", r, c):
                    row -= slope * y[:, r] * x[:, c]
                case ("rate", r, c):
                    row -= slope * s * y[:, r] * x[:, c]
                case ("drive", stimulus, kind, r):
                    row += slope * driven[stimulus] * y[:, r] * (1.0 if kind == "value" else s)
                case ("out", own, kind, c) if own == name:
                    times = s if kind.endswith("rate") else 1.0
                    row += slope * times * (driven[c] if kind.startswith("d") else x[:, c])
    rate, (_, drive_rate) = point.matrices()[1].dense(), point.drive(_weights(point, u))
    direct, direct_rate = _direct(point, signal)
    c, d = point.row(signal)
    values = x @ c + s * (x @ d) + u @ direct + s * (u @ direct_rate)
    by_s = np.einsum("kr,kr->k", y, drive_rate - x @ rate.T) + x @ d + u @ direct_rate
    return Slopes(values, by, by_s)


def _weights(point: Point, u: Complexes) -> dict[str, complex]:
    return {name: complex(u[column]) for name, column in point.stimulated.columns.items()}


def of_measures(responses: Responses, solution: Solution, measures: Sequence[str]) -> Floats:
    """Return the derivatives of measures of ``.ac``, shape (measures, parameters)."""
    cards = _needed([c for c in responses.circuit.deck.measures if c.analysis == "ac"], measures)
    names = measured_signals(cards)
    s: Complexes = (2j * np.pi * solution.axis).astype(np.complex128)
    weights, by_weights = responses.by_weights()
    found = responses.of(names, weights, s)
    by = {name: found[name].by.copy() for name in names}
    for source in {name for row in by_weights for name in row}:
        unit = responses.of(names, {**dict.fromkeys(weights, 0.0), source: 1.0}, s)
        for k, row in enumerate(by_weights):
            for name in names:
                by[name][k] += row.get(source, 0.0) * unit[name].values

    def measured(step: float, k: int) -> Floats:
        table = {}
        for name in names:
            row = found[name].values + step * by[name][k]
            table[f"re({name})"], table[f"im({name})"] = row.real, row.imag
        other = replace(solution, signals=table, measures={}, warnings=[])
        evaluate_measures(other, cards)
        return np.array([other.measures[name] for name in measures])

    result = np.zeros((len(measures), len(responses.parameters)))
    for k, parameter in enumerate(responses.parameters):
        step = _STEP * (abs(parameter.value) or 1.0)
        result[:, k] = (measured(step, k) - measured(-step, k)) / (2.0 * step)
    return result


def _needed(cards: Sequence[Measure], names: Sequence[str]) -> list[Measure]:
    """Return the measures of some names, and those that they are made of, in deck order."""
    wanted, kept = set(names), []
    for card in reversed(cards):
        if card.name in wanted:
            kept.append(card)
            wanted |= {name for e in card.expressions for name in e.variables()}
            late = [*card.late, *(x for c in (card.first, card.second) if c for x in c.late)]
            wanted |= {name for _, e in late for name in e.variables()}
    return kept[::-1]


def of_margins(
    responses: Responses, solution: Solution, card: LoopCard, measures: Sequence[str]
) -> Floats:
    """Return the derivatives of margins and crossover of a loop gain, shape (measures, params)."""
    report = solution.loop
    assert report is not None
    node = responses.circuit.device(card.source).nodes[0]
    names = [f"v({node})", f"i({card.source})"]
    stimuli = [card.source, injection(node)]
    rows = []
    for measure in measures:
        group = report.reversals if measure == "gain_margin" else report.crossovers
        if not group:
            raise undone("there is none", measure)
        own = group[0] if measure == "crossover" else min(group, key=lambda c: abs(c.margin))
        s = np.array([2j * math.pi * own.frequency])
        sets = [responses.of(names, {n: complex(n == on) for n in stimuli}, s) for on in stimuli]
        four = [one[name] for one in sets for name in names]
        values = [part.values[0] for part in four]
        t = complex(_tian(values))
        slopes = [_tian_slope(values, k) for k in range(4)]
        by = sum(f * part.by[:, 0] for f, part in zip(slopes, four, strict=True)) / t
        by_f = (
            2j * math.pi * sum(f * part.by_s[0] for f, part in zip(slopes, four, strict=True)) / t
        )
        # d(log T) = by dp + by_f df: at a crossover |T| stays 1, at a reversal the angle
        if measure == "gain_margin":
            moved = -by.imag / by_f.imag
            rows.append(-20.0 / math.log(10.0) * (by.real + by_f.real * moved))
            continue
        moved = -by.real / by_f.real
        turned = np.degrees(by.imag + by_f.imag * moved)
        rows.append(moved if measure == "crossover" else turned)
    return np.array(rows)


def _tian(values: Sequence[complex]) -> complex:
    return complex(tian(*(np.array([v]) for v in values))[0])


def _tian_slope(values: Sequence[complex], k: int) -> complex:
    """Return the derivative of the loop gain by one of the four responses."""
    va, ia, vb, ib = values
    total = 2.0 * (ia * vb - va * ib) + va + ib
    by = (1.0 - 2.0 * ib, 2.0 * vb, 2.0 * ia, 1.0 - 2.0 * va)[k]
    return by / (1.0 - total) ** 2
