"""Classes of matrices that decide on complementarity problems, each with its witness.

=====================  ================================================  =========================
function               definition                                        in an LCP of M and q
=====================  ================================================  =========================
:func:`is_p_matrix`    all principal minors are positive                 one solution for every q
:func:`is_p0_matrix`   no principal minor is negative                    limit of P-matrices
:func:`is_h_matrix`    the diagonal dominates after scaling columns      P if the diagonal is > 0
:func:`is_m_matrix`    H, diagonal positive, nothing else positive       P, a least solution
:func:`is_monotone`    ``x . Mx >= 0``                                   solutions are convex
:func:`is_definite`    ``x . Mx > 0`` for x != 0: strongly monotone      P in every basis
:func:`is_copositive`  ``x . Mx >= 0`` for ``x >= 0``                    Lemke ends, or none exists
=====================  ================================================  =========================

A matrix is judged to the rounding of its entries: what a relative change of them by n u could make
zero counts as zero (u = 2^-53, n rows).

References: R. W. Cottle, J.-S. Pang, R. E. Stone, *The Linear Complementarity Problem* (1992),
ch. 3; K. P. Hadeler, *On copositive matrices*, Linear Algebra Appl. 49 (1983) 79-89.
"""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from .csc import Floats
from .minors import P0_CLAIM, P_CLAIM, ROUNDING, blocks, failing_minor, negative_minor
from .verdict import Verdict, Witness

_MOST_SUBSETS = 14  # rows of a matrix of which all principal submatrices are looked at: 16383


def square(matrix: npt.ArrayLike) -> Floats:
    """Return a matrix as an array of numbers.

    Raises
    ------
    ValueError
        If it is not square.
    """
    found = np.asarray(matrix, dtype=np.float64)
    if found.ndim != 2 or found.shape[0] != found.shape[1]:
        raise ValueError(f"a square matrix is wanted, not an array of shape {found.shape}")
    return found


def is_p_matrix(matrix: npt.ArrayLike, *, noise: float = 0.0) -> Verdict:
    """Judge whether all principal minors are positive.

    A reducible matrix is P if the blocks on its diagonal are.  A block of up to 20 rows is decided
    by Schur complements; a larger one by sufficient conditions (H-matrix; ``D M + M'D`` positive
    definite for a diagonal D) and small minors, and else remains open: the question is
    co-NP-complete.

    Parameters
    ----------
    matrix : array_like, shape (m, m)
    noise : float
        What computed entries are uncertain by, relative to ``sqrt(m_ii m_jj)``: a minor that such
        changes could make zero counts as zero.

    Returns
    -------
    Verdict
        Where it fails, the witness holds the rows of the minor and a vector x whose sign the matrix
        reverses: ``x_i (Mx)_i <= 0`` for all i.

    Examples
    --------
    >>> bool(is_p_matrix([[1.0, -3.0], [0.5, 1.0]]))
    True
    >>> print(is_p_matrix([[1.0, 2.0], [2.0, 1.0]]))
    a P-matrix: fails, a principal minor is not positive: the minor of rows 0, 1 is -3
    """
    m = square(matrix)
    if not np.all(np.isfinite(m)):
        return _infinite(P_CLAIM)
    for row, entry in enumerate(np.diag(m)):
        if entry <= 0.0:
            return Verdict.no(P_CLAIM, "a principal minor is not positive", _entry(m, row))
    undecided: list[Verdict] = []
    reasons: list[str] = []
    for rows in blocks(m):
        found = _p_block(m, rows, noise)
        if found.holds is False:
            return found
        if found.holds is None:
            undecided.append(found)
        elif found.reason not in reasons:
            reasons.append(found.reason)
    return undecided[0] if undecided else Verdict.yes(P_CLAIM, "; ".join(reasons))


def _p_block(m: Floats, rows: list[int], noise: float) -> Verdict:
    """Judge an irreducible block of positive diagonal."""
    block = m[np.ix_(rows, rows)]
    scale = 1.0 / np.sqrt(np.diag(block))
    unit = block * scale[:, None] * scale
    worst = np.where(unit < 0.0, unit - noise, unit + noise)
    np.fill_diagonal(worst, 1.0 - noise)
    if is_h_matrix(worst):
        return Verdict.yes(P_CLAIM, "an H-matrix of positive diagonal")
    for weights in (np.ones(len(rows)), _balance(unit)):
        # changes e of all entries change the form by no more than n e |x|^2 times sqrt(d_i / d_j)
        shift = len(rows) * noise * float(np.sqrt(weights.max() / weights.min()))
        if is_definite(weights[:, None] * (unit - shift * np.eye(len(rows)))):
            return Verdict.yes(P_CLAIM, "D M + M'D is positive definite for a diagonal D > 0")
    return failing_minor(m, unit, rows, noise)


