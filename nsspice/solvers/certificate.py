"""Proofs that a mixed linear complementarity problem has no solution.

The linear relations of the problem

.. math::

    K z + A \\lambda = b, \\qquad w = q - B z + D \\lambda, \\qquad
    \\lambda_i, w_i \\ge 0

(closed switches: :math:`w_i = 0`, :math:`\\lambda_i` free; open ones: :math:`\\lambda_i = 0`,
:math:`w_i` free) cannot hold together exactly if numbers y and p exist with

.. math::

    K^T y + B^T p = 0, \\quad A^T y - D^T p \\ge 0, \\quad p \\ge 0, \\quad b^T y + q^T p = -1

(Farkas): the equations weighted by y plus the slacks weighted by p would sum to a negative number
although every term is nonnegative.  Closed switches turn their two inequalities into ``= 0`` and a
free sign, open ones into no condition and ``p = 0``, switches that may be either into both, so that
the proof holds for all their states.  Of all such proofs the one with the smallest
1-norm, in a scaled system, names few elements: branch rows in y and pairs in p form the conflicting
loop, current rows in y the nodes of the conflicting cut-set.

For *monotone* problems (K + K' and D positive semidefinite, B = A') feasibility of the linear
relations is also enough for a solution, so that every unsolvable problem has such a proof.  Others
(controlled sources, negative slopes) may have no solution and no proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import Diagnostic, NumericalError
from ..problems.csc import Csc, Floats, Ints

_SWEEPS = 12
_GRADIENT_STEPS = 25
#: entries of the scaled proof below this part of the largest are rounding
_SUPPORT = 1e-7
#: the proof must hold within this part of the terms it sums
_EXACT = 1e-7
#: a contradiction smaller than this part of the data is a matter of rounding, not a proof
_CONFLICT = 1e-9

_PRESOLVE_FROM = 4000
#: the program takes data below 1e-9 for nothing: a contradiction of data much smaller than the
#: largest is looked for among them alone, at so many levels
_LEVEL = 1e-6
_LEVELS = 3

COMPLEMENTARY, CLOSED, OPEN, EITHER = 0, 1, 2, 3


@dataclass(frozen=True, slots=True)
class Certificate:
    """A proof of infeasibility: weights under which the relations add up to a contradiction.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Weights of the rows ``K z + A lam = b``.
    p : ndarray, shape (m,)
        Weights of the slacks.
    rows, pairs : ndarray of int64
        Where y and p are not zero (but for rounding): the conflicting equations and pairs.
    conflict : float
        ``-(b'y + q'p)`` relative to the sum of its terms, between 0 and 1.
    """

    y: Floats
    p: Floats
    rows: Ints
    pairs: Ints
    conflict: float

    def names(
        self, row_names: Sequence[str | None], pair_names: Sequence[str | None]
    ) -> tuple[list[str], list[str]]:
        """Return the names of the conflicting rows and pairs, each once, without the nameless.

        Examples
        --------
        >>> one = np.array([0])
        >>> c = Certificate(np.ones(1), np.ones(1), one, one, 1.0)
        >>> c.names(["v1"], ["d1"])
        (['v1'], ['d1'])
        """
        rows = dict.fromkeys(row_names[i] for i in self.rows.tolist())
        pairs = dict.fromkeys(pair_names[i] for i in self.pairs.tolist())
        return [x for x in rows if x is not None], [x for x in pairs if x is not None]


def infeasibility(
    K: Csc,
    A: Csc,
    B: Csc,
    D: Csc,
    b: npt.ArrayLike,
    q: npt.ArrayLike,
    roles: npt.ArrayLike | None = None,
) -> Certificate | None:
    """Look for a proof that the linear relations of a problem contradict each other.

    Parameters
    ----------
    K, A, B, D : Csc, shapes (n, n), (n, m), (m, n), (m, m)
        ``K z + A lam = b`` and ``w = q - B z + D lam``.
    b, q : array_like, shapes (n,) and (m,)
    roles : array_like of int, shape (m,), optional
        0 complementary pair (default), 1 closed switch, 2 open switch, 3 switch in either state.

    Returns
    -------
    Certificate or None
        None if the relations are feasible, or contradict each other by less than 1e-9 of the data.

    Examples
    --------
    5 V across an ideal diode: rows are the node's current law and the source's voltage.

    >>> K = Csc.from_dense(np.array([[0.0, 1.0], [-1.0, 0.0]]))
    >>> A = Csc.from_dense(np.array([[1.0], [0.0]]))
    >>> B = Csc.from_dense(np.array([[1.0, 0.0]]))
    >>> proof = infeasibility(K, A, B, Csc.zeros((1, 1)), [0.0, -5.0], [0.0])
    >>> proof.rows.tolist(), proof.pairs.tolist()
    ([1], [0])
    >>> infeasibility(K, A, B, Csc.zeros((1, 1)), [0.0, 5.0], [0.0]) is None
    True
    """
    (n, m) = A.shape
    rhs = np.concatenate([np.asarray(b, dtype=float), np.asarray(q, dtype=float)])
    kinds = np.zeros(m, dtype=np.int64) if roles is None else np.asarray(roles, dtype=np.int64)
    if not np.isfinite(rhs).all() or not rhs.any():
        return None  # zero solves it, or nothing can be said
    rows, cols, values = entries_of(K, A, B, D)
    if np.isin(kinds, (CLOSED, OPEN)).all() and _is_solvable(K, A, B, D, rhs, kinds == CLOSED):
        return None
    for leveled in (False, True):  # HiGHS loses its way in one or the other
        scale = _equilibrate(n + m, rows, cols, values, leveled)
        with np.errstate(over="ignore"):
            scaled = values * scale[rows] * scale[cols]
            scaled_rhs = rhs * scale
        if not (np.isfinite(scaled).all() and np.isfinite(scaled_rhs).all()):
            continue  # data at the end of the range of numbers: their products lie beyond
        data = np.abs(scaled_rhs)
        size = float(data.max())
        for _ in range(_LEVELS):
            if size < np.finfo(float).tiny:
                break  # there are no digits left to prove anything with
            used = data <= size
            gain = np.where(used, scaled_rhs / size, 0.0)
            weights = _smallest_proof(n, m, rows, cols, scaled, gain, kinds, used)
            proof = None if weights is None else _proof(n, rows, cols, scaled, gain, kinds, weights)
            if proof is not None:
                weights, named, conflict = proof
                weights = weights * scale / size
                return Certificate(
                    weights[:n],
                    weights[n:],
                    np.flatnonzero(named[:n]),
                    np.flatnonzero(named[n:]),
                    conflict,
                )
            size = float(data[data <= _LEVEL * size].max(initial=0.0))
    return None


def _is_solvable(
    K: Csc, A: Csc, B: Csc, D: Csc, rhs: Floats, closed: npt.NDArray[np.bool_]
) -> bool:
    """Return whether relations without inequalities have a solution that is plainly right.

    Numbers that nearly are a proof show that solutions are large, not that there are none.
    """
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    n = K.shape[0]
    rows, cols, values = entries_of(K, A, B, D)
    kept = np.concatenate([np.ones(n, dtype=bool), closed])
    used = kept[rows] & kept[cols]
    place = np.cumsum(kept) - 1
    size = int(kept.sum())
    matrix: Any = csc_array((values[used], (place[rows[used]], place[cols[used]])), (size, size))
    rhs = rhs[kept]
    try:
        solve = splu(matrix).solve
    except RuntimeError:
        return False  # singular
    x = solve(rhs)
    x += solve(rhs - matrix @ x)
    wrong = np.abs(rhs - matrix @ x)
    return bool((wrong <= _CONFLICT * (abs(matrix) @ np.abs(x) + np.abs(rhs))).all())


def entries_of(K: Csc, A: Csc, B: Csc, D: Csc) -> tuple[Ints, Ints, Floats]:
    """Return ``[[K, A], [B, -D]]`` as triplets: its transpose times (y, p) is what must vanish."""
    n = K.shape[0]
    rows = [K.indices, A.indices, B.indices + n, D.indices + n]
    cols = [K.columns, A.columns + n, B.columns, D.columns + n]
    return (
        np.concatenate(rows),
        np.concatenate(cols),
        np.concatenate([K.data, A.data, B.data, -D.data]),
    )


def _equilibrate(size: int, rows: Ints, cols: Ints, values: Floats, leveled: bool) -> Floats:
    """Return factors (powers of two, equal for row i and column i) that bring entries near one.

    If ``leveled``, first all of them on average (least squares of the logarithms, by conjugate
    gradients), which spreads one level of impedance along factors of one; then, or only, the
    largest of each row.
    """
    kept = values != 0.0
    r, c = rows[kept], cols[kept]

    def gather(x: Floats) -> Floats:
        total = np.bincount(r, x, size) + np.bincount(c, x, size)
        return np.asarray(total, dtype=np.float64)

    degree = np.maximum(gather(np.ones(r.size)), 1.0)
    rest = -gather(np.log(np.abs(values[kept])))
    logs = np.zeros(size)
    direction = np.zeros(size)
    before = np.inf
    for _ in range(_GRADIENT_STEPS if leveled else 0):
        now = float((rest**2 / degree).sum())
        if now <= 1e-4 * size:
            break
        direction = rest / degree + (now / before) * direction
        product = gather(direction[r] + direction[c])
        alpha = now / max(float(direction @ product), 1e-300)
        logs += alpha * direction
        rest = rest - alpha * product
        before = now
    scale = np.exp(np.clip(logs, -170.0, 170.0))
    for _ in range(_SWEEPS):
        entries = np.abs(values) * scale[rows] * scale[cols]
        largest = np.zeros(size)
        np.maximum.at(largest, rows, entries)
        np.maximum.at(largest, cols, entries)
        scale /= np.sqrt(np.where(largest > 0.0, largest, 1.0))
    return np.exp2(np.round(np.log2(scale)))


def _smallest_proof(
    n: int,
    m: int,
    rows: Ints,
    cols: Ints,
    values: Floats,
    rhs: Floats,
    kinds: Ints,
    used: npt.NDArray[np.bool_],
) -> Floats | None:
    """Return the (y, p) of least 1-norm on the relations in use, or None if there is none."""
    try:
        from scipy.optimize import linprog
        from scipy.sparse import coo_array, csr_array, hstack, vstack
    except ImportError:
        message = "a step was not solved, and scipy is needed to decide whether it has a solution"
        hint = "pip install scipy: the message then names the elements that contradict each other"
        raise NumericalError(Diagnostic("NS3010", message, None, hint)) from None

    size = n + m
    transposed: Any = csr_array(coo_array((values, (cols, rows)), shape=(size, size)))
    # weights of free sign are differences of two nonnegative ones, so that their sum is the 1-norm
    pair = np.arange(m)
    known = (kinds != OPEN) & (kinds != EITHER)
    positive = np.concatenate([np.arange(n), n + pair[known]])
    negative = np.concatenate([np.arange(n), n + pair[kinds == CLOSED]])
    positive, negative = positive[used[positive]], negative[used[negative]]
    columns: Any = csr_array(hstack([transposed[:, positive], -transposed[:, negative]]))
    gain = np.concatenate([rhs[positive], -rhs[negative]])
    free = (kinds == CLOSED) | (kinds == EITHER)
    equal = np.concatenate([np.arange(n), n + pair[free]])
    greater = n + pair[kinds == COMPLEMENTARY]
    # HiGHS's presolve has been seen to call such programs unbounded or infeasible although plain
    # simplex solves them: it comes first only where its speed is needed
    large = size > _PRESOLVE_FROM
    # and the tightest tolerances may leave nothing: what comes out is checked anyway
    ways = (
        ("highs", large, 1e-10),
        ("highs", not large, 1e-10),
        ("highs", False, 1e-7),
        ("highs-ipm", True, 1e-10),
    )
    for method, presolve, tolerance in ways:
        result = linprog(
            np.ones(columns.shape[1]),
            A_ub=-columns[greater] if greater.size else None,
            b_ub=np.zeros(greater.size) if greater.size else None,
            A_eq=csr_array(vstack([columns[equal], csr_array(gain[None, :])])),
            b_eq=np.concatenate([np.zeros(equal.size), [-1.0]]),
            bounds=(0.0, None),
            method=method,
            options={
                "primal_feasibility_tolerance": tolerance,
                "dual_feasibility_tolerance": tolerance,
                "presolve": presolve,
            },
        )
        if result.status == 0:
            weights = np.zeros(size)
            weights[positive] += result.x[: positive.size]
            weights[negative] -= result.x[positive.size :]
            return weights
        if result.status == 2 and not presolve and tolerance > 1e-10:
            return None
    return None


def _proof(
    n: int, rows: Ints, cols: Ints, values: Floats, rhs: Floats, kinds: Ints, weights: Floats
) -> tuple[Floats, npt.NDArray[np.bool_], float] | None:
    """Return weights that prove something, which of them count, and what they prove."""
    named = np.abs(weights) > _SUPPORT * np.abs(weights).max()
    for candidate in (np.where(named, weights, 0.0), weights):
        conflict = _check(n, rows, cols, values, rhs, kinds, candidate)
        if conflict is not None:
            return candidate, named, conflict
    return None


def _check(
    n: int, rows: Ints, cols: Ints, values: Floats, rhs: Floats, kinds: Ints, weights: Floats
) -> float | None:
    """Return the relative size of the contradiction, or None if the weights prove nothing.

    The linear program was solved within absolute tolerances; what counts is how each sum compares
    with its own terms.
    """
    terms = values * weights[rows]
    size = weights.size
    sums = np.bincount(cols, weights=terms, minlength=size)
    sizes = np.bincount(cols, weights=np.abs(terms), minlength=size)
    allowed = _EXACT * np.maximum(sizes, _EXACT * float(np.abs(weights).max()))
    wrong = np.abs(sums)
    inner = sums[n:]
    free = (kinds == CLOSED) | (kinds == EITHER)
    wrong[n:] = np.where(kinds == OPEN, 0.0, np.where(free, np.abs(inner), -inner))
    if (wrong > allowed).any():
        return None
    gains = rhs * weights
    conflict = -float(gains.sum()) / float(np.abs(gains).sum())
    return conflict if conflict > _CONFLICT else None
