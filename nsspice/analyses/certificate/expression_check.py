"""Expressions once more: what engines compute with, against the trees that were read.

Each expression of a deck is evaluated by numpy from its tree, at recorded points and
with the voltages of the nodes that it names.  Three things may stand for it in the system:

- A *tape*.  Its value is that of the tree, up to the rounding of the signals.
- *Pairs and switches*, for kinks and jumps.  Where it is continuous, its value is that of the tree
  at each point.  Where it jumps, an instant is known to a tolerance only: an interval is wrong if
  no point of it is right.
- For a comparison, a *switch*.  It is wrong where its node says the opposite throughout an
  interval.  Where both sides are equal throughout, and have come to be so, it has the value that
  is written: what only tends to be equal never is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from ...circuit import MnaSystem
from ...devices.signals import shown
from ...devices.stamper import Compared, Stated, Written
from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import Node, call, sub, var
from ...problems.csc import Floats
from ...solvers.intervals import Recording
from ...solvers.moreau import Recorded, function_values
from ..signals.named_signals import NamedSignals, combination
from .energy import worse

_EPS = float(np.finfo(np.float64).eps)
#: A signal is known to this part of itself, or of the largest that it has been.
_KNOWN = 64.0 * _EPS
#: The same of the solutions of Newton's method, which ends at a hundredth of that.
_ITERATED = 1e-10
#: The same of a comparison at a point of a network without storage: an instant at which both sides
#: only meet is a point, too, and rounding of its time decides what they are there.
_EXACT = 2.0 * _EPS
#: The same where an expression jumps: an instant is known to a tolerance, and a side that is ahead
#: by less than this part of the larger may have crossed the other one late.
_LATE = 1e-6
#: A step with error control does not let decay so large a part of what is compared: what comes to
#: be equal within it has come by a law with a kink.
_KINK = 1e-2
#: Intervals below this part of the time are too short to decide what stays: instants have rounding.
_SHORT = 1e-9
#: Points of a tape looked at in one block of records.
_BLOCK = 256
#: No current is larger [A].
_MOST = 1e300
#: what is 1 or 0 up to rounding
_HALF = 0.5
#: The name of a distance in an expression; no signal has it.
_NEAR = "#near"

_TRUE = {"gt": False, "ge": True, "lt": False, "le": True}
_AHEAD = {"gt": 1.0, "ge": 1.0, "lt": -1.0, "le": -1.0}

_Truths = npt.NDArray[np.bool_]


class _Points(NamedTuple):
    """Time, unknowns, multipliers and sources, shapes (...) and (..., n)."""

    time: Floats
    z: Floats
    lam: Floats
    u: Floats

    def chosen(self, which: _Truths | slice) -> _Points:
        """Return some of the points."""
        return _Points(self.time[which], self.z[which], self.lam[which], self.u[which])

    def flat(self) -> _Points:
        """Return points of intervals one after the other."""
        z, lam, u = (v.reshape(self.time.size, v.shape[-1]) for v in self[1:])
        return _Points(self.time.ravel(), z, lam, u)


class ExpressionCheck:
    """Evaluates the expressions of a deck, and compares what stands for them in the system.

    Parameters
    ----------
    mna : MnaSystem
    frozen : float, optional
        The time that expressions see [s], if that of the records counts something else.
    averaged : bool
        Records hold averages of a step, no solutions at an instant.
    pointwise : bool
        Each record is a solution at an instant.
    """

    def __init__(
        self,
        mna: MnaSystem,
        frozen: float | None = None,
        averaged: bool = False,
        pointwise: bool = False,
    ) -> None:
        layout = mna.layout
        signals, self._sizes = NamedSignals(layout, frozen), _Sizes(mna)
        self._tape = _Tape(mna, signals) if layout.readings else None
        self._stated = [_State(s, mna, signals) for s in layout.stated]
        self._compared = [_Comparison(c, mna, signals) for c in layout.compared]
        self._averaged, self._pointwise = averaged, pointwise
        #: worst relative error, and the expression that is off most
        self.error, self._worst = 0.0, ""

    @property
    def worst(self) -> tuple[float, str]:
        """The worst relative error and what it is of; a wrong comparison goes first, with 1."""
        wrong = next((c.compared for c in self._compared if c.wrong), None)
        if wrong is not None:
            return 1.0, f"the comparison {shown(wrong.comparison)} of {wrong.element}"
        return self.error, self._worst

    def take_points(self, records: Recorded) -> None:
        """Check recorded steps; of those at one instant the last is what follows."""
        time = records.time
        if not time.size:
            return
        points = _Points(time, records.z, records.lam, records.u)
        self._check_tape(points)
        if not self._averaged:
            for state in self._stated:
                if not state.jumps:
                    self._judge(state, state.off(points, self._sizes, records.length))
        if self._pointwise and self._compared:
            last = np.append(time[1:] != time[:-1], True)
            for comparison in self._compared:
                comparison.judge_points(points.chosen(last))

    def take_intervals(self, intervals: Recording) -> None:
        """Check recorded intervals of continuous solutions.

        Points beyond the end of one belong to a step that an event has cut short.  Those without a
        finite doubt, where switches are sampled, count only where nothing jumps.
        """
        points = _Points(intervals.time, intervals.z, intervals.lam, intervals.u)
        self._check_tape(points.flat())
        begin, end, exact = intervals.begin, intervals.end, np.isfinite(intervals.doubt)
        inside = (intervals.time >= begin[:, None]) & (intervals.time <= end[:, None])
        long = end - begin > _SHORT * end
        for state in self._stated:
            off = state.off(points, self._sizes, (end - begin)[:, None])
            if state.jumps:
                least = np.where(inside, off, np.inf).min(axis=1, initial=np.inf)
                off = np.where(exact & inside.any(axis=1) & long, least, 0.0)
            else:
                off = np.where(inside, off, 0.0)
            self._judge(state, off)
        for comparison in self._compared:
            comparison.judge_intervals(begin, end, exact, points)

    def _check_tape(self, points: _Points) -> None:
        """Check some points of tapes, if they are many."""
        if self._tape is not None and points.time.size:
            stride = -(-points.time.size // _BLOCK)
            for state, off in self._tape.off(points.chosen(slice(None, None, stride))):
                self._judge(state, off)

    def _judge(self, state: _Judged, off: Floats) -> None:
        if not off.size or (most := float(np.max(off))) == 0.0:
            return
        error = state.relative(most)
        if worse(error, self.error):
            self.error, self._worst = error, f"the expression {shown(state.expression)}"


class _Judged(Protocol):
    """An expression with the size of its values."""

    @property
    def expression(self) -> Expression:
        """What is written."""

    def relative(self, off: float) -> float:
        """Return an error as a part of the largest value."""


class _OnTape:
    """One expression of a tape, and how large it has been."""

    def __init__(self, written: Written) -> None:
        self.written, self.expression, self.largest = written, written.expression, 0.0

    def relative(self, off: float) -> float:
        """Return an error as a part of the largest value; without one it is infinite."""
        return off / self.largest if self.largest > 0.0 else np.inf if off > 0.0 else off

    def outside(self, signals: Mapping[str, Floats], found: Floats) -> Floats:
        """Return how far values are from those of the tree, the rounding of signals left aside."""
        self.largest = max(self.largest, float(np.max(np.abs(found))))
        with np.errstate(all="ignore"):
            value = _value(self.expression, signals, found)
            if not signals or float(np.max(np.abs(found - value))) == 0.0:
                return np.abs(found - value)
            low, high = value, value
            for name, known in signals.items():
                low, high = _widened(self.expression, signals, name, _KNOWN * known, (low, high))
            return _beyond(found, value, low, high)


class _Tape:
    """The expressions of a tape: currents and the time are those that it reads itself."""

    def __init__(self, mna: MnaSystem, signals: NamedSignals) -> None:
        assert mna.system.smooth is not None
        self._signals = signals
        self._states = [_OnTape(written) for written in mna.layout.readings]
        registers: list[int] = []
        for state in self._states:
            registers += [state.written.register, *state.written.signals.values()]
        outputs = np.array(registers, dtype=np.int32)
        self._tape = replace(mna.system.smooth.tape, outputs=outputs)

    def off(self, points: _Points) -> list[tuple[_OnTape, Floats]]:
        """Return how far the values of each expression are off."""
        time, z, _, u = points
        values = iter(function_values(self._tape, z, u, time).T)
        found = []
        for state in self._states:
            own = next(values)
            read = {name: next(values) for name in state.written.signals}
            nodes = [name for name in read if name.startswith("v(")]
            read |= self._signals.at(nodes, {}, points)
            found.append((state, state.outside(read, own)))
        return found


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
        # sources that hold what integrates at an operating point are not unknowns of the circuit
        points = np.abs(z.reshape(-1, z.shape[-1])[:, : self._largest.size])
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
    """One expression that pairs and switches stand for, and how large its signals have been."""

    def __init__(self, stated: Stated, mna: MnaSystem, signals: NamedSignals) -> None:
        self._stated, self._signals = stated, signals
        self.expression, self._names = stated.expression, stated.expression.variables()
        self.jumps = stated.expression.jumps()
        #: the letter of what the expression gives: that of an unknown, else a current
        self._unit = mna.unknowns[stated.value.z[0][0]][0] if stated.value.z else "i"
        self._rounding = _known(mna)
        self._part = max(_LATE, self._rounding) if self.jumps else self._rounding
        #: what rests on equality does so up to rounding
        self._equal = Expression(_nearly(stated.expression.node))
        self._largest_of = dict.fromkeys(self._names, 0.0)
        self._largest = 0.0

    def relative(self, off: float) -> float:
        """Return an error as a part of the largest value."""
        return off / self._largest if self._largest > 0.0 else off

    def off(self, points: _Points, sizes: _Sizes, lengths: Floats) -> Floats:
        """Return by how much values are outside of what the expression may be."""
        signals = self._signals.at(self._names, self._stated.currents, points)
        found = combination(self._stated.value, *points)
        largest, expression = sizes.at(points.z, lengths), self.expression
        with np.errstate(all="ignore"):
            value = _value(expression, signals, found)
            self._largest = max(self._largest, float(np.max(np.abs(value), initial=0.0)))
            low, high = value, value
            for name, values in signals.items():
                size = max(self._largest_of[name], float(np.max(np.abs(values), initial=0.0)))
                self._largest_of[name] = size
                own = np.maximum(size, largest["i"]) if name[0] == "i" else np.asarray(size)
                low, high = _widened(expression, signals, name, self._part * own, (low, high))
            if self.jumps:
                near = np.asarray(self._part * sum(self._largest_of.values()))
                equal = _value(self._equal, {**signals, _NEAR: near}, found)
                low, high = np.minimum(low, equal), np.maximum(high, equal)
            else:
                # a pair may be on the other side of its kink by rounding
                low, high = np.minimum(low, 2.0 * value - high), np.maximum(high, 2.0 * value - low)
            floor = self._rounding * largest[self._unit]
            return _beyond(found, value, low - floor, high + floor)


class _Comparison:
    """One comparison, and what is known of it."""

    def __init__(self, compared: Compared, mna: MnaSystem, signals: NamedSignals) -> None:
        self.compared, self._signals, self._known = compared, signals, _known(mna)
        self._names = compared.comparison.variables()
        self._stepped = mna.system.smooth is not None
        node = compared.comparison.node
        self._sides = [Expression(side) for side in node.args]
        self._at_equality, self._sign = _TRUE[node.op], _AHEAD[node.op]
        self._size = self._swing = 0.0
        self.wrong = False
        #: end of the last interval [s], the difference late in it, whether both sides were equal
        #: there because they have come to be so
        self._end, self._late, self._came = -np.inf, 0.0, False

    def _look(self, points: _Points) -> tuple[Floats, _Truths, _Truths]:
        """Return by how much the first side is ahead, where both are equal, what the node is."""
        time, z, _, _ = points
        compared = self.compared
        signals = self._signals.at(self._names, compared.currents, points)
        left, right = (_value(side, signals, time) for side in self._sides)
        # what cancels in a voltage keeps the rounding of what it was
        sizes = np.maximum(np.abs(left), np.abs(right))
        self._size = max(self._size, float(sizes.max(initial=0.0)))
        ahead = left - right
        equal = np.abs(ahead) <= self._known * np.maximum(sizes, self._size)
        node = z[..., compared.node]
        if compared.ends is None:
            return ahead, equal, node > _HALF
        low, high = (combination(e, *points) + c for e, c in compared.ends)
        true = np.abs(node - high) < np.abs(node - low)
        # between two laws of one value there is no difference
        same = np.abs(high - low) <= _LATE * np.maximum(np.abs(high), np.abs(low))
        meant = np.where(equal, self._at_equality, self._sign * ahead > 0.0)
        return ahead, equal, np.where(same, meant, true)

    def _opposite(self, ahead: Floats, true: _Truths) -> _Truths:
        self._swing = max(self._swing, float(np.abs(ahead).max(initial=0.0)))
        clear = np.abs(ahead) > _LATE * self._size
        return np.asarray(clear & ((self._sign * ahead > 0.0) != true), dtype=bool)

    def judge_points(self, points: _Points) -> None:
        """Judge points of a network without storage."""
        ahead, equal, true = self._look(points)
        self.wrong |= bool(np.any(self._opposite(ahead, true) & ~equal))
        met = np.abs(ahead) <= _EXACT * self._size
        self.wrong |= bool(np.any(met & (true != self._at_equality)))

    def judge_intervals(self, begin: Floats, end: Floats, exact: _Truths, points: _Points) -> None:
        """Judge intervals, in their order; those that are not exact count for nothing."""
        ahead, equal, true = self._look(points)
        if begin.size == 0:
            return
        opposite = self._opposite(ahead, true)
        self.wrong |= bool(np.any(opposite.all(axis=1) & ~equal.any(axis=1) & exact))
        # in a very short interval nothing moves visibly
        stays = equal.all(axis=1) & (end - begin > _SHORT * end)
        late = np.abs(ahead[:, -2:]).max(axis=1)
        if self._stepped:
            whole = np.abs(ahead).max(axis=1)
            late = np.where(whole > _KINK * self._swing, whole, late)
        if not (stays.any() or self._came):
            self._end, self._late = float(end[-1]), float(late[-1])
            return
        for k in range(begin.size):
            first = self._end == -np.inf  # what is equal from the start on is so
            if stays[k] and (first or begin[k] == self._end):
                self._came |= first or self._late > _LATE * self._swing
                opposed = (true[k] != self._at_equality).all()
                self.wrong |= bool(self._came and opposed and exact[k])
            else:
                self._came = False
            self._end = float(end[k])
            if not stays[k]:
                self._late = float(late[k])


def _known(mna: MnaSystem) -> float:
    """Return to which part of themselves signals of a system are known."""
    return _KNOWN if mna.system.smooth is None else _ITERATED


def _value(expression: Expression, signals: Mapping[str, Floats], like: Floats) -> Floats:
    return np.asarray(expression.evaluate(signals) * np.ones_like(like), dtype=float)


def _widened(
    expression: Expression,
    signals: Mapping[str, Floats],
    name: str,
    by: Floats,
    bounds: tuple[Floats, Floats],
) -> tuple[Floats, Floats]:
    """Return bounds of a value that hold also if one signal is larger or smaller by so much."""
    low, high = bounds
    for moved in (signals[name] - by, signals[name] + by):
        near = _value(expression, {**signals, name: moved}, low)
        low, high = np.minimum(low, near), np.maximum(high, near)
    return low, high


def _beyond(found: Floats, value: Floats, low: Floats, high: Floats) -> Floats:
    """Return how far values are outside of bounds; what is the same, infinite too, is right."""
    return np.asarray(np.where(found == value, 0.0, np.maximum(low - found, found - high)))


def _nearly(node: Node) -> Node:
    """Return a tree in which what differs by less than ``_NEAR`` is equal."""
    args = tuple(_nearly(arg) for arg in node.args)
    if node.op in ("eq", "ne"):
        apart = call("abs", sub(args[0], args[1]))
        return Node("le" if node.op == "eq" else "gt", (apart, var(_NEAR)))
    return Node(node.op, args, node.value)
