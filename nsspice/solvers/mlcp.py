"""One mixed linear complementarity problem, solved by the compiled driver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..problems.csc import Csc, Floats
from .certificate import infeasibility
from .compiled import core_matrix


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
    when the linear relations alone are feasible, and the driver finds it.

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

    Examples
    --------
    A source of 5 V over 1 Ohm and an ideal diode (2 unknowns would do as well):

    >>> one = Csc.from_triplets((1, 1), [0], [0], [1.0])
    >>> s = solve_mlcp(one, one, one, Csc.zeros((1, 1)), np.array([5.0]), np.array([0.0]))
    >>> s.z.tolist(), s.lam.tolist()
    ([0.0], [5.0])
    """
    n, m = A.shape
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
    solved = out["solved"]
    if solved and out["needs_certificate"]:
        # huge against its data: rounding may hide that the relations contradict each other
        solved = infeasibility(K, A, B, D, b, q, roles) is None
    return MlcpSolution(
        out["z"],
        out["l"],
        solved,
        out["residual_rows"],
        out["residual_complementarity"],
    )
