"""The DC points of one island: intervals in which only sources change are one run of the solver."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from ...circuit import Circuit, Island, MnaSystem
from ...errors import NumericalError
from ...problems.descriptor import DescriptorSystem, Waveform
from ...solvers.moreau import MoreauStepper
from ...solvers.stepper import UnsolvedStep
from ..certificate.certificate import Certificate
from ..certificate.failure import named_failure
from ..certificate.followed_path import of_linearised
from ..certificate.island_check import Examiner, judge_of_points, sampling
from ..certificate.regularity import SolutionVerdict
from ..request.load import at_temperature
from ..request.path_following import PATH_METHODS, Following
from ..request.request import Request
from ..signals.curve import Floats
from ..solution.solution import IslandRun
from .dc_start import start_dc, without_storage
from .initial import as_controlled, guess_of, with_integrators

#: A source value that no deck holds, so that the swept source gets a column of its own.
_MARK = 1.234567890123e-101
_BUDGET = 0.05  # [s] longest call inside the core
_ROWS = 4096


@dataclass(slots=True)
class Totals:
    """What the solvers of one island counted, over all points."""

    statistics: list[dict[str, float]]
    certificates: list[Certificate]
    unknowns: int = 0
    pairs: int = 0
    method: str = "point by point"
    verdict: Callable[[], SolutionVerdict] | SolutionVerdict | None = None
    #: the verdict on an operating point that is one of several
    several: SolutionVerdict | None = None


class PointsOfIsland:
    """The DC points of one island."""

    def __init__(
        self,
        circuit: Circuit,
        island: Island,
        names: Sequence[str],
        swept: Mapping[str, Floats],
        request: Request,
        following: Following | None = None,
    ) -> None:
        self.following = following
        self.circuit, self.island, self.names = circuit, island, list(names)
        mine = {device.name: device.letter for device in island.devices}
        self.sources = {n: v for n, v in swept.items() if mine.get(n, "") in ("v", "i")}
        self.others = {
            n: v for n, v in swept.items() if n == "temp" or mine.get(n, "") in tuple("rlc")
        }
        self.temperature, self.values = request.temperature, request.values
        self.totals = Totals([], [])

    def blocks(self, count: int) -> Iterator[Floats]:
        """Yield the recorded columns of all points, some rows at a time.

        Intervals in which only sources change are one run of the solver, which stays close to the
        previous point where a solution is not unique; the matrices change between intervals.
        """
        cuts = [0, count]
        if self.others:
            changed = np.zeros(count, dtype=bool)
            for axis in self.others.values():
                changed[1:] |= np.diff(axis) != 0.0
            cuts = [0, *np.flatnonzero(changed).tolist(), count]
        near: tuple[Floats, Floats] | None = None
        unknowns: list[str] = []
        for first, last in pairwise(cuts):
            mna, system = self._system(first, last)
            if mna.unknowns != unknowns:  # a resistor of 0 Ohm has a current for an unknown
                near, unknowns = guess_of(self.circuit, mna), mna.unknowns
                if near is not None:
                    system = as_controlled(system, near[0])
            stepper = MoreauStepper(system, [mna.functional(name) for name in self.names])
            stepper.freeze_time(0.0)
            if self.following is not None:
                self.totals.method = self.following.apply(stepper, self.island, system)
            self.totals.unknowns, self.totals.pairs = system.n, system.m
            examiner = Examiner(mna, system=system, frozen=0.0)
            # rows that hold what integrates have no elements that a verdict could name
            judged = first == 0 and system.n == mna.system.n
            judge = judge_of_points(mna, system) if judged else None
            size = 2 * system.n + system.m + 2 * len(system.waveforms)
            stepper.watch(*sampling(last - first, size))
            try:
                stored = partial(replace, system, E=mna.system.E, smooth=mna.system.smooth)
                start_dc(stepper, stored, near)
                stepper.plan_points(np.arange(float(last - first)))
                yield from _rows(stepper, last - first)
            except UnsolvedStep as problem:
                raise self._failure(mna, problem, first) from problem
            finally:
                self.totals.statistics.append(dict(stepper.statistics))
                records = stepper.take_records()
                examiner.take(records)
                if judge is not None:
                    judge.take(records)
                stats = stepper.statistics
                free = int(stats["undetermined"])
                if judge is not None:
                    free = judge.undetermined(records, free)
                found = examiner.certificate(int(stats["steps"]), free)
                if self.totals.method in PATH_METHODS:
                    found = of_linearised(found, stats)
                self.totals.certificates.append(found)
            if judge is not None:
                alone = count == 1 and not self.sources and not self.others
                if alone:
                    self.totals.several = judge.search(stepper)
                self.totals.verdict = judge.later()
            near = stepper.state

    def _system(self, first: int, last: int) -> tuple[MnaSystem, DescriptorSystem]:
        """Return the static system in which time counts the points of an interval."""
        values = dict(self.values)
        temperature = self.temperature
        for name, axis in self.others.items():
            if name == "temp":
                temperature = float(axis[first])
            else:
                values[name] = float(axis[first])
        marks = {name: _MARK * (1.0 + k) for k, name in enumerate(self.sources)}
        island = self.island
        if self.circuit.deck.thermal and "temp" in self.others:
            place = self.circuit.islands.index(island)
            island = at_temperature(self.circuit, temperature).islands[place]
        mna = island.assemble(temperature, {**values, **marks}, analysis="dc")
        waveforms = list(mna.system.waveforms)
        times = np.arange(float(last - first))
        for name, axis in self.sources.items():
            column = mna.layout.columns[name]
            points = np.column_stack([times, axis[first:last]]).ravel()
            waveforms[column] = Waveform(
                "pwl", tuple(points.tolist()), scale=waveforms[column].scale
            )
        system = replace(without_storage(mna.system), waveforms=tuple(waveforms))
        return mna, with_integrators(self.circuit, mna, system)

    def _failure(self, mna: MnaSystem, problem: UnsolvedStep, first: int) -> NumericalError:
        """Return the error, with the swept values in place of the count of points."""
        index = first + round(problem.time)
        swept = {**self.sources, **self.others}
        where = ", ".join(f"{name} = {axis[index]:.6g}" for name, axis in swept.items())
        return named_failure(self.circuit, mna, problem, where=where)


def _rows(stepper: MoreauStepper, count: int) -> Iterator[Floats]:
    """Yield the recorded columns of the planned points, those before a failure too."""
    while count:
        try:
            rows, _ = stepper.advance(min(_ROWS, count), _BUDGET)
        except UnsolvedStep:
            yield stepper.pending[:, 1:]
            raise
        count -= rows.shape[0]
        yield rows[:, 1:]


def report_of(number: int, island: Island, totals: Totals) -> IslandRun:
    """Return how the island was solved, over all its points."""
    stats: dict[str, float] = {}
    for part in totals.statistics:
        for key, value in part.items():
            if key.startswith("residual") or key in ("modes", "worst_stage"):
                stats[key] = max(stats.get(key, 0), value)
            else:
                stats[key] = stats.get(key, 0) + value
    return IslandRun(
        number + 1,
        island.problem_class.name,
        island.reason,
        totals.method,
        totals.unknowns,
        totals.pairs,
        stats=stats,
        judge=totals.verdict,
    )
