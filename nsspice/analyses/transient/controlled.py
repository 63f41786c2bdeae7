"""Runs with digital controllers: islands wait at sampling instants until sources are set.

Sources that a controller sets are held values which are known up to the next instant at which
anything is sampled; an engine goes no further than its sources are known.  An island without such a
source waits for a clock, a source that nothing contains.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate

import numpy as np

from ...errors import Diagnostic, UsageError
from ..request.cards import Tran
from ..request.interrupts import Interrupts
from ..request.notebook_progress import Progress
from ..request.recorder import Recorder
from ..signals.curve import Floats
from .advance import Outlet
from .delays import Delays
from .island_runner import IslandRunner
from .memory import Memory
from .outcomes import Stopped
from .schedule import Schedule

#: rows of one island that are computed in one call
_ROWS = 512
#: waits until the records of islands are looked at
_OFTEN = 64


def started(
    schedule: Schedule, prepare: Callable[[], list[IslandRunner]], recorder: Recorder
) -> list[IslandRunner]:
    """Return the runners of all islands after their start.

    A controller that is called at t = 0 reads what the run begins with; a new run then begins,
    with what it has set as an edge of its sources at t = 0.
    """
    sources, memory = schedule.sources, schedule.memory
    if memory is not None:  # what has been read at the end of the period before
        schedule.call(0.0, lambda: memory.reads)
    elif schedule.starts_with_a_sample:
        before = dict(sources.values)
        sources.hold(schedule.stop)
        sampler = Sampler(_begun(prepare), recorder, schedule.reads)
        schedule.call(0.0, lambda: sampler(begin=True))
        sources.renew(before)
    schedule.go_on()
    return _begun(prepare)


def _begun(prepare: Callable[[], list[IslandRunner]]) -> list[IslandRunner]:
    runners = prepare()
    for runner in runners:
        runner.start()
    return runners


def advance_controlled(
    runners: Sequence[IslandRunner],
    schedule: Schedule,
    outlet: Outlet,
    analysis: Tran,
    progress: Progress | None,
    interrupts: Interrupts,
    delays: Delays | None = None,
) -> bool:
    """Advance all islands from instant to instant; return True if Ctrl-C stopped it.

    Raises
    ------
    NumericalError
        The failure of an island.
    """
    waiting = [_Rows(runner.width) for runner in runners]
    lanes = list(zip([runner.stepper for runner in runners], runners, waiting, strict=True))
    sampler = Sampler(runners, outlet.recorder, schedule.reads)
    sources, turn = schedule.sources, 0
    while True:
        failed, late = None, False
        turn += 1
        for stepper, runner, rows in lanes:
            # most waits come without a row: records are handed over now and then
            if turn % _OFTEN and stepper.to_the_wait():
                continue
            late = True
            try:
                to_the_wait(runner, rows.take, interrupts)
            except Stopped as stopped:
                rows.take(stopped.rows)
                failed = failed or (runner, stopped.problem)
        if late and (count := min(rows.count for rows in waiting)):
            parts = [rows.give(count) for rows in waiting]
            block = np.hstack([parts[0], *(part[:, 1:] for part in parts[1:])])
            outlet.write(np.ascontiguousarray(block))
            if progress is not None:
                progress(sources.known / analysis.stop)
        if failed is not None:
            runner, problem = failed
            raise runner.failure(problem) from problem
        interrupts.check()
        time = sources.known
        if delays is not None and delays.known < min(time, analysis.stop):
            before = delays.known
            delays.hand_over(runners)
            assert delays.known > before, "a step as long as a delay waits for itself"
            continue
        if time >= analysis.stop:
            return False
        schedule.call(time, sampler)
        schedule.go_on()


def advance_a_period(
    runners: Sequence[IslandRunner], schedule: Schedule, recorder: Recorder, period: float
) -> Memory:
    """Advance all islands by a period [s]; return what is remembered there.

    Raises
    ------
    Stopped
        Where a step has no solution.
    """
    sampler = Sampler(runners, recorder, schedule.reads)
    while True:
        for runner in runners:
            while not runner.stepper.to_the_wait():
                runner.advance(_ROWS)
                if runner.stepper.waits:
                    break
        time = schedule.sources.known
        if time >= period:
            return schedule.memory_at(time, sampler())
        schedule.call(time, sampler)
        schedule.go_on()


class _Rows:
    """Rows of one island that wait for those of the others."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._parts: list[Floats] = []
        self.count = 0

    def take(self, rows: Floats) -> None:
        """Keep rows; they are copied, since engines use their buffers again."""
        if rows.shape[0]:
            self._parts.append(rows.copy())
            self.count += rows.shape[0]

    def give(self, count: int) -> Floats:
        """Return the first rows."""
        rows = self._parts[0] if len(self._parts) == 1 else np.concatenate(self._parts)
        rest = rows[count:]
        self._parts, self.count = [rest] if rest.size else [], rest.shape[0]
        return rows[:count]


