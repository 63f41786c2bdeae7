"""Runs with digital controllers: islands wait at sampling instants until sources are set.

Sources that a controller sets are held values which are known up to the next instant at which
anything may happen; an engine goes no further than its sources are known.  An island without such a
source waits for a clock, a source that nothing contains.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...circuit import Circuit
from ...devices import CurrentSource, VoltageSource
from ...errors import Diagnostic, UsageError
from ...solvers.polynomial import Polynomial
from ..request.cards import Tran
from ..request.controller import Controller
from ..request.interrupts import Interrupts
from ..request.notebook_progress import Progress
from ..request.recorder import Recorder
from ..request.request import Request
from ..signals.curve import Floats
from .advance import Outlet
from .island_runner import IslandRunner, Stopped

#: rows of one island that are computed in one call
_ROWS = 512
#: instants nearer than this part of their time are one: multiples of periods differ by rounding
_SAME = 1e-12


@dataclass(slots=True)
class HeldSources:
    """Sources that are set from outside, and the clock for which all islands wait.

    Parameters
    ----------
    values : dict of str to float
        The value of each source now, at first that of the deck [V or A].
    """

    values: dict[str, float]
    held: dict[str, Polynomial] = field(init=False)
    clock: Polynomial = field(init=False)
    #: up to where all of them are known [s]
    known: float = 0.0

    def __post_init__(self) -> None:
        self.renew(self.values)

    @classmethod
    def of(cls, circuit: Circuit, names: Iterable[str]) -> HeldSources:
        """Return independent sources of a circuit by name, with their own values."""
        return cls({name: _own_value(circuit, name) for name in names})

    def renew(self, before: Mapping[str, float]) -> None:
        """Begin a new run, before which the sources had other values."""
        self.held = {name: Polynomial.held(value) for name, value in before.items()}
        self.clock = Polynomial.held(0.0, steady=True)
        self.known = 0.0

    def hold(self, to: float) -> None:
        """Hold all sources to an instant [s]."""
        self.known = to
        for name, source in self.held.items():
            source.hold(self.values[name], to)
        self.clock.hold(0.0, to)

    @property
    def overrides(self) -> dict[str, float]:
        """The held values, to be put in place of those of the deck."""
        return dict(self.held)  # type: ignore[arg-type]


@dataclass(slots=True)
class Schedule:
    """When which controller is called and which source changes.

    Parameters
    ----------
    sources : HeldSources
    controllers : tuple of Controller
        With canonical names.
    stop : float
        End of the run [s].
    """

    sources: HeldSources
    controllers: tuple[Controller, ...]
    stop: float
    _calls: list[int] = field(init=False)
    _changes: list[tuple[float, int, str, float]] = field(default_factory=list)
    _count: int = 0

    def __post_init__(self) -> None:
        self._calls = [0] * len(self.controllers)

    @classmethod
    def of(cls, circuit: Circuit, controllers: tuple[Controller, ...], stop: float) -> Schedule:
        """Return the schedule of controllers whose names are canonical."""
        sources = HeldSources.of(circuit, (n for c in controllers for n in c.writes))
        return cls(sources, controllers, stop)

    def wanted(self, request: Request) -> Request:
        """Return a request that records also what is read, and simulates all that is set.

        Raises
        ------
        UsageError
            NS4005 if rows at all points are asked for.
        """
        if request.all_points:
            message = "rows at all points are not shown where controllers set sources"
            raise UsageError(Diagnostic("NS4005", message, hint="leave all_points out"))
        return replace(request, extra=(*request.extra, *self.reads), everything=True)

    def values(self, request: Request) -> dict[str, float]:
        """Return the values by element name that replace those of the deck, held ones included."""
        return {**request.values, **self.sources.overrides}

    @property
    def reads(self) -> list[str]:
        """All signals that are read, each once."""
        return list(dict.fromkeys(name for c in self.controllers for name in c.reads))

    @property
    def starts_with_a_call(self) -> bool:
        """True if a controller is called at t = 0."""
        return any(c.offset == 0.0 for c in self.controllers)

    def _next_call(self, k: int) -> float:
        controller = self.controllers[k]
        return controller.offset + self._calls[k] * controller.period

    def call(self, time: float, values: dict[str, float]) -> None:
        """Call the controllers whose instant it is, and change the sources whose instant it is."""
        near = _SAME * time
        for k, controller in enumerate(self.controllers):
            if self._next_call(k) > time + near:
                continue
            self._calls[k] += 1
            found = controller.step(time, tuple(values[name] for name in controller.reads))
            for name, value in zip(controller.writes, _results(controller, found), strict=True):
                if value is not None:
                    self._count += 1
                    heapq.heappush(
                        self._changes, (time + controller.delay, self._count, name, value)
                    )
        while self._changes and self._changes[0][0] <= time + near:
            _, _, name, value = heapq.heappop(self._changes)
            self.sources.values[name] = value

    def go_on(self) -> None:
        """Hold all sources to the next instant at which something may happen."""
        instants = [self._next_call(k) for k in range(len(self.controllers))]
        if self._changes:
            instants.append(self._changes[0][0])
        later = [t for t in instants if t > self.sources.known * (1.0 + _SAME)]
        upcoming = min(later, default=math.inf)
        # beyond the end nothing has to wait
        ends = upcoming >= self.stop * (1.0 - _SAME)
        self.sources.hold(2.0 * self.stop + 1.0 if ends else upcoming)


def started(
    schedule: Schedule, prepare: Callable[[], list[IslandRunner]], recorder: Recorder
) -> list[IslandRunner]:
    """Return the runners of all islands after their start.

    A controller that is called at t = 0 reads what the run begins with; a new run then begins,
    with what it has set as an edge of its sources at t = 0.
    """
    before = dict(schedule.sources.values)
    schedule.go_on()
    runners = prepare()
    for runner in runners:
        runner.start()
    if not schedule.starts_with_a_call:
        return runners
    schedule.call(0.0, read(runners, recorder, begin=True))
    schedule.sources.renew(before)
    schedule.go_on()
    runners = prepare()
    for runner in runners:
        runner.start()
    return runners


def advance_controlled(
    runners: Sequence[IslandRunner],
    schedule: Schedule,
    outlet: Outlet,
    analysis: Tran,
    progress: Progress | None,
    interrupts: Interrupts,
) -> bool:
    """Advance all islands from instant to instant; return True if Ctrl-C stopped it.

    Raises
    ------
    NumericalError
        The failure of an island.
    """
    waiting = [_Rows(runner.width) for runner in runners]
    while True:
        failed = None
        for runner, rows in zip(runners, waiting, strict=True):
            try:
                to_the_wait(runner, rows.take, interrupts)
            except Stopped as stopped:
                rows.take(stopped.rows)
                failed = failed or (runner, stopped.problem)
        count = min(rows.count for rows in waiting)
        if count:
            parts = [rows.give(count) for rows in waiting]
            block = np.hstack([parts[0], *(part[:, 1:] for part in parts[1:])])
            outlet.write(np.ascontiguousarray(block))
        if failed is not None:
            runner, problem = failed
            raise runner.failure(problem) from problem
        time = schedule.sources.known
        if time >= analysis.stop:
            return False
        schedule.call(time, read(runners, outlet.recorder))
        schedule.go_on()
        if progress is not None:
            progress(time / analysis.stop)
        interrupts.check()


class _Rows:
    """Rows of one island that wait for those of the others."""

    def __init__(self, width: int) -> None:
        self._width = width
        self._parts: list[Floats] = []
        self.count = 0

    def take(self, rows: Floats) -> None:
        """Keep rows; they are copied, since engines use their buffers again."""
        if rows.shape[0]:
            self._parts.append(rows.copy())
            self.count += rows.shape[0]

    def give(self, count: int) -> Floats:
        """Return the first rows."""
        rows = self._parts[0] if len(self._parts) == 1 else np.concatenate(self._parts)
        rest = rows[count:]
        self._parts, self.count = [rest] if rest.size else [], rest.shape[0]
        return rows[:count]


def to_the_wait(
    runner: IslandRunner, take: Callable[[Floats], None], interrupts: Interrupts
) -> None:
    """Advance an island to where it waits, or to its end; its rows are taken as they come."""
    while True:
        take(runner.advance(_ROWS))
        if runner.stepper.waits or runner.stepper.done:
            return
        interrupts.check()


def _own_value(circuit: Circuit, name: str) -> float:
    """Return the value of a source before anything sets it."""
    device = circuit.device(name)
    assert isinstance(device, VoltageSource | CurrentSource)
    return device.source.dc or 0.0


def _results(controller: Controller, found: object) -> list[float | None]:
    """Return one value for each source, None where it stays.

    Raises
    ------
    UsageError
        NS4005 for anything else.
    """
    count = len(controller.writes)
    if found is None:
        return [None] * count
    values = [found] if isinstance(found, int | float | np.number) else found
    try:
        numbers = [None if v is None else float(v) for v in values]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != count or not all(v is None or math.isfinite(v) for v in numbers):
        message = f"a controller that sets {', '.join(controller.writes)} has returned {found!r}"
        hint = f"return {count} finite number{'s' * (count != 1)}, or None"
        raise UsageError(Diagnostic("NS4005", message, hint=hint))
    return numbers


def read(
    runners: Sequence[IslandRunner], recorder: Recorder, begin: bool = False
) -> dict[str, float]:
    """Return all signals at the begin of a run, or just before the instant at which it waits."""
    parts = [runner.stepper.at_wait(begin) for runner in runners]
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        message = "the run begins with implicit steps: nothing can be sampled at t = 0"
        raise UsageError(Diagnostic("NS4005", message, hint="give the controller an offset"))
    recorded = np.concatenate(known)[None, :]
    if not recorder.direct:
        recorded = recorder.signals(recorded)
    return dict(zip(recorder.names, recorded[0].tolist(), strict=True))
