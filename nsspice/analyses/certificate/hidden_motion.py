"""Signals that move more between output points than these show: a run says which.

The points that an engine records for the certificate lie between the output points as well, and
cost nothing.  Where a value lies outside of the two neighbouring output points, they do not show
it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...errors import Diagnostic
from ...problems.descriptor import Functional
from ...solvers.intervals import Recording
from ..signals.signal_function import Floats, Indices
from ..signals.signal_names import unit

#: output points around an instant, and what lies beyond the two nearest as a part of their range:
#: of a sine with ten of them in a period it is 0.025 at its extremes
_AROUND = np.arange(-4, 6)
_PART = 0.5
#: ... for such a part of the time at least: a spike at each edge is known to be there
_SHARE = 1e-3
#: so small a part of a signal's largest value is worth no word
_TRACE = 1e-3
#: ... and of the largest of its unit
_ROUNDING = 1e-9
#: an instant this near to an output point, as a part of the distance of two, is that
_NEAR = 1e-6
#: numbers that one island keeps in a run at most
_MOST = 1 << 20
#: signals of an island that are looked at
_SIGNALS = 256
#: output points in an interval that show everything
_DENSE = 8.0
#: signals named in the warning
_NAMED = 6


class Points(NamedTuple):
    """Some signals at k instants.

    Parameters
    ----------
    time : ndarray, shape (k,)
        [s]
    side : ndarray, shape (k,)
        1 for a limit from the right, -1 for one from the left.
    weight : ndarray, shape (k,)
        Time that each point represents [s].
    values : ndarray, shape (k, c)
    """

    time: Floats
    side: Floats
    weight: Floats
    values: Floats


class Between:
    """Points of the signals of one island between output points.

    Parameters
    ----------
    names : sequence of str
        Signals of the island; those in which smooth functions take part are left out.
    functionals : sequence of Functional
        What they are made of.
    distance : float
        Between two output points [s].
    """

    def __init__(
        self, names: Sequence[str], functionals: Sequence[Functional], distance: float
    ) -> None:
        pairs = zip(names, functionals, strict=True)
        self._plain = [(name, f) for name, f in pairs if not (f.f or f.df)][:_SIGNALS]
        self.names = [name for name, _ in self._plain]
        self.waiting: list[Points] = []
        self._left, self._distance = _MOST, distance
        self._terms: list[tuple[str, Indices, Floats, Indices]] = []

    def _prepare(self) -> None:
        plain = self._plain
        for part in ("z", "lam", "dz", "u"):
            terms = [(k, j, c) for k, (_, f) in enumerate(plain) for j, c in getattr(f, part)]
            if terms:
                column, index, factor = zip(*terms, strict=True)
                self._terms.append(
                    (part, np.array(index), np.array(factor), np.array(column, dtype=np.intp))
                )

    def take(self, intervals: Recording) -> None:
        """Keep the signals at the points of recorded intervals."""
        if not self.names or self._left <= 0:
            return
        # nothing moves faster than an interval is long: many output points in it show everything
        short = intervals.end - intervals.begin < _DENSE * self._distance
        if not short.any():
            return
        if not self._terms:
            self._prepare()
        time = intervals.time[short]
        every = {"z": intervals.z, "lam": intervals.lam, "dz": intervals.rate, "u": intervals.u}
        tables = {part: every[part][short] for part, *_ in self._terms}
        values = np.zeros((time.size, len(self.names)))
        for part, index, factor, column in self._terms:
            table = np.reshape(tables[part], (time.size, -1))
            starts = np.flatnonzero(np.diff(column, prepend=-1))
            sums = np.add.reduceat(table[:, index] * factor, starts, axis=1)
            values[:, column[starts]] += sums
        side = np.zeros(time.shape)
        side[:, 0], side[:, -1] = 1.0, -1.0
        weight = np.abs(intervals.weight[short])
        # stages of a step that was cut at an event lie beyond its end
        inside = (time <= intervals.end[short][:, np.newaxis]).ravel()
        points = Points(time.ravel(), side.ravel(), weight.ravel(), values)
        self.waiting.append(Points(*(v[inside] for v in points)))
        self._left -= values.size


@dataclass(slots=True)
class _Seen:
    """What was seen of the signals of one island that are shown.

    Parameters
    ----------
    mine, columns : ndarray of int, shape (k,)
        Their columns among those of the island, and among those of the output points.
    """

    mine: Indices
    columns: Indices
    time: float = 0.0
    hidden: Floats = field(init=False)
    most: Floats = field(init=False)
    when: Floats = field(init=False)
    largest: Floats = field(init=False)

    def __post_init__(self) -> None:
        self.hidden, self.most, self.when, self.largest = np.zeros((4, self.mine.size))

    @classmethod
    def of(cls, island: Between, place: Mapping[str, int]) -> _Seen:
        """Return that of an island, before anything is seen."""
        shown = [(k, place[n]) for k, n in enumerate(island.names) if n in place]
        table = np.array(shown, dtype=np.intp).reshape(-1, 2)
        return cls(table[:, 0], table[:, 1])


@dataclass(slots=True)
class OutputPoints:
    """Compares what lies between output points with these.

    Parameters
    ----------
    names : sequence of str
        Signals in the columns of the output points, after the time.
    islands : sequence of Between
    """

    names: Sequence[str]
    islands: Sequence[Between]
    _last: Floats | None = None
    _seen: list[_Seen] = field(default_factory=list)
    _low: Floats = field(default_factory=lambda: np.zeros(0))
    _high: Floats = field(default_factory=lambda: np.zeros(0))

    def see(self, rows: Floats) -> None:
        """Compare with the next output points, shape (k, 1 + number of names)."""
        if rows.shape[0] == 0:
            return
        low, high = rows.min(axis=0), rows.max(axis=0)
        if self._last is None:
            self._low, self._high = low, high
        else:
            rows = np.concatenate([self._last, rows])
            self._low, self._high = np.minimum(low, self._low), np.maximum(high, self._high)
        self._last = rows[-1:].copy()
        if rows.shape[0] < 2:
            return
        if not self._seen:
            place = {name: 1 + k for k, name in enumerate(self.names)}
            self._seen = [_Seen.of(island, place) for island in self.islands]
        for island, seen in zip(self.islands, self._seen, strict=True):
            if not seen.mine.size or not island.waiting:
                continue
            points = Points(*(np.concatenate(v) for v in zip(*island.waiting, strict=True)))
            later = points.time > rows[-1, 0]
            island.waiting = [Points(*(v[later] for v in points))] if later.any() else []
            now = ~later & (points.time >= rows[0, 0])
            if now.any():
                at = Points(*(v[now] for v in points))
                self._compare(seen, at._replace(values=at.values[:, seen.mine]), rows)

    def _compare(self, seen: _Seen, points: Points, rows: Floats) -> None:
        time = rows[:, 0]
        near = _NEAR * float(time[-1] - time[0]) / (time.size - 1)
        k = np.searchsorted(time, points.time + near * points.side, "right") - 1
        k = np.clip(k, 0, time.size - 2)
        table = rows[:, seen.columns]
        left, right = table[k], table[k + 1]
        low, high = np.minimum(left, right), np.maximum(left, right)
        beyond = np.maximum(0.0, np.maximum(points.values - high, low - points.values))
        around = table[np.clip(k[:, np.newaxis] + _AROUND, 0, time.size - 1)]
        top = beyond.argmax(axis=0)
        sizes = np.maximum(np.abs(points.values).max(axis=0), np.abs(table).max(axis=0))
        off = beyond > np.maximum(_PART * np.ptp(around, axis=1), _TRACE * sizes)
        seen.hidden += points.weight @ off
        seen.time += float(points.weight.sum())
        seen.largest = np.maximum(seen.largest, sizes)
        most = beyond[top, np.arange(top.size)]
        further = most > seen.most
        seen.most[further], seen.when[further] = most[further], points.time[top[further]]

    @property
    def sizes(self) -> Floats:
        """The largest magnitude of each signal at the output points."""
        if self._last is None:
            return np.zeros(len(self.names))
        return np.maximum(np.abs(self._low), np.abs(self._high))[1:]

    def warning(self) -> Diagnostic | None:
        """Return what the output points do not show, None if they show enough."""
        hidden = []
        of_unit: dict[str, float] = {}
        for seen in self._seen:
            for column, largest in zip(seen.columns, seen.largest, strict=True):
                kind = unit(self.names[column - 1])
                of_unit[kind] = max(float(largest), of_unit.get(kind, 0.0))
        for seen in self._seen:
            for j in np.flatnonzero(seen.most > _TRACE * seen.largest):
                column, most, when = int(seen.columns[j]), float(seen.most[j]), float(seen.when[j])
                name = self.names[column - 1]
                # a current that is rounding next to the others may swing freely
                if most <= _ROUNDING * of_unit[unit(name)]:
                    continue
                span = float(self._high[column] - self._low[column])
                if seen.hidden[j] > _SHARE * seen.time or most > span:
                    hidden.append((most / float(seen.largest[j]), -column, name, most, when))
        if not hidden:
            return None
        hidden.sort(reverse=True)
        told = ", ".join(
            f"{name} by {most:.3g} {unit(name)} (at {when:.6g} s)"
            for _, _, name, most, when in hidden[:_NAMED]
        )
        more = f", and {len(hidden) - _NAMED} more" if len(hidden) > _NAMED else ""
        return Diagnostic(
            "NS5004",
            f"signals move between output points without being shown: {told}{more}",
            None,
            "use --all-points or a smaller tstep; .measure and sol.average() do not depend on it",
            severity="warning",
        )
