"""Signs of functions of time over all parameters of a box, by Bernstein's coefficients.

A polynomial lies in the hull of its coefficients in Bernstein's basis (G. Farin, *Curves and
Surfaces for CAGD*, 2002, ch. 6); on parts of the interval these come nearer to it.
"""

from __future__ import annotations

import math
from functools import lru_cache
from math import comb

import numpy as np

from ...problems.csc import Floats
from ...problems.taylor import Models, combined

#: how often an interval is halved
_DEPTH = 6


@lru_cache(maxsize=64)
def _basis(degree: int) -> Floats:
    """Return the matrix that turns powers into Bernstein's coefficients."""
    return np.array(
        [
            [comb(i, j) / comb(degree, j) if j <= i else 0.0 for j in range(degree + 1)]
            for i in range(degree + 1)
        ]
    )


@lru_cache(maxsize=64)
def _half(degree: int) -> Floats:
    """Return the matrix that gives the coefficients of the left half (de Casteljau)."""
    return np.array(
        [
            [comb(i, j) * 0.5**i if j <= i else 0.0 for j in range(degree + 1)]
            for i in range(degree + 1)
        ]
    )


def bernstein(powers: Models) -> Models:
    """Return Bernstein's coefficients of a polynomial on [0, 1], shape (k,)."""
    return combined(_basis(powers.shape[0] - 1), powers)


def halves(coefficients: Models) -> tuple[Models, Models]:
    """Return Bernstein's coefficients on both halves."""
    matrix = _half(coefficients.shape[0] - 1)
    return combined(matrix, coefficients), combined(matrix[::-1, ::-1], coefficients)


def slope(powers: Models) -> Models:
    """Return the derivative of a polynomial in powers; the remainder stays in its first term."""
    k = powers.shape[0]
    if k < 2:
        return Models.constant(powers.home, np.zeros(1))
    return powers[1:] * np.arange(1.0, k)


def smallest(coefficients: Models) -> float:
    """Return a lower bound on an interval."""
    return float(coefficients.range()[0].min())


def positive(
    powers: Models, rate: Models | None = None, *, starts: bool = False, ends: bool = False
) -> bool:
    """Return whether a function is proved to be positive inside of an interval.

    Parameters
    ----------
    powers : Models, shape (k,)
        The function.
    rate : Models, shape (k,), optional
        Its derivative.
    starts, ends : bool
        It is exactly zero there: near it the sign of the derivative decides.
    """
    slopes = bernstein(rate if rate is not None else slope(powers))
    return _least(bernstein(powers), slopes, starts, ends, _DEPTH, False) > 0.0


def deepest(powers: Models, *, starts: bool, ends: bool) -> float:
    """Return how far a function goes below zero at most; arguments as for :func:`positive`."""
    slopes = bernstein(slope(powers))
    return max(0.0, -_least(bernstein(powers), slopes, starts, ends, _DEPTH, True))


def _least(
    values: Models, slopes: Models, starts: bool, ends: bool, depth: int, whole: bool
) -> float:
    """Return a lower bound, infinity where it is positive; without ``whole`` the first not so."""
    least = smallest(values)
    if least > 0.0 or (starts and smallest(slopes) > 0.0) or (ends and smallest(-slopes) > 0.0):
        return math.inf
    if depth == 0:
        return least
    one, two = halves(values)
    first, second = halves(slopes)
    left = _least(one, first, starts, False, depth - 1, whole)
    if left <= 0.0 and not whole:
        return left
    return min(left, _least(two, second, False, ends, depth - 1, whole))
