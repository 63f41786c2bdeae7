"""A counter that drives switches, in a run: its events and their instants."""

from __future__ import annotations

import math
from collections.abc import Callable

from ..request.converters import Pwm

#: at one instant registers are written, then loaded, then outputs turn
WRITE, LOAD, TURN = range(3)
#: instants nearer than this part of their time are one: multiples of periods differ by rounding
_SAME = 1e-12
#: ``post(instant, rank, function, argument)`` has ``function(instant, argument)`` called then
Post = Callable[[float, int, Callable[[float, float], None], float], None]
#: ``change(source, value, instant)``
Change = Callable[[str, float, float], None]


class Counter:
    """A counter in a run.

    Parameters
    ----------
    pwm : Pwm
    post, change : callable
        How events are asked for, and sources set.
    """

    def __init__(self, pwm: Pwm, post: Post, change: Change) -> None:
        self._pwm, self._post, self._change = pwm, post, change
        self._written = self._compare = pwm.rounded(pwm.duty)
        #: the output before dead times, and since when [s]
        self._on: bool | None = None
        self._since = -math.inf
        #: number of the present period, of the plans, and of the turns
        self._cycle = 0
        self._plan_number = self._turn_number = 0

    def begin(self) -> None:
        """Begin at t = 0, where the counter may be within a period."""
        phase = self._pwm.phase
        if phase > 0.0:
            self._cycle = -1
            self._plan(0.0)
            self._post_middle()
        self._post(phase, LOAD, self._next, 0.0 if phase > 0.0 else 1.0)

    @property
    def state(self) -> tuple[float, float, float]:
        """What is written and compared with, and the instant of the last turn before dead times."""
        return self._written, self._compare, self._since

    def begin_from(self, state: tuple[float, float, float], on: bool | None) -> None:
        """Begin at t = 0 as in the middle of a run; turns lie before t = 0."""
        self._written, self._compare, self._since = state
        self._on = on
        self.begin()
        if on is not None and self._since + self._pwm.dead_time > 0.0:
            self._turn_number += 1
            self._post(self._since + self._pwm.dead_time, TURN, self._turn_on, self._turn_number)

    @property
    def on(self) -> bool | None:
        """The output before dead times."""
        return self._on

    def write(self, instant: float, duty: float) -> None:
        """Write a duty cycle into the register."""
        self._written = self._pwm.rounded(duty)
        if self._pwm.load == "now":
            # after a period that begins at this instant
            self._post(instant, LOAD, self._take, 0.0)

    def _take(self, instant: float, _: float) -> None:
        self._compare = self._written
        self._plan(instant)

    def _start(self) -> float:
        return self._pwm.phase + self._cycle * self._pwm.period

    def _next(self, instant: float, first: float) -> None:
        """Begin a period."""
        self._cycle = 0 if first else self._cycle + 1
        if self._pwm.load in ("zero", "both"):
            self._compare = self._written
        self._plan(instant, 0.0)
        self._post_middle()
        following = self._pwm.phase + (self._cycle + 1) * self._pwm.period
        self._post(following, LOAD, self._next, 0.0)

    def _post_middle(self) -> None:
        middle = self._start() + 0.5 * self._pwm.period
        if self._pwm.load in ("top", "both") and middle > 0.0:
            self._post(middle, LOAD, self._top, 0.0)

    def _top(self, instant: float, _: float) -> None:
        self._compare = self._written
        self._plan(instant, 0.5)

    def _plan(self, instant: float, place: float | None = None) -> None:
        """Turn as the counter says at a place of its period, and ask for its turns after that."""
        start, period = self._start(), self._pwm.period
        if place is None:
            place = (instant - start) / period
        # instants that differ by rounding are one
        place += _SAME * instant / period
        parts = [part for part in self._pwm.on(self._compare) if part[0] < part[1]]
        self._plan_number += 1
        # another plan may follow at this instant
        on = any(a <= place < b for a, b in parts)
        self._post(instant, TURN, self._edge, self._plan_number if on else -self._plan_number)
        for a, b in parts:
            for edge, number in ((a, self._plan_number), (b, -self._plan_number)):
                if place < edge < 1.0:
                    self._post(start + edge * period, TURN, self._edge, number)

    def _edge(self, instant: float, number: float) -> None:
        """Turn on, or off for a negative number, if the plan is still the present one."""
        if abs(number) == self._plan_number:
            self._turn(instant, number > 0)

    def _turn(self, instant: float, on: bool) -> None:
        if on == self._on:
            return
        first, self._on, self._since = self._on is None, on, instant
        self._turn_number += 1
        pwm = self._pwm
        low = pwm.levels[0]
        if not on or first:
            self._change(pwm.output, low, instant)
        if pwm.complement is not None and (on or first):
            self._change(pwm.complement, low, instant)
        if pwm.dead_time == 0.0:
            self._turn_on(instant, self._turn_number)
        else:
            at = instant + pwm.dead_time
            self._post(at, TURN, self._turn_on, self._turn_number)

    def _turn_on(self, instant: float, number: float) -> None:
        """Turn the output on whose turn it is, unless there has been another one since."""
        if number != self._turn_number:
            return
        output = self._pwm.output if self._on else self._pwm.complement
        if output is not None:
            self._change(output, self._pwm.levels[1], instant)
