"""A periodic orbit for all parameters of a box: enclosed, and its order of events proved.

Unknown are the states at the beginning and the durations that conditions end.  Newton's method on
polynomials gives them up to the degree of the models; for what is left, :math:`\\xi`,

.. math::

    N(\\xi) = \\xi - Y F(X + \\xi) \\in -Y F(X) + (I - Y F') \\xi

maps a box into itself, so that there is one orbit in it, and only one, for every parameter
(R. Krawczyk, Computing 4 (1969) 187, doi:10.1007/BF02234767).  Y is a polynomial, too.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...problems.csc import Floats
from ...problems.descriptor import Functional
from ...problems.taylor import Models, Space
from ..gradients.carried import Lost
from .arrays import Arrays, model_of
from .elimination import solve
from .flow import Piece, move
from .mode import Mode
from .nominal import Nominal
from .signs import positive
from .sources import edges, period_of

#: nearer than this part of the period the end of a section is an edge of a source
_AT_EDGE = 1e-8
#: a condition that ends a section, as a part of its value at the beginning
_ENDED = 1e-6
#: attempts to enclose the orbit
_ATTEMPTS = 6


class NotProved(Exception):
    """Something is not proved for all of a box.

    Parameters
    ----------
    message : str
    models : Models, optional
        Functions whose signs decide.

    Attributes
    ----------
    weights : ndarray, shape (n,), or None
        How much each parameter takes part in it.
    inherent : bool
        Whether it is the functions that differ within the box, not their enclosures that are wide.
    """

    def __init__(self, message: str, models: Models | None = None) -> None:
        super().__init__(message)
        self.weights: Floats | None = None
        self.inherent = False
        if models is not None:
            n, size = models.home.variables, models.home.size
            linear = np.abs(models.coefficients.reshape(-1, size)[:, 1 : 1 + n])
            self.weights = linear.max(axis=0)
            self.inherent = bool(models.remainder.max() < 0.1 * linear.sum(axis=1).max())


@dataclass(slots=True)
class Segment:
    """A part of the period with one mode.

    Parameters
    ----------
    mode : Mode
    until : float or None
        Instant of its end [s]; None if a condition ends it.
    guard : Models or None
        That condition, as a row on w.
    key : (str, int) or None
        Which one it is.
    unknown : int
        Number of its duration among the unknowns, -1 if ``until`` fixes it.
    """

    mode: Mode
    until: float | None
    guard: Models | None = None
    key: tuple[str, int] | None = None
    unknown: int = -1


@dataclass(slots=True)
class Run:
    """One period from given unknowns.

    Parameters
    ----------
    residual : Models, shape (X,)
        F.
    jacobian : Models, shape (X, X), or None
    starts : list of Models
        w and its derivatives at the beginning of each segment.
    durations : list of Models
    pieces : list of list of Piece
    changes : list of Models
        Of w over each segment.
    """

    residual: Models
    jacobian: Models | None
    starts: list[Models] = field(default_factory=list)
    durations: list[Models] = field(default_factory=list)
    pieces: list[list[Piece]] = field(default_factory=list)
    changes: list[Models] = field(default_factory=list)


class Orbit:
    """The orbit of an island over a box.

    Parameters
    ----------
    arrays : Arrays
    nominal : Nominal
        That of the middle.

    Attributes
    ----------
    segments : list of Segment
    period : Models
        [s]
    unknowns : Models, shape (X,)
        States and durations, enclosed.
    run : Run
        With them.

    Raises
    ------
    Lost, Unbounded, NotProved
        If it cannot be enclosed.
    """

    def __init__(self, arrays: Arrays, nominal: Nominal) -> None:
        self.home: Space = arrays.home
        self._arrays, self._nominal = arrays, nominal
        period = period_of(arrays.waveforms, nominal.stop)
        self.period = model_of(self.home, period)
        self.segments, guess = self._segments(period)
        self.scale = self._scale()
        self._steps: list[int] = []
        self.unknowns = self._enclosed(guess)
        self.run = self.through(self.unknowns, False)

    def _segments(self, period: float) -> tuple[list[Segment], Floats]:
        """Return the segments and the first guess of the unknowns."""
        nominal, stop = self._nominal, self._nominal.stop
        times = edges(self._arrays.waveforms, stop)
        sections = nominal.sections
        cuts: list[tuple[float, float | None]] = [(s.start, None) for s in sections]
        for k, (at, _) in enumerate(cuts):
            near = [t for t in times if abs(float.__add__(t, 0.0) - at) < _AT_EDGE * stop]
            if near:
                cuts[k] = at, near[0]
        if cuts[0][1] is not None and cuts[0][1] != 0.0:
            raise Lost("an edge of a source moves across the beginning of the period")
        segments: list[Segment] = []
        states: list[int] = []
        durations: list[float] = []
        for k, section in enumerate(sections):
            end = sections[k + 1].start if k + 1 < len(sections) else stop
            until = cuts[k + 1][1] if k + 1 < len(sections) else period
            inner = [
                t
                for t in times
                if section.start + _AT_EDGE * stop < float.__add__(t, 0.0) < end - _AT_EDGE * stop
            ]
            begin = section.start
            for t in [*inner, until]:
                finish = end if t is None or t is until else float.__add__(t, 0.0)
                mode = Mode(self._arrays, sorted(section.active), 0.5 * (begin + finish))
                states = mode.states
                segment = Segment(mode, t)
                if t is None:
                    after = sections[(k + 1) % len(sections)].active
                    self._find_guard(segment, section.active ^ after, k, end)
                    segment.unknown = len(durations)
                    durations.append(finish - begin)
                segments.append(segment)
                begin = finish
        first = sections[0].first[states]
        for segment in segments:
            if segment.unknown >= 0:
                segment.unknown += len(states)
        self._check_entries(segments)
        return segments, np.concatenate([first, durations])

    def _w(self, z: Floats, states: list[int], time: float, width: int) -> Floats:
        w = np.zeros(width)
        w[: len(states)] = z[states]
        w[len(states)], w[len(states) + 1] = 1.0, time
        return w

    def _find_guard(self, segment: Segment, changed: frozenset[int], k: int, end: float) -> None:
        """Find the condition that ends a section; it must be one."""
        section, mode = self._nominal.sections[k], segment.mode
        first = self._w(section.first, mode.states, section.start, mode.width)
        last = self._w(section.last, mode.states, end, mode.width)
        found = []
        for key, row in mode.guards():
            kind, number = key
            pair = number if kind == "pair" else self._arrays.switches[number].pair
            middle = row.middle
            begin, finish = abs(float(middle @ first)), abs(float(middle @ last))
            size = max(begin, float(np.abs(middle * last).max()))
            if pair in changed and finish <= _ENDED * size:
                found.append((key, row))
        if len(found) != 1:
            raise NotProved(f"{len(found) or 'no'} conditions end at {end:g} s together")
        segment.key, segment.guard = found[0]

    def _check_entries(self, segments: list[Segment]) -> None:
        """Refuse modes whose states must jump when they are entered."""
        for k, segment in enumerate(segments):
            before = segments[k - 1]
            if segment.mode.regular or before.mode.active == segment.mode.active:
                continue
            rows = segment.mode.conditions
            for row in range(rows.shape[0]):
                places = np.flatnonzero(~rows[row].nothing)
                guard = before.guard
                if (
                    guard is None
                    or places.size != 1
                    or not np.array_equal(np.flatnonzero(~guard.nothing), places)
                ):
                    raise Lost("a mode that states enter by a jump")

    def _scale(self) -> Floats:
        """Return factors that make the parts of w comparable."""
        mode = self.segments[0].mode
        stored = np.abs(self._arrays.E.middle[:, mode.states]).max(axis=0)
        states = np.sqrt(stored)
        ends = np.array([z[mode.states] for s in self._nominal.sections for z in (s.first, s.last)])
        size = float((states * np.abs(ends)).max(initial=0.0))
        size, stop = size or 1.0, self._nominal.stop
        outputs = [1.0] * (mode.width - len(mode.states) - 2)
        for k in range(len(outputs)):
            row = mode.matrix[len(mode.states) + 2 + k].bound()
            first = self._w(self._nominal.sections[0].first, mode.states, 0.0, mode.width)
            outputs[k] = size / (stop * (float(row @ np.abs(first)) or 1.0))
        return np.concatenate([states, [size, size / stop], outputs])

    def through(self, unknowns: Models, derive: bool) -> Run:
        """Return a period from given unknowns, with derivatives by them if wanted."""
        home = self.home
        count = unknowns.shape[0]
        mode = self.segments[0].mode
        x, width = len(mode.states), mode.width
        columns = 1 + count if derive else 1
        w = Models.constant(home, np.zeros((width, columns)))
        w[:x, 0] = unknowns[:x]
        w[x, 0] = Models.constant(home, 1.0)
        if derive:
            for k in range(x):
                w[k, 1 + k] = Models.constant(home, 1.0)
        begin = w
        change = Models.constant(home, np.zeros((width, columns)))
        #: time since the last instant that is fixed, with its derivatives
        fixed = Models.constant(home, 0.0)
        since = Models.constant(home, np.zeros(columns))
        rows: list[Models] = []
        run = Run(Models.constant(home, np.zeros(count)), None)
        for segment in self.segments:
            duration = Models.constant(home, np.zeros(columns))
            if segment.unknown >= 0:
                duration[0] = unknowns[segment.unknown]
                if derive:
                    duration[1 + segment.unknown] = Models.constant(home, 1.0)
                since = since + duration
            else:
                assert segment.until is not None
                until = model_of(home, segment.until)
                duration = -since
                duration[0] = duration[0] + (until - fixed)
                fixed, since = until, Models.constant(home, np.zeros(columns))
            matrix = segment.mode.matrix
            self._enter(segment, w, change, begin)
            run.starts.append(w)
            moved, pieces = move(matrix, duration[0], w, self.scale)
            if derive:
                rate = matrix @ (w[:, :1] + moved[:, :1])
                moved[:, 1:] = moved[:, 1:] + rate * duration[1:][None, :]
            run.pieces.append(pieces)
            run.durations.append(duration[0])
            run.changes.append(moved)
            w, change = w + moved, change + moved
            if segment.guard is not None:
                rows.append((segment.guard[None, :] @ w)[0])
        values = Models.constant(home, np.zeros((count, columns)))
        values[:x] = change[:x]
        for k, row in enumerate(rows):
            values[x + k] = row
        run.residual = values[:, 0]
        if derive:
            run.jacobian = values[:, 1:]
        return run

    def _enter(self, segment: Segment, w: Models, change: Models, begin: Models) -> None:
        """Set states to the zero that the condition before has brought them to."""
        mode = segment.mode
        if mode.regular:
            return
        for row in range(mode.conditions.shape[0]):
            place = int(np.flatnonzero(~mode.conditions[row].nothing)[0])
            if place < len(mode.states):
                w[place] = Models.constant(self.home, np.zeros(w.shape[1]))
                change[place] = -begin[place]

    def _enclosed(self, guess: Floats) -> Models:
        """Return the unknowns for all parameters."""
        home = self.home
        found = Models.constant(home, guess)
        for _ in range(4 + home.degree.bit_length()):
            run = self.through(found, True)
            assert run.jacobian is not None
            step = solve(run.jacobian, run.residual[:, None])[:, 0]
            coefficients = found.coefficients - step.coefficients
            done = np.abs(step.coefficients).sum(axis=1) <= 1e-13 * np.abs(coefficients).sum(axis=1)
            found = Models(home, coefficients, np.zeros(guess.size))
            if done.all():
                break
        if not np.isfinite(found.coefficients).all():
            raise NotProved("Newton's method did not find the orbit")
        residual = self.through(found, False).residual
        radius: Floats = np.zeros(guess.size)
        inverse: Models | None = None
        for _ in range(_ATTEMPTS):
            run = self.through(Models(home, found.coefficients, radius), True)
            assert run.jacobian is not None
            if inverse is None:
                one = Models.constant(home, np.eye(guess.size))
                inverse = solve(run.jacobian, one)
                inverse.remainder = np.zeros_like(inverse.remainder)
            left = (inverse @ residual[:, None]).bound()[:, 0]
            away = (Models.constant(home, np.eye(guess.size)) - inverse @ run.jacobian).bound()
            if not np.isfinite(away).all() or np.abs(np.linalg.eigvals(away)).max() >= 0.9:
                raise NotProved("the orbit is not proved to be unique")
            reach = (left + away @ radius) * (1.0 + 1e-12)
            if (reach < radius).all():
                return Models(home, found.coefficients, reach)
            wide = np.linalg.solve(np.eye(guess.size) - away, left)
            radius = np.asarray(2.0 * wide + 1e-300, dtype=float)
        raise NotProved("the orbit is not proved to exist")

    def output(self, number: int) -> Functional:
        """Return a signal that is looked at."""
        return self._arrays.outputs[number]

    def prove_order(self) -> None:
        """Prove that the modes follow each other as in the middle.

        Raises
        ------
        NotProved
        """
        for k, segment in enumerate(self.segments):
            before = self.segments[k - 1]
            if float(self.run.durations[k].range()[0]) <= 0.0:
                raise NotProved("a segment may vanish", self.run.durations[k])
            pieces = self.run.pieces[k]
            for key, row in segment.mode.guards():
                starts = key == before.key and segment.mode.regular
                for number, piece in enumerate(pieces):
                    last = number + 1 == len(pieces)
                    powers = piece.along(row)
                    if not positive(
                        powers,
                        starts=starts and number == 0,
                        ends=last and key == segment.key,
                        rate=piece.along((row[None, :] @ segment.mode.matrix)[0]),
                    ):
                        raise NotProved(f"the order of events ({key[0]} {key[1]})", powers)
