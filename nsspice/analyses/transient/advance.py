"""The loop that advances all islands by the same rows, and where the rows go."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...solvers.stepper import UnsolvedStep
from ..certificate.copied_rows import CopiedRows
from ..certificate.written_rows import WrittenRows
from ..request.cards import Tran
from ..request.interrupts import Interrupts
from ..request.notebook_progress import Progress
from ..request.recorder import Recorder
from ..request.row_sinks import Sink, Store
from ..signals.curve import Floats
from .handover_to_steps import Race
from .island_runner import IslandRunner
from .outcomes import Stopped

#: most numbers in one block: it should stay in the cache, and reach the file before Ctrl-C has to
#: wait.  Blocks that depended on the clock would leave other last digits in each run: rows of an
#: exact segment are computed together, as far as a block goes.
_BLOCK = 1 << 17


class Outlet:
    """Turns recorded columns into signals and hands them on."""

    def __init__(self, recorder: Recorder, store: Store, sink: Sink | None, keep: bool) -> None:
        self.recorder, self.store, self.sink, self.keep = recorder, store, sink, keep
        #: takes notice of rows that are not kept
        self.watch: Callable[[Floats], None] | None = None
        #: compare recorded columns with what steppers show of them
        self.copies: list[CopiedRows] = []
        #: judges rows as they are written
        self.judge: WrittenRows | None = None
        #: instants at which rows are limits of short steps after a jump: these keep no law exactly
        self.limits: Callable[[], Floats] = lambda: np.zeros(0)
        self.rows = 0

    @property
    def table(self) -> Floats:
        """The rows kept."""
        return self.store.table

    def room(self, rows: int) -> Floats | None:
        """Return the place of the next rows in the table, None if they cannot be made there."""
        return self.store.room(rows) if self.keep and self.recorder.direct else None

    def write(self, block: Floats, placed: bool = False) -> None:
        """Take complete rows: time, then the recorded columns; ``placed`` in what ``room`` gave."""
        if block.shape[0] == 0:
            return
        for copy in self.copies:
            copy.take(block)
        if not self.recorder.direct:
            block = np.column_stack([block[:, 0], self.recorder.signals(block[:, 1:])])
        if placed:
            self.store.filled += block.shape[0]
        elif self.keep:
            self.store.write(block)
        else:
            self._keep_ends(block)
        if self.judge is not None:
            limits = self.limits()
            kept = block[~np.isin(block[:, 0], limits)] if limits.size else block
            self.judge.take(kept)
        self.rows += block.shape[0]
        if self.sink is not None:
            self.sink.write(block)
        if self.watch is not None:
            self.watch(block)

    def _keep_ends(self, block: Floats) -> None:
        """Keep the first row of all and the last one so far."""
        if self.rows == 0:
            self.store.write(block[:1])
            block = block[1:]
        if block.shape[0]:
            self.store.filled = 1
            self.store.write(block[-1:])


def advance_all(
    runners: list[IslandRunner],
    races: Sequence[Race | None],
    outlet: Outlet,
    rows: int,
    analysis: Tran,
    progress: Progress | None,
    interrupts: Interrupts,
) -> bool:
    """Advance all islands by blocks of rows; return True if Ctrl-C stopped it.

    A runner that has lost its race is replaced.

    A failed step or Ctrl-C ends it with the rows that all islands have.

    Raises
    ------
    NumericalError
        The earliest failure of any island.
    """
    width = 1 + outlet.recorder.recorded
    most = max(1, _BLOCK // width)
    # one buffer for all blocks: the first touch of fresh memory costs more than filling it
    buffer = np.empty((min(most, rows) if len(runners) > 1 else 0, width))
    while outlet.rows < rows:
        want = min(most, rows - outlet.rows)
        if len(runners) == 1:
            room = outlet.room(want)
            block, failed = _pass_on(runners[0], want, analysis, progress, room)
            outlet.write(block, room is not None)
            if failed is None:
                _race(runners, races, 0, block, interrupts)
        else:
            block, got = buffer[:want], [0] * len(runners)
            try:
                failed = _fill(runners, races, block, got, analysis, progress, interrupts)
            except KeyboardInterrupt:
                outlet.write(block[: min(got)])
                return True
            outlet.write(block[: min(got)])
        if failed is not None:
            runner, problem = failed
            raise runner.failure(problem) from problem
        if progress is not None:
            progress(outlet.rows / rows)
        interrupts.check()
    return False


def _pass_on(
    runner: IslandRunner,
    want: int,
    analysis: Tran,
    progress: Progress | None,
    room: Floats | None,
) -> tuple[Floats, tuple[IslandRunner, UnsolvedStep] | None]:
    """Return the next rows of the only island as they come, without copying them."""
    try:
        block, failed = runner.advance(want, room), None
    except Stopped as stopped:
        block, failed = stopped.rows, (runner, stopped.problem)
    if progress is not None and block.shape[0] == 0:
        progress(runner.stepper.time / analysis.stop)
    return block, failed


def _race(
    runners: list[IslandRunner],
    races: Sequence[Race | None],
    k: int,
    block: Floats,
    interrupts: Interrupts,
) -> None:
    """Replace a runner whose race is lost, after a block of its rows."""
    race = races[k]
    if race is not None:
        runners[k] = race.after(runners[k], block.shape[0], interrupts.check) or runners[k]


def _fill(
    runners: list[IslandRunner],
    races: Sequence[Race | None],
    block: Floats,
    got: list[int],
    analysis: Tran,
    progress: Progress | None,
    interrupts: Interrupts,
) -> tuple[IslandRunner, UnsolvedStep] | None:
    """Let every island compute its columns of a block; ``got`` counts its rows.

    Where an island fails, those after it go no further than its last row.
    """
    want, left = block.shape[0], 1
    failed = None
    for k in range(len(runners)):
        columns = slice(left, left + runners[k].width)
        while got[k] < want:
            runner = runners[k]
            try:
                part = runner.advance(want - got[k])
            except Stopped as stopped:
                part, failed = stopped.rows, (runner, stopped.problem)
                want = got[k] + part.shape[0]
            rows = slice(got[k], got[k] + part.shape[0])
            block[rows, 0] = part[:, 0]
            block[rows, columns] = part[:, 1:]
            got[k] += part.shape[0]
            if failed is None:
                _race(runners, races, k, part, interrupts)
            interrupts.check()
            if progress is not None and part.shape[0] == 0:
                progress(runner.stepper.time / analysis.stop)
        left = columns.stop
    return failed
