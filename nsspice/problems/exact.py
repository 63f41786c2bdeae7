"""Linear algebra and linear programs without rounding: numbers are integers over one denominator.

A floating-point number is a rational one, so that questions on given matrices have exact answers.
Pivoting keeps integers (J. Edmonds; D. Avis, K. Fukuda): all entries of a tableau share the
determinant of its basis as denominator, by which each update divides without remainder.  Bland's
rule ends every program.

Reference: A. Schrijver, *Theory of Linear and Integer Programming* (1986), sections 3.3 and 11.3.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from .csc import Floats

#: entries of a tableau up to which a program is solved: about a second
MOST = 4000
#: rows up to which all principal minors are formed, and all modes of a problem looked at
SUBSETS = 8


class Empty(Exception):
    """A linear program has no feasible point."""


def maximise(
    cost: Sequence[float], C: Floats, d: Sequence[float], *, nonnegative: bool = False
) -> Fraction | None:
    """Return the largest value of ``cost . x`` with ``C x <= d``, None if it is unbounded.

    Parameters
    ----------
    cost : sequence of float, length n
    C : ndarray, shape (k, n)
    d : sequence of float, length k
    nonnegative : bool
        Whether ``x >= 0`` is asked for as well.

    Raises
    ------
    Empty
        If there is no such x.

    Examples
    --------
    >>> import numpy as np
    >>> maximise([1.0], np.array([[3.0]]), [1.0])
    Fraction(1, 3)
    """
    rows = [[Fraction(float(x)) for x in row] for row in C]
    right = [Fraction(float(x)) for x in d]
    price = [Fraction(float(x)) for x in cost]
    if not nonnegative:  # x = x+ - x-
        rows = [[*row, *(-x for x in row)] for row in rows]
        price = [*price, *(-x for x in price)]
    tableau = _Tableau(rows, right)
    if not tableau.feasible():
        raise Empty
    return tableau.best(price)


def feasible(C: Floats, d: Sequence[float], *, nonnegative: bool = False) -> bool:
    """Return whether some x has ``C x <= d``, and ``x >= 0`` if asked for.

    Examples
    --------
    >>> import numpy as np
    >>> feasible(np.array([[1.0], [-1.0]]), [-1.0, -1.0])
    False
    """
    try:
        maximise([0.0] * C.shape[1], C, d, nonnegative=nonnegative)
    except Empty:
        return False
    return True


class _Tableau:
    """The program ``A x + s = b``, ``x, s >= 0`` in integers, with a column for each x, s and b."""

    def __init__(self, A: list[list[Fraction]], b: list[Fraction]) -> None:
        k, n = len(A), len(A[0]) if A else 0
        self.n, self.width = n, n + k
        self.rows: list[list[int]] = []
        self.scales: list[int] = []
        for i, (row, right) in enumerate(zip(A, b, strict=True)):
            unit = [Fraction(int(i == j)) for j in range(k)]
            whole = [*row, *unit, right]
            scale = 1
            for x in whole:
                scale = max(scale, x.denominator)  # powers of two: the largest is a multiple of all
            self.rows.append([int(x * scale) for x in whole])
            self.scales.append(scale)
        self.basis = [n + i for i in range(k)]
        self.by = 1
        # slacks scaled with their rows are units again
        for i in range(k):
            self.rows[i][n + i] = 1

    def feasible(self) -> bool:
        """Pivot to a feasible basis; return whether there is one.

        By the auxiliary variable that all rows share (A. Schrijver, section 11.2).
        """
        worst = min(range(len(self.rows)), key=lambda i: self.rows[i][-1], default=None)
        if worst is None or self.rows[worst][-1] >= 0:
            return True
        for row in self.rows:
            row.insert(-1, -1)
        extra = self.width
        self.width += 1
        self._pivot(worst, extra)
        price = [0] * self.width
        price[extra] = -1
        self._climb(price)
        if extra in self.basis:
            place = self.basis.index(extra)
            if self.rows[place][-1] > 0:
                return False
            column = next((j for j in range(extra) if self.rows[place][j]), None)
            if column is not None:
                self._pivot(place, column)
        kept = [i for i, j in enumerate(self.basis) if j != extra]
        self.rows = [self.rows[i] for i in kept]
        self.basis = [self.basis[i] for i in kept]
        for row in self.rows:
            del row[extra]
        self.width -= 1
        return True

    def best(self, price: list[Fraction]) -> Fraction | None:
        """Return the largest value of a linear function of x, None if it is unbounded."""
        scale = max((x.denominator for x in price), default=1)
        whole = [int(x * scale) for x in price] + [0] * (self.width - self.n)
        if not self._climb(whole):
            return None
        total = sum(whole[j] * row[-1] for j, row in zip(self.basis, self.rows, strict=True))
        return Fraction(total, self.by) / scale

    def _climb(self, price: list[int]) -> bool:
        """Pivot by Bland's rule to the best basis; return False if there is none."""
        while True:
            # reduced costs times the common denominator
            inside = set(self.basis)
            for column in range(self.width):
                if column in inside:
                    continue
                gain = price[column] * self.by - sum(
                    price[j] * row[column] for j, row in zip(self.basis, self.rows, strict=True)
                )
                if gain > 0:
                    break
            else:
                return True
            place: int | None = None
            for i, row in enumerate(self.rows):
                if row[column] <= 0:
                    continue
                if place is None:
                    place = i
                    continue
                ours, theirs = (
                    row[-1] * self.rows[place][column],
                    self.rows[place][-1] * row[column],
                )
                if ours < theirs or (ours == theirs and self.basis[i] < self.basis[place]):
                    place = i
            if place is None:
                return False
            self._pivot(place, column)

    def _pivot(self, place: int, column: int) -> None:
        pivot = self.rows[place]
        by = pivot[column]
        for i, row in enumerate(self.rows):
            if i == place:
                continue
            factor = row[column]
            self.rows[i] = [
                (x * by - factor * y) // self.by for x, y in zip(row, pivot, strict=True)
            ]
        self.by = by
        self.basis[place] = column
        if by < 0:
            self.by = -by
            self.rows = [[-x for x in row] for row in self.rows]


