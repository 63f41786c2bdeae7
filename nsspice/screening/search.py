"""Running a deck without its effects: each alone, each on the ideal circuit, then greedily."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor

from ..circuit import Circuit, build
from ..netlist.deck import Deck
from .bench import Bench, pool_of
from .candidates import candidates
from .comparison_basis import beginning, prepared
from .edits import Edit, without
from .line_fit import junction_diodes, straight
from .result import EffectRow, EffectsReport, Verdict
from .trial import Trial

Progress = Callable[[str, float], None]

#: leaving an effect out must save this part of the time to be worth a change of the results
_WORTH = 1.1
#: a search that would take longer than this [s] compares the beginning of the run
_PATIENCE = 60.0


def effects(
    circuit: Circuit,
    tol: float = 1e-3,
    *,
    drop: Iterable[str] = (),
    workers: int | None = None,
    progress: Progress | None = None,
) -> EffectsReport:
    """Find out which effects of a deck matter for its measures, and what they cost.

    The deck is run as it is, without each effect, and with each effect alone on the circuit without
    any.  Then effects are removed one after the other, the largest saving per change first, while
    the measures stay within ``tol`` of those of the whole deck; those that save nothing are put
    back.  Every recommended combination has been run.

    Parameters
    ----------
    circuit : Circuit
        With a ``.tran`` card.  Its ``.measure`` cards are compared; without any, averages and
        extremes of the saved signals over the last whole periods of the sources.
    tol : float
        Largest relative change of a measure.
    drop : iterable of str
        Elements to try as open circuits in addition to those found.
    workers : int, optional
        Processes; all cores by default.
    progress : callable, optional
        Called with the next run and the fraction completed, 0 to 1.

    Returns
    -------
    EffectsReport

    Raises
    ------
    UsageError
        NS4040 if there is no transient, or the deck itself cannot be run.

    Examples
    --------
    >>> import nsspice
    >>> deck = '''charger
    ... V1 a 0 SIN(0 10 50)
    ... D1 a b DM
    ... C1 b 0 1m IC=0 Lser=1n
    ... R1 b 0 10
    ... .model DM D(Vfwd=0.7)
    ... .tran 0.1m 40m uic
    ... .measure tran mean AVG v(b) FROM=20m TO=40m
    ... '''
    >>> report = effects(nsspice.read(deck), 1e-3, workers=1)
    >>> [row.edit.name for row in report.rows if row.change > 1e-3]
    ['model dm: forward drop']
    """
    deck = prepared(circuit)
    edits = candidates(circuit, drop, tol)
    say = progress or (lambda what, share: None)
    count = os.cpu_count() or 1 if workers is None else workers
    with pool_of(count) as pool:
        return _Search(deck, edits, tol, pool, say, max(count, 1)).report()


class _Search:
    """The trials of one deck; what is known is kept if Ctrl-C ends it."""

    def __init__(
        self,
        deck: Deck,
        edits: Sequence[Edit],
        tol: float,
        pool: Executor,
        say: Progress,
        workers: int,
    ) -> None:
        self.edits, self.tol, self.pool, self.say = list(edits), tol, pool, say
        #: runs of the deck to its end, and those in which effects are compared
        self.full = self.bench = Bench(deck, pool)
        self.workers = workers
        self.compared = math.inf
        self.recommended: frozenset[Edit] = frozenset()
        self.interrupted = False

    def report(self) -> EffectsReport:
        """Make all runs and return what they have shown."""
        self.say("the deck as it is", 0.0)
        circuit = build(self.full.deck)
        self.full.begin([d.name for d in junction_diodes(circuit)])
        self.edits += straight(circuit, self.full.whole.largest)
        self.cut()
        every = frozenset(self.edits)
        try:
            self.say("each effect left out", 0.1)
            self.run([frozenset([e]) for e in self.edits])
            self.say("each effect alone", 0.5)
            (ideal,) = self.run([every])
            if not ideal.problem and _WORTH * ideal.seconds < self.bench.whole.seconds:
                self.run([every - {e} for e in self.edits])
            self.say("combinations", 0.8)
            found = self.restored(self.greedy())
            self.say("the recommended deck", 0.9)
            self.recommended = self.confirmed(found)
        except KeyboardInterrupt:
            self.interrupted = True
        return self.summary()

    def cut(self) -> None:
        """Compare effects in the beginning alone if whole runs would take too long."""
        runs = 2.0 * len(self.edits) / self.workers
        expected = runs * self.full.whole.seconds
        if expected <= _PATIENCE:
            return
        found = beginning(build(self.full.deck), _PATIENCE / expected)
        if found is not None:
            deck, self.compared = found
            self.bench = Bench(deck, self.pool)
            self.bench.begin()

    def confirmed(self, dropped: frozenset[Edit]) -> frozenset[Edit]:
        """Return those effects without which a run to the end is within the tolerance as well.

        What changes most in the beginning comes back first, half of the effects at a time.
        """
        if self.full is self.bench:
            return dropped
        change = {e: self.change(self.bench.trials[frozenset([e])])[0] for e in dropped}
        rest = sorted(dropped, key=lambda e: (change[e], e.name))
        while rest:
            (trial,) = self.full.run([frozenset(rest)])
            if not trial.problem and self.full.change(trial)[0] <= self.tol:
                break
            rest = rest[: len(rest) // 2]
        return frozenset(rest)

    def run(self, sets: Sequence[frozenset[Edit]]) -> list[Trial]:
        """Run what has not been run, side by side."""
        return self.bench.run(sets)

    def change(self, trial: Trial) -> tuple[float, str]:
        """Return the largest relative change of a measure, and which it is."""
        return self.bench.change(trial)

    def admissible(self, trial: Trial) -> bool:
        """Return whether a trial is within the tolerance."""
        return not trial.problem and self.change(trial)[0] <= self.tol

    def greedy(self) -> frozenset[Edit]:
        """Leave effects out one after the other, the largest saving per change first."""
        whole = self.bench.whole
        order = []
        for edit in self.edits:
            trial = self.bench.trials[frozenset([edit])]
            if self.admissible(trial):
                saved = max(whole.seconds / trial.seconds - 1.0, 0.0)
                order.append((self.change(trial)[0] / (saved + 1e-3), edit))
        order.sort(key=lambda pair: pair[0])
        rest = [edit for _, edit in order]
        # most effects of a realistic deck change nothing: all together first, then halves
        return self._dropped(frozenset(), rest)

    def _dropped(self, base: frozenset[Edit], edits: list[Edit]) -> frozenset[Edit]:
        """Return ``base`` with as many of the effects as the tolerance allows."""
        if not edits:
            return base
        (trial,) = self.run([base | frozenset(edits)])
        if self.admissible(trial):
            return trial.dropped
        if len(edits) == 1:
            return base
        half = len(edits) // 2
        return self._dropped(self._dropped(base, edits[:half]), edits[half:])

    def restored(self, dropped: frozenset[Edit]) -> frozenset[Edit]:
        """Take back what saves nothing in the end: for a free effect no result should change.

        Where it saves nothing alone, either, it stays in as well; but leaving several out together
        may be what lets another method run, so that the whole is compared with each.
        """
        dropped -= self.void(dropped)
        trials = self.run([dropped, *(dropped - {e} for e in dropped)])[1:]
        now = self.bench.trials[dropped]
        free = [
            e
            for e, trial in zip(dropped, trials, strict=True)
            if not trial.problem and trial.seconds < _WORTH * now.seconds
        ]
        back = dropped - frozenset(free)
        if not free:
            return dropped
        (trial,) = self.run([back])
        good = self.admissible(trial) and trial.seconds < _WORTH * now.seconds
        return back if good else dropped

    def void(self, dropped: frozenset[Edit]) -> frozenset[Edit]:
        """Return edits of what other edits have removed altogether."""
        opened = frozenset(e for e in dropped if e.kind == "open")
        left = without(self.bench.deck, opened).elements
        models = {e.model.name for e in left if e.model is not None}
        lines = {e.target for e in dropped if e.kind == "straight"}
        bare = lines | {e.target for e in dropped if e.kind == "ideal"}
        gone = {"parameter": bare, "ideal": lines, "straight": set()}
        found = frozenset(
            e
            for e in dropped
            if e.kind in gone and (e.target not in models or e.target in gone[e.kind])
        )
        smooth = {d.name for d in junction_diodes(build(self.bench.deck))}
        left_smooth = any(
            e.name in smooth and e.model is not None and e.model.name not in bare for e in left
        )
        return found if left_smooth else found | {e for e in dropped if e.kind == "lines"}

    def summary(self) -> EffectsReport:
        """Return the report of what has been run."""
        whole, best = self.full.whole, self.full.trials[self.recommended]
        every, trials = frozenset(self.edits), self.bench.trials
        ideal = trials.get(every)
        rows = []
        for edit in self.edits:
            single, alone = (trials.get(s) for s in (frozenset([edit]), every - {edit}))
            rows.append(self.row(edit, self.bench.whole, single, ideal, alone))
        rows.sort(key=lambda r: (r.verdict != "drop", -r.factor if r.factor == r.factor else 0.0))
        runs = len(trials) + (0 if self.full is self.bench else len(self.full.trials))
        return EffectsReport(
            self.full.deck.title, self.tol, rows, dict(whole.values), dict(best.values),
            (whole.seconds, best.seconds), (whole.methods, best.methods),
            self.full.change(best)[0], runs, self.interrupted, self.compared,
        )  # fmt: skip

    def row(
        self,
        edit: Edit,
        whole: Trial,
        single: Trial | None,
        ideal: Trial | None,
        alone: Trial | None,
    ) -> EffectRow:
        """Return what is known of one effect."""
        own = math.nan
        if ideal is not None and alone is not None and not (ideal.problem or alone.problem):
            own = alone.seconds / ideal.seconds
        if single is None:
            return EffectRow(edit, math.nan, "", math.nan, own, "not tried")
        if single.slow:
            return EffectRow(edit, math.nan, "", math.nan, own, "keep", "slower without it")
        if single.problem:
            return EffectRow(edit, math.nan, "", math.nan, own, "needed", single.problem)
        change, worst = self.change(single)
        factor = whole.seconds / single.seconds
        verdict: Verdict = "keep"
        reason = f"{worst} changes" if change > self.tol else ""
        if edit in self.recommended:
            verdict = "drop"
        elif self.interrupted:
            reason = reason or "combinations were not tried"
        elif change <= self.tol or max(factor, own) < _WORTH:
            verdict = "no cost"
            if factor >= _WORTH:
                reason = "saves nothing once the others are gone"
        return EffectRow(edit, change, worst, factor, own, verdict, reason)


def recommended(circuit: Circuit, report: EffectsReport) -> Circuit:
    """Return the circuit without the effects that a report leaves out."""
    return build(without(circuit.deck, report.dropped))
