"""Piecewise-linear expressions once more: what pairs and switches give, against what is written.

Every expression that nodes inside its element stand for is evaluated from its tree by numpy, with
the voltages of the nodes that the deck names.  Where it is continuous, its value must be that of
the system at each recorded point.  Where it jumps, an instant is known to a tolerance only, and
the comparisons themselves are looked at by ``comparisons``: here an interval is wrong if no point
of it is right.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ...circuit import MnaSystem
from ...devices.stamper import Stated
from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import Node, call, sub, var
from ...problems.csc import Floats
from ..signals.named_signals import NamedSignals, combination
from .energy import worse

#: A signal is known to this part of the largest that it has been.
_KNOWN = 64.0 * float(np.finfo(np.float64).eps)
#: The same of the solutions of Newton's method, which ends at a hundredth of that.
_ITERATED = 1e-10
#: The same where an expression jumps: an instant is known to a tolerance.
_LATE = 1e-6
#: Intervals below this part of the time are too short for that: instants have rounding.
_SHORT = 1e-9
#: No current is larger [A].
_MOST = 1e300
#: The name of that distance in an expression; no signal has it.
_NEAR = "#near"


class StatementCheck:
    """Evaluates expressions of a deck at recorded points, and compares their pairs and switches.

    Parameters
    ----------
    mna : MnaSystem
    frozen : float, optional
        The time that expressions see [s], if that of the records counts something else.
    """

    def __init__(self, mna: MnaSystem, frozen: float | None = None) -> None:
        self._signals = NamedSignals(mna.layout, frozen)
        self._sizes = _Sizes(mna)
        known = _KNOWN if mna.system.smooth is None else _ITERATED
        self._states = [_State(s, known, _unit_of(s, mna)) for s in mna.layout.stated]
        #: worst relative error
        self.error = 0.0
        #: expression that is off most
        self.worst: Stated | None = None

    def take_points(self, time: Floats, z: Floats, lam: Floats, u: Floats) -> None:
        """Check points, shapes (k, ...): expressions without jumps."""
        for state in self._states:
            if not state.jumps and time.size:
                steps = np.diff(time, prepend=-np.inf)
                self._judge(state, float(np.max(self._off(state, time, z, lam, u, steps))))

    def take_intervals(
        self,
        begin: Floats,
        end: Floats,
        exact: npt.NDArray[np.bool_],
        time: Floats,
        z: Floats,
        lam: Floats,
        u: Floats,
    ) -> None:
        """Check k intervals of s points each, shapes (k,) and (k, s, ...).

        Points beyond the end of an interval belong to a step that an event has cut short.  Those
        that are not ``exact``, where switches are sampled, count where nothing jumps.
        """
        inside = (time >= begin[:, None]) & (time <= end[:, None])
        for state in self._states:
            off = self._off(state, time, z, lam, u, (end - begin)[:, None])
            if state.jumps:
                least = np.where(inside, off, np.inf).min(axis=1, initial=np.inf)
                told = exact & inside.any(axis=1) & (end - begin > _SHORT * end)
                off = np.where(told, least, 0.0)
            else:
                off = np.where(inside, off, 0.0)
            if off.size:
                self._judge(state, float(np.max(off)))

    def _judge(self, state: _State, off: float) -> None:
        error = off / state.largest if state.largest > 0.0 else off
        if worse(error, self.error):
            self.error, self.worst = error, state.stated

    def _off(
        self, state: _State, time: Floats, z: Floats, lam: Floats, u: Floats, lengths: Floats
    ) -> Floats:
        """Return how far values are from those of the tree, the rounding of signals left aside."""
        signals = self._signals.at(state.names, state.stated.currents, (time, z, lam, u))
        found = combination(state.stated.value, time, z, lam, u)
        return state.outside(signals, found, self._sizes.at(z, lengths))


class _Sizes:
    """The largest voltage, and the largest term of Kirchhoff's current law.

    Each voltage and each current is known to their rounding, however small it is itself.
    """

    def __init__(self, mna: MnaSystem) -> None:
        system = mna.system
        self._nodes = system.row_kind == 0
        self._volts = np.array([name[0] == "v" for name in mna.unknowns], dtype=bool)
        self._conducting, self._storing = system.G.abs(), system.E.abs()
        self._largest = np.zeros(system.n)

    def at(self, z: Floats, lengths: Floats) -> dict[str, Floats]:
        """Return them by letter in steps of these lengths [s], with the largest unknowns so far."""
        points = np.abs(z.reshape(-1, z.shape[-1]))
        self._largest = np.maximum(self._largest, points.max(axis=0, initial=0.0))
        conducted, stored = (
            float(matrix.dot(self._largest)[self._nodes].max(initial=0.0))
            for matrix in (self._conducting, self._storing)
        )
        volts = self._largest[self._volts].max(initial=0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            # a step over an instant has no length, and gives no rates
            rates = np.where(stored > 0.0, np.minimum(stored / np.abs(lengths), _MOST), 0.0)
        return {"v": np.asarray(volts), "i": conducted + rates}


class _State:
    """One expression, and how large its signals have been."""

    def __init__(self, stated: Stated, known: float, unit: str) -> None:
        #: the letter of what the expression gives, a voltage or a current
        self._unit = unit
        self.stated, self.names = stated, stated.expression.variables()
        self.jumps = stated.expression.jumps()
        self._rounding, self._known = known, max(_LATE, known) if self.jumps else known
        #: what rests on equality does so up to rounding
        self._equal = Expression(_nearly(stated.expression.node))
        self._sizes = dict.fromkeys(self.names, 0.0)
        self.largest = 0.0

    def outside(
        self, signals: Mapping[str, Floats], found: Floats, largest: Mapping[str, Floats]
    ) -> Floats:
        """Return by how much values are outside of what the expression may be."""
        expression = self.stated.expression
        with np.errstate(all="ignore"):
            value = _value(expression, signals, found)
            self.largest = max(self.largest, float(np.max(np.abs(value), initial=0.0)))
            low, high = value, value
            for name, values in signals.items():
                size = max(self._sizes[name], float(np.max(np.abs(values), initial=0.0)))
                self._sizes[name] = size
                own = np.maximum(size, largest["i"]) if name[0] == "i" else size
                for part in (-self._known, self._known):
                    near = _value(expression, {**signals, name: values + part * own}, found)
                    low, high = np.minimum(low, near), np.maximum(high, near)
            if self.jumps:
                near = np.asarray(self._known * sum(self._sizes.values()))
                equal = _value(self._equal, {**signals, _NEAR: near}, found)
                low, high = np.minimum(low, equal), np.maximum(high, equal)
            else:
                # a pair may be on the other side of its kink by rounding
                low, high = np.minimum(low, 2.0 * value - high), np.maximum(high, 2.0 * value - low)
            floor = self._rounding * largest[self._unit]
            low, high = low - floor, high + floor
            return np.asarray(np.where(found == value, 0.0, np.maximum(low - found, found - high)))


def _unit_of(stated: Stated, mna: MnaSystem) -> str:
    """Return the letter of what an expression gives: that of an unknown, else a current."""
    return mna.unknowns[stated.value.z[0][0]][0] if stated.value.z else "i"


def _nearly(node: Node) -> Node:
    """Return a tree in which what differs by less than ``_NEAR`` is equal."""
    args = tuple(_nearly(arg) for arg in node.args)
    if node.op in ("eq", "ne"):
        apart = call("abs", sub(args[0], args[1]))
        return Node("le" if node.op == "eq" else "gt", (apart, var(_NEAR)))
    return Node(node.op, args, node.value)


def _value(expression: Expression, signals: Mapping[str, Floats], like: Floats) -> Floats:
    return np.asarray(expression.evaluate(signals) * np.ones_like(like), dtype=float)