def to_the_wait(
    runner: IslandRunner, take: Callable[[Floats], None], interrupts: Interrupts
) -> None:
    """Advance an island to where it waits, or to its end; its rows are taken as they come."""
    stepper = runner.stepper
    while True:
        take(runner.advance(_ROWS))
        if stepper.waits or stepper.done:
            return
        interrupts.check()


class Sampler:
    """Samples signals where a run waits.

    Parameters
    ----------
    runners : sequence of IslandRunner
    recorder : Recorder
    names : sequence of str
        Of the signals.
    """

    def __init__(
        self, runners: Sequence[IslandRunner], recorder: Recorder, names: Sequence[str]
    ) -> None:
        self._steppers = [runner.stepper for runner in runners]
        homes = [k for k, local in enumerate(recorder.local) for _ in local]
        found = [recorder.terms(name) for name in names]
        self._recorder, self._names = recorder, names
        #: the sums of recorded columns, None if there are powers among the signals
        self._sums = None if None in found else [terms for terms in found if terms is not None]
        used = range(len(homes)) if self._sums is None else {k for s in self._sums for k, _ in s}
        #: the islands that are asked
        self._homes = sorted({homes[k] for k in used})
        # the rows of these islands one after the other, each with the time first
        starts = list(accumulate(map(len, recorder.local), initial=0))
        shown: list[int] = []
        for home in self._homes:
            shown += [-1, *range(starts[home], starts[home + 1])]
            shown += [-1] * (self._steppers[home].columns - 1 - len(recorder.local[home]))
        self._shown, self._place = shown, {k: j for j, k in enumerate(shown)}
        #: the places of signals that are a column each
        self._columns: list[int] | None = None
        if self._sums is not None and all(len(s) == 1 and s[0][1] == 1.0 for s in self._sums):
            self._columns = [self._place[s[0][0]] for s in self._sums]

    def __call__(self, begin: bool = False) -> list[float]:
        """Return the values at the begin of a run, or just before the instant at which it waits.

        Raises
        ------
        UsageError
            NS4005 if the run begins with implicit steps.
        """
        row: list[float] = []
        for home in self._homes:
            part = self._steppers[home].at_wait(begin)
            if part is None:
                message = "the run begins with implicit steps: nothing can be sampled at t = 0"
                hint = "give the controller an offset"
                raise UsageError(Diagnostic("NS4005", message, hint=hint))
            row += part
        if self._columns is not None:
            return [row[k] for k in self._columns]
        if self._sums is not None:
            return [sum(f * row[self._place[k]] for k, f in terms) for terms in self._sums]
        recorded = [v for v, k in zip(row, self._shown, strict=True) if k >= 0]
        values = self._recorder.signals(np.array([recorded]))[0].tolist()
        return [values[self._recorder.names.index(name)] for name in self._names]
