"""Impacts with restitution: Newton's law at each, and where they accumulate.

The engines stop a contact dead (e = 0), by the projection of the speeds before onto those that the
contact allows, in the metric of the masses.  With restitution e the speeds afterwards are

.. math::

    v^+ = v^- + (1 + e) (v_0 - v^-), \\qquad v_0 \\text{ those of } e = 0,

which is Moreau's law for contacts of one coefficient.  Flights become shorter by the factor e, and
there are infinitely many of them in a finite time; once what is left of them is rounding of the
motion, the body rests.

References: J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics* (1988);
B. Brogliato, *Nonsmooth Mechanics* (Springer, 2016), ch. 4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..errors import Diagnostic
from ..netlist.derivative import derivative as _derivative
from ..solvers.stepper import Jump
from .assembly import Assembly, Model
from .engines import Stretch
from .errors import wrong
from .expression import Expr

Floats = npt.NDArray[np.float64]

#: Flights shorter than this part of the run are over.  In one of length tau a position moves by
#: a tau^2 / 8, 2^-51 of the a T^2 / 2 of the run: rounding.
_OVER = 2.0**-24
#: a slack below zero by so many units of what stands in it is rounding
_ROUNDING = 64.0 * 2.0**-53


@dataclass(slots=True)
class Impacts:
    """The contacts of a model with restitution.

    Parameters
    ----------
    restitution : mapping of str to float
        By contact force; contacts without restitution are left to the engines.
    rates : mapping of str to Expr
        Rates of the gaps, in states and the time.
    """

    restitution: Mapping[str, float]
    rates: Mapping[str, Expr] = field(default_factory=dict)

    def pairs(self, assembly: Assembly) -> dict[int, float]:
        """Return the pairs that bounce, with their coefficients."""
        found = {assembly.pairs.index(name): e for name, e in self.restitution.items()}
        return {k: e for k, e in found.items() if e > 0.0}

    def first(self, part: Stretch, bouncing: Mapping[int, float]) -> Jump | None:
        """Return the first impact of a bouncing contact, None without any."""
        for jump in part.jumps:
            if any(jump.multipliers[k] != 0.0 for k in bouncing):
                return jump
        return None

    def factor(self, impact: Jump, bouncing: Mapping[int, float]) -> float:
        """Return by how much an impulse is larger than that of e = 0.

        Raises
        ------
        UsageError
            NS6005 if contacts of different coefficients, or others, take part in one impact.
        """
        hit = np.flatnonzero(impact.multipliers).tolist()
        found = {bouncing.get(k, 0.0) for k in hit}
        if len(found) > 1:
            raise wrong(
                "NS6005",
                f"at t = {impact.time:.9g} contacts of different restitution are hit at once, for "
                "which no law of impacts is given",
                "give them one coefficient",
            )
        return 1.0 + found.pop()

    def weight(self, impact: Jump, bouncing: Mapping[int, float], assembly: Assembly) -> float:
        """Return by how much the impact is larger than the engine's jump: ``1 + e``, made exact."""
        return self.factor(impact, bouncing) * self._exact(impact, bouncing, assembly)

    def after(self, impact: Jump, bouncing: Mapping[int, float], assembly: Assembly) -> Floats:
        """Return the unknowns after an impact, shape (n,); those of states count."""
        change = impact.after - impact.before
        return np.asarray(impact.before + self.weight(impact, bouncing, assembly) * change)

    def _exact(self, impact: Jump, bouncing: Mapping[int, float], assembly: Assembly) -> float:
        """Return what makes the gap's rate after the engine's jump exactly zero.

        The engine ends its short step in contact, so that rounding of the gap stands in the speed.
        """
        hit = [k for k in bouncing if impact.multipliers[k] != 0.0]
        if len(hit) != 1 or (rate := self.rates.get(assembly.pairs[hit[0]])) is None:
            return 1.0
        before, after = (
            float(rate.value(states_of(assembly, z, impact.time)))
            for z in (impact.before, impact.after)
        )
        return before / (before - after) if before != after else 1.0

    def accumulated(self, flight: float, stop: float, bouncing: Mapping[int, float]) -> bool:
        """Return whether the flights that are left are rounding of the motion."""
        return max(bouncing.values()) < 1.0 and 0.0 < flight < _OVER * stop

    def told(self, time: float, flight: float) -> Diagnostic:
        """Return what the user should know about an accumulation.

        Parameters
        ----------
        time, flight : float
            The last impact, and the flight before it [s].
        """
        names = ", ".join(self.restitution)
        e = max(self.restitution.values())
        return Diagnostic(
            "NS6031",
            f"the impacts of {names} accumulate at t = {time + flight * e / (1.0 - e):.12g}, and "
            "the contact lasts from there on",
            hint="nothing is to be done: infinitely many impacts end in a finite time",
            severity="warning",
        )


def check_start(model: Model, start: Mapping[str, float], at: float) -> None:
    """Refuse states that a condition on positions does not allow, as no impulse moves positions.

    Raises
    ------
    UsageError
        NS6005 if a slack of relative degree two or more is negative at the start.
    """
    slacks = {pair.name: pair.slack for pair in model.pairs if pair.multiplier}
    values = {**start, "time": at}
    for name in gap_rates(model, slacks):
        slack = slacks[name]
        if not slack.names <= values.keys():
            continue
        found = float(slack.value(values))
        size = max((abs(v) for k, v in values.items() if k in slack.names), default=0.0)
        if found < -_ROUNDING * max(size, abs(found) * 1e-3):
            raise wrong(
                "NS6005",
                f"the start violates the condition of {name}: its slack is {found:.6g}, and no "
                "impulse changes it",
                "start where the slack is not negative",
            )


def states_of(assembly: Assembly, z: Floats, time: float) -> dict[str, float]:
    """Return the states by name, and the time of the model."""
    found = dict(zip(assembly.columns, map(float, z), strict=True))
    found["time"] = time + assembly.offset
    return {name: found[name] for name in (*assembly.states, "time")}


def gap_rates(model: Model, contacts: Mapping[str, Expr]) -> dict[str, Expr]:
    """Return the rates of gaps, along the rates of the states, where only states stand in them."""
    states = {row.name: row.right for row in model.rows if row.state}
    found = {}
    for name, gap in contacts.items():
        total = Expr(_derivative(gap.node, "time"))
        for state, right in states.items():
            slope = Expr(_derivative(gap.node, state))
            if slope.node.op != "num" or slope.node.value != 0.0:
                total = total + slope * right
        if total.names <= {*states, "time"}:
            found[name] = total
    return found
