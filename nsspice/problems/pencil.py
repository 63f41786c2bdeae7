"""The roots of ``det(A + s B)`` for a pencil of matrices, with a bound of their rounding errors.

Infinite roots are split off first: with ``U`` orthogonal, the rows of ``U'B`` below its rank are
zero; with ``V`` orthogonal, the same rows of ``U'A`` become ``[0 T]`` with ``T`` triangular.  The
determinant is that of the rest times ``det T``, a constant; and so on, until ``B`` has full rank.
What remains is an eigenvalue problem without infinite roots, however high the index of the pencil.

References: P. Van Dooren, "The computation of Kronecker's canonical form of a singular pencil",
Linear Algebra Appl. 27 (1979) 103, doi:10.1016/0024-3795(79)90035-1; G. W. Stewart and J. G. Sun,
"Matrix Perturbation Theory", Academic Press 1990, section VI.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Matrix = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]

_ROUNDING = float(np.finfo(np.float64).eps)


class SingularPencil(Exception):
    """The determinant is zero for every s."""


@dataclass(frozen=True, slots=True)
class Roots:
    """Roots, and what they may be off by.

    Parameters
    ----------
    values : ndarray, shape (k,)
        Sorted by size.
    errors : ndarray, shape (k,)
        First-order bounds of the effect of rounding.
    """

    values: Complexes
    errors: Matrix

    def clean(self) -> Complexes:
        """Return the roots, parts of them that are within their error of zero as zero."""
        real = np.where(np.abs(self.values.real) <= self.errors, 0.0, self.values.real)
        imag = np.where(np.abs(self.values.imag) <= self.errors, 0.0, self.values.imag)
        return real + 1j * imag


def roots(A: Matrix, B: Matrix) -> Roots:
    """Return all s with ``det(A + s B) = 0``.

    Parameters
    ----------
    A, B : ndarray, shape (n, n)

    Raises
    ------
    SingularPencil
        If the determinant does not depend on s because it is zero.

    Examples
    --------
    >>> roots(np.array([[0.0, -1.0], [6.0, 5.0]]), np.eye(2)).values.round(12)
    array([-2.+0.j, -3.+0.j])
    """
    A, B, rate = _scaled(A, B)
    # orthogonal transformations of n rows change the matrices by n units of rounding at most
    rounding = A.shape[0] * _ROUNDING
    known = rounding * float(np.linalg.norm(A)), rounding * float(np.linalg.norm(B))
    A, B = _finite(A, B, known)
    if A.size == 0:
        return Roots(np.zeros(0, complex), np.zeros(0))
    from scipy.linalg import eig

    s: Any
    s, left, right = eig(A, -B, left=True, right=True)
    # an eigenvalue moves by |y' dA x + s y' dB x| / |y' B x|
    moved = known[0] + np.abs(s) * known[1]
    pull = np.abs(np.einsum("ik,ij,jk->k", left.conj(), B, right))
    errors = np.divide(moved, pull, out=np.full(s.size, np.inf), where=pull > 0.0)
    # no eigenvalue moves by more than a root of the perturbation (P. Henrici, 1962)
    errors = np.minimum(errors, np.maximum(np.abs(s), 1.0) * rounding ** (1.0 / s.size))
    s = _joined(s, errors)
    order = np.lexsort((s.imag, s.real, np.abs(s).round(12)))
    return Roots(rate * s[order], rate * errors[order])


def _joined(s: Complexes, errors: Matrix) -> Complexes:
    """Return roots with each cluster replaced by its mean.

    A multiple root falls apart into roots that are closer than their errors; their mean is as
    accurate as a simple root.
    """
    near = np.abs(s[:, None] - s) <= 2.0 * np.minimum(errors[:, None], errors)
    while True:  # neighbours of neighbours
        wider = near @ near
        if np.array_equal(wider, near):
            mean: Complexes = (near @ s) / near.sum(axis=1)
            return mean
        near = wider


def _scaled(A: Matrix, B: Matrix) -> tuple[Matrix, Matrix, float]:
    """Return the pencil with rows, columns and time in units in which its entries are near 1.

    The logarithms of the units are a problem of least squares (A. R. Curtis and J. K. Reid, 1972).
    Powers of 2 round nothing.
    """
    n = A.shape[0]
    count = np.count_nonzero(A) + np.count_nonzero(B)
    equations, sizes = np.zeros((count, 2 * n + 1)), np.zeros(count)
    at = 0
    for is_rate, M in enumerate((A, B)):
        rows, cols = np.nonzero(M)
        here = np.arange(at, at + rows.size)
        equations[here, rows] = 1.0
        equations[here, n + cols] = 1.0
        equations[here, 2 * n] = is_rate
        sizes[here] = -np.log2(np.abs(M[rows, cols]))
        at += rows.size
    found = np.exp2(np.round(np.linalg.lstsq(equations, sizes, rcond=None)[0]))
    units = found[:n, None] * found[n : 2 * n]
    rate = float(found[2 * n])
    return A * units, B * units * rate, rate


def _finite(A: Matrix, B: Matrix, known: tuple[float, float]) -> tuple[Matrix, Matrix]:
    """Return the part of a pencil without infinite roots; entries are known to ``known``."""
    from scipy.linalg import rq

    while A.size:
        n = A.shape[0]
        left, values, _ = np.linalg.svd(B)
        rank = int(np.count_nonzero(values > known[1]))
        if rank == n:
            break
        A, B = left.T @ A, left.T @ B
        triangle, turn = rq(A[rank:])
        tail = np.abs(np.diag(triangle[:, rank:]))
        if tail.min() <= known[0]:
            raise SingularPencil
        A, B = (A[:rank] @ turn.T)[:, :rank], (B[:rank] @ turn.T)[:, :rank]
    return A, B
