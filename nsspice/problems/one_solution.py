"""Whether each step of an active system has one solution: the P-property of its pairs."""

from __future__ import annotations

import numpy as np

from .csc import Csc, Floats
from .descriptor import DescriptorSystem
from .matrices import is_p_matrix
from .regularity import equilibration, inverses

#: of an inverse by elimination, for each row: (Higham, Accuracy and Stability, 2002, section 14.3)
_ROUNDING = 8.0 * 2.0**-53


def may_have_several(system: DescriptorSystem, K: Csc) -> bool:
    """Return whether ``M = D + B K^-1 A`` is not a P-matrix, with all switches open.

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
    found = pair_matrix(K.dense(), A, B, system.D.dense()[np.ix_(pairs, pairs)])
    if found is None:
        return True
    M, error = found
    kept = _one_of_each_couple(M)
    return not certainly_p(M[np.ix_(kept, kept)], error[np.ix_(kept, kept)])


def pair_matrix(K: Floats, A: Floats, B: Floats, D: Floats) -> tuple[Floats, Floats] | None:
    """Return ``D + B K^-1 A`` and what rounding leaves of its entries; None if K is singular.

    Examples
    --------
    >>> one = np.eye(1)
    >>> pair_matrix(2.0 * one, one, one, one)[0].tolist()
    [[1.5]]
    """
    inverse, scales = inverses(K[None]), equilibration(K[None]) if len(K) else None
    if inverse is None:
        return None
    X, size = inverse[0], np.zeros_like(K)
    if scales is not None:
        # factors L U of the scaled matrix have products of n times its largest entry anywhere
        rows, columns = scales[0][0], scales[1][0]
        scaled = np.abs(X / columns[:, None] / rows)
        most = float(np.max(np.abs(K * rows[:, None] * columns)))
        size = most * np.outer(columns * scaled.sum(axis=1), rows * scaled.sum(axis=0))
    error = _ROUNDING * max(len(K), 1) * (np.abs(D) + np.abs(B) @ size @ np.abs(A))
    return np.asarray(D + B @ X @ A), np.asarray(error)


def certainly_p(M: Floats, error: Floats) -> bool:
    """Return whether all matrices within an error of one are P.

    Examples
    --------
    >>> certainly_p(np.array([[1e-17]]), np.array([[1e-16]]))
    False
    """
    diagonal = np.diag(M)
    if np.any(diagonal <= np.diag(error)):
        return False
    root = np.sqrt(diagonal)
    noise = float(np.max(error / root / root[:, None], initial=0.0))
    return noise < 1.0 and bool(is_p_matrix(M, noise=noise))


def _one_of_each_couple(matrix: Floats) -> list[int]:
    """Return the pairs with one left of each two that work against each other.

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
    return keep
