"""Sparse matrices in compressed-column form, small enough to import at start-up.

``scipy.sparse`` would triple the start-up time of a small deck; the few operations needed on the
Python side of the compiled core are written here on numpy alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Csc:
    """A sparse matrix in compressed-column form.

    Parameters
    ----------
    shape : (int, int)
        Number of rows and columns.
    indptr : ndarray of int64, shape (ncols + 1,)
        Start of each column in ``indices`` and ``data``.
    indices : ndarray of int64, shape (nnz,)
        Row numbers, ascending within a column, no duplicates.
    data : ndarray of float64, shape (nnz,)
        Values.

    Examples
    --------
    >>> m = Csc.from_triplets((2, 2), [0, 1, 1], [0, 0, 0], [1.0, 2.0, 3.0])
    >>> m.dense().tolist()
    [[1.0, 0.0], [5.0, 0.0]]
    """

    shape: tuple[int, int]
    indptr: Ints
    indices: Ints
    data: Floats

    @classmethod
    def from_triplets(
        cls,
        shape: tuple[int, int],
        rows: Sequence[int] | Ints,
        cols: Sequence[int] | Ints,
        values: Sequence[float] | Floats,
    ) -> Csc:
        """Return the matrix with the given entries; repeated entries are added, zeros dropped.

        Raises
        ------
        IndexError
            If a row or column lies outside of the shape; nothing counts from the end.
        """
        r = np.asarray(rows, dtype=np.int64)
        c = np.asarray(cols, dtype=np.int64)
        v = np.asarray(values, dtype=np.float64)
        order = np.lexsort((r, c))
        r, c, v = r[order], c[order], v[order]
        if r.size:
            if r.min() < 0 or r.max() >= shape[0] or c[0] < 0 or c[-1] >= shape[1]:
                raise IndexError(f"entries outside of a matrix of shape {shape}")
            first = np.ones(r.size, dtype=bool)
            first[1:] = (r[1:] != r[:-1]) | (c[1:] != c[:-1])
            starts = np.flatnonzero(first)
            r, c, v = r[starts], c[starts], np.add.reduceat(v, starts)
            keep = v != 0.0
            r, c, v = r[keep], c[keep], v[keep]
        indptr = np.zeros(shape[1] + 1, dtype=np.int64)
        np.cumsum(np.bincount(c, minlength=shape[1]), out=indptr[1:])
        return cls(shape, indptr, r, v)

    @classmethod
    def zeros(cls, shape: tuple[int, int]) -> Csc:
        """Return the zero matrix."""
        none = np.zeros(0, dtype=np.int64)
        return cls(shape, np.zeros(shape[1] + 1, dtype=np.int64), none, np.zeros(0))

    @classmethod
    def from_dense(cls, matrix: Floats) -> Csc:
        """Return the nonzero entries of a dense matrix."""
        rows, cols = np.nonzero(matrix)
        return cls.from_triplets((matrix.shape[0], matrix.shape[1]), rows, cols, matrix[rows, cols])

    @cached_property
    def columns(self) -> Ints:
        """Column number of every stored entry, shape (nnz,)."""
        ends = self.indptr  # np.diff costs several times this difference
        return np.repeat(np.arange(self.shape[1], dtype=np.int64), ends[1:] - ends[:-1])

    def dense(self) -> Floats:
        """Return the matrix as an array, shape ``self.shape``."""
        out = np.zeros(self.shape)
        out[self.indices, self.columns] = self.data
        return out

    def diagonal(self) -> Floats:
        """Return the entries on the diagonal, shape (nrows,).

        Examples
        --------
        >>> Csc.from_triplets((2, 2), [0, 0, 1], [0, 1, 0], [1.0, 2.0, 3.0]).diagonal().tolist()
        [1.0, 0.0]
        """
        out = np.zeros(self.shape[0])
        on = self.indices == self.columns
        out[self.indices[on]] = self.data[on]
        return out

    def dot(self, x: Floats) -> Floats:
        """Return the product with a vector, shape (nrows,)."""
        products = self.data * x[self.columns]
        sums = np.bincount(self.indices, weights=products, minlength=self.shape[0])
        return np.asarray(sums, dtype=np.float64)  # integers where nothing is stored

    def transposes(self, other: Csc) -> bool:
        """Return whether this is the transpose of another matrix, entry by entry.

        Examples
        --------
        >>> row = Csc.from_triplets((1, 2), [0, 0], [0, 1], [1.0, 2.0])
        >>> column = Csc.from_triplets((2, 1), [0, 1], [0, 0], [1.0, 2.0])
        >>> row.transposes(column), row.transposes(row)
        (True, False)
        """
        if self.shape != other.shape[::-1] or self.data.size != other.data.size:
            return False
        # other's entries go by its columns; in a stable order by its rows they go as those here
        order = np.argsort(other.indices, kind="stable")
        return bool(
            (other.columns[order] == self.indices).all()
            and (other.indices[order] == self.columns).all()
            and (other.data[order] == self.data).all()
        )

    def abs(self) -> Csc:
        """Return the matrix of absolute values."""
        return Csc(self.shape, self.indptr, self.indices, np.abs(self.data))


def weighted_sum(terms: Sequence[tuple[Csc, float]]) -> Csc:
    """Return the weighted sum of matrices of equal shape.

    Parameters
    ----------
    terms : sequence of (Csc, float)
        Matrices and their factors; at least one.

    Examples
    --------
    >>> one = Csc.from_triplets((1, 1), [0], [0], [1.0])
    >>> weighted_sum([(one, 2.0), (one, 0.5)]).dense().tolist()
    [[2.5]]
    """
    return Csc.from_triplets(
        terms[0][0].shape,
        np.concatenate([m.indices for m, _ in terms]),
        np.concatenate([m.columns for m, _ in terms]),
        np.concatenate([m.data * factor for m, factor in terms]),
    )
