"""Whether charges that move at one instant can have passed where charges can pass.

At an instant the charges ``E z`` of the nodes change by what passes pairs, forward only, and
branches whose currents are free, both ways: there are ``q >= 0`` and ``p`` with

.. math::  \\Delta (E z) + A q + G_c p = 0

in the rows of currents.  The ``q`` are not unique where pairs form loops or lie in parallel, so
that one solution with a wrong sign proves nothing; a least square with bounds decides (C. L. Lawson
and R. J. Hanson, Solving Least Squares Problems, SIAM 1995, chapter 23).
"""

from __future__ import annotations

import numpy as np

from ...problems.csc import Floats
from ...problems.descriptor import DescriptorSystem

#: part of the largest voltage below which a pair counts as having none
_NONE = 1e-9
#: Numbers in the dense matrix at most (32 MB): beyond, nothing is explained.
_MOST = 4_000_000


def unexplained(system: DescriptorSystem, moved: Floats, after: Floats) -> float:
    """Return the part of charges, relative to the largest, that no impulses explain.

    Parameters
    ----------
    system : DescriptorSystem
    moved : ndarray, shape (n,)
        Changes of charges [A s]; those of fluxes are left out.
    after : ndarray, shape (n,)
        Unknowns after the instant: a pair with a voltage then has passed nothing.

    Returns
    -------
    float
        Relative to the largest change.
    """
    from scipy.optimize import nnls

    kinds = np.asarray(system.row_kind)
    rows = kinds == 0
    wanted = -moved[rows]
    largest = float(np.max(np.abs(wanted), initial=0.0))
    if largest == 0.0:
        return 0.0
    if system.n * (system.n + system.m) > _MOST:
        return 1.0
    A, G = system.A.dense()[rows], system.G.dense()[rows]
    stores = np.zeros(system.n, dtype=bool)
    stores[system.E.columns] = True
    free = (kinds == 1) & ~stores
    sizes = np.abs(system.q) + system.B.abs().dot(np.abs(after))
    passing = np.abs(system.q - system.B.dot(after)) <= _NONE * np.max(sizes, initial=0.0)
    own = np.flatnonzero(passing)
    other = np.array([k for k in own if k in system.switched], dtype=int)
    matrix = np.hstack([A[:, own], -A[:, other], G[:, free], -G[:, free]])
    if not matrix.size:
        return 1.0
    try:
        found, _ = nnls(matrix, wanted / largest, maxiter=10 * (matrix.shape[1] + 10))
    except RuntimeError:  # no end within so many rounds
        return 1.0
    return float(np.max(np.abs(matrix @ found - wanted / largest)))
