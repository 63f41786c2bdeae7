r"""Contacts that last, held at the level of accelerations.

A closed contact ``0 <= n`` orthogonal to ``gap >= 0`` is a problem of index 3: the force appears in
the second derivative of the gap.  While gap and its rate are zero, the contact says the same of the
acceleration,

.. math::

    0 \le n \perp \ddot{\text{gap}} \ge 0,

which is of index 1, and has closed forms where the model is linear.  Once the force has come down
to zero the gap grows as long as it accelerates; from then on it is watched itself.

Reference: F. Pfeiffer, C. Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), ch. 4.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...netlist.expressions.derivative import derivative as _derivative
from ...solvers.stepper import Jump
from ..equations.assembly import Model
from ..terms.expression import Expr
from .engines import Interval

#: a value is zero below so many units of the terms in it
ROUNDING = 64.0 * 2.0**-53


@dataclass(slots=True)
class Resting:
    """The contacts of a model, and which of them are closed and at rest.

    Parameters
    ----------
    model : Model
    gaps, rates, accelerations : dict of str to Expr
        By contact force; those whose gap has a rate in states and the time alone, and an
        acceleration that its force enters.
    speeds : dict of str to Expr
        What an impulse changes, and must not become negative: rates of gaps, and slacks whose rate
        their multiplier enters.
    closed : set of str
    """

    model: Model
    gaps: dict[str, Expr]
    rates: dict[str, Expr]
    accelerations: dict[str, Expr]
    speeds: dict[str, Expr]
    closed: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, model: Model) -> Resting:
        """Return the contacts of a model, all of them open."""
        slacks = {pair.name: pair.slack for pair in model.pairs if pair.multiplier}
        states = {row.name for row in model.rows if row.state}
        found = cls(model, {}, {}, {}, {})
        # rates that are mixed by a matrix are left to the engines
        for name, slack in {} if model.mass else slacks.items():
            rate = rate_of(model, slack)
            if not slack.names <= {*states, "time"}:
                continue
            if name in rate.names:
                found.speeds[name] = slack
            if not rate.names <= {*states, "time"}:
                continue
            found.gaps[name], found.rates[name], found.speeds[name] = slack, rate, rate
            acceleration = rate_of(model, rate)
            if name in acceleration.names:
                found.accelerations[name] = acceleration
        return found

    def held(self) -> Model:
        """Return the model with the closed contacts at the level of accelerations."""
        pairs = [
            replace(pair, slack=self.accelerations[pair.name]) if pair.name in self.closed else pair
            for pair in self.model.pairs
        ]
        return Model(list(self.model.rows), pairs, self.model.mass, self.model.given)

    def settle(
        self,
        values: Mapping[str, float],
        speed: float = 0.0,
        way: float = 0.0,
        hit: Collection[str] = (),
    ) -> None:
        """Close the contacts whose gap and rate are zero.

        Parameters
        ----------
        values : mapping of str to float
            States, and the time of the model [s].
        speed, way : float
            What a rate, and a gap, are rounding of [m/s], [m].
        hit : collection of str
            Contacts that were hit right now, or press: no gap is left there.
        """
        self.closed = set()
        for name in self.accelerations:
            gap, rate = self.gaps[name], self.rates[name]
            near = ROUNDING * max(way, size_of(gap, values))
            slow = ROUNDING * max(speed, size_of(rate, values))
            if (name in hit or abs(value_of(gap, values)) <= near) and (
                abs(value_of(rate, values)) <= slow
            ):
                self.closed.add(name)

    def speed(self, values: Mapping[str, float]) -> float:
        """Return the largest rate of a gap, and of what moves on both sides of it."""
        rates = self.rates.values()
        return max(
            (max(abs(value_of(rate, values)), size_of(rate, values)) for rate in rates), default=0.0
        )


@dataclass(frozen=True, slots=True)
class Turn:
    """The end of an interval: an impact, or a contact whose gap begins to accelerate downwards.

    Parameters
    ----------
    time : float
        [s]
    hit : list of int
        Pairs that are hit.
    jump : Jump or None
        What the engine has found for e = 0; None where it was too small for it.
    pressing : set of str
        Contacts at rest that have a force.
    """

    time: float
    hit: list[int]
    jump: Jump | None = None
    pressing: frozenset[str] = frozenset()


def first_turn(part: Interval, contacts: Mapping[int, str], closed: set[str]) -> Turn | None:
    """Return what ends an interval, None if nothing does.

    A contact at the level of accelerations remains there when its force ends: its gap grows as long
    as it accelerates, and is watched itself from then on.

    Parameters
    ----------
    part : Interval
    contacts : mapping of int to str
        Pairs.
    closed : set of str
        Those at the level of accelerations.
    """
    jump = next((j for j in part.jumps if any(j.multipliers[k] != 0.0 for k in contacts)), None)
    end = np.inf if jump is None else jump.time
    pressing = set(closed)
    for time, k, closes in zip(*(column.tolist() for column in part.events), strict=True):
        name = contacts.get(k)
        if time >= end:
            break
        if not closes:
            pressing.discard(name)
        elif name in closed and name not in pressing and time > 0.0:
            return Turn(time, [], pressing=frozenset(pressing))
        elif name is not None and name not in closed:
            return Turn(time, [k], pressing=frozenset(pressing))
    if jump is None:
        return None
    hit = [k for k in np.flatnonzero(jump.multipliers).tolist() if contacts.get(k) not in closed]
    return Turn(jump.time, hit, jump, frozenset(pressing))


def rate_of(model: Model, expr: Expr) -> Expr:
    """Return the rate of an expression of states and the time."""
    total = Expr(_derivative(expr.node, "time"))
    for row in model.rows:
        if row.state:
            slope = Expr(_derivative(expr.node, row.name))
            if slope.node.op != "num" or slope.node.value != 0.0:
                total = total + slope * row.right
    return total


def value_of(expr: Expr, values: Mapping[str, float]) -> float:
    """Return the value of an expression of states and the time."""
    return float(expr.value(values))


def size_of(expr: Expr, values: Mapping[str, float]) -> float:
    """Return the largest of the terms of an expression besides the time."""
    named = (abs(values[name]) for name in expr.names if name != "time")
    return float(np.max(list(named), initial=0.0))
