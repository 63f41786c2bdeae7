"""The shortest time that is a multiple of several periods."""

from __future__ import annotations

import math
from collections.abc import Sequence

#: periods are multiples of each other up to so many roundings of numbers that decks state
_SAME = 1e-9
#: of more periods a fraction of one is lost in that
_WHOLE = 0.1 / _SAME
#: of the longest period
_MULTIPLES = 10_000


def common(periods: Sequence[float]) -> float | None:
    """Return the common period [s]: None without any, nan if there is none.

    Parameters
    ----------
    periods : sequence of float
        [s]

    Examples
    --------
    >>> common([1e-5, 2.5e-6, 4e-6])
    2e-05
    >>> common([1.0, 2.0**0.5])
    nan
    """
    if not periods:
        return None
    longest = max(periods)
    for count in range(1, _MULTIPLES + 1):
        total = count * longest
        if all(is_multiple(total, period) for period in periods):
            return total
    return math.nan


def is_multiple(total: float, period: float) -> bool:
    """Return whether a time holds a whole number of periods, up to rounding.

    Of so many periods that rounding hides whether they are whole it does not.

    Examples
    --------
    >>> is_multiple(0.3, 0.1), is_multiple(0.35, 0.1), is_multiple(1e300, 0.1)
    (True, False, False)
    """
    ratio = total / period
    return (
        0.5 < ratio <= _WHOLE and round(ratio) >= 1 and abs(ratio - round(ratio)) <= _SAME * ratio
    )
