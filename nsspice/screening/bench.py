"""Runs of one deck without some effects, side by side, and how far their measures differ."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context

from ..errors import Diagnostic, UsageError
from ..netlist.deck import Deck
from .comparison_basis import sizes
from .edits import Edit
from .trial import Trial, attempt

#: a run is given up after so many times what that of the whole deck took, but not before [s]
_SLOWER = 3.0
_SOON = 2.0


class _Here(Executor):
    """Runs in this process: for one worker, and where processes cost more than they gain."""

    def submit(self, fn, /, *args, **kwargs):  # type: ignore[no-untyped-def]
        future: Future[Trial] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except BaseException as error:
            future.set_exception(error)
            raise
        return future


def pool_of(workers: int) -> Executor:
    """Return what makes so many runs side by side."""
    return _Here() if workers <= 1 else ProcessPoolExecutor(workers, get_context("spawn"))


class Bench:
    """Runs of one deck without some effects, each made once."""

    def __init__(self, deck: Deck, pool: Executor) -> None:
        self.deck, self.pool = deck, pool
        self.trials: dict[frozenset[Edit], Trial] = {}

    @property
    def whole(self) -> Trial:
        """The deck as it is, which is run first."""
        return self.trials[frozenset()]

    def run(self, sets: Sequence[frozenset[Edit]], diodes: Sequence[str] = ()) -> list[Trial]:
        """Run what has not been run, side by side; note the largest currents of some diodes."""
        todo = [s for s in dict.fromkeys(sets) if s not in self.trials]
        limit = math.inf
        if self.trials:
            limit = max(_SLOWER * self.whole.seconds, _SOON)
        same = ([x] * len(todo) for x in (limit, tuple(diodes)))
        for trial in self.pool.map(attempt, [self.deck] * len(todo), todo, *same):
            self.trials[trial.dropped] = trial
        return [self.trials[s] for s in sets]

    def begin(self, diodes: Sequence[str] = ()) -> None:
        """Run the deck as it is; note the largest currents of some diodes.

        Raises
        ------
        UsageError
            NS4040 if that is not possible.
        """
        (whole,) = self.run([frozenset()], diodes)
        if whole.problem:
            raise UsageError(
                Diagnostic(
                    "NS4040",
                    f"the deck itself cannot be used as a reference: {whole.problem}",
                    hint="nsspice run it first",
                )
            )

    def change(self, trial: Trial) -> tuple[float, str]:
        """Return the largest relative change of a measure, and which it is."""
        reference = self.whole.values
        scales, others = sizes(reference), sizes(trial.values)
        worst, name = 0.0, ""
        for key, value in reference.items():
            other = trial.values.get(key, math.nan)
            if math.isnan(value) and math.isnan(other):
                continue
            size = max(scales[key], others.get(key, 0.0))
            part = 0.0 if size == 0.0 else abs(other - value) / size
            if not part <= worst:
                worst, name = (math.inf if math.isnan(part) else part), key
        return worst, name
