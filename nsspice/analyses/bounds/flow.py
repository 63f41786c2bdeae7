"""Motion along a segment: ``w' = A w`` for a duration, as a Taylor series in time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...problems.csc import Floats
from ...problems.taylor import Models, Unbounded, stacked

#: of a series of one step; beyond, the duration is divided
_LARGEST = 2.0
#: steps of a segment at most
_STEPS = 400
#: what is left of a series, as a part of the rounding of its first term
_LEFT = 1e-17


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a segment: ``w(s) = sum of terms[k] s^k`` with s from 0 to 1.

    Parameters
    ----------
    terms : Models, shape (k, w)
        The last one is what is left of the series, for all s.
    """

    terms: Models

    def along(self, row: Models) -> Models:
        """Return coefficients of a row along the piece, shape (k,), the rest in the first."""
        found = (self.terms @ row[:, None])[:, 0]
        result = found[:-1].copy()
        result.remainder[0] += self.left(row)
        return result

    def left(self, row: Models) -> float:
        """Return a bound of what is left of the series of a row."""
        return float((self.terms[-1:] @ row[:, None]).bound()[0, 0])


def _scaled(bound: Floats, scale: Floats) -> float:
    """Return the maximum norm of a matrix in scaled states."""
    return float((scale[:, None] * bound / scale).sum(axis=1).max(initial=0.0))


def steps_of(matrix: Models, duration: Models, scale: Floats) -> int:
    """Return into how many steps a duration is divided.

    Raises
    ------
    Unbounded
        If there are too many.
    """
    size = _scaled(matrix.bound() * float(duration.bound()), scale)
    count = max(1, math.ceil(size / _LARGEST))
    if count > _STEPS:
        raise Unbounded("time constants far below the period")
    return int(2 ** math.ceil(math.log2(count)))  # so that parts are exact


def move(
    matrix: Models, duration: Models, start: Models, scale: Floats, count: int | None = None
) -> tuple[Models, list[Piece]]:
    """Return the change of w over a duration, and the pieces on the way.

    Parameters
    ----------
    matrix : Models, shape (w, w)
    duration : Models, shape ()
        [s]
    start : Models, shape (w, c)
        Columns: w, and its derivatives by unknowns.
    scale : ndarray, shape (w,)
        Factors that make states comparable.
    count : int, optional
        Steps.

    Returns
    -------
    change : Models, shape (w, c)
    pieces : list of Piece
        Of the first column.
    """
    count = steps_of(matrix, duration, scale) if count is None else count
    step = matrix * (duration * (1.0 / count))[None, None]  # a power of two
    norm = _scaled(step.bound(), scale)
    change = Models.constant(matrix.home, np.zeros(start.shape))
    pieces = []
    for _ in range(count):
        here = start + change
        term, terms = here, [here[:, 0]]
        size = scale[:, None] * here.bound()
        first = size.max(axis=0)
        k = 0
        moved = Models.constant(matrix.home, np.zeros(start.shape))
        while True:
            k += 1
            term = (step @ term).over(k)
            moved = moved + term
            terms.append(term[:, 0])
            largest = (scale[:, None] * term.bound()).max(axis=0)
            if (k > norm and (largest <= _LEFT * first).all()) or k > 60:
                break
        # the terms after the k-th are below a geometric series of ratio norm / (k + 2)
        left = largest * norm / (k + 1) / (1.0 - norm / (k + 2))
        rest = left[None, :] / scale[:, None] * (1.0 + 1e-9)
        moved.remainder = moved.remainder + rest
        tail = Models.constant(matrix.home, np.zeros(start.shape[0]))
        tail.remainder = rest[:, 0]
        pieces.append(Piece(stacked([*terms, tail])))
        change = change + moved
    return change, pieces
