"""The range of a polynomial over the box [-1, 1]^n, proved from both sides."""

from __future__ import annotations

import heapq
from functools import lru_cache
from math import comb

import numpy as np

from .csc import Floats
from .taylor import Models, Space

#: of the width of the range
_ENOUGH = 1e-4
#: boxes at most
_BOXES = 2000


@lru_cache(maxsize=512)
def _placed(home: Space, variable: int, middle: float, radius: float) -> Floats:
    """Return the matrix of a substitution ``delta -> middle + radius * delta`` in one variable."""
    matrix = np.zeros((home.size, home.size))
    place = {tuple(p): k for k, p in enumerate(home.powers.tolist())}
    for k, powers in enumerate(home.powers.tolist()):
        p = powers[variable]
        for q in range(p + 1):
            other = list(powers)
            other[variable] = q
            matrix[place[tuple(other)], k] += comb(p, q) * middle ** (p - q) * radius**q
    return matrix


@lru_cache(maxsize=512)
def _slopes(home: Space, variable: int) -> Floats:
    """Return the matrix of the derivative by a variable."""
    matrix = np.zeros((home.size, home.size))
    place = {tuple(p): k for k, p in enumerate(home.powers.tolist())}
    for k, powers in enumerate(home.powers.tolist()):
        if powers[variable]:
            other = list(powers)
            other[variable] -= 1
            matrix[place[tuple(other)], k] = powers[variable]
    return matrix


def _hull(home: Space, c: Floats) -> tuple[float, float]:
    low, high = Models(home, c, np.zeros(())).range()
    return float(low), float(high)


def largest(models: Models) -> tuple[float, float]:
    """Return an upper bound of a function, and a value that it attains or exceeds.

    Variables in which the polynomial is monotone go to their ends, the others are halved, the most
    promising part first.

    Parameters
    ----------
    models : Models, shape ()

    Examples
    --------
    >>> from nsspice.problems.taylor import space
    >>> x = Models.variable(space(1, 2), 0.0, 1.0, 0)
    >>> bound, attained = largest(x - x * x)
    >>> bool(0.25 <= bound < 0.2501), bool(0.2499 < attained <= 0.25)
    (True, True)
    """
    home = models.home
    whole = models.coefficients
    spread = float(np.abs(whole[1:]).sum())
    moving = [v for v in range(home.variables) if whole[home.powers[:, v] > 0].any()]
    heap = [(-_hull(home, whole)[1], 0, whole, tuple(moving), 0)]
    attained, count, closed, deepest = -np.inf, 0, -np.inf, 0
    while heap:
        top = -heap[0][0]
        if top <= attained + _ENOUGH * spread or count > _BOXES:
            break
        _, _, c, left, depth = heapq.heappop(heap)
        count += 1
        free = []
        deepest = max(deepest, depth + len(left) + 1)
        for v in left:
            low, high = _hull(home, _slopes(home, v) @ c)
            if low >= 0.0 or high <= 0.0:
                c = _placed(home, v, 1.0 if low >= 0.0 else -1.0, 0.0) @ c
            else:
                free.append(v)
        attained = max(attained, float(c[0]))
        if not free:
            closed = max(closed, float(c[0]))
            continue
        # the one whose range of slopes makes most difference
        widths = [np.ptp(_hull(home, _slopes(home, v) @ c)) for v in free]
        v = free[int(np.argmax(widths))]
        for middle in (-0.5, 0.5):
            part = _placed(home, v, middle, 0.5) @ c
            bound = _hull(home, part)[1]
            if bound > attained:
                heapq.heappush(
                    heap, (-bound, 2 * count + (middle > 0.0), part, tuple(free), depth + 1)
                )
    bound = max(attained, closed, -heap[0][0] if heap else -np.inf)
    # each substitution rounds sums of at most so many terms, and lets no sum of magnitudes grow
    rounding = deepest * (home.size + 2) * 2.0**-52 * float(np.abs(whole).sum())
    slack = (float(models.remainder) + rounding) * (1.0 + 2.0**-50)
    return bound + slack, attained - slack
