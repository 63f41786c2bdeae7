"""When controllers are called and sources change: the events of a run with controllers."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from heapq import heappop, heappush, heapreplace

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, UsageError
from ..request.controller import Controller
from ..request.converters import Adc, Pwm
from ..request.request import Request
from .counter import WRITE, Counter
from .held import HeldSources
from .memory import Memory

#: instants nearer than this part of their time are one: multiples of periods differ by rounding
_SAME = 1e-12
#: events that are worked out before the circuit follows
_AHEAD = 4096
#: at one instant signals are sampled, then controllers are called
_SAMPLE, _CALL = range(2)

Event = tuple[float, int, int, Callable[[float, float], None], float]


class Schedule:
    """The events of a run.

    Parameters
    ----------
    sources : HeldSources
    controllers : tuple of Controller
        With canonical names.
    stop : float
        End of the run [s].
    memory : Memory, optional
        What the controllers remember, and have just read, if the run is the middle of another one.
    halt : float, optional
        Where the run waits, before what happens there [s].
    """

    def __init__(
        self,
        sources: HeldSources,
        controllers: tuple[Controller, ...],
        stop: float,
        memory: Memory | None = None,
        halt: float = math.inf,
    ) -> None:
        self.sources, self.controllers, self.stop = sources, controllers, stop
        self._halt, self.memory = halt, memory
        self._events: list[Event] = []
        #: what is to be done at the present instant, and how late that may be
        self._due: list[tuple[int, int, Callable[[float, float], None], float]] = []
        self._latest = -math.inf
        self._count = 0
        #: all signals that are read, each once
        self.reads = list(
            dict.fromkeys(
                read.signal if isinstance(read, Adc) else read
                for controller in controllers
                for read in controller.reads
            )
        )
        self.counters: list[Counter] = []
        self._calls = [_Calls(self, controller) for controller in controllers]
        if memory is not None:
            self._remember(memory)
        #: instant, kind, controller, which of its calls, which of its reads
        self._waits: list[tuple[float, int, int, int, int]] = []
        for k, calls in enumerate(self._calls):
            for wait in calls.first_waits(k):
                heappush(self._waits, wait)
        if memory is None:
            for counter in self.counters:
                counter.begin()

    @classmethod
    def of(
        cls,
        circuit: Circuit,
        controllers: tuple[Controller, ...],
        stop: float,
        memory: Memory | None = None,
        halt: float = math.inf,
    ) -> Schedule:
        """Return the schedule of controllers whose names are canonical."""
        if memory is None:
            sources = HeldSources.of(circuit, (n for c in controllers for n in c.sources))
        else:
            sources = HeldSources(dict(memory.sources))
        return cls(sources, controllers, stop, memory, halt)

    def _remember(self, memory: Memory) -> None:
        for counter, there, on in zip(self.counters, memory.counters, memory.outputs, strict=True):
            counter.begin_from(there, on)
        samples = iter(memory.samples)
        for calls, state in zip(self._calls, memory.states, strict=True):
            calls.remember(state, samples)
        for instant, k, j, value in memory.pending:
            self.post(instant, WRITE, self._calls[k].writes[j], value)

    def memory_at(self, instant: float, reads: Sequence[float]) -> Memory:
        """Return what is remembered where the run waits, and read there; times count from there."""
        places = {id(w): (k, j) for k, c in enumerate(self._calls) for j, w in enumerate(c.writes)}
        pending = sorted(event for event in self._events if event[1] == WRITE)
        counters = [counter.state for counter in self.counters]
        return Memory(
            tuple(reads),
            dict(self.sources.values),
            tuple(calls.state for calls in self._calls),
            tuple(own for calls in self._calls for own in calls.samples),
            tuple((event[0] - instant, *places[id(event[3])], event[4]) for event in pending),
            tuple((written, compare, since - instant) for written, compare, since in counters),
            tuple(counter.on for counter in self.counters),
        )

    def wanted(self, request: Request) -> Request:
        """Return a request that records also what is read, and simulates all that is set.

        Raises
        ------
        UsageError
            NS4005 if rows at all points are asked for.
        """
        if request.all_points:
            message = "rows at all points are not shown where controllers or delays set sources"
            raise UsageError(Diagnostic("NS4005", message, hint="leave all_points out"))
        return replace(request, extra=(*request.extra, *self.reads), everything=True)

    def values(self, request: Request) -> dict[str, float]:
        """Return the values by element name that replace those of the deck, held ones included."""
        return {**request.values, **self.sources.overrides}

    @property
    def starts_with_a_sample(self) -> bool:
        """True if something is read at t = 0."""
        return bool(self._waits) and self._waits[0][0] <= 0.0

    def post(
        self, instant: float, rank: int, function: Callable[[float, float], None], argument: float
    ) -> None:
        """Have a function called at an instant [s]."""
        self._count += 1
        if instant <= self._latest:
            heappush(self._due, (rank, self._count, function, argument))
        else:
            heappush(self._events, (instant, rank, self._count, function, argument))

    def call(self, time: float, values: Callable[[], Sequence[float]]) -> None:
        """Take the samples and call the controllers whose instant it is.

        Parameters
        ----------
        time : float
            [s]
        values : callable
            Returns the values of ``reads``.
        """
        waits, latest = self._waits, time * (1.0 + _SAME)
        if not waits or waits[0][0] > latest:
            return
        read = values()
        while waits[0][0] <= latest:
            _, kind, k, n, j = waits[0]
            calls = self._calls[k]
            if kind == _CALL:
                calls.run(time, read)
            else:
                calls.sample(j, read)
            heapreplace(waits, (calls.instant(n + 1, j), kind, k, n + 1, j))

    def go_on(self) -> None:
        """Work out all changes up to the next sample, and hold the sources to it."""
        upcoming = min(self._waits[0][0] if self._waits else math.inf, self._halt)
        ends = upcoming >= self.stop * (1.0 - _SAME)
        if ends:  # beyond the end nothing has to wait
            upcoming = 2.0 * self.stop + 1.0
        events, before = self._events, (self.stop if ends else upcoming) * (1.0 - _SAME)
        if events and events[0][0] < before:
            upcoming = self._change_up_to(before, upcoming)
        self.sources.hold(upcoming)

    def _change_up_to(self, before: float, upcoming: float) -> float:
        """Work out the changes before an instant; return up to where all are known [s]."""
        events, left = self._events, _AHEAD
        while events and events[0][0] < before:
            if left <= 0 and events[0][0] > self.sources.known:
                return events[0][0]
            left -= self._work_off(events[0][0])
        return upcoming

    def _work_off(self, instant: float) -> int:
        """Do what is to be done at an instant in order; return how much that was."""
        events, due, count = self._events, self._due, 0
        self._latest = instant * (1.0 + _SAME)
        while events and events[0][0] <= self._latest:
            heappush(due, heappop(events)[1:])
        while due:
            _, _, function, argument = heappop(due)
            function(instant, argument)
            count += 1
        self._latest = -math.inf
        return count


class _Calls:
    """The calls of one controller."""

    def __init__(self, schedule: Schedule, controller: Controller) -> None:
        self._schedule, self._controller = schedule, controller
        self._step, self._delay = controller.step, controller.delay
        reads = [r if isinstance(r, Adc) else Adc(r) for r in controller.reads]
        self._places = [schedule.reads.index(read.signal) for read in reads]
        self._converters = [read if isinstance(read, Adc) else None for read in controller.reads]
        self._plain = not any(self._converters)
        self._delays = [0.0 if c is None else c.delay for c in self._converters]
        #: what was sampled and is not used yet, of each read with a delay
        self._samples = {j: deque[float]() for j, delay in enumerate(self._delays) if delay}
        self.writes = [self._writer(write) for write in controller.writes]

    def _writer(self, write: str | Pwm) -> Callable[[float, float], None]:
        if isinstance(write, str):
            change = self._schedule.sources.change
            return lambda instant, value: change(write, value, instant)
        counter = Counter(write, self._schedule.post, self._schedule.sources.change)
        self._schedule.counters.append(counter)
        return counter.write

    @property
    def state(self) -> tuple[float, ...]:
        """What its function remembers."""
        return tuple(float(v) for v in getattr(self._step, "state", ()))

    @property
    def samples(self) -> list[tuple[float, ...]]:
        """What its converters have sampled."""
        return [tuple(own) for own in self._samples.values()]

    def remember(self, state: Sequence[float], samples: Iterator[tuple[float, ...]]) -> None:
        """Go on from a state of the function, with samples that are taken in order."""
        if state:
            self._step.state = list(state)  # type: ignore[attr-defined]
        for own in self._samples.values():
            own.extend(next(samples))

    def first_waits(self, k: int) -> list[tuple[float, int, int, int, int]]:
        """Return when it is called, and its converters sample, for the first time."""
        taken = {j: len(own) for j, own in self._samples.items()}
        samples = [(self.instant(n, j), _SAMPLE, k, n, j) for j, n in taken.items()]
        return [(self.instant(0, -1), _CALL, k, 0, -1), *samples]

    def instant(self, n: int, j: int) -> float:
        """Return when it is called for the n-th time, or what is read then is sampled."""
        called = self._controller.offset + n * self._controller.period
        return called if j < 0 else max(0.0, called - self._delays[j])

    def sample(self, j: int, read: Sequence[float]) -> None:
        """Take a sample."""
        self._samples[j].append(read[self._places[j]])

    def run(self, time: float, read: Sequence[float]) -> None:
        """Call it, and write what it returns."""
        if self._plain:
            found = self._step(time, tuple([read[place] for place in self._places]))
        else:
            found = self._step(time, self._converted(read))
        writes, delay = self.writes, self._delay
        if found.__class__ is float and len(writes) == 1 and math.isfinite(found):
            if not delay:
                writes[0](time, found)
            else:
                self._schedule.post(time + delay, WRITE, writes[0], found)
            return
        if found is None:
            return
        for write, value in zip(writes, _results(self._controller, found), strict=True):
            if value is not None:
                self._schedule.post(time + delay, WRITE, write, value)

    def _converted(self, read: Sequence[float]) -> tuple[float, ...]:
        """Return what the converters make of the present values, or of earlier ones."""
        values = [read[place] for place in self._places]
        for j, converter in enumerate(self._converters):
            if converter is not None:
                own = self._samples.get(j)
                values[j] = converter.convert(own.popleft() if own else values[j])
        return tuple(values)


def _results(controller: Controller, found: object) -> list[float | None]:
    """Return one value for each source, None where it stays.

    Raises
    ------
    UsageError
        NS4005 for anything else.
    """
    count = len(controller.writes)
    values = [found] if isinstance(found, int | float | np.number) else found
    try:
        numbers = [None if v is None else float(v) for v in values]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != count or not all(v is None or math.isfinite(v) for v in numbers):
        message = f"a controller that sets {', '.join(controller.sources)} has returned {found!r}"
        hint = f"return {count} finite number{'s' * (count != 1)}, or None"
        raise UsageError(Diagnostic("NS4005", message, hint=hint))
    return numbers
