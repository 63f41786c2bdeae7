"""Proved bounds of measures over tolerances: for every circuit of a box, not for samples of it."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, NsspiceError, UsageError, suggest
from ...netlist.deck import Measure
from ...problems.csc import Floats
from ...problems.polynomial_range import largest
from ...problems.taylor import Models, Unbounded
from ..gradients.carried import Lost
from ..gradients.variation import Parameter
from ..request.load import need_circuit
from ..request.sampled import refuse_sampled
from ..studies.batch import Job, jobs_of
from .enclosure import Box, signal_of, weights_of
from .orbit import NotProved

#: parameters at most
_MOST = 8
#: degrees of the models that are tried, by the number of parameters
_DEGREES = ((5, (3, 4, 5)), (_MOST, (3, 4)))
#: parts of the spread: a remainder that needs no higher degree, and one that needs no smaller box
_FINE, _ENOUGH = 0.02, 0.1
#: side of the smallest box, as a part of the whole
_SMALLEST = 1.0 / 16.0


@dataclass(frozen=True, slots=True)
class Bound:
    """What a measure cannot leave.

    Parameters
    ----------
    measure : str
    low, high : float
        Every circuit of the decided part of the box lies between.
    least, most : float
        Values that circuits of the box are proved to reach or to pass: the bounds are no further
        out than these.
    decided : float
        Part of the box for which this is proved, 1 for all of it.
    """

    measure: str
    low: float
    high: float
    least: float
    most: float
    decided: float


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds of all measures.

    Parameters
    ----------
    measures : dict of str to Bound
    parameters : dict of str to (float, float)
        The box.
    undecided : list of dict of str to (float, float)
        Parts of the box for which nothing is proved.
    reasons : list of str
        Why, for each of them.
    boxes : int
        Parts that were looked at.
    seconds : float
    """

    measures: dict[str, Bound]
    parameters: dict[str, tuple[float, float]]
    undecided: list[dict[str, tuple[float, float]]]
    reasons: list[str]
    boxes: int
    seconds: float

    def __getitem__(self, measure: str) -> Bound:
        return self.measures[measure.lower()]

    @property
    def decided(self) -> float:
        """Part of the box for which the bounds are proved."""
        return min((bound.decided for bound in self.measures.values()), default=1.0)


@dataclass(slots=True)
class _Hull:
    """Of the parts looked at so far."""

    low: float = math.inf
    high: float = -math.inf
    least: float = math.inf
    most: float = -math.inf

    def add(self, model: Models) -> None:
        high, most = largest(model)
        low, least = largest(-model)
        self.low, self.high = min(self.low, -low), max(self.high, high)
        self.least, self.most = min(self.least, -least), max(self.most, most)


@dataclass(slots=True)
class _Search:
    """Parts of the box that are left to do."""

    circuit: Circuit
    job: Job
    cards: list[Measure]
    parameters: list[Parameter]
    whole: Floats
    hulls: dict[str, _Hull] = field(default_factory=dict)
    undecided: list[tuple[Floats, str]] = field(default_factory=list)
    boxes: int = 0

    def run(self, seconds: float) -> None:
        """Look at the whole box, then at halves of what is not decided."""
        stop = time.perf_counter() + seconds
        left = [self.whole]
        while left:
            ends = left.pop()
            if self.boxes and time.perf_counter() > stop:
                self.undecided.append((ends, "the time was up"))
                continue
            left += self._look(ends)

    def _look(self, ends: Floats) -> list[Floats]:
        """Decide a part of the box; return halves of it if it is not decided."""
        self.boxes += 1
        found: dict[str, Models] | None = None
        weights: Floats | None = None
        why = ""
        try:
            box = Box(self.circuit, self.job, self.parameters, ends)
            for degree in _degrees(len(self.parameters)):
                try:
                    found = box.measures(self.cards, degree)
                except (NotProved, Unbounded) as problem:
                    why, weights = str(problem), getattr(problem, "weights", None)
                    if getattr(problem, "inherent", False):
                        break  # narrower enclosures by a higher degree will not help
                    continue
                if all(_is_fine(model) for model in found.values()):
                    break
        except NsspiceError as problem:
            why = problem.diagnostics[0].message
        fine = found is not None and all(_is_fine(m, _ENOUGH) for m in found.values())
        if found is not None:
            weights = weights_of(list(found.values()))
        side = None if fine else self._side(ends, weights)
        if side is None:
            if found is None:
                self.undecided.append((ends, why))
            else:
                for name, model in found.items():
                    self.hulls.setdefault(name, _Hull()).add(model)
            return []
        middle = ends[side].mean()
        halves = []
        for low, high in ((ends[side, 0], middle), (middle, ends[side, 1])):
            half = ends.copy()
            half[side] = low, high
            halves.append(half)
        return halves

    def _side(self, ends: Floats, weights: Floats | None) -> int | None:
        """Return the parameter to halve, None if the box is small enough."""
        width = self.whole[:, 1] - self.whole[:, 0]
        share = (ends[:, 1] - ends[:, 0]) / np.where(width > 0.0, width, 1.0)
        free = share > 1.5 * _SMALLEST
        if not free.any():
            return None
        if weights is None or not weights[free].any():
            weights = share
        return int(np.argmax(np.where(free, weights, -1.0)))

    def part(self, ends: Floats) -> float:
        """Return the part of the whole box that a box is."""
        width = self.whole[:, 1] - self.whole[:, 0]
        moving = width > 0.0
        return float(np.prod((ends[moving, 1] - ends[moving, 0]) / width[moving]))


