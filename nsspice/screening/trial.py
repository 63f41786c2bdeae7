"""One run of a deck without some effects: its measures, and the processor time it took."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ..analyses.batch import Request, jobs_of, run_job
from ..circuit import build
from ..errors import NsspiceError
from ..netlist.deck import Deck, Measure
from ..netlist.expression import Expression
from .edits import Edit, without

#: a run is repeated until it has taken so long [s], and the least time counts
_LEAST = 0.2
_REPEATS = 5


@dataclass(frozen=True, slots=True)
class Trial:
    """What one run gave.

    Parameters
    ----------
    dropped : frozenset of Edit
        The effects that were left out.
    values : mapping of str to float
        Measures by name, nan for one that was not found.
    seconds : float
        Processor time of the analyses [s].
    methods : tuple of str
        Of the islands.
    problem : str
        Why there is no result, ``""`` if there is one.
    """

    dropped: frozenset[Edit]
    values: Mapping[str, float] = field(default_factory=dict)
    seconds: float = float("inf")
    methods: tuple[str, ...] = ()
    problem: str = ""


def attempt(deck: Deck, dropped: frozenset[Edit]) -> Trial:
    """Run a deck without some effects; an error is a result as well."""
    try:
        circuit = build(without(deck, dropped))
        jobs = [job for job in jobs_of(circuit.deck) if job.kind == "tran"]
        best = float("inf")
        values: dict[str, float] = {}
        methods: tuple[str, ...] = ()
        spent, count = 0.0, 0
        while count == 0 or (spent < _LEAST and count < _REPEATS):
            begin = time.process_time()
            solutions = [run_job(circuit, job, Request()) for job in jobs]
            taken = time.process_time() - begin
            spent, count, best = spent + taken, count + 1, min(best, taken)
        for k, solution in enumerate(solutions):
            if solution.certificate is not None and not solution.certificate.passed:
                return Trial(dropped, problem="its certificate fails")
            prefix = f"{jobs[k].label}: " if len(jobs) > 1 else ""
            values |= {prefix + name: v for name, v in solution.measures.items()}
            methods += tuple(island.method for island in solution.islands)
        return Trial(dropped, values, best, tuple(dict.fromkeys(methods)))
    except NsspiceError as error:
        return Trial(
            dropped, problem=f"{error.diagnostics[0].code}: {error.diagnostics[0].message}"
        )


def measured(deck: Deck, signals: list[str], window: tuple[float, float]) -> Deck:
    """Return a deck that measures averages and extremes of signals, if it measures nothing.

    Parameters
    ----------
    deck : Deck
    signals : list of str
    window : (float, float)
        From when to when [s]: a whole number of periods where the sources have one.
    """
    if any(m.analysis == "tran" for m in deck.measures):
        return deck
    span = deck.elements[0].span
    cards = [
        Measure(
            f"{operation} {name}", "tran", operation, span,
            expression=Expression.parse(name, span), start=window[0], stop=window[1],
        )
        for name in signals
        for operation in ("avg", "max", "min")
    ]  # fmt: skip
    return replace(deck, measures=[*deck.measures, *cards])