def semidefinite(matrix: npt.ArrayLike) -> bool:
    """Return whether ``x . Mx >= 0`` for all x, by elimination.

    Examples
    --------
    >>> semidefinite([[1.0, 1.0], [1.0, 1.0]]), semidefinite([[1.0, 1.0], [1.0, 1.0 - 2.0**-52]])
    (True, False)
    """
    m = _fractions(matrix)
    n = len(m)
    both = [[m[i][j] + m[j][i] for j in range(n)] for i in range(n)]
    for k in range(n):
        if both[k][k] < 0 or (both[k][k] == 0 and any(both[k][j] for j in range(k, n))):
            return False
        if both[k][k] == 0:
            continue
        for i in range(k + 1, n):
            factor = both[i][k] / both[k][k]
            if factor:
                both[i] = [x - factor * y for x, y in zip(both[i], both[k], strict=True)]
    return True


def determinant(matrix: npt.ArrayLike) -> Fraction:
    """Return a determinant.

    Examples
    --------
    >>> determinant([[1.0, 2.0], [3.0, 4.0]])
    Fraction(-2, 1)
    """
    m = _fractions(matrix)
    n, value = len(m), Fraction(1)
    for k in range(n):
        place = next((i for i in range(k, n) if m[i][k]), None)
        if place is None:
            return Fraction(0)
        if place != k:
            m[k], m[place], value = m[place], m[k], -value
        value *= m[k][k]
        for i in range(k + 1, n):
            factor = m[i][k] / m[k][k]
            if factor:
                m[i] = [x - factor * y for x, y in zip(m[i], m[k], strict=True)]
    return value


def least_minor(matrix: Floats) -> tuple[int, tuple[int, ...]]:
    """Return the least sign of a principal minor, and its rows; of at most ``SUBSETS`` rows."""
    n = len(matrix)
    worst, where = 1, tuple(range(min(n, 1)))
    for count in range(1, n + 1):
        for rows in itertools.combinations(range(n), count):
            value = determinant(matrix[list(rows)][:, list(rows)])
            sign = (value > 0) - (value < 0)
            if sign < worst:
                worst, where = sign, rows
    return worst, where


def solves(M: Floats, q: Sequence[float], on: Sequence[int]) -> bool:
    """Return whether an LCP has a solution whose other components are zero, slacks of these too.

    Examples
    --------
    >>> import numpy as np
    >>> M = np.array([[0.0, 1e-10], [-1e-10, 0.0]])
    >>> solves(M, [-1.0, 1.0], [0, 1]), solves(M, [-1.0, 1.0], [])
    (True, False)
    """
    on = list(on)
    off = [k for k in range(len(q)) if k not in on]
    if not on:
        return all(float(x) >= 0.0 for x in q)
    chosen = M[:, on]
    rows = [*(chosen[k] for k in on), *(-chosen[k] for k in on), *(-chosen[k] for k in off)]
    right = [*(-float(q[k]) for k in on), *(float(q[k]) for k in on), *(float(q[k]) for k in off)]
    return feasible(np.array(rows), right, nonnegative=True)


def _fractions(matrix: npt.ArrayLike) -> list[list[Fraction]]:
    return [[Fraction(float(x)) for x in row] for row in np.asarray(matrix, dtype=np.float64)]


__all__ = [
    "MOST",
    "SUBSETS",
    "Empty",
    "determinant",
    "feasible",
    "least_minor",
    "maximise",
    "semidefinite",
    "solves",
]
