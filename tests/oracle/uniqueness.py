"""Which scalar outputs of a solved step are determined by the circuit alone.

Two solutions of a monotone problem differ by a direction d = (dz, dl) with ``K dz + A dl = 0``,
``dl = 0`` where w > 0, ``dw = 0`` where l > 0, and no power: ``(K + K') dz = 0``.  An output is
unique if it vanishes on all such directions.
"""

from __future__ import annotations

import numpy as np

from .mlcp import Point
from .residual import Floats, Mlcp

DEGENERATE = 1e-9


def directions(p: Mlcp, point: Point) -> Floats:
    """Return an orthonormal basis, shape (n + m, k), of all directions between solutions.

    For pairs with l = w = 0 both changes are allowed, so the basis may be too large, never too
    small: an output called unique is unique.
    """
    n, m = p.n, p.m
    lam_size = np.abs(point.lam).max(initial=0.0)
    w_size = max(np.abs(point.w).max(initial=0.0), np.abs(p.q).max(initial=0.0))
    on = point.lam > DEGENERATE * lam_size
    off = point.w > DEGENERATE * w_size
    on = np.where(p.switch, p.closed, on)
    off = np.where(p.switch, ~p.closed, off & ~on)
    parts = [np.hstack([p.K, p.A])]
    parts.append(np.eye(n + m)[n:][off])
    parts.append(np.hstack([p.B, -p.D])[on])
    symmetric = p.K + p.K.T
    if n and np.linalg.eigvalsh(_unit(symmetric)).min() > -1e-12 and np.array_equal(p.B, p.A.T):
        parts.append(np.hstack([symmetric, np.zeros((n, m))]))
    matrix = np.vstack(parts)
    # balance rows and columns: the kernel is then mapped back
    columns = np.ones(n + m)
    for _ in range(6):
        size = np.abs(matrix * columns).max(axis=1)
        matrix = matrix / np.where(size > 0, size, 1.0)[:, None]
        size = np.abs(matrix * columns).max(axis=0)
        columns = columns / np.sqrt(np.where(size > 0, size, 1.0))
    _, values, vt = np.linalg.svd(matrix * columns)
    rank = int((values > 1e-11 * values.max(initial=0.0)).sum())
    kernel = columns[:, None] * vt[rank:].T
    return np.asarray(np.linalg.qr(kernel)[0]) if kernel.size else kernel


def _unit(matrix: Floats) -> Floats:
    """Return the matrix scaled to unit diagonal where it has one."""
    d = np.sqrt(np.abs(np.diag(matrix)))
    d = np.where(d > 0, d, 1.0)
    return matrix / d[:, None] / d[None, :]


def unique_signals(p: Mlcp, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """Return masks (of z, of lam) telling which entries are uniquely determined."""
    basis = directions(p, point)
    if basis.shape[1] == 0:
        return np.ones(p.n, dtype=bool), np.ones(p.m, dtype=bool)
    still = np.abs(basis).max(axis=1) <= 1e-9
    return still[: p.n], still[p.n :]
