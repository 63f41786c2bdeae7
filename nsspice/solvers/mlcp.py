"""One mixed linear complementarity problem, solved by the compiled driver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..problems.csc import Csc, Floats
from .certificate import infeasibility
from .compiled import core_matrix
from .scales import Scales

#: rounding of more than this part of the data leaves nothing known
_KNOWN = 0.1


@dataclass(frozen=True, slots=True)
class MlcpSolution:
    """Result of :func:`solve_mlcp`.

    Parameters
    ----------
    z : ndarray, shape (n,)
    lam : ndarray, shape (m,)
    solved : bool
        False if no stage reached the residual 1e-10.
    residual_rows, residual_complementarity : float
        Scale-relative residuals.
    """

    z: Floats
    lam: Floats
    solved: bool
    residual_rows: float
    residual_complementarity: float


def solve_mlcp(
    K: Csc,
    A: Csc,
    B: Csc,
    D: Csc,
    b: Floats,
    q: Floats,
    *,
    roles: npt.NDArray[np.uint8] | None = None,
    row_kind: npt.NDArray[np.uint8] | None = None,
    start: tuple[Floats, Floats] | None = None,
) -> MlcpSolution:
    """Solve ``K z + A lam = b``, ``0 <= lam`` orthogonal to ``q - B z + D lam >= 0``.

    For monotone problems (K + K', D positive semidefinite and B = A') a solution exists exactly
    when the linear relations alone are feasible, and the driver finds it.  Pairs in very different
    units are solved, and judged, in even ones.

    Parameters
    ----------
    K, A, B, D : Csc, shapes (n, n), (n, m), (m, n), (m, m)
    b, q : ndarray, shapes (n,) and (m,)
    roles : ndarray of uint8, shape (m,), optional
        0 complementary pair (default), 1 ``w = 0`` and lam free, 2 ``lam = 0`` and w free.
    row_kind : ndarray of uint8, shape (n,), optional
        Rows of one kind share a scale in the residual.
    start : (ndarray, ndarray), optional
        A point to stay close to where the solution is not unique; least norm without.

    Returns
    -------
    MlcpSolution

    Raises
    ------
    ValueError
        If a vector has another shape than the matrices need, or entries are not numbers.

    Examples
    --------
    A source of 5 V over 1 Ohm and an ideal diode (2 unknowns would do as well):

    >>> one = Csc.from_triplets((1, 1), [0], [0], [1.0])
    >>> s = solve_mlcp(one, one, one, Csc.zeros((1, 1)), np.array([5.0]), np.array([0.0]))
    >>> s.z.tolist(), s.lam.tolist()
    ([0.0], [5.0])
    """
    n, m = A.shape
    b, q = _vector("b", b, n), _vector("q", q, m)
    if start is not None:
        start = (_vector("start[0]", start[0], n), _vector("start[1]", start[1], m))
    for name, matrix in zip("KABD", (K, A, B, D), strict=True):
        if not np.isfinite(matrix.data).all():
            raise ValueError(f"{name} has entries that are not numbers")
    scales = Scales.of_pairs(K, A, B, D)
    if scales is not None:
        K, A, B, D, b, q, start = scales.problem(K, A, B, D, b, q, start)
    out = _core.solve_mlcp(
        core_matrix(K),
        core_matrix(A),
        core_matrix(B),
        core_matrix(D),
        b,
        q,
        np.zeros(m, np.uint8) if roles is None else roles,
        np.zeros(n, np.uint8) if row_kind is None else row_kind,
        start,
    )
    z, lam, solved = out["z"], out["l"], out["solved"]
    if solved and out["needs_certificate"]:
        # huge against its data: rounding may hide that the relations contradict each other
        solved = not _hides(K, A, B, D, b, q, z, lam)
        solved = solved and infeasibility(K, A, B, D, b, q, roles) is None
    if scales is not None:
        z, lam = scales.solution(z, lam)
    return MlcpSolution(z, lam, solved, out["residual_rows"], out["residual_complementarity"])


def _vector(name: str, values: Floats, size: int) -> Floats:
    """Return a vector of floats of this size."""
    out = np.ascontiguousarray(values, dtype=np.float64)
    if out.shape != (size,):
        raise ValueError(f"{name} has the shape {out.shape}, the matrices need ({size},)")
    if not np.isfinite(out).all():
        raise ValueError(f"{name} has entries that are not numbers")
    return out


def _hides(K: Csc, A: Csc, B: Csc, D: Csc, b: Floats, q: Floats, z: Floats, lam: Floats) -> bool:
    """Return whether rounding of the terms of the pairs is as large as their data."""
    terms = B.abs().dot(np.abs(z)) + D.abs().dot(np.abs(lam))
    data = max(np.abs(q).max(initial=0.0), np.abs(b).max(initial=0.0))
    rounding: float = np.finfo(np.float64).eps * terms.max(initial=0.0)
    return bool(rounding > _KNOWN * data)
