"""Between a digital controller and a circuit: converters and counters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ...errors import Diagnostic, UsageError

_MOST_BITS = 52


@dataclass(frozen=True, slots=True)
class Adc:
    """An analogue-to-digital converter among the ``reads`` of a controller.

    Parameters
    ----------
    signal : str
        What is converted.
    bits : int
        Codes run from 0 to ``2**bits - 1``.
    low, high : float
        Range [V or A]; one code is ``(high - low)/2**bits``, beyond the range the last code stays.
    delay : float
        From the sample to the result [s]: the controller gets what was sampled that much before
        it is called.

    Examples
    --------
    >>> Adc("v(out)", bits=2, high=4.0).convert(1.4), Adc("v(out)", bits=2, high=4.0).convert(9.0)
    (1.0, 3.0)
    """

    signal: str
    bits: int = 12
    low: float = 0.0
    high: float = 1.0
    delay: float = 0.0

    def convert(self, value: float) -> float:
        """Return the nearest value that has a code [V or A]."""
        step = (self.high - self.low) / (1 << self.bits)
        code = math.floor((value - self.low) / step + 0.5)
        return self.low + step * min(max(code, 0), (1 << self.bits) - 1)

    def check(self) -> None:
        """Refuse impossible numbers.

        Raises
        ------
        UsageError
            NS4005
        """
        if not (isinstance(self.bits, int) and 1 <= self.bits <= _MOST_BITS):
            raise wrong(f"a converter cannot have {self.bits!r} bits", f"give 1 to {_MOST_BITS}")
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            message = f"a converter cannot have the range {self.low!r} to {self.high!r}"
            raise wrong(message, "give low below high")
        if not 0.0 <= self.delay < math.inf:
            message = f"the delay of a converter cannot be {self.delay!r}"
            raise wrong(message, "give seconds")


@dataclass(frozen=True, slots=True)
class Pwm:
    """A counter with a compare register among the ``writes`` of a controller.

    The controller returns a duty cycle, 0 to 1.  The output is ``levels[1]`` while the counter is
    below the compare register, otherwise ``levels[0]``; its edges are exact instants.

    Parameters
    ----------
    output : str
        The V or I source that is set.
    period : float
        Of the counter [s].
    counter : str
        ``up``: the output is on at the start of each period; ``down``: at its end; ``updown``: on
        both sides of the start, at which the counter is zero.
    complement : str, optional
        The source that is set to the inverse.
    dead_time : float
        From the edge that turns one output off to that which turns the other one on [s].
    load : str
        When the compare register takes what was written: at ``zero`` (the start of a period), at
        ``top`` (the middle of one that counts up and down), at ``both``, or ``now``.  What is
        written at such an instant is taken then.
    ticks : int, optional
        Counts from zero to the top: duty cycles are rounded to multiples of ``1/ticks``.
    phase : float
        Start of the first full period [s].
    duty : float
        Before anything is written.
    levels : (float, float)
        Values of the sources, off and on [V or A].
    """

    output: str
    period: float
    counter: Literal["up", "down", "updown"] = "up"
    complement: str | None = None
    dead_time: float = 0.0
    load: Literal["zero", "top", "both", "now"] = "zero"
    ticks: int | None = None
    phase: float = 0.0
    duty: float = 0.0
    levels: tuple[float, float] = (0.0, 1.0)

    @property
    def outputs(self) -> tuple[str, ...]:
        """The sources that are set."""
        return (self.output,) if self.complement is None else (self.output, self.complement)

    def rounded(self, duty: float) -> float:
        """Return the duty cycle that the compare register holds."""
        duty = min(max(duty, 0.0), 1.0)
        return duty if self.ticks is None else math.floor(duty * self.ticks + 0.5) / self.ticks

    def on(self, duty: float) -> list[tuple[float, float]]:
        """Return the parts of a period in which the output is on.

        Examples
        --------
        >>> Pwm("vg", 1e-5, "updown").on(0.5)
        [(0.0, 0.25), (0.75, 1.0)]
        """
        if self.counter == "up":
            return [(0.0, duty)]
        if self.counter == "down":
            return [(1.0 - duty, 1.0)]
        return [(0.0, 0.5 * duty), (1.0 - 0.5 * duty, 1.0)] if duty < 1.0 else [(0.0, 1.0)]

    def check(self) -> None:
        """Refuse impossible numbers.

        Raises
        ------
        UsageError
            NS4005
        """
        if not 0.0 < self.period < math.inf:
            raise wrong(f"the period of a counter cannot be {self.period!r}", "give seconds")
        if not (0.0 <= self.dead_time < 0.5 * self.period):
            message = f"the dead time of a counter cannot be {self.dead_time!r}"
            raise wrong(message, "give seconds, less than half of the period")
        if not (0.0 <= self.phase < self.period):
            message = f"the phase of a counter cannot be {self.phase!r}"
            raise wrong(message, "give seconds, less than the period")
        if self.counter not in ("up", "down", "updown"):
            raise wrong(f"no counter counts {self.counter!r}", "give up, down or updown")
        loads = ("zero", "now", "top", "both") if self.counter == "updown" else ("zero", "now")
        if self.load not in loads:
            message = f"a counter that counts {self.counter} cannot load at {self.load!r}"
            raise wrong(message, f"give {', '.join(loads)}")
        if self.ticks is not None and not (isinstance(self.ticks, int) and self.ticks >= 1):
            raise wrong(f"a counter cannot have {self.ticks!r} ticks", "give a whole number")
        if not 0.0 <= self.duty <= 1.0:
            raise wrong(f"the duty cycle of a counter cannot be {self.duty!r}", "give 0 to 1")
        if not (len(self.levels) == 2 and all(map(math.isfinite, self.levels))):
            raise wrong(f"a counter cannot have the levels {self.levels!r}", "give two numbers")


def wrong(message: str, hint: str) -> UsageError:
    """Return the error about an impossible value."""
    return UsageError(Diagnostic("NS4005", message, hint=hint))
