"""Delays: what a signal was some time ago drives an element, as the run goes on.

Steps with error control leave polynomials of a signal; shifted by the delay they are a source that
is known that much ahead.  Engines go no further than their sources are known, and wait there.  They
wait within a piece, whose second half is handed on with the next one: what jumps between two pieces
is known before it is reached.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, UsageError
from ...netlist.deck import Delay
from ...solvers.polynomial import Polynomial
from ..request.cards import Tran
from ..request.recorder import Recorder
from ..request.request import Request
from ..signals.curve import Floats
from ..signals.signal_function import places
from .island_runner import IslandRunner

#: steps in the shortest delay at least: one that was as long as it would wait for itself
_STEPS = 4.0
#: a step of a value, relative to the largest so far, that is more than rounding of a solution
_JUMP = 1e-9
#: what two pieces may differ by from one polynomial, in units of the error of a step, and at least
_MERGED, _EXACT = 1e-2, 1e-13
#: the part of the largest of all signals below which one has no scale of its own: rounding of the
#: others is not what jumps there
_SMALL = 1e-3
#: change of a slope over a piece, relative to the largest value, at which no step has to end
_KINK = 1e-3


class Delays:
    """The delays of a run.

    Parameters
    ----------
    circuit : Circuit
    reltol : float
        Error of a step.
    """

    def __init__(self, circuit: Circuit, reltol: float) -> None:
        found = circuit.deck.delays
        self._circuit = circuit
        self._links = [_Link(delay, max(_EXACT, _MERGED * reltol)) for delay in found]

    @property
    def signals(self) -> list[str]:
        """What is delayed."""
        return list(dict.fromkeys(link.delay.signal for link in self._links))

    @property
    def longest_step(self) -> float:
        """The longest step that does not wait for itself [s]."""
        return min(link.delay.delay for link in self._links) / _STEPS

    @property
    def known(self) -> float:
        """Up to where all of them are known [s]."""
        return min(link.handed.end() for link in self._links)

    @property
    def values(self) -> dict[str, float]:
        """What the elements are driven by, to be put in place of the deck's."""
        handed = {link.delay.element: link.handed for link in self._links}
        return dict(handed)  # type: ignore[arg-type]

    def begin(self, request: Request, analysis: Tran) -> None:
        """Say what has been before the run: the operating point, or nothing with ``uic``."""
        before = dict.fromkeys(self.signals, 0.0)
        if not analysis.uic:
            from ..static.statics import run_op

            wanted = replace(request, signals=self.signals, extra=(), controllers=(), sink=None)
            point = run_op(self._circuit, replace(wanted, progress=None))
            before = {name: float(point[name][0]) for name in self.signals}
        for link in self._links:
            link.begin(before[link.delay.signal])

    def attend(self, runners: Sequence[IslandRunner], recorder: Recorder) -> None:
        """Find where the signals are recorded.

        Raises
        ------
        UsageError
            NS4020 for a method without polynomials.
        """
        for link in self._links:
            (home, local, _), *rest = self._circuit.parts(link.delay.signal)
            assert not rest
            runner = runners[home]
            if runner.method not in ("sdirk", "modewise"):
                message = f"method={runner.method} cannot handle delays"
                hint = "method=auto and method=sdirk can"
                raise UsageError(Diagnostic("NS4020", message, link.delay.span, hint))
            link.attend(runner, recorder.local[home].index(local))

    def hand_over(self, runners: Sequence[IslandRunner]) -> None:
        """Take what the islands have recorded since the last time."""
        for runner in runners:
            runner.hand_over()
        largest = _SMALL * max(link.largest for link in self._links)
        for link in self._links:
            link.largest = max(link.largest, largest)
            link.take()
        for runner in runners:
            runner.delayed = []


