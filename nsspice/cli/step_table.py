"""Runs of ``.step`` cards as one table, with what they warn of said once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from .report import report_warnings, say

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution
    from ..analyses.studies.batch import Job
    from ..errors import Diagnostic


def is_stepped(jobs: Sequence[Job], k: int) -> bool:
    """Return whether a job is one of several of an analysis."""
    job = jobs[k]
    return bool(job.steps) and sum(other.card is job.card for other in jobs) > 1


def show_steps(title: str, jobs: Sequence[Job], solutions: Sequence[Solution]) -> None:
    """Print the runs of each analysis that is stepped: a row each, then warnings and files.

    Parameters
    ----------
    title : str
        Of the deck.
    jobs, solutions : sequence
        Solutions may be fewer, where a run failed or was interrupted.
    """
    if not any(job.steps for job in jobs):
        return
    import numpy as np

    from ..analyses.solution.refusal import failure_of
    from ..sweeps.points import Points
    from ..sweeps.table import SweepTable
    from ..sweeps.worker import Outcome, values_of

    done = list(zip(jobs, solutions, strict=False))
    cards = {id(job.card): job.card for k, (job, _) in enumerate(done) if is_stepped(jobs, k)}
    for card in cards.values():
        runs = [(job, solution) for job, solution in done if job.card is card]
        outcomes: list[Outcome | None] = []
        for _, solution in runs:
            failure = failure_of(solution)
            said = None if failure is None else failure.diagnostics[0]
            code, message = ("", "") if said is None else (said.code, said.message)
            outcomes.append(Outcome(values_of(solution), code, message, solution.wall_time))
        names = tuple(dict.fromkeys(name for job, _ in runs for name in job.values))
        points = np.array([[job.values[name] for name in names] for job, _ in runs])
        table = SweepTable(title, Points(names, points), outcomes)
        held = all(s.certificate is None or s.certificate.passed for _, s in runs)
        verdict = "certificate holds" if held else "certificate FAILS"
        say(f"{runs[0][0].kind}: {len(runs)} steps, {verdict}\n{table}")
        _say_once([solution for _, solution in runs])
        files = [name for _, solution in runs for name in solution.files]
        if files:
            text = ", ".join(files) if len(files) < 3 else f"{files[0]} to {files[-1]}"
            say(f"  written: {text}")


def _say_once(solutions: Sequence[Solution]) -> None:
    """Report the first warning of each kind, with the number of runs that have it."""
    first: dict[str, Diagnostic] = {}
    counts: dict[str, int] = {}
    for solution in solutions:
        for warning in {w.code: w for w in reversed(solution.warnings)}.values():
            first.setdefault(warning.code, warning)
            counts[warning.code] = counts.get(warning.code, 0) + 1
    report_warnings(
        [
            w if counts[w.code] == 1 else replace(w, message=f"{w.message} (in {n} steps)")
            for w, n in ((w, counts[code]) for code, w in first.items())
        ]
    )
