"""Comparisons once more: what the switches that stand for them do, compared with the deck."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ...circuit import MnaSystem
from ...devices.stamper import Compared
from ...netlist.expressions.expression import Expression
from ...problems.csc import Floats
from ..signals.named_signals import NamedSignals, combination

#: Both sides are known to this part of the larger: what differs by less is equal.
_KNOWN = 64.0 * float(np.finfo(np.float64).eps)
#: The same of the solutions of Newton's method, which ends at a hundredth of that.
_ITERATED = 1e-10
#: The same at a point of a network without storage: an instant at which both sides only meet is a
#: point, too, and rounding of its time decides what they are there.
_EXACT = 2.0 * float(np.finfo(np.float64).eps)
#: An instant is known to a tolerance: a side that is ahead by less than this part of the larger may
#: have crossed the other one late.
_LATE = 1e-6
#: A step with error control does not let decay so large a part of what is compared: what comes to
#: be equal within it has come by a law with a kink.
_KINK = 1e-2
#: Intervals below this part of the time are too short to decide what stays.
_SHORT = 1e-9
#: what is 1 or 0 up to rounding
_HALF = 0.5

_TRUE = {"gt": False, "ge": True, "lt": False, "le": True}
_AHEAD = {"gt": 1.0, "ge": 1.0, "lt": -1.0, "le": -1.0}

_Truths = npt.NDArray[np.bool_]


class ComparisonCheck:
    """Evaluates the comparisons of a deck at recorded points against the states of the switches.

    Both sides are taken from the tree by numpy, with the voltages of the nodes that it names.  A
    comparison is wrong where its node says the opposite throughout a recorded interval.  Where
    both sides are equal throughout, and have come to be so, it has to have the value that is
    written: what only tends to be equal never is.

    Parameters
    ----------
    mna : MnaSystem
    frozen : float, optional
        The time that expressions see [s], if that of the records counts something else.
    """

    def __init__(self, mna: MnaSystem, frozen: float | None = None) -> None:
        self._signals = NamedSignals(mna.layout, frozen)
        self._known = _KNOWN if mna.system.smooth is None else _ITERATED
        smooth = mna.system.smooth is not None
        self._states = [_State(compared, smooth) for compared in mna.layout.compared]

    @property
    def worst(self) -> Compared | None:
        """A comparison that is wrong, None without any."""
        return next((s.compared for s in self._states if s.wrong), None)

    def take_points(self, time: Floats, z: Floats, lam: Floats, u: Floats) -> None:
        """Check points of a network without storage, the last of each instant; shapes (k, ...)."""
        last = np.ones(time.size, dtype=bool)
        last[:-1] = time[1:] != time[:-1]
        time, z, lam, u = time[last], z[last], lam[last], u[last]
        for state in self._states:
            ahead, equal, true = self._look(state, time, z, lam, u)
            state.judge_points(ahead, equal, true)

    def take_intervals(
        self,
        begin: Floats,
        end: Floats,
        exact: _Truths,
        time: Floats,
        z: Floats,
        lam: Floats,
        u: Floats,
    ) -> None:
        """Check k intervals of s points each, the last one at the end; shapes (k,) and (k, s, ...).

        Those that are not ``exact``, where switches are sampled, count for nothing.
        """
        for state in self._states:
            ahead, equal, true = self._look(state, time, z, lam, u)
            state.judge_intervals(begin, end, exact, ahead, equal, true)

    def _look(
        self, state: _State, time: Floats, z: Floats, lam: Floats, u: Floats
    ) -> tuple[Floats, _Truths, _Truths]:
        """Return by how much the first side is ahead, where both are equal, what the node is."""
        compared = state.compared
        names = compared.comparison.variables()
        signals = self._signals.at(names, compared.currents, (time, z, lam, u))
        left, right = (_value(side, signals, time) for side in state.sides)
        # what cancels in a voltage keeps the rounding of what it was
        sizes = np.maximum(np.abs(left), np.abs(right))
        state.size = max(state.size, float(sizes.max(initial=0.0)))
        ahead = left - right
        known = self._known * np.maximum(sizes, state.size)
        equal = np.abs(ahead) <= known
        if compared.ends is None:
            return ahead, equal, z[..., compared.node] > _HALF
        node = z[..., compared.node]
        low, high = (combination(e, time, z, lam, u) + c for e, c in compared.ends)
        true = np.abs(node - high) < np.abs(node - low)
        # between two laws of one value there is no difference
        same = np.abs(high - low) <= _LATE * np.maximum(np.abs(high), np.abs(low))
        meant = np.where(equal, state.at_equality, state.ahead(ahead))
        return ahead, equal, np.where(same, meant, true)


class _State:
    """What is known of one comparison."""

    def __init__(self, compared: Compared, stepped: bool) -> None:
        self.compared, self._stepped = compared, stepped
        node = compared.comparison.node
        self.sides = [Expression(side) for side in node.args]
        self.at_equality, self._sign = _TRUE[node.op], _AHEAD[node.op]
        self.size = self.swing = 0.0
        self.wrong = False
        #: end of the last interval [s], the difference late in it, whether both sides were equal
        #: there because they have come to be so
        self._end, self._late, self._came = -np.inf, 0.0, False

    def ahead(self, ahead: Floats) -> _Truths:
        """Return whether the side is ahead that makes the comparison true."""
        return np.asarray(self._sign * ahead > 0.0, dtype=bool)

    def _opposite(self, ahead: Floats, true: _Truths) -> _Truths:
        self.swing = max(self.swing, float(np.abs(ahead).max(initial=0.0)))
        clear = np.abs(ahead) > _LATE * self.size
        return np.asarray(clear & ((self._sign * ahead > 0.0) != true), dtype=bool)

    def judge_points(self, ahead: Floats, equal: _Truths, true: _Truths) -> None:
        """Judge points of a network without storage."""
        self.wrong |= bool(np.any(self._opposite(ahead, true) & ~equal))
        met = np.abs(ahead) <= _EXACT * self.size
        self.wrong |= bool(np.any(met & (true != self.at_equality)))

    def judge_intervals(
        self,
        begin: Floats,
        end: Floats,
        exact: _Truths,
        ahead: Floats,
        equal: _Truths,
        true: _Truths,
    ) -> None:
        """Judge intervals, in their order."""
        if begin.size == 0:
            return
        opposite = self._opposite(ahead, true)
        self.wrong |= bool(np.any(opposite.all(axis=1) & ~equal.any(axis=1) & exact))
        # in a very short interval nothing moves visibly
        stays = equal.all(axis=1) & (end - begin > _SHORT * end)
        late = np.abs(ahead[:, -2:]).max(axis=1)
        if self._stepped:
            whole = np.abs(ahead).max(axis=1)
            late = np.where(whole > _KINK * self.swing, whole, late)
        if not (stays.any() or self._came):
            self._end, self._late = float(end[-1]), float(late[-1])
            return
        for k in range(begin.size):
            first = self._end == -np.inf  # what is equal from the start on is so
            if stays[k] and (first or begin[k] == self._end):
                self._came |= first or self._late > _LATE * self.swing
                opposed = (true[k] != self.at_equality).all()
                self.wrong |= bool(self._came and opposed and exact[k])
            else:
                self._came = False
            self._end = float(end[k])
            if not stays[k]:
                self._late = float(late[k])


def _value(side: Expression, signals: Mapping[str, Floats], like: Floats) -> Floats:
    return np.asarray(side.evaluate(signals) * np.ones_like(like), dtype=float)
