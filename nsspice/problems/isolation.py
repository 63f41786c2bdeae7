"""Whether another solution is near one: strong metric sub-regularity of a linear system.

Solutions of ``K z + A lam = p``, ``w = q - B z + D lam >= 0``, ``lam >= 0``, ``lam . w = 0`` near
one of them differ by directions d = (dz, dlam) with ``K dz + A dlam = 0``, ``dw = 0`` where
lam > 0, ``dlam = 0`` where w > 0, and ``dlam >= 0``, ``dw >= 0``, ``dlam dw = 0`` where both are
zero (T. Roubal, R. Cibulka 2017, theorem 2.2 (ii)).  The solutions of a monotone problem form a
convex set, so that one with nothing near it is the only one.
"""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from .csc import Floats
from .descriptor import DescriptorSystem
from .passivity import passive
from .regularity import index_sets
from .verdict import Verdict, Witness

CLAIM = "no other solution nearby"
_ROUNDING = 1e-11  # of a null space, after rows and columns were scaled
_MOST = 4096  # sets of tight inequalities that are tried


def isolated(
    system: DescriptorSystem,
    z: Floats,
    lam: Floats,
    roles: npt.NDArray[np.uint8] | None = None,
) -> Verdict:
    """Judge a solution of a system without smooth functions.

    Parameters
    ----------
    system : DescriptorSystem
    z, lam : ndarray, shapes (n,) and (m,)
    roles : ndarray of uint8, shape (m,), optional
        0 complementary pair (default), 1 closed switch, 2 open switch.

    Returns
    -------
    Verdict
        Where it fails, the witness holds a direction (dz, dlam), shape (n + m,), along which there
        are solutions, and the pairs whose currents change.

    Examples
    --------
    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.constant(0.0))
    >>> equation = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),))
    >>> from dataclasses import replace
    >>> system = replace(equation.system(), smooth=None)  # 0 in Sgn(z): z = 0 alone
    >>> bool(isolated(system, np.zeros(2), np.zeros(2)))
    True
    """
    n, m = system.n, system.m
    on, off = index_sets(system, z, lam, roles)
    full = np.block([[system.G.dense(), system.A.dense()], [-system.B.dense(), system.D.dense()]])
    blocked = np.eye(n + m)[n:][off]
    equations = [full[:n], full[n:][on], blocked]
    convex = passive(system)
    if convex:  # differences of solutions of a monotone problem dissipate nothing
        dissipated = full[:n, :n] + full[:n, :n].T
        equations.append(np.hstack([dissipated, np.zeros((n, m))]))
    basis = null_space(np.vstack(equations))
    if basis.shape[1] == 0:
        return Verdict.yes(CLAIM, "no direction satisfies the linearised laws")
    between = np.flatnonzero(~on & ~off)
    signed = np.vstack([np.eye(n + m)[n:][between], full[n:][between]]) @ basis
    found = rays(signed)
    if found is None:
        return Verdict.undecided(CLAIM, f"{len(between)} pairs neither conduct nor block")
    for ray in found:
        change = signed @ ray
        if np.all(np.abs(change[: len(between)] * change[len(between) :]) <= _ROUNDING):
            d = basis @ ray
            moved = tuple(int(k) for k in np.flatnonzero(np.abs(d[n:]) > _ROUNDING))
            text = "solutions lie along a line"
            return Verdict.no(CLAIM, "the laws leave something free", Witness(text, moved, d))
    if found:
        return Verdict.undecided(CLAIM, "inequalities alone do not decide it")
    return Verdict.yes(CLAIM, "no direction satisfies the laws and inequalities")


def rays(signed: Floats) -> list[Floats] | None:
    """Return vectors that span ``signed y >= 0``, one if it holds a line; None if too many."""
    count, dimension = signed.shape
    line = null_space(signed)
    if line.shape[1]:
        return [line[:, 0]]
    total = 1
    for k in range(dimension - 1):
        total = total * (count - k) // (k + 1)
    if total > _MOST:
        return None
    found: list[Floats] = []
    for rows in itertools.combinations(range(count), dimension - 1):
        ray = null_space(signed[list(rows)]) if rows else np.eye(dimension)
        if ray.shape[1] != 1:
            continue
        for y in (ray[:, 0], -ray[:, 0]):
            if np.all(signed @ y >= -_ROUNDING):
                found.append(y)
    return found


def null_space(matrix: Floats) -> Floats:
    """Return a basis of the null space, columns of length one."""
    count = matrix.shape[1]
    columns = np.ones(count)
    rows = matrix
    for _ in range(6):
        size = np.abs(rows * columns).max(axis=1, initial=0.0)
        rows = rows[size > 0.0] / size[size > 0.0, None]
        if not len(rows):
            return np.eye(count)
        size = np.abs(rows * columns).max(axis=0)
        columns = columns / np.sqrt(np.where(size > 0.0, size, 1.0))
    _, values, right = np.linalg.svd(rows * columns)
    rank = int(np.sum(values > _ROUNDING * values[0]))
    basis = columns[:, None] * right[rank:].T
    return np.asarray(basis / np.linalg.norm(basis, axis=0))


__all__ = ["isolated", "null_space", "rays"]
