"""The operating points of a circuit whose switches control themselves, state by state.

In each combination of states of such switches the circuit is a problem without them: a closed one
is a branch of its own, an open one is absent.  A solution counts if it keeps every switch
as it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...problems.csc import Floats
from ...problems.descriptor import DescriptorSystem, Switch
from ...problems.held_switches import held
from ...problems.uniqueness import uniqueness
from ...solvers.moreau import MoreauStepper
from ...solvers.stepper import UnsolvedStep

MOST = 6  #: switches of which all states are looked at: 64 problems


@dataclass(slots=True)
class Points:
    """Operating points of all states.

    Parameters
    ----------
    found : list of (ndarray (n,), ndarray (m,))
        Unknowns and multipliers.
    all : bool
        In every state a solution was excluded, or found and proved to be the only one.
    """

    found: list[tuple[Floats, Floats]] = field(default_factory=list)
    all: bool = True


def operating_points(system: DescriptorSystem, pairs: Sequence[int]) -> Points:
    """Return the operating points of a static system, in all states of some of its switches.

    Parameters
    ----------
    system : DescriptorSystem
    pairs : sequence of int
        Those of the switches, at most ``MOST``.
    """
    out = Points()
    switches = {s.pair: s for s in system.switches}
    for states in itertools.product((False, True), repeat=len(pairs)):
        closed = dict(zip(pairs, states, strict=True))
        inner, columns = held(system, closed)
        stepper = MoreauStepper(inner, [])
        stepper.freeze_time(0.0)
        try:
            stepper.start_dc(0.0, None)
        except UnsolvedStep as problem:
            out.all = out.all and problem.certificate is not None
            continue
        z, lam = np.zeros(system.n), np.zeros(system.m)
        point, many = stepper.state
        z[:] = point[: system.n]
        lam[columns[0]] = many
        lam[columns[1]] = point[system.n :]
        slack = system.q - system.B.dot(z) + system.D.dot(lam)
        if all(
            _stays(switches[k], on, z, float(lam[k]), float(slack[k])) for k, on in closed.items()
        ):
            out.found.append((z, lam))
        out.all = out.all and uniqueness(inner).unique
    return out


def _stays(switch: Switch, on: bool, z: Floats, lam: float, slack: float) -> bool:
    """Return whether a switch stays as it is at a solution."""
    control = sum(factor * float(z[j]) for j, factor in switch.control)
    above = switch.at_threshold
    if switch.latching:  # it opens without a current, and fires where it may conduct
        return lam > 0.0 if on else not (control > switch.on_above and slack < 0.0)
    if on is not switch.inverted:
        return control > switch.off_below or (control == switch.off_below and above is not False)
    return control < switch.on_above or (control == switch.on_above and above is not True)


__all__ = ["MOST", "Points", "operating_points"]
