"""Is a network passive?  Then each of its steps is a monotone problem."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .csc import Csc, Floats, weighted_sum

if TYPE_CHECKING:
    from .descriptor import DescriptorSystem

_MOST_ROWS = 120  # unknowns and pairs together, for dense matrices


def passive(system: DescriptorSystem) -> bool:
    """Return True if the arrays show that the network is passive.

    Examples
    --------
    >>> from nsspice.problems import DescriptorSystem
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> def resistor(g):
    ...     G = Csc.from_triplets((1, 1), [0], [0], [g])
    ...     return DescriptorSystem(one, G, none((1, 0)), none((0, 1)), none((0, 0)),
    ...         np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))
    >>> passive(resistor(1.0)), passive(resistor(-1.0))
    (True, False)
    """
    if system.smooth is not None:
        return True  # judged by Newton's method, not here
    a, b = system.A, system.B
    if system.n + system.m <= _MOST_ROWS:  # full matrices are faster
        transposes = np.array_equal(a.dense().T, b.dense())
        return transposes and all(_semidefinite_full(m.dense()) for m in (system.G, system.D))
    transposed = Csc.from_triplets(b.shape, a.columns, a.indices, a.data)
    if not _equal(transposed, b):
        return False
    return all(_semidefinite(matrix) for matrix in (system.G, system.D))


def _equal(a: Csc, b: Csc) -> bool:
    return weighted_sum([(a, 1.0), (b, -1.0)]).data.size == 0


def _semidefinite_full(full: Floats) -> bool:
    """Return True if the symmetric part is positive semidefinite, by dominance or eigenvalues."""
    both = full + full.T
    diagonal = both.diagonal()
    others = np.abs(both).sum(axis=0) - np.abs(diagonal)
    if (diagonal >= others * (1.0 - 1e-12)).all():
        return True
    values = np.linalg.eigvalsh(both)
    return bool(values[0] >= -1e-12 * max(abs(values[0]), abs(values[-1])))


def _semidefinite(matrix: Csc) -> bool:
    """Return the same for a sparse matrix; a large one is judged by dominance alone."""
    n = matrix.shape[0]
    if matrix.data.size == 0:
        return True
    rows = np.concatenate([matrix.indices, matrix.columns])
    cols = np.concatenate([matrix.columns, matrix.indices])
    both = Csc.from_triplets((n, n), rows, cols, np.concatenate([matrix.data, matrix.data]))
    on = both.indices == both.columns
    diagonal = np.zeros(n)
    diagonal[both.indices[on]] = both.data[on]
    others = np.bincount(both.indices[~on], np.abs(both.data[~on]), minlength=n)
    if np.all(diagonal >= others * (1.0 - 1e-12)):
        return True
    return n <= _MOST_ROWS and _semidefinite_full(matrix.dense())
