"""Drives the compiled stepper one step at a time and rebuilds every problem it had to solve."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from nsspice.circuit import MnaSystem
from nsspice.solvers.moreau import MoreauStepper
from nsspice.solvers.stepper import UnsolvedStep

from .mlcp import Point
from .residual import Bools, Mlcp
from .stepping import Network
from .uniqueness import unique_signals


@dataclass
class Step:
    """A problem as the oracle writes it, and what the core answered (None: it refused)."""

    number: int
    problem: Mlcp
    point: Point | None
    error: UnsolvedStep | None = None

    def unique(self) -> tuple[Bools, Bools]:
        """Return which unknowns and multipliers of a solved step are determined."""
        assert self.point is not None
        return unique_signals(self.problem, self.point)


def march(mna: MnaSystem, h: float, count: int) -> list[Step]:
    """Take ``count`` steps from the deck's initial values; stop at the first refusal.

    Step 0 is the impulsive start.  Its problem is written with a length of 1e-3 h, which a linear
    program can judge better than the 1e-9 h of the core, and its point does not solve it.
    """
    system = mna.system
    network = Network(system, 0.0, count * h)
    charges = mna.initial_charges()
    stepper = MoreauStepper(system, ())
    u = network.u(0.0, "right")
    start = network.impulse(charges, u, 1e-3 * h)
    stepper.plan(0.0, count * h, h, 0.0, h)
    try:
        stepper.start_charges(0.0, charges, h)
    except UnsolvedStep as error:
        return [Step(0, start, None, error)]
    steps = [Step(0, start, _point(start, stepper))]
    stepper.advance(1)
    for k in range(1, count + 1):
        z0, u0, u = stepper.state[0].copy(), u, network.u(k * h, "left")
        problem = network.step(z0, u0, u, h)
        try:
            stepper.advance(1)
        except UnsolvedStep as error:
            steps.append(Step(k, problem, None, error))
            break
        steps.append(Step(k, problem, _point(problem, stepper)))
    return steps


def _point(problem: Mlcp, stepper: MoreauStepper) -> Point:
    z, lam = (np.array(part) for part in stepper.state)
    w = problem.slack(z, lam)
    return Point(z, lam, w, lam > w)


def named_part(
    mna: MnaSystem, elements: Iterable[str], nodes: Iterable[str]
) -> tuple[Bools, Bools]:
    """Return the rows and pairs that a message with these names speaks of."""
    elements, nodes = set(elements), set(nodes)
    rows = np.array(
        [
            (e is not None and e in elements) or (v is not None and v in nodes)
            for e, v in zip(mna.row_elements, mna.row_nodes, strict=True)
        ],
        dtype=bool,
    )
    pairs = np.array([e in elements for e in mna.pair_elements], dtype=bool)
    return rows, pairs