def _balance(unit: Floats) -> Floats:
    """Return the weights d for which ``d_i |m_ij|`` is nearest to symmetric: left over right."""
    sizes = np.abs(unit)
    right, left = _perron(sizes), _perron(sizes.T)
    return np.asarray(left / right)


def _perron(sizes: Floats) -> Floats:
    """Return the positive eigenvector of an irreducible matrix without negative entries."""
    values, vectors = np.linalg.eig(sizes)
    vector = np.abs(vectors[:, int(np.argmax(values.real))])
    return np.asarray(np.maximum(vector, np.finfo(float).tiny))


def is_p0_matrix(matrix: npt.ArrayLike) -> Verdict:
    """Judge whether no principal minor is negative.

    Parameters
    ----------
    matrix : array_like, shape (m, m)

    Examples
    --------
    >>> bool(is_p0_matrix([[0.0, -1.0], [1.0, 0.0]])), bool(is_p0_matrix([[0.0, 1.0], [1.0, 0.0]]))
    (True, False)
    """
    m = square(matrix)
    if not np.all(np.isfinite(m)):
        return _infinite(P0_CLAIM)
    for row, entry in enumerate(np.diag(m)):
        if entry < 0.0:
            return Verdict.no(P0_CLAIM, "a principal minor is negative", _entry(m, row))
    undecided: list[Verdict] = []
    for rows in blocks(m):
        block = m[np.ix_(rows, rows)]
        if is_monotone(block) or is_p_matrix(block):
            continue
        found = negative_minor(m, rows)
        if found.holds is False:
            return found
        if found.holds is None:
            undecided.append(found)
    return undecided[0] if undecided else Verdict.yes(P0_CLAIM, "no principal minor is negative")


def is_h_matrix(matrix: npt.ArrayLike) -> Verdict:
    """Judge whether the diagonal dominates, row by row, after some positive scaling of the columns.

    Parameters
    ----------
    matrix : array_like, shape (m, m)

    Returns
    -------
    Verdict
        With the scaling w as witness: ``|m_ii| w_i > sum of |m_ij| w_j``; where it fails with a
        vector w >= 0 for which no row dominates.

    Examples
    --------
    >>> bool(is_h_matrix([[1.0, 50.0], [0.01, 1.0]])), bool(is_h_matrix([[1.0, -2.0], [2.0, 1.0]]))
    (True, False)
    """
    claim = "an H-matrix"
    m = square(matrix)
    if not np.all(np.isfinite(m)):
        return _infinite(claim)
    n = len(m)
    diagonal = np.abs(np.diag(m))
    if np.any(diagonal == 0.0):
        row = int(np.argmin(diagonal))
        return Verdict.no(claim, "the diagonal has a zero", _entry(m, row))
    others = np.abs(m) / diagonal[:, None]
    np.fill_diagonal(others, 0.0)
    try:
        weights = np.linalg.solve(np.eye(n) - others, np.ones(n))
    except np.linalg.LinAlgError:
        weights = np.zeros(n)
    outweighed = others @ weights
    slack = n * ROUNDING * (weights + outweighed)
    if np.all(weights > 0.0) and np.all(weights - outweighed > slack):
        text = "the diagonal dominates after scaling columns"
        return Verdict.yes(claim, text, Witness(text, vector=np.asarray(weights, dtype=np.float64)))
    # the spectral radius of the others is 1 or more: its eigenvector dominates nowhere
    worst = max(blocks(others), key=lambda rows: _radius(others[np.ix_(rows, rows)]))
    vector = np.zeros(n)
    vector[worst] = _perron(others[np.ix_(worst, worst)])
    text = f"the other entries outweigh the diagonal in rows {_names(worst)}"
    return Verdict.no(
        claim, "no scaling makes the diagonal dominate", Witness(text, tuple(worst), vector)
    )


def _radius(sizes: Floats) -> float:
    return float(np.abs(np.linalg.eigvals(sizes)).max(initial=0.0))


