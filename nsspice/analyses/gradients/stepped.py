"""Derivatives of measures of an island that is run by steps with error control.

The run is repeated with its windows and instants among the ends of steps, all of which are
recorded; one pass backwards (:mod:`~nsspice.solvers.backward`) says what anything that acts in the
equations does to the measures, and each parameter acts as in :mod:`.drivers`.  The error is that of
the steps: halving ``reltol`` shows it.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...devices.sources.waveform import initial_value
from ...errors import Diagnostic, UsageError
from ...problems.csc import Csc
from ...problems.descriptor import Functional, Waveform
from ...problems.tape import CODES
from ...solvers.along_run import Points, at_rest
from ...solvers.backward import Backward
from ...solvers.intervals import Intervals, joined
from ...solvers.perturbed import Outputs
from ...solvers.sdirk import Accuracy, SdirkStepper
from ...solvers.tangent import Tangent
from ..request.cards import Tran
from ..request.restart_state import Beginning, with_gates
from ..request.settings import Settings
from ..signals.curve import Floats
from ..static.initial import initial_voltages, start, stored_at
from .acting import Acting, TapeAt
from .drivers import Driven
from .instants import moved_instants
from .rates_as_unknowns import with_rates
from .refusals import unbounded, undone
from .stepped_goals import Aims
from .variation import Parameter

#: steps are half as long as those of the run: their errors count by their derivatives
_FINER = 1.0 / 16.0
#: rows that a run by steps returns together
_ROWS = 64
#: condition from which on nothing restores an orbit
_UNBOUNDED = 1e9


@dataclass(frozen=True, slots=True)
class Course:
    """How an island was run.

    Parameters
    ----------
    analysis : Tran
    settings : Settings
    beginning : Beginning or None
        Of an orbit.
    periodic : bool
        It is one period of an orbit.
    trigger : Functional or None
        What ends a free period, as a combination of unknowns.
    """

    analysis: Tran
    settings: Settings
    beginning: Beginning | None
    periodic: bool
    trigger: Functional | None = None


class _Stepper(SdirkStepper):
    """Keeps the DC solution with which a run begins: unknowns, multipliers, gates."""

    rest: tuple[Floats, Floats, list[bool]] | None = None

    def start_dc(self, time: float = 0.0, guess: tuple[Floats, Floats] | None = None) -> Floats:
        """Start from the static solution."""
        found = super().start_dc(time, guess)
        z, lam = self.state
        self.rest = z.copy(), lam.copy(), list(self.gates)
        return found


class SteppedRun:
    """A recorded run of one island, with sources in place of parameters.

    Parameters
    ----------
    circuit : Circuit
    mna : MnaSystem
        As it was run, each source apart.
    course : Course
    acting : Driven
        Of :func:`~nsspice.analyses.gradients.drivers.driven`.
    names : sequence of str
        Signals: the first outputs.
    marks : sequence of float
        Instants at which steps have to end [s].
    """

    def __init__(
        self,
        circuit: Circuit,
        mna: MnaSystem,
        course: Course,
        acting: Driven,
        names: Sequence[str],
        marks: Sequence[float],
    ) -> None:
        self.circuit, self.mna, self.course, self.acting = circuit, mna, course, acting
        self.periodic = course.periodic
        self._marked = _with_marks(acting, mna, marks, course)
        self._rest: tuple[Floats, Floats, list[bool]] | None = None
        record, charges = self._record()
        system, record, own = with_rates(self._marked.system, record, acting.outputs[: len(names)])
        more = system.n - charges.size
        self.tangent = Tangent(system, record, np.append(charges, np.zeros(more)))
        self.tangent.jumps[0] |= more > 0  # what has a rate begins as it is
        self.outputs = Outputs(self.tangent, own, 0)

    def _record(self) -> tuple[Intervals, Floats]:
        """Run it; return its steps, and what is stored before the beginning."""
        analysis, settings = self.course.analysis, self.course.settings
        mna, beginning = self._marked, self.course.beginning
        accuracy = Accuracy(_FINER * settings.reltol, settings.vntol, settings.abstol)
        stepper = _Stepper(mna.system, (), accuracy)
        longest = analysis.longest_step(settings.step, mna.system.timed)
        if mna.system.static:  # no error of a step says how fast it changes
            longest = min(longest, analysis.row_distance)
        stepper.record_all()
        stepper.plan(0.0, analysis.stop, longest, 0.0, analysis.stop)
        if beginning is not None:
            charges = beginning.charges
            stepper.start_charges(0.0, charges, longest)
        else:
            begun = start(self.circuit, mna, stepper, analysis, longest)
            self._rest = stepper.rest
            if begun is not None:
                charges = begun[0]
            else:
                assert self._rest is not None
                charges = stored_at(mna.system, self._rest[0])[0]
        parts, done = [], False
        while not done:
            _, done = stepper.advance(_ROWS)
            parts.append(Intervals.of(stepper.take_intervals()))
        return joined(parts), charges

    def derivatives(
        self,
        aims: Aims,
        changes: Sequence[Mapping[Any, float]],
        periods: Floats,
        parameters: Sequence[Parameter],
        tape_at: TapeAt,
    ) -> Floats:
        """Return derivatives of functionals by parameters, shape (functionals, parameters).

        ``periods`` are those of the period, or of the level that ends a free one, which is then the
        last functional.
        """
        tangent, stop = self.tangent, self.course.analysis.stop
        goal = aims.goal(tangent, self.outputs, self.mna.system.waveforms, self.periodic)
        asked, r = goal.shifts.shape[1], tangent.stored.size
        free = self.course.trigger is not None
        count = asked + free  # a free period is one more functional
        if self.periodic:
            goal = goal.widened(free + r)
        end = np.zeros((r, goal.shifts.shape[1]))
        end[:, count:] = np.eye(r)[:, : end.shape[1] - count]
        # by the instant of the end
        late = tangent.r[-1, -1, tangent.stored] @ end
        late[asked:count] = 1.0
        instant, by_level = self._instant_of_end() if free else (None, 0.0)
        ending = None if instant is None else np.outer(instant, late)
        back = Backward(tangent, self.outputs, goal, end, self.periodic, ending)
        points, turns, instants = back.points, back.turns, back.instants
        found = np.zeros((count, len(changes)))
        if self.periodic:
            mix = np.vstack([np.eye(count), self._restored(back.begin, count)])
            points = points.combined(mix)
            turns = [replace(turn, by=turn.by @ mix) for turn in turns]
            instants = [(t, by @ mix) for t, by in instants]
            # of a free period: by the level that ends it
            found += np.outer(late @ mix, by_level * periods if free else periods)
        else:
            points = self._begin(points, back.begin, changes, found)
        acts = Acting(self.acting, self.tangent, points, turns)
        for owner, driver in zip(self.acting.owners, self.acting.drivers, strict=True):
            found[:, owner] += acts(driver)
        if self.mna.system.smooth is not None:
            self._refuse_read_sources(changes)
            for j, parameter in enumerate(parameters):
                found[:, j] += acts.by_functions(parameter, tape_at)
        for k in range(count):
            own = [(t, float(by[k])) for t, by in sorted(instants, key=lambda item: item[0])]
            found[k] += moved_instants(self.mna.system.waveforms, changes, own, stop, self.periodic)
        return found

    def _instant_of_end(self) -> tuple[Floats, float]:
        """Return how the end of a free period depends on the unknowns and on its level [s]."""
        assert self.course.trigger is not None
        tangent = self.tangent
        row = np.zeros(tangent.system.n + tangent.system.m)
        for j, factor in self.course.trigger.z:
            row[j] += factor
        rate = float(row @ tangent.motion(tangent.record.begin.size - 1))
        return -row / rate, 1.0 / rate

    def _restored(self, begin: Floats, count: int) -> Floats:
        """Return derivatives by what is stored at the end of a period, shape (r, functionals)."""
        size = self.tangent.size[self.tangent.stored]
        size = np.where(size > 0.0, size, 1.0)
        # in parts of what is stored at most
        matrix = np.eye(size.size) - begin[:, count:] * size[:, np.newaxis] / size
        if size.size and not np.linalg.cond(matrix) < _UNBOUNDED:
            raise unbounded()
        scaled = begin[:, :count] * size[:, np.newaxis]
        return np.asarray(np.linalg.solve(matrix, scaled) / size[:, np.newaxis])

    def _begin(
        self,
        points: Points,
        begin: Floats,
        changes: Sequence[Mapping[Any, float]],
        found: Floats,
    ) -> Points:
        """Carry derivatives by the charges at the beginning on to what they depend on."""
        tangent, analysis = self.tangent, self.course.analysis
        if analysis.uic:
            place = {int(row): k for k, row in enumerate(tangent.stored)}
            for j, change in enumerate(changes):
                for key, d in change.items():
                    if key[0] == "charge" and key[1] in place:
                        found[:, j] += begin[place[key[1]]] * d
            return points
        if self.mna.system.static:
            return points
        if initial_voltages(self.circuit, self.mna):
            hint = "add uic to the .tran card"
            message = "the DC solution with nodes held by .ic is not differentiated"
            raise UsageError(Diagnostic("NS4041", message, hint=hint))
        assert self._rest is not None
        z, lam, gates = self._rest
        u = np.array([initial_value(wave) for wave in self._marked.system.waveforms])
        active = _conducting(self._marked, z, lam, gates)
        z = np.append(z, np.zeros(tangent.system.n - z.size))
        rest = at_rest(tangent, (z, lam, u), active, begin)
        none = np.zeros((1, points.outputs.shape[1], begin.shape[1]))
        return Points.joined([points, replace(rest, outputs=none)])

    def _refuse_read_sources(self, changes: Sequence[Mapping[Any, float]]) -> None:
        smooth = self.mna.system.smooth
        if smooth is not None and (smooth.tape.ops == CODES["source"]).any():
            for change in changes:
                if any(key[0] in ("wave", "scale") for key in change):
                    raise undone("a smooth law reads a source that depends on it", "a parameter")


def _with_marks(
    acting: Driven, mna: MnaSystem, marks: Sequence[float], course: Course
) -> MnaSystem:
    """Return an island with its stimuli, and a source of no equation that ends steps."""
    system, stop = acting.system, course.analysis.stop
    inside = sorted({t for t in marks if 0.0 < t < stop})
    S = system.S
    if inside:
        values = [0.0, 0.0]
        for k, t in enumerate(inside):
            values += [t, float((k + 1) % 2)]
        values += [2.0 * stop, 0.0]
        S = Csc((S.shape[0], S.shape[1] + 1), np.append(S.indptr, S.indptr[-1]), S.indices, S.data)
        system = replace(system, S=S, waveforms=(*system.waveforms, Waveform("pwl", tuple(values))))
    other = copy.copy(mna)
    other.system = system
    return other if course.beginning is None else with_gates(other, course.beginning.gates)


def _conducting(mna: MnaSystem, z: Floats, lam: Floats, gates: Sequence[bool]) -> Any:
    """Return the pairs that conduct in a DC solution, shape (m,)."""
    system = mna.system
    active = lam > system.q - system.B.dot(z) + system.D.dot(lam)
    for switch, gate in zip(system.switches, gates, strict=True):
        closed = gate != switch.inverted
        active[switch.pair] = (active[switch.pair] and closed) if switch.latching else closed
    return active