def _degrees(count: int) -> tuple[int, ...]:
    return next(degrees for most, degrees in _DEGREES if count <= most)


def _is_fine(model: Models, part: float = _FINE) -> bool:
    spread = float(np.abs(model.coefficients[1:]).sum())
    rounding = 1e-12 * float(abs(model.coefficients[0]))
    return bool(float(model.remainder) <= part * spread + rounding)


def bounds(
    circuit: Circuit,
    tolerances: Mapping[str, float | tuple[float, float]],
    measures: Sequence[str] | None = None,
    *,
    seconds: float = 60.0,
) -> Bounds:
    """Enclose measures of a periodic steady state for all values of parameters, with proof.

    The orbit is enclosed by Taylor models in the parameters and shown to exist, and to be the only
    one near that of the middle, for every one of them; so is the order of its events.  Where that
    is not possible the box is halved, down to a sixteenth of each side: what is left then is not
    decided.  That no orbit with another order of events exists as well is not proved.

    Parameters
    ----------
    circuit : Circuit
        With ``.pss`` and ``.measure pss`` cards: AVG, PP, MAX and MIN of voltages and currents.
    tolerances : mapping of str to float or (float, float)
        Relative tolerance, or both ends, of at most eight ``.param`` names, elements or model
        parameters.
    measures : sequence of str, optional
        Names of measures; all by default.
    seconds : float
        After which no more parts are looked at [s].

    Returns
    -------
    Bounds

    Raises
    ------
    UsageError
        NS4005 for names that the deck does not have; NS4043 for circuits and measures that have no
        enclosure.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''Chopper with an RL load
    ... V1 in 0 10
    ... S1 in a g 0 SW
    ... D1 0 a
    ... L1 a b 1m
    ... R1 b 0 2
    ... Vg g 0 PULSE(0 1 0 0 0 50u 100u)
    ... .model SW SW(VT=0.5)
    ... .pss
    ... .measure pss mean AVG i(l1)
    ... ''')
    >>> mean = bounds(circuit, {"v1": 0.05, "r1": 0.1})["mean"]
    >>> bool(mean.low <= 4.75 / 2.2 < mean.low + 0.02), bool(5.25 / 1.8 <= mean.high < 2.94)
    (True, True)
    """
    need_circuit(circuit)
    refuse_sampled(circuit.deck, "a proof of bounds")
    begin = time.perf_counter()
    cards = _cards(circuit, measures)
    jobs = [job for job in jobs_of(circuit.deck) if job.kind == "pss"]
    if len(jobs) != 1 or circuit.deck.steps:
        raise _refused("a deck with one .pss card and without .step cards is needed")
    parameters = [Parameter.of(circuit, name) for name in tolerances]
    if not 1 <= len(parameters) <= _MOST or any(p.target.kind == "temp" for p in parameters):
        raise _refused(f"1 to {_MOST} parameters, elements or model parameters are needed")
    whole = np.array(
        [_ends(p, given) for p, given in zip(parameters, tolerances.values(), strict=True)]
    )
    search = _Search(circuit, jobs[0], cards, parameters, whole)
    try:
        search.run(seconds)
    except Lost as why:
        raise _refused(str(why)) from why
    names = [p.target.name for p in parameters]

    def named(ends: Floats) -> dict[str, tuple[float, float]]:
        return {name: (low, high) for name, (low, high) in zip(names, ends.tolist(), strict=True)}

    decided = 1.0 - sum(search.part(ends) for ends, _ in search.undecided)
    found = {
        card.name: Bound(
            card.name, *(_values(search.hulls.get(card.name))), decided if decided > 1e-12 else 0.0
        )
        for card in cards
    }
    return Bounds(
        found,
        named(whole),
        [named(ends) for ends, _ in search.undecided],
        [why for _, why in search.undecided],
        search.boxes,
        time.perf_counter() - begin,
    )


def _values(hull: _Hull | None) -> tuple[float, float, float, float]:
    if hull is None:
        return (math.nan,) * 4
    return hull.low, hull.high, hull.least, hull.most


def _cards(circuit: Circuit, measures: Sequence[str] | None) -> list[Measure]:
    known = {m.name: m for m in circuit.deck.measures if m.analysis == "pss"}
    names = list(known) if measures is None else [name.lower() for name in measures]
    for name in names:
        if name not in known:
            hint = suggest(name, known) or f"it has {', '.join(known) or 'none'}"
            message = f"the deck has no .measure pss {name}"
            raise UsageError(Diagnostic("NS4005", message, hint=hint))
    if not names:
        raise _refused("the deck has no .measure pss card")
    for name in names:
        try:
            signal_of(known[name])
        except Lost as why:
            raise _refused(str(why)) from why
    return [known[name] for name in names]


def _ends(parameter: Parameter, given: float | tuple[float, float] | Any) -> tuple[float, float]:
    """Return both ends of a parameter."""
    if isinstance(given, int | float):
        size = abs(parameter.value) * given
        low, high = parameter.value - size, parameter.value + size
    else:
        low, high = given
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        message = f"the tolerance of {parameter.target.name} cannot be {given!r}"
        raise UsageError(Diagnostic("NS4005", message, hint="give 0.05 for 5 %, or (low, high)"))
    return low, high


def _refused(why: str) -> UsageError:
    hint = "nsspice tolerance shows samples"
    return UsageError(Diagnostic("NS4043", f"no proved bounds: {why}", hint=hint))
