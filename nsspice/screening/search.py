"""Running a deck without its effects: each alone, each on the ideal circuit, then greedily."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context

from ..analyses.periodic_sources import common_period
from ..circuit import Circuit, build
from ..errors import Diagnostic, UsageError
from ..netlist.deck import Deck, TranCard
from .candidates import candidates
from .edits import Edit, without
from .result import EffectRow, EffectsReport, Verdict
from .trial import Trial, attempt, measured

Progress = Callable[[str, float], None]

#: leaving an effect out must save this part of the time to be worth a change of the results
_WORTH = 1.1
#: signals that are measured where a deck measures nothing
_SIGNALS = 6


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
    any.  Then effects are left out one after the other, the largest saving per change first, while
    the measures stay within ``tol`` of those of the whole deck; what saves nothing comes back.
    Every combination that is recommended has been run.

    Parameters
    ----------
    circuit : Circuit
        With a ``.tran`` card.  Its ``.measure`` cards are compared; without any, averages and
        extremes of the saved signals over the last whole periods of the sources.
    tol : float
        Largest relative change of a measure.
    drop : iterable of str
        Elements to try as open circuits besides what is found.
    workers : int, optional
        Processes; all cores by default.
    progress : callable, optional
        Called with what is run next and the finished share, 0 to 1.

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
    deck = _prepared(circuit)
    edits = candidates(circuit, drop)
    say = progress or (lambda what, share: None)
    count = os.cpu_count() or 1 if workers is None else workers
    with _pool(count) as pool:
        return _Search(deck, edits, tol, pool, say).report()


def _prepared(circuit: Circuit) -> Deck:
    """Return the deck with measures; refuse one that has no transient."""
    deck = circuit.deck
    cards = [card for card in deck.analyses if isinstance(card, TranCard)]
    if not cards or deck.steps:
        raise UsageError(
            Diagnostic(
                "NS4040",
                f"{deck.file} has {'.step cards' if cards else 'no transient'}: effects are "
                "compared in one transient",
                hint="add a .tran card" if not cards else "remove the .step cards",
            )
        )
    waveforms = [w for island in circuit.islands for w in island.assemble().system.waveforms]
    period, stop = common_period(waveforms), cards[0].tstop
    start = stop / 2.0
    if period is not None and 0.0 < period < stop / 2.0:
        start = stop - math.floor(stop / 2.0 / period) * period
    signals = [s.name for s in deck.saves] or circuit.default_signals()
    return measured(deck, signals[:_SIGNALS], (start, stop))


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


def _pool(workers: int) -> Executor:
    return _Here() if workers <= 1 else ProcessPoolExecutor(workers, get_context("spawn"))


class _Search:
    """The trials of one deck; what is known is kept if Ctrl-C ends it."""

    def __init__(
        self, deck: Deck, edits: Sequence[Edit], tol: float, pool: Executor, say: Progress
    ) -> None:
        self.deck, self.edits, self.tol, self.pool, self.say = deck, list(edits), tol, pool, say
        self.trials: dict[frozenset[Edit], Trial] = {}
        self.recommended: frozenset[Edit] = frozenset()
        self.interrupted = False

    def report(self) -> EffectsReport:
        """Make all runs and return what they have shown."""
        self.say("the deck as it is", 0.0)
        (whole,) = self.run([frozenset()])
        if whole.problem:
            raise UsageError(
                Diagnostic(
                    "NS4040",
                    f"the deck itself cannot be compared with: {whole.problem}",
                    hint="nsspice run it first",
                )
            )
        every = frozenset(self.edits)
        try:
            self.say("each effect left out", 0.1)
            self.run([frozenset([e]) for e in self.edits])
            self.say("each effect alone", 0.5)
            self.run([every, *(every - {e} for e in self.edits)])
            self.say("combinations", 0.8)
            self.recommended = self.restored(self.greedy())
        except KeyboardInterrupt:
            self.interrupted = True
        return self.summary()

    def run(self, sets: Sequence[frozenset[Edit]]) -> list[Trial]:
        """Run what has not been run, side by side."""
        todo = [s for s in dict.fromkeys(sets) if s not in self.trials]
        for trial in self.pool.map(attempt, [self.deck] * len(todo), todo):
            self.trials[trial.dropped] = trial
        return [self.trials[s] for s in sets]

    def change(self, trial: Trial) -> tuple[float, str]:
        """Return the largest relative change of a measure, and which it is."""
        reference = self.trials[frozenset()].values
        worst, name = 0.0, ""
        for key, value in reference.items():
            other = trial.values.get(key, math.nan)
            if math.isnan(value) and math.isnan(other):
                continue
            size = max(abs(value), abs(other))
            part = 0.0 if size == 0.0 else abs(other - value) / size
            if not part <= worst:
                worst, name = (math.inf if math.isnan(part) else part), key
        return worst, name

    def admissible(self, trial: Trial) -> bool:
        """Return whether a trial is within the tolerance."""
        return not trial.problem and self.change(trial)[0] <= self.tol

    def greedy(self) -> frozenset[Edit]:
        """Leave effects out one after the other, the largest saving per change first."""
        whole = self.trials[frozenset()]
        order = []
        for edit in self.edits:
            trial = self.trials[frozenset([edit])]
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
        now = self.trials[dropped]
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
        left = without(self.deck, opened).elements
        models = {e.model.name for e in left if e.model is not None}
        return frozenset(
            e for e in dropped if e.kind in ("parameter", "ideal") and e.target not in models
        )

    def summary(self) -> EffectsReport:
        """Return the report of what has been run."""
        whole, best = self.trials[frozenset()], self.trials[self.recommended]
        every = frozenset(self.edits)
        ideal = self.trials.get(every)
        rows = []
        for edit in self.edits:
            single, alone = (self.trials.get(s) for s in (frozenset([edit]), every - {edit}))
            rows.append(self.row(edit, whole, single, ideal, alone))
        rows.sort(key=lambda r: (r.verdict != "drop", -r.factor if r.factor == r.factor else 0.0))
        return EffectsReport(
            self.deck.title, self.tol, rows, dict(whole.values), dict(best.values),
            (whole.seconds, best.seconds), (whole.methods, best.methods),
            self.change(best)[0], len(self.trials), self.interrupted,
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
