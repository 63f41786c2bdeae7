r"""Impacts with restitution: Newton's law at each, and where they accumulate.

The engines stop a contact dead (e = 0), by the projection of the speeds before onto those that the
contact allows, in the metric of the masses.  With one coefficient e the speeds afterwards are

.. math::

    v^+ = v^- + (1 + e) (v_0 - v^-), \qquad v_0 \text{ those of } e = 0,

and where contacts of different coefficients are hit at once, with G the rates of the gaps by the
speeds, M the masses and B the directions of the forces,

.. math::

    M (v^+ - v^-) = B \lambda, \qquad 0 \le \lambda \perp G v^+ + e\, G v^- \ge 0,

which is Moreau's law for e equal everywhere.  Flights of a contact become shorter by the factor e,
and there are infinitely many of them in a finite time; once what is left of them is rounding of the
motion, the contact stops dead.  It bounces again when it was open for longer.

References: J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics* (1988);
B. Brogliato, *Nonsmooth Mechanics* (Springer, 2016), ch. 4.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ...errors import Diagnostic
from ...netlist.expressions.derivative import derivative as _derivative
from ...problems.csc import Csc
from ...solvers.mlcp import solve_mlcp
from ..equations.assembly import Assembly, Model
from ..equations.conditions import Contact
from ..terms.errors import wrong
from ..terms.expression import Expr
from .resting import ROUNDING, Resting, Turn, size_of, value_of

Floats = npt.NDArray[np.float64]

#: Flights shorter than this part of the run are over.  In one of length tau a position moves by
#: a tau^2 / 8, 2^-51 of the a T^2 / 2 of the run: rounding.
_OVER = 2.0**-24


@dataclass(slots=True)
class Impacts:
    """The contacts of a model, and when each was hit last.

    Parameters
    ----------
    restitution : mapping of str to float
        By contact force; 0 for conditions that are not contacts.
    contacts : Resting
    stop : float
        Length of the run [s].
    last : dict of str to float
        The last impact of each contact [s], since the begin of the run.
    accumulated : set of str
        Contacts whose impacts have accumulated, until they are hit after a flight.
    """

    restitution: Mapping[str, float]
    contacts: Resting
    stop: float
    last: dict[str, float] = field(default_factory=dict)
    accumulated: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, model: Model, conditions: Iterable[object], stop: float) -> Impacts:
        """Return the contacts of a model, with the coefficients of those that are conditions."""
        found = {c.force.name: c.restitution for c in conditions if isinstance(c, Contact)}
        return cls(found, Resting.of(model), stop)

    @property
    def bounce(self) -> bool:
        """True if some contact has a restitution."""
        return any(e > 0.0 for e in self.restitution.values())

    def pass_through(
        self, turn: Turn, before: Floats, here: float, assembly: Assembly
    ) -> tuple[Floats, Floats, list[Diagnostic]]:
        """Return unknowns (n,), impulses (m,) and warnings of a turn, and close what rests then.

        Parameters
        ----------
        turn : Turn
        before : ndarray, shape (n,)
        here : float
            Begin of the interval, since the begin of the run [s].
        assembly : Assembly
            Of the interval.
        """
        after, impulses = before, np.zeros(len(assembly.pairs))
        coefficients, warnings = self._coefficients(turn, here, assembly)
        if coefficients:
            found = self._by_law(turn, before, coefficients, assembly)
            after, impulses = found or self._by_jump(turn, coefficients, assembly)
        speed = self.contacts.speed(states_of(assembly, before, turn.time))
        hit = {assembly.pairs[k] for k in turn.hit} | turn.pressing
        values = states_of(assembly, after, turn.time)
        self.contacts.settle(values, speed, speed * (here + turn.time), hit)
        return after, impulses, warnings

    def _coefficients(
        self, turn: Turn, here: float, assembly: Assembly
    ) -> tuple[dict[int, float], list[Diagnostic]]:
        """Note which contacts are hit; return their coefficients and the warnings."""
        at, begin = here + turn.time, assembly.offset - here
        coefficients, warnings = {}, []
        forces = {pair.name for pair in self.contacts.model.pairs if pair.multiplier}
        for k in turn.hit:
            name = assembly.pairs[k]
            if name not in forces:
                continue  # a term between bounds takes no impulse: what it carried in a short step
            e = self.restitution.get(name, 0.0)
            flight = at - self.last.get(name, -np.inf)
            if 0.0 < e < 1.0 and flight < _OVER * self.stop:
                if name not in self.accumulated:
                    warnings.append(_told(name, e, begin + at, flight))
                self.accumulated.add(name)
                e = 0.0
            else:
                self.accumulated.discard(name)
            coefficients[k] = e
            self.last[name] = at
        return coefficients, warnings

    def _by_jump(
        self, turn: Turn, coefficients: Mapping[int, float], assembly: Assembly
    ) -> tuple[Floats, Floats]:
        """Return unknowns and impulses by one coefficient and what the engine has found for e = 0.

        Raises
        ------
        UsageError
            NS6005 where the coefficients differ.
        """
        if len(set(coefficients.values())) > 1 or turn.jump is None:
            names = ", ".join(assembly.pairs[k] for k in coefficients)
            raise wrong(
                "NS6005",
                f"at t = {turn.time + assembly.offset:.9g} contacts with different restitution "
                f"are hit together with a condition that is not on states alone ({names}), for "
                f"which there is no impact law",
                "give them one coefficient",
            )
        weight = 1.0 + next(iter(coefficients.values()))
        jump = turn.jump
        return jump.before + weight * (jump.after - jump.before), weight * jump.multipliers

    def _by_law(
        self, turn: Turn, before: Floats, coefficients: Mapping[int, float], assembly: Assembly
    ) -> tuple[Floats, Floats] | None:
        """Return unknowns (n,) and impulses (m,) after an impact by Newton's law.

        None if something takes part that is not a condition on states, or whose multiplier does not
        act on rates of states alone.
        """
        values = states_of(assembly, before, turn.time)
        touching = dict(coefficients)
        # what touches without an impulse of e = 0 may be pushed by what bounces off
        way = self.contacts.speed(values) * abs(values["time"])
        for name, gap in self.contacts.gaps.items():
            near = abs(value_of(gap, values)) <= ROUNDING * max(size_of(gap, values), way)
            if near or name in turn.pressing:
                e = self.restitution.get(name, 0.0)
                touching.setdefault(assembly.pairs.index(name), e)
        names = [assembly.pairs[k] for k in touching]
        found = self._directions(names, values, assembly.states)
        if found is None:
            return None
        push, pull = found
        speeds = np.array([value_of(self.contacts.speeds[name], values) for name in names])
        solved = solve_mlcp(
            Csc.from_dense(np.eye(push.shape[0])),
            Csc.from_dense(-push),
            Csc.from_dense(-pull),
            Csc.zeros((len(names), len(names))),
            np.zeros(push.shape[0]),
            (1.0 + np.array(list(touching.values()))) * speeds,
        )
        if not solved.solved:
            return None
        after = before.copy()
        after[[assembly.columns.index(state) for state in assembly.states]] += solved.z
        impulses = np.zeros(len(assembly.pairs))
        impulses[list(touching)] = solved.lam
        return after, impulses

    def _directions(
        self, names: Sequence[str], values: Mapping[str, float], states: Sequence[str]
    ) -> tuple[Floats, Floats] | None:
        """Return rates of states by forces, and rates of gaps by states; None without a law."""
        push = np.zeros((len(states), len(names)))
        pull = np.zeros((len(names), len(states)))
        if not all(name in self.contacts.speeds for name in names):
            return None
        for j, name in enumerate(names):
            for row in self.contacts.model.rows:
                slope = Expr(_derivative(row.right.node, name))
                if slope.node.op == "num" and slope.node.value == 0.0:
                    continue
                if not row.state or not slope.names <= values.keys():
                    return None
                push[states.index(row.name), j] = value_of(slope, values)
            for i, state in enumerate(states):
                slope = Expr(_derivative(self.contacts.speeds[name].node, state))
                pull[j, i] = value_of(slope, values)
        return push, pull


def _told(name: str, e: float, time: float, flight: float) -> Diagnostic:
    """Return what the user should know about an accumulation, ``flight`` being the last one [s]."""
    return Diagnostic(
        "NS6031",
        f"the impacts of {name} accumulate at t = {time + flight * e / (1.0 - e):.12g}, and "
        "the contact lasts until something lifts it",
        hint="nothing to do: infinitely many impacts can end in finite time",
        severity="warning",
    )


def check_start(model: Model, start: Mapping[str, float], at: float) -> None:
    """Refuse states that a condition on positions does not allow, as no impulse moves positions.

    Raises
    ------
    UsageError
        NS6005 if a slack of relative degree two or more is negative at the start.
    """
    values = {**start, "time": at}
    for name, slack in Resting.of(model).gaps.items():
        if not slack.names <= values.keys():
            continue
        found = value_of(slack, values)
        size = max((abs(v) for k, v in values.items() if k in slack.names), default=0.0)
        if found < -ROUNDING * max(size, abs(found) * 1e-3):
            raise wrong(
                "NS6005",
                f"the initial values violate the condition of {name}: its slack is {found:.6g}, "
                f"and no "
                "impulse changes it",
                "start where the slack is not negative",
            )


def states_of(assembly: Assembly, z: Floats, time: float) -> dict[str, float]:
    """Return the states by name, and the time of the model."""
    found = dict(zip(assembly.columns, map(float, z), strict=True))
    found["time"] = time + assembly.offset
    return {name: found[name] for name in (*assembly.states, "time")}
