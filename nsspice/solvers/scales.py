"""Even scales for a complementarity problem whose pairs are measured in very different units.

Rows of ``w`` and columns of ``lam`` may be multiplied by positive numbers: the problem stays the
same.  The factors make the largest entry of each row and column one (D. Ruiz: *A scaling
algorithm to equilibrate both rows and columns norms in matrices*, RAL-TR-2001-034).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..problems.csc import Csc, Floats
from .certificate import entries_of

#: pairs are left as they are while their largest entries lie within this ratio
_EVEN = 1e4
_ROUNDS = 8

Start = tuple[Floats, Floats] | None


@dataclass(frozen=True, slots=True)
class Scales:
    """Factors of the rows and columns of a problem.

    Parameters
    ----------
    rows, columns : ndarray, shape (n + m,)
        Of the laws and slacks, and of ``z`` and ``lam``.

    Examples
    --------
    >>> none, two = Csc.zeros((0, 0)), Csc.from_dense(np.diag([1e-9, 1e9]))
    >>> scales = Scales.of_pairs(none, Csc.zeros((0, 2)), Csc.zeros((2, 0)), two)
    >>> even = scales.rows * scales.columns * [1e-9, 1e9]
    >>> bool(((even >= 0.5) & (even <= 2.0)).all())
    True
    """

    rows: Floats
    columns: Floats

    @classmethod
    def of_pairs(cls, K: Csc, A: Csc, B: Csc, D: Csc) -> Scales | None:
        """Return scales for a problem with uneven pairs; nothing for others."""
        n, m = A.shape
        r, c, values = entries_of(K, A, B, D)
        v = np.abs(values)
        rows, columns = np.ones(n + m), np.ones(n + m)

        def largest(places: np.ndarray) -> Floats:
            out = np.zeros(n + m)
            np.maximum.at(out, places, v * rows[r] * columns[c])
            return np.where(out > 0.0, out, 1.0)

        first = np.concatenate([largest(r)[n:], largest(c)[n:]])
        if not m or first.max() <= _EVEN * first.min():
            return None
        for _ in range(_ROUNDS):
            by_rows, by_columns = np.sqrt(largest(r)), np.sqrt(largest(c))
            rows, columns = rows / by_rows, columns / by_columns
        # powers of two round nothing
        rows, columns = np.exp2(np.round(np.log2(np.stack([rows, columns]))))
        return cls(rows, columns)

    def problem(
        self, K: Csc, A: Csc, B: Csc, D: Csc, b: Floats, q: Floats, start: Start
    ) -> tuple[Csc, Csc, Csc, Csc, Floats, Floats, Start]:
        """Return the problem in even units."""
        n = A.shape[0]
        laws, slacks = self.rows[:n], self.rows[n:]
        z, lam = self.columns[:n], self.columns[n:]

        def scaled(matrix: Csc, rows: Floats, columns: Floats) -> Csc:
            return replace(
                matrix, data=matrix.data * rows[matrix.indices] * columns[matrix.columns]
            )

        if start is not None:
            start = (start[0] / z, start[1] / lam)
        return (
            scaled(K, laws, z),
            scaled(A, laws, lam),
            scaled(B, slacks, z),
            scaled(D, slacks, lam),
            b * laws,
            q * slacks,
            start,
        )

    def solution(self, z: Floats, lam: Floats) -> tuple[Floats, Floats]:
        """Return a solution in the units of the problem as it was given."""
        n = z.size
        return z * self.columns[:n], lam * self.columns[n:]
