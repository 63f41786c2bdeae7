"""Whether a solution moves continuously with the data: strong metric regularity, P-matrices.

For a static system ``K z + A lam = p``, ``w = q - B z + D lam`` with smooth functions linearised,
a solution is locally unique and Lipschitz in p under Robinson's condition (S. M. Robinson,
*Strongly regular generalized equations*, Math. Oper. Res. 5, 1980), for products of monotone
graphs what corollary 2.1 and theorem 2.2 of R. Cibulka, T. Roubal (2017) ask for: with the pairs
that certainly conduct put into the equations, those that do neither must give a P-matrix.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .csc import Floats
from .descriptor import DescriptorSystem
from .matrices import is_p_matrix
from .verdict import Verdict

CLAIM = "strongly regular"
#: Minors and determinants below this part of the product of their rows' lengths are zero.
ZERO = 1e-11


@dataclass(frozen=True, slots=True)
class Regularity:
    """Strong metric regularity of a system at a solution.

    Parameters
    ----------
    verdict : Verdict
    modulus : float
        Largest change of an unknown per unit of a row's right-hand side, over all modes that the
        solution touches; inf if not regular.
    unknown, row : int
        Where that is reached.
    between : tuple of int
        Pairs that neither conduct nor block: ``lam = w = 0``.
    """

    verdict: Verdict
    modulus: float
    unknown: int = -1
    row: int = -1
    between: tuple[int, ...] = ()

    @property
    def strong(self) -> bool | None:
        """Whether it is strongly regular; None if that is not decided."""
        return self.verdict.holds

    @property
    def badness(self) -> tuple[bool, float]:
        """What solutions are compared by: not regular is worst, then the largest modulus."""
        return not self.strong, self.modulus


def index_sets(
    system: DescriptorSystem,
    z: Floats,
    lam: Floats,
    roles: npt.NDArray[np.uint8] | None = None,
    scale: float = 1e-9,
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Return which pairs conduct and which block at solutions; the others do neither.

    Parameters as of :func:`strong_regularity`; both results have the shape of lam.  They alone
    decide on the regularity of a system without smooth functions.

    Examples
    --------
    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.unknown(0))
    >>> system = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).system()
    >>> on, off = index_sets(system, np.array([0.0, 1.0]), np.zeros(2))
    >>> on.tolist(), off.tolist()
    ([False, False], [False, True])
    """
    w = system.q - z @ system.B.dense().T + lam @ system.D.dense().T
    most = np.abs(w).max(axis=-1, initial=0.0, keepdims=True)
    on = lam > scale * np.abs(lam).max(axis=-1, initial=0.0, keepdims=True)
    off = w > scale * np.maximum(most, np.abs(system.q).max(initial=0.0))
    if roles is not None:
        on, off = (roles == 1) | (on & (roles == 0)), (roles == 2) | (off & (roles == 0))
    return on, off


def strong_regularity(
    system: DescriptorSystem,
    jacobian: Floats,
    z: Floats,
    lam: Floats,
    roles: npt.NDArray[np.uint8] | None = None,
    scale: float = 1e-9,
) -> Regularity:
    """Judge a solution of a static system, or the worst of k solutions.

    At a kink of a function :mod:`nsspice.problems.piecewise` judges.

    Parameters
    ----------
    system : DescriptorSystem
    jacobian : ndarray, shape (p, n) or (k, p, n)
        Derivatives of the smooth functions at the solution; p = 0 without any.
    z, lam : ndarray, shapes (n,) and (m,), or (k, n) and (k, m)
    roles : ndarray of uint8, shape of lam, optional
        0 complementary pair (default), 1 closed switch, 2 open switch.
    scale : float
        Multipliers and slacks below this part of the largest are zero.

    Examples
    --------
    0 in z + Sgn(z) - 1 at z = 0: at the end of the vertical piece, still regular with modulus 1.

    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.unknown(0))
    >>> system = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).system()
    >>> found = strong_regularity(system, np.eye(1, 2), np.array([0.0, 1.0]), np.zeros(2))
    >>> found.strong, found.modulus, found.between
    (True, 1.0, (0,))
    """
    n = system.n
    z, lam = np.atleast_2d(z), np.atleast_2d(lam)
    on, off = index_sets(system, z, lam, roles, scale)
    modes: dict[bytes, list[int]] = {}
    for k in range(len(z)):
        modes.setdefault(on[k].tobytes() + off[k].tobytes(), []).append(k)
    linear = np.block([[system.G.dense(), system.A.dense()], [-system.B.dense(), system.D.dense()]])
    worst = None
    for points in modes.values():
        full = linear[None]
        if system.smooth is not None:  # else one point of a mode speaks for all of them
            slopes = jacobian.reshape(len(z), -1, n)[points]
            full = np.repeat(full, len(points), axis=0)
            full[:, :n, :n] += system.smooth.F.dense() @ slopes
        found = _in_mode(full, n, on[points[0]], off[points[0]])
        if worst is None or found.badness > worst.badness:
            worst = found
    assert worst is not None  # there is a point, hence a mode
    return worst


