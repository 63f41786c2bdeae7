"""One run of a deck without some effects: its measures, and the processor time it took."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..analyses.request.request import Request
from ..analyses.studies.batch import jobs_of, run_job
from ..circuit import build
from ..errors import NsspiceError
from ..netlist.deck import Deck
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
    slow : bool
        It was given up because it took too long.
    largest : mapping of str to float
        Largest current of some diodes at the output points of the second half [A].
    """

    dropped: frozenset[Edit]
    values: Mapping[str, float] = field(default_factory=dict)
    seconds: float = float("inf")
    methods: tuple[str, ...] = ()
    problem: str = ""
    slow: bool = False
    largest: Mapping[str, float] = field(default_factory=dict)


class _TooLong(Exception):
    """A run has taken more time than it was given."""


def _late(current: npt.NDArray[np.float64]) -> float:
    return float(current[current.size // 2 :].max(initial=0.0))


def attempt(
    deck: Deck,
    dropped: frozenset[Edit],
    limit: float = math.inf,
    diodes: tuple[str, ...] = (),
) -> Trial:
    """Run a deck without some effects; an error is a result as well.

    Parameters
    ----------
    deck : Deck
    dropped : frozenset of Edit
    limit : float
        Processor time after which a run is given up [s].
    diodes : tuple of str
        Whose largest currents are wanted.
    """
    begin = 0.0

    def watch(_: float) -> None:
        if time.process_time() - begin > limit:
            raise _TooLong

    try:
        circuit = build(without(deck, dropped))
        request = Request(extra=[f"i({name})" for name in diodes])
        jobs = [job for job in jobs_of(circuit.deck) if job.kind == "tran"]
        best = float("inf")
        values: dict[str, float] = {}
        methods: tuple[str, ...] = ()
        spent, count = 0.0, 0
        while count == 0 or (spent < _LEAST and count < _REPEATS):
            begin = time.process_time()
            solutions = [run_job(circuit, job, request, progress=watch) for job in jobs]
            taken = time.process_time() - begin
            spent, count, best = spent + taken, count + 1, min(best, taken)
        for k, solution in enumerate(solutions):
            if solution.certificate is not None and not solution.certificate.passed:
                return Trial(dropped, problem="its certificate fails")
            prefix = f"{jobs[k].label}: " if len(jobs) > 1 else ""
            values |= {prefix + name: v for name, v in solution.measures.items()}
            methods += tuple(island.method for island in solution.islands)
        # the first half has the rush into empty capacitors
        late = {d: max(_late(s[f"i({d})"]) for s in solutions) for d in diodes}
        return Trial(dropped, values, best, tuple(dict.fromkeys(methods)), largest=late)
    except _TooLong:
        return Trial(dropped, problem=f"takes more than {limit:.2g} s", slow=True)
    except NsspiceError as error:
        return Trial(
            dropped, problem=f"{error.diagnostics[0].code}: {error.diagnostics[0].message}"
        )