def is_m_matrix(matrix: npt.ArrayLike) -> Verdict:
    """Judge whether a matrix is H, positive on the diagonal and nowhere else.

    Parameters
    ----------
    matrix : array_like, shape (m, m)

    Examples
    --------
    >>> bool(is_m_matrix([[2.0, -1.0], [-1.0, 2.0]])), bool(is_m_matrix([[2.0, 1.0], [-1.0, 2.0]]))
    (True, False)
    """
    claim = "an M-matrix"
    m = square(matrix)
    if not np.all(np.isfinite(m)):
        return _infinite(claim)
    others = m - np.diag(np.diag(m))
    if np.any(others > 0.0):
        i, j = (int(k) for k in np.argwhere(others > 0.0)[0])
        text = f"the entry of row {i} and column {j} is {m[i, j]:.6g}"
        return Verdict.no(
            claim,
            "an entry off the diagonal is positive",
            Witness(text, (i, j), value=float(m[i, j])),
        )
    for row, entry in enumerate(np.diag(m)):
        if entry <= 0.0:
            return Verdict.no(claim, "a diagonal entry is not positive", _entry(m, row))
    return is_h_matrix(m).named(claim)


def is_monotone(matrix: npt.ArrayLike) -> Verdict:
    """Judge whether ``x . Mx >= 0`` for all x: the symmetric part is positive semidefinite.

    Parameters
    ----------
    matrix : array_like, shape (m, m)

    Returns
    -------
    Verdict
        Where it fails with a vector x and the negative value of ``x . Mx``.

    Examples
    --------
    >>> bool(is_monotone([[0.0, -1.0], [1.0, 0.0]])), bool(is_monotone([[1.0, 0.0], [3.0, 1.0]]))
    (True, False)
    """
    return _by_eigenvalues(square(matrix), "monotone", strict=False)


def is_definite(matrix: npt.ArrayLike) -> Verdict:
    """Judge whether ``x . Mx > 0`` for all x but 0: a strongly monotone matrix.

    Parameters
    ----------
    matrix : array_like, shape (m, m)

    Returns
    -------
    Verdict
        The value of its witness is the least eigenvalue of the symmetric part, the modulus of
        strong monotonicity where it holds.

    Examples
    --------
    >>> is_definite([[2.0, -1.0], [1.0, 3.0]]).witness.value
    2.0
    >>> print(is_definite([[0.0, -1.0], [1.0, 0.0]]))
    strongly monotone: fails, x . Mx is not positive: x . Mx = 0 for x = (1, 0)
    """
    return _by_eigenvalues(square(matrix), "strongly monotone", strict=True)


def _by_eigenvalues(m: Floats, claim: str, *, strict: bool) -> Verdict:
    if not np.all(np.isfinite(m)):
        return _infinite(claim)
    n = len(m)
    both = 0.5 * (m + m.T)
    diagonal = np.diag(both)
    wrong = "x . Mx is not positive" if strict else "x . Mx is negative"
    for row in range(n):
        if diagonal[row] < 0.0 or (strict and diagonal[row] == 0.0):
            return Verdict.no(claim, wrong, _form(m, np.eye(n)[row]))
        if diagonal[row] == 0.0 and both[row].any():
            # a zero with something next to it: e_j - t e_row is negative for t large enough
            j = int(np.argmax(np.abs(both[row])))
            x = np.eye(n)[j]
            x[row] = -(diagonal[j] + abs(both[row, j])) / both[row, j]
            return Verdict.no(claim, wrong, _form(m, x))
    kept = np.flatnonzero(diagonal > 0.0)
    if kept.size == 0:
        return Verdict.yes(claim, "the symmetric part is zero", Witness("", value=0.0))
    scale = 1.0 / np.sqrt(diagonal[kept])
    values, vectors = np.linalg.eigh(both[np.ix_(kept, kept)] * scale[:, None] * scale)
    # scaled entries are right to 3 u, and eigenvalues of a matrix to n u of the largest
    slack = (3.0 + n) * ROUNDING * max(abs(float(values[0])), abs(float(values[-1])))
    if values[0] < -slack or (strict and values[0] <= slack):
        x = np.zeros(n)
        x[kept] = scale * vectors[:, 0]
        return Verdict.no(claim, wrong, _form(m, x / np.abs(x).max()))
    least = float(np.linalg.eigvalsh(both)[0])
    text = "the symmetric part is positive " + ("definite" if strict else "semidefinite")
    return Verdict.yes(claim, text, Witness(f"its least eigenvalue is {least:.6g}", value=least))


