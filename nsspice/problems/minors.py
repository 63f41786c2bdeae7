"""Signs of principal minors, all of them if there are few rows.

By Schur complements: all principal minors of a matrix are positive exactly if its first entry is
positive and both the rest and the complement of that entry in it have positive principal minors
(M. J. Tsatsomeros, L. Li, *A recursive test for P-matrices*, BIT 40, 2000).  All complements of one
level are formed at once, with a running bound of their rounding; a pivot within its bound is judged
by the minor itself.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from .csc import Floats
from .verdict import Verdict, Witness

ROUNDING = 2.0**-53  #: unit roundoff u
P_CLAIM, P0_CLAIM = "a P-matrix", "a P0-matrix"
_MOST = 20  # rows whose minors are all formed: a million pivots, half a second
_MOST_P0 = 14  # rows of which all determinants are formed


def failing_minor(m: Floats, unit: Floats, rows: list[int], noise: float) -> Verdict:
    """Judge whether all principal minors of a block are positive.

    Parameters
    ----------
    m : ndarray, shape (n, n)
        The whole matrix.
    unit : ndarray, shape (k, k)
        The block, rows and columns scaled to a diagonal of ones.
    rows : list of int
        Its rows in the matrix.
    noise : float
        What the entries of ``unit`` are uncertain by, besides their rounding.
    """
    wrong = "a principal minor is not positive"
    if len(rows) <= _MOST:
        chosen = _by_complements(unit, noise)
        if chosen is None:
            return Verdict.yes(P_CLAIM, "all principal minors are positive")
        return Verdict.no(P_CLAIM, wrong, _witness(m, [rows[k] for k in chosen]))
    for chosen in (*_small_minors(unit), list(range(len(rows)))):
        if not _positive(unit[np.ix_(chosen, chosen)], noise):
            return Verdict.no(P_CLAIM, wrong, _witness(m, [rows[k] for k in chosen]))
    text = f"a block of {len(rows)} rows, more than {_MOST}, and no sufficient condition holds"
    return Verdict.undecided(P_CLAIM, text)


def _small_minors(unit: Floats) -> Iterator[list[int]]:
    """Yield the rows of minors of order 2 and 3 that seem not to be positive."""
    for count in (2, 3):
        for chunk in _subsets(len(unit), count):
            parts = unit[chunk[:, :, None], chunk[:, None, :]]
            for k in np.flatnonzero(np.linalg.det(parts) <= _determinant_bound(parts)):
                yield [int(r) for r in chunk[k]]


def _by_complements(unit: Floats, noise: float) -> list[int] | None:
    """Return the rows of a principal minor that is not positive, None without any."""
    n = len(unit)
    # rounding of two scalings and of the entry
    values, errors = unit[None], 3.0 * ROUNDING * np.abs(unit)[None] + noise
    taken = np.zeros(1, dtype=np.int64)  # rows that were eliminated, as bits
    for row in range(n):
        pivots, bounds = values[:, 0, 0], errors[:, 0, 0]
        for k in np.flatnonzero(pivots <= bounds):
            rows = [r for r in range(row) if int(taken[k]) >> r & 1] + [row]
            if not _positive(unit[np.ix_(rows, rows)], noise):
                return rows
        if row == n - 1:
            return None
        # a pivot within its bound that is positive after all: its bound cannot exceed it
        bounds = np.minimum(bounds, pivots)
        p = pivots[:, None, None]
        b, c = values[:, 1:, :1], values[:, :1, 1:]
        eb, ec = errors[:, 1:, :1], errors[:, :1, 1:]
        product = b * c / p
        size = np.abs(product)
        rest, spread = values[:, 1:, 1:], errors[:, 1:, 1:]
        complement = rest - product
        grown = spread + (np.abs(b) * ec + eb * np.abs(c)) / p
        grown += size * (bounds[:, None, None] / p + 2.0 * ROUNDING)
        grown += ROUNDING * np.abs(complement)
        values = np.concatenate([rest, complement])
        errors = np.concatenate([spread, grown])
        taken = np.concatenate([taken, taken | 1 << row])
    return None


def _positive(part: Floats, noise: float) -> bool:
    """Return whether a determinant is positive, and no change by n u and noise makes it zero."""
    n = len(part)
    try:
        inverse = np.linalg.inv(part)
    except np.linalg.LinAlgError:
        return False
    # J. Rohn 1989: singular within changes E only if the spectral radius of |A^-1| E is 1 or more
    spread = np.abs(inverse) @ (n * ROUNDING * np.abs(part) + noise)
    if not np.all(np.isfinite(spread)) or float(spread.sum(axis=1).max()) >= 1.0:
        return False
    sign, _ = np.linalg.slogdet(part)
    return bool(sign > 0.0)


def _witness(m: Floats, rows: list[int]) -> Witness:
    """Return a minor that is not positive, with a vector whose sign the matrix reverses.

    A matrix of negative determinant has a real negative eigenvalue, one of zero a null vector.
    """
    part = m[np.ix_(rows, rows)]
    value = float(np.linalg.det(part))
    even, columns = _even(part), _columns(part)
    if abs(float(np.linalg.det(even))) <= float(_determinant_bound(even[None])[0]):
        vector, shown = np.linalg.svd(even)[2][-1] * columns, "0 within rounding"
    else:
        values, vectors = np.linalg.eig(even)
        real = np.where(values.imag == 0.0, values.real, np.inf)
        vector, shown = vectors[:, int(np.argmin(real))].real * columns, f"{value:.6g}"
    x = np.zeros(len(m))
    x[rows] = vector / np.abs(vector).max()
    names = ", ".join(map(str, rows))
    return Witness(f"the minor of rows {names} is {shown}", tuple(rows), x, value)


def negative_minor(m: Floats, rows: list[int]) -> Verdict:
    """Judge whether no principal minor of a block, given by its rows, is negative."""
    block = _even(m[np.ix_(rows, rows)])
    n = len(rows)
    few = n <= _MOST_P0
    for count in range(1, n + 1) if few else (1, 2, 3, n):
        for chunk in _subsets(n, count):
            parts = block[chunk[:, :, None], chunk[:, None, :]]
            found = np.flatnonzero(np.linalg.det(parts) < -_determinant_bound(parts))
            if found.size:
                witness = _witness(m, [rows[int(k)] for k in chunk[found[0]]])
                return Verdict.no(P0_CLAIM, "a principal minor is negative", witness)
    if few:
        return Verdict.yes(P0_CLAIM, "no principal minor is negative")
    return Verdict.undecided(P0_CLAIM, f"a block of {n} rows, more than {_MOST_P0}")


def _columns(m: Floats) -> Floats:
    """Return factors of columns that, with others of rows, bring entries near to one.

    Geometric means of the entries that are not zero; the signs of minors, and of ``x_i (Mx)_i``, do
    not depend on them, bounds by lengths of rows do.
    """
    sizes = np.abs(m)
    logs = np.where(sizes > 0.0, np.log(np.where(sizes > 0.0, sizes, 1.0)), np.nan)
    rows, columns = np.zeros(len(m)), np.zeros(len(m))
    filled = sizes > 0.0
    for _ in range(4):
        rows = _means(logs - columns, filled, 1)
        columns = _means(logs - rows[:, None], filled, 0)
    return np.asarray(np.exp(-columns))


def _means(logs: Floats, filled: npt.NDArray[np.bool_], axis: int) -> Floats:
    total = np.where(filled, logs, 0.0).sum(axis=axis)
    return np.asarray(total / np.maximum(filled.sum(axis=axis), 1))


def _even(m: Floats) -> Floats:
    """Return a matrix with scaled columns and rows: see :func:`_columns`, rows of length 1."""
    scaled = m * _columns(m)
    lengths = np.linalg.norm(scaled, axis=1)
    return np.asarray(scaled / np.where(lengths > 0.0, lengths, 1.0)[:, None])


def _determinant_bound(parts: Floats) -> Floats:
    """Return what relative changes of n u may do to determinants: n^2 u times Hadamard's bound."""
    n = parts.shape[-1]
    return np.asarray(n * n * ROUNDING * np.prod(np.linalg.norm(parts, axis=-1), axis=-1))


def _subsets(n: int, count: int) -> list[npt.NDArray[np.int64]]:
    rows = np.array(list(itertools.combinations(range(n), count)), dtype=np.int64)
    return [rows[k : k + 4096] for k in range(0, len(rows), 4096)]


def blocks(m: Floats) -> list[list[int]]:
    """Return the rows of the irreducible blocks: strongly connected components of the entries.

    Examples
    --------
    >>> blocks(np.array([[1.0, 5.0, 0.0], [0.0, 1.0, 2.0], [0.0, 3.0, 1.0]]))
    [[0], [1, 2]]
    """
    n = len(m)
    reach = (m != 0.0) | np.eye(n, dtype=bool)
    for _ in range(max(n - 1, 0).bit_length()):
        reach = (reach.astype(np.float64) @ reach.astype(np.float64)) > 0.0
    both = reach & reach.T
    found: list[list[int]] = []
    seen = np.zeros(n, dtype=bool)
    for k in range(n):
        if not seen[k]:
            found.append([int(j) for j in np.flatnonzero(both[k])])
            seen |= both[k]
    return found
