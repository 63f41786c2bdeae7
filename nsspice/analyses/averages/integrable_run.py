"""A transient as a run whose signals can be integrated exactly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...circuit.blocks import Blocks
from ...problems.descriptor import Functional
from ...solvers.modewise import ModewiseStepper
from ...solvers.orbit import PeriodMap, State
from ..request.cards import Tran
from ..request.request import Request
from ..request.restart_state import Beginning
from ..signals.curve import Floats
from ..static.initial import start
from .integrals import Course, Integrals


class First(ModewiseStepper):
    """Takes the first state of a run, and does not run."""

    charges: Floats
    first_gates: list[bool]

    def _start(self, charges: Floats, gates: list[bool], active: list[bool] | None = None) -> None:
        self.charges, self.first_gates = charges, list(gates)


def first_state(circuit: Circuit, mna: MnaSystem, analysis: Tran) -> First:
    """Return the first state of an island's run."""
    nothing: list[Functional] = []
    first = First(mna.system, nothing)
    step = analysis.solver_step(None)
    if mna.system.static:
        first.charges = np.zeros(mna.system.n)
        first.first_gates = first.gates_at_start(first.charges, step)
    else:
        start(circuit, mna, first, analysis, step)
    return first


def integrals_of(
    blocks: Blocks,
    analysis: Tran,
    request: Request,
    beginnings: Sequence[Beginning | None] | None = None,
) -> Integrals:
    """Return exact integrals of a transient's signals, which is run once more for the first."""
    circuit = blocks.circuit

    def course_of(home: int) -> Course:
        island = circuit.islands[home]
        mna = island.assemble(
            request.temperature,
            request.values,
            tstep=analysis.row_distance,
            tstop=analysis.stop,
        )
        system = mna.system
        core = PeriodMap(system, analysis.stop).core
        beginning = None if beginnings is None else beginnings[home]
        if beginning is not None:
            charges, gates = beginning.charges, beginning.gates
        else:
            first = first_state(circuit, mna, analysis)
            charges, gates = first.charges, first.first_gates
        return Course(mna, system, State(core.energy_of(charges), gates), analysis.stop)

    given = request.temperature
    ambient = circuit.deck.temperature if given is None else given
    driven = frozenset(link.target for link in blocks.links)
    return Integrals(circuit, course_of, (0.0, analysis.stop), False, ambient, driven=driven)