class _Link:
    """One delay."""

    def __init__(self, delay: Delay, same: float) -> None:
        self.delay, self.handed, self._same = delay, Polynomial(), same
        #: scale of the signal: the largest value so far
        self.largest = 0.0
        self._end = self._slope = 0.0

    def begin(self, value: float) -> None:
        self.handed = Polynomial()
        self.handed.begin_with(value)
        half = 0.5 * self.delay.delay
        self.handed.push(0.0, half, [value], False)
        self._rest: tuple[float, float, list[float]] = half, half, [value]
        self.largest, self._end, self._slope = abs(value), value, 0.0

    def attend(self, runner: IslandRunner, column: int) -> None:
        self._runner, self._column = runner, runner.followed.index(column)

    def take(self) -> None:
        """Hand new pieces on, shifted."""
        count = len(self._runner.followed)
        for table in self._runner.delayed:
            points = (table.shape[1] - 2) // count
            first = 2 + self._column * points
            whole: _Piece | None = None
            for row in table:
                if row[1] <= 0.0:
                    continue
                piece = _Piece(row[0], row[1], row[first : first + points])
                self.largest = max(self.largest, float(np.abs(piece.values).max()))
                if whole is None:
                    whole = piece
                elif (longer := whole.followed_by(piece, self._same * self.largest)) is not None:
                    whole = longer
                else:
                    self._push(whole)
                    whole = piece
            if whole is not None:
                self._push(whole)

    def _push(self, piece: _Piece) -> None:
        self.handed.push(*self._rest, False)
        coefficients = _to_chebyshev(piece.values.size) @ piece.values
        degrees = np.arange(coefficients.size) ** 2
        signs = np.where(np.arange(coefficients.size) % 2 == 0, -1.0, 1.0)
        # slopes at the ends of [-1, 1]: T_k'(1) = k^2
        start = 2.0 / piece.length * float((signs * degrees) @ coefficients)
        jump = abs(piece.values[0] - self._end) > _JUMP * self.largest
        kink = abs(start - self._slope) * piece.length > _KINK * self.largest
        at, half = piece.begin + self.delay.delay, 0.5 * piece.length
        first, second = (part @ coefficients for part in _halves(coefficients.size))
        self.handed.push(at, half, first.tolist(), bool(jump or kink))
        self._rest = at + half, half, second.tolist()
        self._end = float(piece.values[-1])
        self._slope = 2.0 / piece.length * float(degrees @ coefficients)


class _Piece(NamedTuple):
    """A polynomial by its values at the points of a piece."""

    begin: float
    length: float
    values: Floats

    def at(self, times: Floats) -> Floats:
        """Return values at some instants."""
        x = 2.0 * (times - self.begin) / self.length - 1.0
        coefficients = _to_chebyshev(self.values.size) @ self.values
        return np.asarray(np.polynomial.chebyshev.chebval(x, coefficients))

    def followed_by(self, other: _Piece, tolerance: float) -> _Piece | None:
        """Return one piece for two, None if they are not one polynomial within a tolerance.

        Without that each piece would end a step of what it drives, whose pieces come back.
        """
        points = places(self.values.size)
        own, others = (p.begin + p.length * points for p in (self, other))
        end = other.begin + other.length
        times = self.begin + (end - self.begin) * points
        early = times <= other.begin
        values = np.where(early, self.at(times), other.at(times))
        whole = _Piece(self.begin, end - self.begin, values)
        off = max(
            float(np.abs(whole.at(own) - self.values).max()),
            float(np.abs(whole.at(others) - other.values).max()),
        )
        return whole if off <= tolerance else None


@lru_cache
def _halves(count: int) -> tuple[Floats, Floats]:
    """Return the matrices from Chebyshev coefficients to those of both halves of a piece."""
    x = 2.0 * places(count) - 1.0
    parts = (np.polynomial.chebyshev.chebvander(0.5 * (x + s), count - 1) for s in (-1.0, 1.0))
    first, second = (_to_chebyshev(count) @ part for part in parts)
    return first, second


@lru_cache
def _to_chebyshev(points: int) -> Floats:
    """Return the matrix from values at the points of a piece to Chebyshev coefficients."""
    x = 2.0 * places(points) - 1.0
    matrix = np.polynomial.chebyshev.chebvander(x, points - 1)
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
