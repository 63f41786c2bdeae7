"""Whether each step of an active system has one solution: the P-property of its pairs."""

from __future__ import annotations

import numpy as np

from .csc import Csc, Floats
from .descriptor import DescriptorSystem
from .matrices import is_p_matrix

_NOISE = 1e-13  # of the entries of M, from the solution with K


def may_have_several(system: DescriptorSystem, K: Csc) -> bool:
    """Return whether ``M = D + B K^-1 A`` is no P-matrix, with all switches open.

    Parameters
    ----------
    system : DescriptorSystem
    K : Csc, shape (n, n)
        Matrix of a step: ``G + E / h``, or G where nothing is stored.
    """
    switched = system.switched
    pairs = [k for k in range(system.m) if k not in switched]
    if not pairs:
        return False
    A, B = system.A.dense()[:, pairs], system.B.dense()[pairs]
    try:
        M = system.D.dense()[np.ix_(pairs, pairs)] + B @ np.linalg.solve(K.dense(), A)
    except np.linalg.LinAlgError:
        return True
    return not is_p_matrix(_one_of_each_couple(M), noise=_NOISE)


def _one_of_each_couple(matrix: Floats) -> Floats:
    """Return the matrix with one pair left of each two that work against each other.

    The two pairs of a two-way breakdown (or of a clamp) are one monotone curve of one current.
    """
    size = np.max(np.abs(matrix), initial=0.0)
    keep: list[int] = []
    for j in range(matrix.shape[0]):
        opposite = any(
            np.all(np.abs(matrix[:, i] + matrix[:, j]) <= 1e-9 * size)
            and np.all(np.abs(matrix[i] + matrix[j]) <= 1e-9 * size)
            for i in keep
        )
        if not opposite:
            keep.append(j)
    return np.asarray(matrix[np.ix_(keep, keep)])
