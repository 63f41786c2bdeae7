"""The run that is measured: circuit, analysis, signals; one run with given settings."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...analyses.request.cards import Tran
from ...analyses.request.recorder import select
from ...analyses.request.request import Request
from ...analyses.request.settings import Settings
from ...analyses.solution.solution import Floats, Solution
from ...analyses.studies.refinement import junction_voltages, stored_quantities
from ...analyses.transient.transient import run_tran
from ...circuit import Circuit, build
from ...errors import Diagnostic, StepError, UsageError
from ...netlist.deck import TranCard
from ...solvers.compiled import compiled
from .graph import Graph


class GivenUp(StepError):
    """A run took longer than it may."""


@dataclass(frozen=True, slots=True)
class Problem:
    """A transient whose cost is asked for.

    Parameters
    ----------
    circuit : Circuit
    analysis : Tran
    signals : list of str
        What errors are measured in.
    """

    circuit: Circuit
    analysis: Tran
    signals: list[str]

    @classmethod
    def of(cls, circuit: Circuit, signals: Sequence[str] | None = None) -> Problem:
        """Return the first transient of a deck, errors in ``signals`` or in the stored quantities.

        Raises
        ------
        UsageError
            NS4006 if the deck has no ``.tran`` card.
        """
        card = next((c for c in circuit.deck.analyses if isinstance(c, TranCard)), None)
        if card is None:
            raise UsageError(
                Diagnostic(
                    "NS4006",
                    f"{circuit.deck.file} has no .tran card",
                    hint="cost measures a transient: add .tran tstep tstop",
                )
            )
        if signals:
            names = select(circuit, signals)
        else:
            names = stored_quantities(circuit) or junction_voltages(circuit)
        return cls(circuit, Tran.from_card(card), names or circuit.default_signals())

    @property
    def timed(self) -> bool:
        """True if smooth laws depend on the time itself."""
        return any(island.assemble().system.timed for island in self.circuit.islands)

    def run(self, settings: Settings, limit: float = math.inf) -> tuple[Solution, float]:
        """Run once; return the solution and its time inside the process [s].

        The clock starts with a circuit that has just been assembled: what the runs of one circuit
        share, such as the modes that follow from it alone, is paid for in each.

        Parameters
        ----------
        settings : Settings
        limit : float
            The run is given up after this time of computing [s], which what else runs on the
            machine does not spend.

        Raises
        ------
        KeyboardInterrupt
            If Ctrl-C stopped the run.
        GivenUp
            NS3002, if the run took too long.
        """
        circuit, analysis = build(self.circuit.deck), self.analysis
        for island in circuit.islands:
            compiled(island.assemble(tstep=analysis.row_distance, tstop=analysis.stop).system)
        begin, computed = time.perf_counter(), time.process_time()

        def watch(done: float) -> None:
            if time.process_time() - computed > limit:
                message = f"stopped after {limit:.3g} s, {100.0 * done:.3g} % of the run completed"
                hint = "a longer --limit allows more"
                raise GivenUp(Diagnostic("NS3002", message, None, hint))

        solution = run_tran(
            circuit, analysis, settings, Request(signals=self.signals, progress=watch)
        )
        spent = time.perf_counter() - begin
        if solution.interrupted:
            raise KeyboardInterrupt
        return solution, spent

    def table(self, solution: Solution) -> Floats:
        """Return the signals at the rows, shape (rows, signals)."""
        return np.column_stack([solution[name] for name in self.signals])

    def graph(self, solution: Solution) -> Graph:
        """Return the signals at the rows, with both sides of jumps."""
        return Graph.of(solution, self.signals)
