"""Linear equations whose coefficients are Taylor models."""

from __future__ import annotations

import numpy as np

from ...problems.taylor import Models, Unbounded


class Solved:
    """Equations ``M y = R w``, solved for as many y as they determine.

    Gauss-Jordan elimination with complete pivoting by the middle of the box.  What is left is
    exactly zero, as only the topology makes it, or the equations are refused.

    Parameters
    ----------
    matrix : Models, shape (k, k)
    right : Models, shape (k, n)

    Attributes
    ----------
    known, free : list of int
        Unknowns that are determined, and the others.
    by_right : Models, shape (k, n)
    by_free : Models, shape (k, free)
        ``y = by_right w + by_free y[free]``; the rows of free unknowns are not set.
    conditions : Models, shape (free, n)
        ``0 = conditions w``, which is left of the other equations.

    Raises
    ------
    Unbounded
        If a pivot may vanish in the box.
    """

    def __init__(self, matrix: Models, right: Models) -> None:
        home, k = matrix.home, matrix.shape[0]
        n = right.shape[1]
        # one array for both sides: columns of M, then those of R with the sign of the left side
        both = Models.constant(home, np.zeros((k, k + n)))
        both[:, :k], both[:, k:] = matrix, -right
        rows, columns = list(range(k)), list(range(k))
        pivots: list[tuple[int, int]] = []
        while rows:
            sizes = np.abs(both.middle[np.ix_(rows, columns)])
            # rows of their own scale: an equation times 1e-6 is the same equation
            scale = np.abs(both.middle[rows][:, :k]).max(axis=1)
            sizes = sizes / np.where(scale > 0.0, scale, 1.0)[:, None]
            i, j = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
            if both[np.ix_(rows, columns)].nothing.all():
                break
            row, column = rows[int(i)], columns[int(j)]
            both[row] = both[row] * both[row, column].inverse()[None]
            both[row, column] = Models.constant(home, 1.0)
            for other in range(k):
                if other != row and not both[other, column].nothing:
                    factor = both[other, column]
                    both[other] = both[other] - both[row] * factor[None]
                    both[other, column] = Models.constant(home, 0.0)
            rows.remove(row)
            columns.remove(column)
            pivots.append((row, column))
        self.known, self.free = [c for _, c in pivots], columns
        self.by_right = Models.constant(home, np.zeros((k, n)))
        self.by_free = Models.constant(home, np.zeros((k, len(columns))))
        for row, column in pivots:
            self.by_right[column] = -both[row, k:]
            if columns:
                self.by_free[column] = -both[row][columns]
        self.conditions = both[rows][:, k:] if rows else Models.constant(home, np.zeros((0, n)))


def solve(matrix: Models, right: Models) -> Models:
    """Return the solution of regular equations.

    Raises
    ------
    Unbounded
        If they may be singular in the box.
    """
    solved = Solved(matrix, right)
    if solved.free:
        raise Unbounded("equations without a unique solution")
    return solved.by_right
