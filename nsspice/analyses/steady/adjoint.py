"""What one signal makes of a current or voltage put in anywhere: one transposed solve.

With :math:`M(s) x = b` about an operating point and the signal :math:`c(s)^T x`, the solution of
:math:`M^T y = c` holds its response to a unit in each equation.
"""

from __future__ import annotations

import numpy as np

from ...problems.descriptor import Functional
from .linearised import Complexes, Point, unbounded

_DENSE = 150


def adjoint(point: Point, signal: Functional, s: Complexes) -> Complexes:
    """Return responses of a signal to a unit on the right of each equation, shape (k, n + active).

    Parameters
    ----------
    point : Point
    signal : Functional
    s : ndarray of complex, shape (k,)
        [1/s]

    Raises
    ------
    NumericalError
        NS3063 where the equations have no solution.
    """
    value, rate = point.matrices()
    c, d = point.row(signal)
    size = c.size
    found = np.empty((s.size, size), complex)
    if size <= _DENSE:
        G, E = value.dense().T, rate.dense().T
        for k, at in enumerate(s):
            matrix = G + at * E
            # columns of volts and of amperes: each unknown of the transposed equations is scaled
            scale = np.abs(matrix).max(axis=0)
            scale[scale == 0.0] = 1.0
            try:
                found[k] = np.linalg.solve(matrix / scale, c + at * d) / scale
            except np.linalg.LinAlgError:
                raise unbounded(float(at.imag) / (2.0 * np.pi)) from None
    else:
        from scipy.sparse import csc_matrix
        from scipy.sparse.linalg import splu

        G, E = (csc_matrix((m.data, m.indices, m.indptr), shape=m.shape) for m in (value, rate))
        for k, at in enumerate(s):
            try:
                found[k] = splu((G + at * E).tocsc()).solve((c + at * d).astype(complex), "T")
            except RuntimeError:
                raise unbounded(float(at.imag) / (2.0 * np.pi)) from None
    if not np.isfinite(found).all():
        raise unbounded(float(s[0].imag) / (2.0 * np.pi))
    return found
