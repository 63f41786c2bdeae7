"""Handing a run over to steps with error control where closed forms have too many ends.

The exact engine follows each event: ringing at gigahertz that a diode rectifies has ten million of
them.  When a run has become long, and each time that its work has doubled, steps with error control
follow the same island from its begin with a part of that work.  Where they catch up they go on in
its place, where they do not come three quarters as far the race is over.  Their run is whole and
certified as such; rows that have been shown stay as they are.
Work is counted, not timed, so that the result does not depend on the machine.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import NsspiceError
from ...solvers.modewise import ModewiseStepper
from ..signals.curve import Floats
from .island_runner import IslandRunner
from .outcomes import Stopped

#: Part of the work of the exact engine that steps get.  Closed forms are known to rounding, so that
#: steps have to be cheaper by far; and a race that is lost takes no more than this part of a run.
_SHARE = 1 / 8


class Race:
    """Steps against the exact engine, for one island.

    Parameters
    ----------
    begin : callable
        Returns a runner of the same island by steps, which has not been started.
    """

    def __init__(self, begin: Callable[[], IslandRunner]) -> None:
        self._begin: Callable[[], IslandRunner] | None = begin
        self._steps: IslandRunner | None = None
        self._doublings = 0.0
        self._shown = self._reached = 0
        self._last: Floats = np.empty((0, 0))

    def after(
        self, runner: IslandRunner, rows: int, check: Callable[[], None]
    ) -> IslandRunner | None:
        """Return the runner that takes over from one by the exact engine, if any.

        Parameters
        ----------
        runner : IslandRunner
        rows : int
            How many it has just shown.
        check : callable
            Called now and then; may raise what ends the run.
        """
        self._shown += rows
        if self._begin is None or not isinstance(runner.stepper, ModewiseStepper):
            return None
        statistics = runner.stepper.statistics
        if statistics["doublings"] == self._doublings:
            return None
        self._doublings = statistics["doublings"]
        work = _SHARE * statistics["work"]
        try:
            if self._steps is None:
                self._steps = self._begin()
                self._steps.start()
            if not self._come(self._steps, 3 * (self._shown + 1) // 4, work, check):
                self._begin = None  # far behind, as it will be
                return None
            if not self._come(self._steps, self._shown + 1, work, check):
                return None
        except (Stopped, NsspiceError):
            self._begin = None  # the exact engine is alone
            return None
        now, steps = runner.stepper.time, self._steps
        steps.take_over(runner, self._last)
        spent, segments = int(steps.stepper.statistics["steps"]), int(statistics["segments"])
        steps.note = f"{spent} steps have overtaken {segments} closed forms at {now:.3g} s"
        self._begin = None
        return steps

    def _come(self, steps: IslandRunner, rows: int, work: float, check: Callable[[], None]) -> bool:
        """Return whether steps come to so many rows with so much work."""
        while self._reached < rows:
            if steps.stepper.statistics["steps"] > work:
                return False
            block = steps.advance(rows - self._reached)
            self._reached += block.shape[0]
            if block.shape[0]:
                self._last = block[-1:].copy()
            check()
        return steps.stepper.statistics["steps"] <= work
