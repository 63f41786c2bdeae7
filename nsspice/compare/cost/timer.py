"""Times of short runs: the least of many, taken in two turns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace

from ...errors import NsspiceError
from .report import Measurement

_SHORT = 0.1  # [s] shorter runs are repeated until so much is spent
_REPEATS = (2, 19)  # at least and at most

#: Runs once and returns the time [s].
Run = Callable[[], float]


class Timer:
    """Repeats short runs at once, and again when all others are done; the least time counts.

    The speed of a shared machine varies for seconds by half: what is repeated within a tenth of a
    second only is slow as a whole.

    Examples
    --------
    >>> from nsspice.compare.cost import Measurement
    >>> timer, times = Timer(), iter([3e-2] * 3 + [2e-2] * 5)
    >>> seconds = timer.least("moreau", 1e-6, 4e-2, lambda: next(times))
    >>> row = Measurement("moreau", "h", 1e-6, 10, 0.1, 0.1, seconds)
    >>> row.seconds, timer.second_turn([row])[0].seconds
    (0.03, 0.02)
    """

    def __init__(self) -> None:
        self._runs: dict[tuple[str, str], Run] = {}

    def least(self, method: str, value: float, seconds: float, run: Run) -> float:
        """Return the least time of a run with these settings that took so long the first time.

        Parameters
        ----------
        method : str
        value : float
            Of the varied parameter.
        seconds : float
            Of the first run [s].
        run : callable
            Runs once more and returns the time [s].
        """
        self._runs[method, repr(value)] = run  # what has no parameter has nan
        return _least(seconds, run)

    def second_turn(self, rows: Sequence[Measurement]) -> list[Measurement]:
        """Return the measurements with the least times of both turns.

        What fails the second time keeps the time of the first.
        """
        found = list(rows)
        for k, row in enumerate(rows):
            run = self._runs.get((row.method, repr(row.value)))
            if run is not None:
                with suppress(NsspiceError):
                    found[k] = replace(row, seconds=_least(row.seconds, run))
        return found


def _least(seconds: float, run: Run) -> float:
    return min([seconds, *(run() for _ in range(_repeats(seconds)))])


def _repeats(seconds: float) -> int:
    """Return how often a run is repeated that took so long [s].

    Examples
    --------
    >>> _repeats(1e-3), _repeats(0.02), _repeats(0.09), _repeats(0.2)
    (19, 5, 2, 0)
    """
    least, most = _REPEATS
    return 0 if seconds >= _SHORT else min(most, max(least, int(_SHORT / seconds)))
