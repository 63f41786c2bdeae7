"""The theta terms: what makes a step with theta < 1 an average of the state equations.

A theta step on the state equations ``x' = A x + B u + F s`` averages the smooth part only:

    x1 = x0 + h (theta (A x1 + F s1) + (1 - theta) (A x0 + F s0) + B u1),

while algebraic equations and complementarity hold at the new time and the multiplier is fully
implicit.  On the MNA system this is the implicit step with correction currents: in parallel to each
tree capacitor, and in series with each cotree inductor, the change of its smooth rate times
``1 - theta``.
"""

from __future__ import annotations

import numpy as np

from ..errors import Diagnostic, RegularityError
from ..problems.csc import Csc, Floats, Ints
from .mna import MnaSystem
from .normal_form import Reference, Solve, reference

#: columns solved at a time, and the most entries that the rates may have
CHUNK = 64
LIMIT = 20_000_000


def theta_terms(mna: MnaSystem, theta: float) -> tuple[Csc, Csc]:
    """Return H and Hs of the theta step.

    The step reads ``(E/h + G + H) z1 + A lam1 = (E/h + H) z0 + (S - Hs) u1 + Hs u0``.

    Parameters
    ----------
    mna : MnaSystem
    theta : float
        Weight of the new state; 1 gives empty terms.

    Returns
    -------
    H : Csc, shape (n, n)
    Hs : Csc, shape (n, p)

    Raises
    ------
    RegularityError
        NS2060 if the states do not determine the rates, NS2062 if there are too many entries.
    """
    n, p = mna.system.n, len(mna.system.waveforms)
    if theta == 1.0 or mna.system.static:
        return Csc.zeros((n, n)), Csc.zeros((n, p))
    network = reference(mna)
    k, m = len(network.states), mna.system.m
    incidence = network.incidence()
    solve = network.solver()
    # a unit of unknown j sets the states P' e_j; only unknowns that touch a state count
    touched = np.unique(incidence.indices)
    h = _responses(
        network, solve, incidence, _selected_rows(incidence, touched), n + m, 1.0 - theta
    )
    h = Csc.from_triplets((n, n), h.indices, touched[h.columns], h.data)
    keep = ~network.fixed[mna.system.S.indices]
    sources = Csc.from_triplets(
        (n + m + k, p),
        mna.system.S.indices[keep],
        mna.system.S.columns[keep],
        mna.system.S.data[keep],
    )
    return h, _responses(network, solve, incidence, sources, 0, 1.0 - theta)


def _selected_rows(matrix: Csc, rows: Ints) -> Csc:
    """Return the transpose of some rows of a matrix, shape (ncols, number of rows)."""
    place = np.full(matrix.shape[0], -1, dtype=np.int64)
    place[rows] = np.arange(rows.size)
    return Csc.from_triplets(
        (matrix.shape[1], rows.size), matrix.columns, place[matrix.indices], matrix.data
    )


def _responses(
    network: Reference, solve: Solve, incidence: Csc, right: Csc, top: int, weight: float
) -> Csc:
    """Return ``weight * P @ rates`` for sparse right sides that start at row ``top``."""
    n, m = network.mna.system.n, network.mna.system.m
    order = network.matrix.shape[0]
    found: list[tuple[Ints, Ints, Floats]] = []
    count = 0
    for left in range(0, right.shape[1], CHUNK):
        width = min(CHUNK, right.shape[1] - left)
        entries = slice(right.indptr[left], right.indptr[left + width])
        columns = np.repeat(np.arange(width), np.diff(right.indptr[left : left + width + 1]))
        block = np.zeros((order, width))
        block[right.indices[entries] + top, columns] = right.data[entries]
        rho = solve(block)[n + m :]
        rows, size = _spread(incidence, rho), _spread(incidence.abs(), np.abs(rho))
        # differences of equal rates leave rounding errors where the network has no path
        i, j = np.nonzero(np.abs(rows) > 4e-16 * size.max(axis=0, initial=0.0))
        found.append((i.astype(np.int64), j.astype(np.int64) + left, weight * rows[i, j]))
        count += i.size
        if count > LIMIT:
            raise RegularityError(
                Diagnostic(
                    "NS2062",
                    f"with theta < 1 the rates of {len(network.states)} states depend on too many "
                    "others",
                    None,
                    "use theta=1",
                )
            )
    none = np.zeros(0, dtype=np.int64)
    return Csc.from_triplets(
        (n, right.shape[1]),
        np.concatenate([none, *(f[0] for f in found)]),
        np.concatenate([none, *(f[1] for f in found)]),
        np.concatenate([np.zeros(0), *(f[2] for f in found)]),
    )


def _spread(incidence: Csc, rho: Floats) -> Floats:
    """Return ``P @ rho`` for several columns."""
    out = np.zeros((incidence.shape[0], rho.shape[1]))
    np.add.at(out, incidence.indices, incidence.data[:, None] * rho[incidence.columns])
    return out
