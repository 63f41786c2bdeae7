"""The reference that runs are measured against, and how sure it is."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ...analyses.request.settings import Settings
from ...analyses.solution.solution import Floats
from ...errors import Diagnostic, NumericalError, UsageError
from .graph import Graph
from .problem import GivenUp, Problem

#: tolerances of the controlled runs behind a reference; the last is the finest
_TIGHT = (1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
#: those that replace them where not even the first is reached, or to compare a single one with
_LOOSE = (1e-6, 1e-5, 1e-4, 1e-3)
#: a finer run is not begun if it would take longer than this [s], or so many limits of a run
_PATIENCE = 6.0, 3.0
#: below this share of the range nothing is claimed: rounding of the signals
_ROUNDING = 1e-15


@dataclass(frozen=True, slots=True)
class Run:
    """A controlled run: its tolerance, its steps, its rows and its time [s]."""

    tolerance: float
    steps: int
    table: Floats
    graph: Graph
    seconds: float


@dataclass(frozen=True, slots=True)
class Reference:
    """Values at the output rows, far more accurate than what is measured against them.

    Parameters
    ----------
    graph : Graph
    error : float
        Estimate of its own error, as a share of the range of each signal.
    how : str
        How it was made, one sentence.
    runs : tuple of (Solution, float)
        Controlled runs that it rests on, and their times [s]: points of the curve, too.
    """

    graph: Graph
    error: float
    how: str
    runs: tuple[Run, ...] = ()

    @classmethod
    def none(cls) -> Reference:
        """Return what stands for a reference that has not been made."""
        return cls(Graph.of_table(np.zeros((0, 0))), float("nan"), "none")

    def distance(self, table: Floats) -> tuple[float, float]:
        """Return the largest and the mean distance of a table, as shares of the ranges.

        Both are those of the worst signal.  At a jump each value between its sides is right.
        """
        if table.shape != self.graph.low.shape:
            return float("nan"), float("nan")
        d = self.graph.shares(Graph.of_table(table))
        return float(np.max(d, initial=0.0)), float(np.max(np.mean(d, axis=0), initial=0.0))


def make_reference(problem: Problem, limit: float = 2.0) -> Reference:
    """Return the reference of a problem.

    The exact mode-wise engine where it can treat the circuit, checked by controlled steps of order
    four; those alone elsewhere, with an error estimated from the last two tolerances.

    Parameters
    ----------
    problem : Problem
    limit : float
        Longest time of one run that is measured [s]; one of the reference is given up after three
        times as long, but 6 s at least, except the first where the exact engine has none.

    Raises
    ------
    NumericalError
        If no method solves the deck.
    """
    least, times = _PATIENCE
    patience = max(least, times * limit)
    exact = _modewise(problem, patience)
    runs, other = _controlled(problem, exact, patience)
    finest = runs[-1] if runs else None
    if exact is not None:
        if finest is None:
            return Reference(
                exact, float("nan"), "the exact mode-wise engine, without an independent check"
            )
        error = _apart(exact, finest.graph)
        how = (
            "the exact mode-wise engine; its difference from sdirk (order 4, reltol "
            f"{finest.tolerance:g}), which is less accurate, bounds its error"
        )
        return Reference(exact, max(error, _ROUNDING), how, tuple(runs))
    if finest is None:
        raise NumericalError(
            Diagnostic(
                "NS3002",
                "no method reached the end of the run",
                hint="see what nsspice run says about this deck",
            )
        )
    how = f"sdirk of order 4 with reltol {finest.tolerance:g}"
    if len(runs) < 2:
        alone = f"{how}; without an independent check its error is not known"
        return Reference(finest.graph, float("nan"), alone, tuple(runs))
    how += f"; its error is estimated by the difference from the same with {other}"
    error = max(_apart(finest.graph, runs[-2].graph), _ROUNDING)
    return Reference(finest.graph, error, how, tuple(runs))


def _modewise(problem: Problem, patience: float) -> Graph | None:
    try:
        return problem.graph(problem.run(Settings("modewise"), patience)[0])
    except (UsageError, NumericalError):
        return None


def _controlled(problem: Problem, exact: Graph | None, patience: float) -> tuple[list[Run], str]:
    """Return controlled runs, the finest last, and how the one before differs from it."""
    runs: list[Run] = []
    last = float("inf")
    # without the exact engine there is no other reference, however long the first run takes
    alone = math.inf if exact is None else patience
    for tolerance in _TIGHT:
        try:
            found = _run(problem, tolerance, patience if runs else alone)
        except GivenUp:
            if not runs:
                return _loosest_first(problem, patience), "a tenfold tolerance"
            break
        if found is None:
            break
        if runs and found.steps == runs[-1].steps:
            # its longest step rules: the same run once more shows nothing
            coarser = _run(problem, tolerance, patience, longer=2.0)
            return [run for run in (coarser, found) if run], "a longest step twice as long"
        gap = _apart(found.graph, runs[-1].graph) if runs else np.inf
        if gap > last:
            break  # rounding has taken over: the run before was the best
        last = gap
        runs.append(found)
        # fourth order: a tenth of the tolerance takes 1.8 times the steps, near rounding more
        if 4.0 * found.seconds > patience:
            break
        if exact is not None and _apart(exact, found.graph) < 1e-13:
            break
    # where the circuit is expensive a looser, less accurate run shows how sure the tight one is
    for tolerance in _LOOSE if len(runs) < 2 else ():
        found = None
        with suppress(GivenUp):
            found = _run(problem, tolerance, alone)
        if found is not None:
            runs.insert(0, found)
        if len(runs) > 1:
            ratio = runs[0].tolerance / runs[1].tolerance
            return runs, f"{ratio:.3g} times the tolerance"
    return runs, "a tenfold tolerance"


def _loosest_first(problem: Problem, patience: float) -> list[Run]:
    """Return the controlled runs that replace the first tight one where it takes too long."""
    runs: list[Run] = []
    for tolerance in reversed(_LOOSE):
        try:
            found = _run(problem, tolerance, patience)
        except GivenUp:
            break
        if found is not None:
            runs.append(found)
            if 4.0 * found.seconds > patience:
                break
    return runs


def _run(
    problem: Problem, tolerance: float, patience: float, longer: float | None = None
) -> Run | None:
    """Return a controlled run, None if it fails; with a longest step so many times the usual.

    Raises
    ------
    GivenUp
        If it takes longer than ``patience`` [s].
    """
    step = None
    if longer is not None:
        step = longer * problem.analysis.longest_step(timed=problem.timed)
    try:
        solution, spent = problem.run(Settings("sdirk", step=step, reltol=tolerance), patience)
    except GivenUp:
        raise
    except (NumericalError, UsageError):
        return None
    steps = int(solution.stats["steps"])
    return Run(tolerance, steps, problem.table(solution), problem.graph(solution), spent)


def _apart(a: Graph, b: Graph) -> float:
    return float(np.max(a.shares(b), initial=0.0))