def is_copositive(matrix: npt.ArrayLike, *, strict: bool = False) -> Verdict:
    """Judge whether ``x . Mx >= 0`` for all ``x >= 0``.

    Hadeler's criterion over principal submatrices, by their number of rows: the first that is not
    copositive, while those inside are, has an inverse without positive entries.

    Parameters
    ----------
    matrix : array_like, shape (m, m)
        Its symmetric part is what counts.
    strict : bool
        Whether ``x . Mx > 0`` is asked for, but at 0.

    Examples
    --------
    >>> bool(is_copositive([[1.0, 4.0], [4.0, 1.0]]))
    True
    >>> print(is_copositive([[1.0, -2.0], [-2.0, 1.0]]))
    copositive: fails, x . Mx is negative for an x >= 0: x . Mx = -2 for x = (1, 1)
    """
    claim = "strictly copositive" if strict else "copositive"
    wrong = f"x . Mx is {'not positive' if strict else 'negative'} for an x >= 0"
    m = square(matrix)
    if not np.all(np.isfinite(m)):
        return _infinite(claim)
    n = len(m)
    both = 0.5 * (m + m.T)
    diagonal = np.diag(both)
    for row in range(n):
        if diagonal[row] < 0.0 or (strict and diagonal[row] == 0.0):
            return Verdict.no(claim, wrong, _form(m, np.eye(n)[row]))
    if np.all(both >= 0.0):
        return Verdict.yes(claim, "no entry of the symmetric part is negative")
    if is_definite(m) or (not strict and is_monotone(m)):
        return Verdict.yes(
            claim, "the symmetric part is positive " + "semi" * (not strict) + "definite"
        )
    size = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    unit = both / size[:, None] / size
    # without a negative entry in a row, that row and column only add
    for count in range(2, min(n, _MOST_SUBSETS) + 1):
        for rows in _chunks(itertools.combinations(range(n), count)):
            if n > _MOST_SUBSETS and count > 3:
                return Verdict.undecided(claim, f"more than {_MOST_SUBSETS} rows")
            found = _least(unit, rows, strict)
            if found is not None:
                return Verdict.no(claim, wrong, _form(m, found / size / np.max(found / size)))
    return Verdict.yes(claim, "no principal submatrix has an inverse without positive entries")


def _chunks(combinations: itertools.combinations[tuple[int, ...]]) -> list[npt.NDArray[np.int64]]:
    rows = np.array(list(combinations), dtype=np.int64)
    return [rows[k : k + 4096] for k in range(0, len(rows), 4096)]


def _least(unit: Floats, rows: npt.NDArray[np.int64], strict: bool) -> Floats | None:
    """Return an ``x >= 0`` with a negative form (or one of zero) that lives on one set of rows."""
    parts = unit[rows[:, :, None], rows[:, None, :]]
    values, vectors = np.linalg.eigh(parts)
    count = rows.shape[1]
    slack = (3.0 + count) * ROUNDING * np.abs(values).max(axis=1)
    for k in np.flatnonzero(values[:, 0] < (slack if strict else -slack)):
        candidates = [vectors[k, :, 0]]
        if values[k, 0] < -slack[k] and np.all(np.abs(values[k]) > slack[k]):
            candidates.append(-np.linalg.solve(parts[k], np.ones(count)))
        for vector in candidates:
            x = np.abs(vector) if np.all(vector <= 0.0) else np.maximum(vector, 0.0)
            form = float(x @ parts[k] @ x)
            bound = (3.0 + count) * ROUNDING * float(x @ np.abs(parts[k]) @ x)
            if x.any() and (form < -bound or (strict and form <= bound)):
                found = np.zeros(len(unit))
                found[rows[k]] = x
                return found
    return None


def _infinite(claim: str) -> Verdict:
    return Verdict.undecided(claim, "some entries are not finite")


def _entry(m: Floats, row: int) -> Witness:
    text = f"the diagonal entry of row {row} is {m[row, row]:.6g}"
    return Witness(text, (row,), np.eye(len(m))[row], float(m[row, row]))


def _form(m: Floats, x: Floats) -> Witness:
    """Return the witness ``x . Mx``."""
    value = float(x @ m @ x)
    shown = ", ".join(f"{v:.6g}" for v in x[:8] + 0.0) + ", ..." * (len(x) > 8)
    rows = tuple(int(k) for k in np.flatnonzero(x))
    return Witness(f"x . Mx = {value:.6g} for x = ({shown})", rows, x, value)


def _names(rows: list[int]) -> str:
    return ", ".join(map(str, rows[:8])) + ", ..." * (len(rows) > 8)


__all__ = [
    "is_copositive",
    "is_definite",
    "is_h_matrix",
    "is_m_matrix",
    "is_monotone",
    "is_p0_matrix",
    "is_p_matrix",
    "square",
]
