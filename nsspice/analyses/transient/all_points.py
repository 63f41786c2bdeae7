"""Rows at the solver's own points and on both sides of each jump, for all islands together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...solvers.stepper import UnsolvedStep
from ..request.cards import Tran
from ..request.interrupts import Interrupts
from ..request.notebook_progress import Progress
from ..request.recorder import Recorder
from ..signals.curve import Floats
from ..solution.solution import FinePoints
from .advance import Outlet
from .island_runner import IslandRunner
from .outcomes import Stopped
from .union_of_instants import Merger, align

_ROWS = 4096  # of one island at once


def advance_points(
    runners: Sequence[IslandRunner],
    outlet: Outlet,
    analysis: Tran,
    progress: Progress | None,
    interrupts: Interrupts,
) -> bool:
    """Advance all islands from point to point; return True if Ctrl-C stopped it.

    An instant that appears twice is a jump: before and after.  Islands with other instants are
    shown there by their closed forms or the polynomials of their steps.

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
            # a block waits for those that drive it
            while (driver := runners[k].waits_for(running)) is not None:
                k = driver
            try:
                rows, done = runners[k].advance_points(_ROWS)
            except Stopped as stopped:
                rows, done, failed = stopped.rows, True, (runners[k], stopped.problem)
            curves, runners[k].curves = runners[k].curves, []
            merger.add(k, rows.copy(), curves)
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
        raise runner.failure(problem) from problem
    return False


def with_sides(
    rows_of: Sequence[Sequence[Floats]], widths: Sequence[int], recorder: Recorder, table: Floats
) -> FinePoints | None:
    """Return the rows with all points that were kept between them, None if there are none.

    An instant that appears twice among the points of an island is a jump: before and after.
    Signals of several islands are interpolated between the rows.

    Parameters
    ----------
    rows_of : sequence of sequences of ndarray
        Of each island: blocks of points, in the order of time.
    widths : sequence of int
        Number of columns that each island records.
    recorder : Recorder
    table : ndarray, shape (k, 1 + number of signals)
        The rows: time, then the signals.
    """
    points = {k: np.concatenate(blocks) for k, blocks in enumerate(rows_of) if blocks}
    if table.shape[0] < 2 or not points:
        return None
    homes, starts = recorder.homes(), np.cumsum([0, *widths])
    parts, places = [], []
    for home in sorted(set(homes.tolist())):
        columns = np.flatnonzero(homes == home)
        part = table[:, np.append(0, 1 + columns)]
        if home in points:
            wide = np.zeros((points[home].shape[0], int(starts[-1])))
            wide[:, starts[home] : starts[home + 1]] = points[home][:, 1:]
            values = recorder.signals(wide)[:, columns]
            part = _put_in(np.column_stack([points[home][:, 0], values]), part)
        parts.append(part)
        places.append(columns)
    together = align(parts)
    order = np.concatenate(places).tolist()
    names = recorder.names
    return FinePoints(together[:, 0], {names[n]: together[:, 1 + j] for j, n in enumerate(order)})


def _put_in(points: Floats, rows: Floats) -> Floats:
    """Return rows and points in the order of time; a row at a jump is the side after it."""
    time, at = rows[:, 0], points[:, 0]
    points = points[(at >= time[0]) & (at <= time[-1])]
    at = points[:, 0]
    # numpy's functions for sets would do, but they load its masked arrays, which takes longer
    first = np.diff(at, prepend=-np.inf) > 0.0
    last = np.diff(at, append=np.inf) > 0.0
    has_row = time[np.searchsorted(time, at)] == at
    before = points[first & ~(last & has_row)]
    after = points[last & ~first & ~has_row]
    everything = np.concatenate([before, rows, after])
    turn = np.repeat([0, 1, 2], [before.shape[0], rows.shape[0], after.shape[0]])
    ordered: Floats = everything[np.lexsort((turn, everything[:, 0]))]
    return ordered
