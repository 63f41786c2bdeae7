"""The reference that runs are measured against, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...analyses.settings import Settings
from ...analyses.solution import Floats
from ...errors import Diagnostic, NumericalError, UsageError
from .graph import Graph
from .problem import Problem

#: tolerances of the controlled runs that stand behind a reference; the last is the finest
_TIGHT = (1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
#: a finer run is not begun if it would take longer than this [s]
_PATIENCE = 6.0
#: below this share of the range nothing is claimed: rounding of the signals
_ROUNDING = 1e-15


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
    """

    graph: Graph
    error: float
    how: str

    def distance(self, table: Floats) -> tuple[float, float]:
        """Return the largest and the mean distance of a table, as shares of the ranges.

        Both are those of the worst signal.  At a jump each value between its sides is right.
        """
        if table.shape != self.graph.low.shape:
            return float("nan"), float("nan")
        d = self.graph.shares(Graph.of_table(table))
        return float(np.max(d, initial=0.0)), float(np.max(np.mean(d, axis=0), initial=0.0))


def make_reference(problem: Problem) -> Reference:
    """Return the reference of a problem.

    The exact mode-wise engine where it can treat the circuit, checked by controlled steps of order
    four; those alone elsewhere, with an error estimated from the last two tolerances.

    Raises
    ------
    NumericalError
        If no method solves the deck.
    """
    exact = _modewise(problem)
    finest, before, tolerance, other = _controlled(problem, exact)
    if exact is not None:
        if finest is None:
            return Reference(
                exact, float("nan"), "by the exact mode-wise engine; nothing to check it with"
            )
        error = _apart(exact, finest)
        how = (
            "by the exact mode-wise engine; its distance from sdirk (order 4, reltol "
            f"{tolerance:g}), which errs more, bounds its error"
        )
        return Reference(exact, max(error, _ROUNDING), how)
    if finest is None or before is None:
        raise NumericalError(
            Diagnostic(
                "NS3002",
                "no method reached the end of the run with tight tolerances",
                hint="see what nsspice run says of this deck",
            )
        )
    how = (
        f"by sdirk of order 4 with reltol {tolerance:g}; its error is estimated by the distance "
        f"from the same with {other}"
    )
    return Reference(finest, max(_apart(finest, before), _ROUNDING), how)


def _modewise(problem: Problem) -> Graph | None:
    try:
        return problem.graph(problem.run(Settings("modewise"))[0])
    except (UsageError, NumericalError):
        return None


def _controlled(
    problem: Problem, exact: Graph | None
) -> tuple[Graph | None, Graph | None, float, str]:
    """Return the finest result that patience allows, one to compare it with, and the difference."""
    finest: Graph | None = None
    before: Graph | None = None
    other = "a tenfold tolerance"
    reached, last, steps = float("nan"), float("inf"), 0
    for tolerance in _TIGHT:
        try:
            solution, spent = problem.run(Settings("sdirk", reltol=tolerance))
        except (NumericalError, UsageError):
            break
        found = problem.graph(solution)
        if steps == (steps := solution.stats["steps"]):
            # its longest step rules: the same run once more tells nothing
            finest, before, reached = found, _coarser(problem, tolerance), tolerance
            other = "a longest step twice as long"
            break
        gap = np.inf if finest is None else _apart(found, finest)
        if gap > last:
            break  # rounding has taken over: the run before was the best
        last = gap
        finest, before, reached = found, finest, tolerance
        # fourth order: a tenth of the tolerance takes 1.8 times the steps, near rounding more
        if 4.0 * spent > _PATIENCE:
            break
        if exact is not None and _apart(exact, finest) < 1e-13:
            break
    return finest, before, reached, other


def _coarser(problem: Problem, tolerance: float) -> Graph | None:
    """Return a controlled run whose longest step is twice the usual one."""
    longest = 2.0 * problem.analysis.longest_step(timed=problem.timed)
    try:
        return problem.graph(problem.run(Settings("sdirk", step=longest, reltol=tolerance))[0])
    except (NumericalError, UsageError):
        return None


def _apart(a: Graph, b: Graph) -> float:
    return float(np.max(a.shares(b), initial=0.0))
