"""Parts of a PWL that are repeated: ``REPEAT FOR n (...) ENDREPEAT``, ``REPEAT FOREVER``.

PSpice's and LTspice's form.  The times between the words count from where the part begins, and each
turn begins where the one before ended.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import Span
from ..findings import Unreadable

#: points of one source, written out
MAX_POINTS = 1_000_000


@dataclass(frozen=True, slots=True)
class Repetition:
    """A part of the values of a PWL, and how often it is gone through.

    Parameters
    ----------
    first, last : int
        It is ``values[first:last]``.
    count : float
        Number of turns; ``inf`` repeats to the end of the run.
    span : Span
    """

    first: int
    last: int
    count: float
    span: Span


def written_out(
    values: Sequence[float], relative: Sequence[int], parts: Sequence[Repetition]
) -> tuple[list[float], float | None]:
    """Return all points of a PWL, and the time from which it repeats, None if it does not.

    Parameters
    ----------
    values : sequence of float
        Times and values in turn, as written.
    relative : sequence of int
        Places of times that count from the time before.
    parts : sequence of Repetition
        In order.  Times outside of them that follow one are relative.

    Raises
    ------
    Unreadable
        If a number of turns is not whole, a part takes no time, or the points are too many.

    Examples
    --------
    >>> here = Span("a.net", 2, 1)
    >>> written_out([0.0, 5.0, 1.0, 0.0], (), [Repetition(0, 4, 2.0, here)])
    ([0.0, 5.0, 1.0, 0.0, 1.0, 5.0, 2.0, 0.0], None)
    >>> written_out([0.0, 5.0, 1.0, 0.0], (), [Repetition(0, 4, math.inf, here)])
    ([0.0, 5.0, 1.0, 0.0], 0.0)
    """
    marked = set(relative)
    points: list[float] = []
    at = 0
    for part in parts:
        _add(points, values, marked, at, part.first)
        at = part.last
        turn = _turn(values, marked, part)
        if math.isinf(part.count):
            begin = points[-2] if points else 0.0
            if not points and turn[0] == 0.0:
                return turn, 0.0
            # the second turn leads from the last value to the first one, which the first does not
            _append(points, turn, begin)
            repeat = points[-2]
            _append(points, turn, repeat)
            return points, repeat
        if part.count < 1.0 or part.count % 1.0:
            message = f"a part of a PWL cannot be repeated {part.count:g} times"
            hint = "write REPEAT FOR n with a whole number above zero, or REPEAT FOREVER"
            raise Unreadable("NS1009", message, part.span, hint)
        if len(points) + part.count * len(turn) > 2 * MAX_POINTS:
            message = f"a PWL has more than {MAX_POINTS} points, written out"
            raise Unreadable("NS1043", message, part.span, "repeat it FOREVER, or use PULSE")
        for _ in range(int(part.count)):
            _append(points, turn, points[-2] if points else 0.0)
    _add(points, values, marked, at, len(values))
    return points, None


def _add(
    points: list[float], values: Sequence[float], marked: set[int], first: int, last: int
) -> None:
    """Append points outside repeated parts."""
    for k in range(first, last, 2):
        before = points[-2] if k in marked and points else 0.0
        points += (before + values[k], values[k + 1])


def _turn(values: Sequence[float], marked: set[int], part: Repetition) -> list[float]:
    """Return the points of a repeated part, with times from its beginning on."""
    turn: list[float] = []
    _add(turn, values, marked, part.first, part.last)
    if not turn[-2] > 0.0:
        message = "a part of a PWL with zero length cannot be repeated"
        raise Unreadable(
            "NS1009", message, part.span, "the last time is the length of one repetition"
        )
    return turn


def _append(points: list[float], turn: list[float], begin: float) -> None:
    """Append one turn."""
    for k in range(0, len(turn), 2):
        points += (begin + turn[k], turn[k + 1])
