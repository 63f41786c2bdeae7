"""Rows at the solver's own points and on both sides of each jump, for all islands together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..solvers.stepper import UnsolvedStep
from .cards import Tran
from .curve import Floats
from .failure import named_failure
from .interrupts import Interrupts
from .island_runner import IslandRunner, Stopped
from .merge import Merger
from .recorder import Recorder
from .rows import Outlet, Progress
from .solution import FinePoints

_ROWS = 4096  # of one island at once


def advance_points(
    runners: Sequence[IslandRunner],
    outlet: Outlet,
    analysis: Tran,
    progress: Progress | None,
    interrupts: Interrupts,
) -> bool:
    """Advance all islands from point to point; return True if Ctrl-C stopped it.

    An instant that stands twice is a jump: before and after.  Islands with other instants are
    interpolated there.

    Raises
    ------
    NumericalError
        The earliest failure of any island, after the rows before it.
    """
    merger = Merger([1 + runner.width for runner in runners])
    running = set(range(len(runners)))
    failed: tuple[IslandRunner, UnsolvedStep] | None = None
    try:
        while running:
            # the island that is behind goes next, so that little waits
            k = min(running, key=merger.reached)
            try:
                rows, done = runners[k].advance_points(_ROWS)
            except Stopped as stopped:
                rows, done, failed = stopped.rows, True, (runners[k], stopped.problem)
            merger.add(k, rows.copy())
            if failed is not None:
                break
            if done:
                running.remove(k)
                merger.end(k)
            outlet.write(merger.take())
            interrupts.check()
            if progress is not None:
                progress(min(1.0, min(runner.stepper.time for runner in runners) / analysis.stop))
    except KeyboardInterrupt:
        outlet.write(merger.take())
        return True
    outlet.write(merger.take())
    if failed is not None:
        runner, problem = failed
        raise named_failure(runner.circuit, runner.mna, problem) from problem
    return False


def with_sides(
    rows_of: Sequence[Sequence[Floats]], widths: Sequence[int], recorder: Recorder, table: Floats
) -> FinePoints | None:
    """Return the rows of a solution with both sides of all jumps put in; None without jumps.

    A signal of an island that does not jump at an instant, or of several islands, is interpolated
    there.

    Parameters
    ----------
    rows_of : sequence of sequences of ndarray
        Of each island: blocks of rows around jumps, before, after, before, after ...
    widths : sequence of int
        Number of columns that each island records.
    recorder : Recorder
    table : ndarray, shape (k, 1 + number of signals)
        The rows: time, then the signals.
    """
    sides = {k: np.concatenate(blocks) for k, blocks in enumerate(rows_of) if blocks}
    if table.shape[0] < 2 or not sides:
        return None
    time = table[:, 0]
    sides = {k: rows[_between(rows[:, 0], time)] for k, rows in sides.items()}
    # numpy's functions for sets would do, but they load its masked arrays, which takes longer
    instants = np.sort(np.concatenate([rows[:, 0] for rows in sides.values()]))
    instants = instants[np.diff(instants, prepend=-np.inf) > 0.0]
    before = np.column_stack([instants, *(np.interp(instants, time, y) for y in table.T[1:])])
    after = before.copy()
    homes = recorder.homes()
    starts = np.cumsum([0, *widths])
    for k, rows in sides.items():
        wide = np.zeros((rows.shape[0], int(starts[-1])))
        wide[:, starts[k] : starts[k + 1]] = rows[:, 1:]
        values = recorder.signals(wide)
        places = np.searchsorted(instants, rows[::2, 0])
        for column in np.flatnonzero(homes == k):
            before[places, 1 + column] = values[::2, column]
            after[places, 1 + column] = values[1::2, column]
    # a row at an instant is the one after the jump
    after = after[time[np.searchsorted(time, instants)] != instants]
    everything = np.concatenate([before, table, after])
    turn = np.repeat([0, 1, 2], [before.shape[0], table.shape[0], after.shape[0]])
    everything = everything[np.lexsort((turn, everything[:, 0]))]
    names = recorder.names
    return FinePoints(everything[:, 0], {n: everything[:, 1 + j] for j, n in enumerate(names)})


def _between(instants: Floats, time: Floats) -> npt.NDArray[np.bool_]:
    """Return which instants lie within the rows."""
    inside: npt.NDArray[np.bool_] = (instants >= time[0]) & (instants <= time[-1])
    return inside