def _in_mode(
    full: Floats,
    n: int,
    on: npt.NDArray[np.bool_],
    off: npt.NDArray[np.bool_],
) -> Regularity:
    """Judge linearised systems, shape (k, n + m, n + m), in which the same pairs conduct."""
    between = np.flatnonzero(~on & ~off)
    kept, others = np.concatenate([np.arange(n), n + np.flatnonzero(on)]), n + between
    free = "the linearised laws leave something free"
    singular = Regularity(Verdict.no(CLAIM, free), math.inf, between=tuple(between.tolist()))
    inner_part = full[:, kept[:, None], kept]
    inverse = inverses(inner_part)
    if inverse is None:
        return singular
    if len(others):
        columns, rows = full[:, kept[:, None], others], full[:, others[:, None], kept]
        for block in full[:, others[:, None], others] - rows @ inverse @ columns:
            found = is_p_matrix(block)
            if not found:
                return replace(singular, verdict=replace(found, claim=CLAIM))
    modulus, place = 0.0, (0, 0)
    count = len(others) if len(others) <= 6 else 0
    for mode in itertools.product((False, True), repeat=count):
        inner: Floats | None = inverse
        if any(mode):
            index = np.concatenate([kept, others[np.array(mode)]])
            inner = inverses(full[:, index[:, None], index])
        if inner is None:
            return singular
        sizes = np.abs(inner[:, :n, :n]).max(axis=0)
        best = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
        if sizes[best] > modulus:
            modulus, place = float(sizes[best]), (int(best[0]), int(best[1]))
    verdict = Verdict.yes(CLAIM, "one orientation in all modes that the solution touches")
    return Regularity(verdict, modulus, *place, tuple(between.tolist()))


def inverses(matrices: Floats) -> Floats | None:
    """Return the inverses of matrices, None if one is singular; rows and columns are scaled first.

    Parameters
    ----------
    matrices : ndarray, shape (k, n, n)

    Examples
    --------
    >>> inverses(np.array([[[1.0]], [[4.0]]])).ravel().tolist()
    [1.0, 0.25]
    >>> inverses(np.zeros((1, 1, 1))) is None
    True
    """
    if matrices.shape[-1] == 0:
        return matrices
    scales = equilibration(matrices)
    if scales is None:
        return None
    rows, columns = scales
    scaled = matrices * rows[:, :, None] * columns[:, None]
    values = np.linalg.svd(scaled, compute_uv=False)
    if np.any(values[:, -1] <= 1e-14 * values[:, 0]):
        return None
    return np.asarray(np.linalg.inv(scaled) * columns[:, :, None] * rows[:, None])


def equilibration(matrices: Floats) -> tuple[Floats, Floats] | None:
    """Return factors of rows and of columns, (k, n) each, that bring entries near to one or below.

    None where a row or a column is zero, or an entry is not a number.

    Examples
    --------
    >>> rows, columns = equilibration(np.array([[[4.0]]]))
    >>> round(float((rows * columns)[0, 0]) * 4.0, 2)
    1.0
    """
    if not np.all(np.isfinite(matrices)):  # atan2(0, 0) has no slopes
        return None
    rows, columns = np.ones(matrices.shape[:2]), np.ones(matrices.shape[:2])
    sizes = scaled = np.abs(matrices)
    for _ in range(6):
        tallest = scaled.max(axis=2)
        if np.any(tallest == 0.0) or np.any(scaled.max(axis=1) == 0.0):
            return None
        rows /= np.sqrt(tallest)
        columns /= np.sqrt((sizes * rows[:, :, None] * columns[:, None]).max(axis=1))
        scaled = sizes * rows[:, :, None] * columns[:, None]
    return rows, columns


__all__ = [
    "Regularity",
    "equilibration",
    "index_sets",
    "inverses",
    "strong_regularity",
]
