"""The checks of rows: what is written, and both sides of jumps, by the laws of the deck."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ..certificate.copied_rows import CopiedRows
from ..certificate.node_reach import NodeReach
from ..certificate.written_rows import TOLERANCE, Violation
from ..request.recorder import Recorder
from ..signals.curve import Floats
from .advance import Outlet
from .island_runner import IslandRunner


def violations(
    outlet: Outlet, runners: Sequence[IslandRunner], begun: Sequence[IslandRunner]
) -> tuple[list[Violation], list[Violation]]:
    """Return what the rows have shown: worst errors of laws, and of set-valued elements.

    Where a runner has taken over from one that had ``begun``, not all rows are known.
    """
    table, recorder = outlet.judge, outlet.recorder
    sampled = joined(unwatched(runner) for runner in runners)
    # rows of steps with error control are interpolated, smooth laws are solved by iteration
    near = (r.method == "sdirk" or r.mna.system.smooth is not None for r in runners)
    granted = [
        runner.settings.reltol if loose else TOLERANCE
        for runner, loose in zip(runners, near, strict=True)
    ]
    if table is None:
        found = []
    else:
        found = [table.worst(sampled, max(granted, default=TOLERANCE))]
        for runner, names in zip(runners, recorder.local, strict=True):
            # steps end next to the instants that they look for, which are known less well than rows
            if runner.sides and runner.method == "modewise":
                beside = table.beside(names)
                beside.take(np.concatenate(runner.sides))
                found.append(beside.worst(sampled))
    copies = [copy.worst() for copy in outlet.copies] if list(runners) == list(begun) else []
    return [*(law for law, _ in found), *copies], [pair for _, pair in found]


def unwatched(runner: IslandRunner) -> tuple[str, ...] | None:
    """Return the switches that are sampled; None for all, late at the ends of fixed steps."""
    moreau, steps = runner.method == "moreau", runner.stepper.statistics.get("fixed_steps")
    return None if (runner.all_points if moreau else steps) else tuple(runner.sampled)


def joined(parts: Iterable[tuple[str, ...] | None]) -> list[str] | None:
    """Return the switches of all islands that are not judged by rows; None if that is all.

    Examples
    --------
    >>> joined([("s1",), ()]), joined([("s1",), None])
    (['s1'], None)
    """
    found = list(parts)
    if None in found:
        return None
    return [name for names in found if names is not None for name in names]


def limits(runners: Sequence[IslandRunner]) -> Floats:
    """Return the instants so far at which rows are limits of short steps [s].

    Those of jumps that steps have found, and the start of an exact run that begins with a step.
    """
    found: list[float] = []
    for runner in runners:
        stats = runner.stepper.statistics
        if runner.method == "modewise":
            found += [0.0] if stats["fixed_steps"] else []
        elif stats.get("jumps"):
            found += [jump.time for jump in runner.stepper.jumps if jump.length > 0.0]
    return np.array(found)


def copies_of(
    runners: Sequence[IslandRunner], recorder: Recorder, reach: NodeReach
) -> list[CopiedRows]:
    """Return what compares the rows of each island with what its stepper reports of them."""
    out, first = [], 1
    for runner, names in zip(runners, recorder.local, strict=True):
        out.append(CopiedRows(runner.stepper, first, names, reach))
        first += len(names)
    return out
