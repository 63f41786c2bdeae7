"""The loop that advances all islands by the same rows, and where the rows go."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence

import numpy as np

from .cards import Tran
from .curve import Floats
from .failure import named_failure
from .island_runner import IslandRunner, Stopped
from .recorder import Recorder
from .sink import Sink, Store

#: Called with the finished share of the run, 0 to 1.
Progress = Callable[[float], None]

_CHUNK_TIME = 0.1  # [s] aim for one block of rows
_CHUNK_NUMBERS = 1 << 20  # most numbers in one block


class Outlet:
    """Turns recorded columns into signals and hands them on."""

    def __init__(self, recorder: Recorder, store: Store, sink: Sink | None, keep: bool) -> None:
        self.recorder, self.store, self.sink, self.keep = recorder, store, sink, keep
        self.rows = 0

    @property
    def table(self) -> Floats:
        """The rows kept."""
        return self.store.table

    def write(self, block: Floats) -> None:
        """Take complete rows: time, then the recorded columns."""
        if block.shape[0] == 0:
            return
        if not self.recorder.direct:
            block = np.column_stack([block[:, 0], self.recorder.signals(block[:, 1:])])
        if self.keep:
            self.store.write(block)
        else:
            self._keep_ends(block)
        self.rows += block.shape[0]
        if self.sink is not None:
            self.sink.write(block)

    def _keep_ends(self, block: Floats) -> None:
        """Keep the first row of all and the last one so far."""
        if self.rows == 0:
            self.store.write(block[:1])
            block = block[1:]
        if block.shape[0]:
            self.store.filled = 1
            self.store.write(block[-1:])


def advance_all(
    runners: Sequence[IslandRunner],
    outlet: Outlet,
    rows: int,
    analysis: Tran,
    progress: Progress | None,
) -> bool:
    """Advance all islands by blocks of rows; return True if Ctrl-C stopped it.

    A failed step or Ctrl-C ends it with the rows that all islands have.
    """
    width = 1 + outlet.recorder.recorded
    most = max(1, _CHUNK_NUMBERS // width)
    size = min(most, 256)
    while outlet.rows < rows:
        want = min(size, rows - outlet.rows)
        block = np.empty((want, width))
        got = [0] * len(runners)
        begin = clock.perf_counter()
        try:
            _fill(runners, block, got, analysis, progress)
        except KeyboardInterrupt:
            outlet.write(block[: min(got)])
            return True
        except Stopped as stopped:
            k = next(j for j, g in enumerate(got) if g < want)
            _put(block, runners, k, got, stopped.rows)
            outlet.write(block[: got[k]])
            runner = runners[k]
            raise named_failure(runner.circuit, runner.mna, stopped.problem) from stopped.problem
        outlet.write(block)
        if progress is not None:
            progress(outlet.rows / rows)
        spent = clock.perf_counter() - begin
        if spent < _CHUNK_TIME / 2.0:
            size = min(most, 2 * size)
        elif spent > 2.0 * _CHUNK_TIME:
            size = max(1, size // 2)
    return False


def _fill(
    runners: Sequence[IslandRunner],
    block: Floats,
    got: list[int],
    analysis: Tran,
    progress: Progress | None,
) -> None:
    """Let every island compute its columns of a block; ``got`` counts its rows."""
    for k, runner in enumerate(runners):
        while got[k] < block.shape[0]:
            part = runner.advance(block.shape[0] - got[k])
            _put(block, runners, k, got, part)
            if progress is not None and part.shape[0] == 0:
                progress(runner.stepper.time / analysis.stop)


def _put(
    block: Floats, runners: Sequence[IslandRunner], k: int, got: list[int], part: Floats
) -> None:
    """Write rows of island k into its columns."""
    first, last = got[k], got[k] + part.shape[0]
    left = 1 + sum(r.width for r in runners[:k])
    block[first:last, 0] = part[:, 0]
    block[first:last, left : left + part.shape[1] - 1] = part[:, 1:]
    got[k] = last
