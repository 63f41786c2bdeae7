r"""Strong regularity where smooth functions have kinks, or fold: all pieces, not orientation alone.

Near a point the equations are piecewise smooth, and strongly regular exactly if their piecewise
linear approximation is one to one.  Its pieces are the sides of the kinks and, for each pair that
neither conducts nor blocks, conducting and blocking.

- Pieces of both orientations, or a singular one: it is not.
- One orientation over the whole box of the kinks' slopes: it is, as Clarke's Jacobian lies inside.
- One orientation of the pieces alone does not decide: the doubling of angles
  ``(|a| - |b|, |a + b| - |a - b|)`` has it, and takes every value twice.  The number of pieces that
  hold a solution for one right-hand side is the degree; one to one means one.

References: J.-S. Pang, D. Ralph, *Piecewise smoothness, local invertibility, and parametric
analysis of normal maps*, Math. Oper. Res. 21 (1996); S. Scholtes, *Introduction to Piecewise
Differentiable Equations* (2012), section 2.3.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .csc import Floats
from .descriptor import DescriptorSystem
from .regularity import CLAIM, Regularity, index_sets, inverses
from .verdict import Verdict

_MOST = 10  # kinks and pairs at a point whose sides are all combined: 1024 pieces
#: a direction within this part of the boundary between two pieces is on neither side
_CLEAR = 1e-7
_ZERO = 1e-12  # within this part it lies in it
_RIGHT_HAND_SIDES = 20
#: slopes of different sides that are one sum of the changes at each kink, relative
_ADDITIVE = 1e-10


@dataclass(frozen=True, slots=True, eq=False)
class Kinks:
    """The slopes around a point at which functions have kinks.

    Parameters
    ----------
    jacobians : ndarray, shape (2^k, p, n)
        Slopes of the functions on all sides, the last kink's sides next to each other, lower first.
    directions : ndarray, shape (k, n)
        Along which each kink goes from its lower to its upper side.
    sure : bool
        Each kink is where a smooth function of the unknowns vanishes, and near the point their
        signs are combined as those of the directions are.
    """

    jacobians: Floats
    directions: Floats
    sure: bool = True

    @property
    def sides(self) -> npt.NDArray[np.float64]:
        """Signs of the sides, shape (2^k, k)."""
        count = len(self.directions)
        found = np.array(list(itertools.product((-1.0, 1.0), repeat=count)))
        return found.reshape(1 << count, count)


def regular_at_kinks(
    system: DescriptorSystem,
    kinks: Kinks,
    z: Floats,
    lam: Floats,
    roles: npt.NDArray[np.uint8] | None = None,
    scale: float = 1e-9,
    rows: npt.NDArray[np.bool_] | None = None,
) -> Regularity:
    """Judge a solution of a static system at which functions have kinks.

    Parameters
    ----------
    system : DescriptorSystem
    kinks : Kinks
    z, lam : ndarray, shapes (n,) and (m,)
    roles : ndarray of uint8, shape (m,), optional
        0 complementary pair (default), 1 closed switch, 2 open switch.
    scale : float
        Multipliers and slacks below this part of the largest are zero.
    rows : ndarray of bool, shape (n,), optional
        Whose right-hand sides are data; all by default.  Bounds of sets are none.

    Examples
    --------
    ``|z| = 0`` has no solution nearby for a negative right-hand side, and two for a positive one:

    >>> from nsspice.problems import GeneralizedEquation, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.op("abs", tape.unknown(0)))
    >>> system = GeneralizedEquation(tape.finish()).system()
    >>> fold = Kinks(np.array([[[-1.0]], [[1.0]]]), np.ones((1, 1)))
    >>> regular_at_kinks(system, fold, np.zeros(1), np.zeros(0)).strong
    False
    """
    n, m = system.n, system.m
    on, off = index_sets(system, z[None], lam[None], None if roles is None else roles[None], scale)
    on, off = on[0], off[0]
    between = np.flatnonzero(~on & ~off)
    owners = tuple(between.tolist())

    if len(kinks.directions) + between.size > _MOST:
        return _told(None, "too many kinks meet at the solution", owners)
    pieces, signs = _pieces(system, kinks, np.flatnonzero(off), between)
    across = np.zeros((len(kinks.directions) + between.size, n + m))
    across[: len(kinks.directions), :n] = kinks.directions
    across[range(len(kinks.directions), len(across)), n + between] = 1.0
    fixed = np.ones(n + m, dtype=bool)
    fixed[:n] = False if rows is None else ~rows
    return _judged(kinks, pieces, signs, across, fixed, n, owners)


def _told(holds: bool | None, text: str, owners: tuple[int, ...]) -> Regularity:
    return Regularity(Verdict(CLAIM, holds, text), np.inf, between=owners)


def _pieces(
    system: DescriptorSystem,
    kinks: Kinks,
    blocking: npt.NDArray[np.intp],
    between: npt.NDArray[np.intp],
) -> tuple[Floats, Floats]:
    """Return the matrices of all pieces, shape (pieces, n + m, n + m), and their sides.

    The unknown of a pair is its multiplier where it conducts, minus its slack where it blocks.
    """
    n, m = system.n, system.m
    linear = np.block([[system.G.dense(), system.A.dense()], [-system.B.dense(), system.D.dense()]])
    unit = np.eye(n + m)
    pieces, signs = [], []
    for jacobian, side in zip(kinks.jacobians, kinks.sides, strict=True):
        full = linear.copy()
        if system.smooth is not None:
            full[:n, :n] += system.smooth.F.dense() @ jacobian
        for mode in itertools.product((1.0, -1.0), repeat=between.size):
            blocked = [n + int(k) for k in blocking]
            blocked += [n + int(k) for k, sign in zip(between, mode, strict=True) if sign < 0.0]
            piece = full.copy()
            piece[:, blocked] = unit[:, blocked]
            pieces.append(piece)
            signs.append([*side, *mode])
    return np.array(pieces), np.array(signs)


def _judged(
    kinks: Kinks,
    pieces: Floats,
    signs: Floats,
    across: Floats,
    fixed: npt.NDArray[np.bool_],
    n: int,
    owners: tuple[int, ...],
) -> Regularity:
    each = [inverses(piece[None]) for piece in pieces]
    found = [np.zeros_like(pieces[0]) if one is None else one[0] for one in each]
    own = np.array(
        [0.0 if one is None else np.linalg.slogdet(one[0])[0] for one in each], dtype=np.float64
    )
    met = np.ones(len(pieces), dtype=bool)
    text = "one orientation over all of Clarke's Jacobian"
    if own[0] == 0.0 or np.any(own != own[0]) or not _additive(kinks):
        if not kinks.sure:
            text = "kinks lie upon each other, and not all sides need to be met"
            return _told(None, text, owners)
        met = np.array(
            [_met(piece[fixed], side, across) for piece, side in zip(pieces, signs, strict=True)]
        )
        own = own[met]
        if np.any(own == 0.0):
            return _told(False, "the linearised laws leave something free", owners)
        if np.any(own != own[0]):
            return _told(False, "the orientation changes at a kink", owners)
        degree = _degree(pieces[met], signs[met], across, fixed)
        if degree is None:
            return _told(None, "rounding decides on which side of a kink a solution is", owners)
        if degree != 1:
            text = f"one orientation, but {degree} solutions lie nearby for one right-hand side"
            return _told(False, text, owners)
        text = "one orientation in all pieces, and one solution for each right-hand side"
    sizes = np.where(fixed, 0.0, np.abs(np.array(found)[met]).max(axis=0))[:n]
    place = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
    verdict = Verdict.yes(CLAIM, text)
    return Regularity(verdict, float(sizes[place]), int(place[0]), int(place[1]), owners)


def _additive(kinks: Kinks) -> bool:
    """Return whether each kink adds its own change to the slopes, regardless of the others.

    The determinant is then linear in the share of each change, so that its signs at all sides are
    those of everything between.
    """
    on = kinks.sides > 0.0
    base = kinks.jacobians[0]
    changes = np.zeros((len(kinks.directions), *base.shape))
    for k in range(len(changes)):
        alone = on[:, k] & (on.sum(axis=1) == 1)
        changes[k] = kinks.jacobians[alone][0] - base
    sums = base + np.einsum("sk,kpn->spn", on.astype(np.float64), changes)
    size = float(np.max(np.abs(kinks.jacobians), initial=0.0))
    if np.max(np.abs(sums - kinks.jacobians), initial=0.0) > _ADDITIVE * size:
        return False
    # a change of rank one is linear in its share; several functions may share one kink
    return all(np.linalg.matrix_rank(change) <= 1 for change in changes)


def _met(still: Floats, side: Floats, across: Floats) -> bool:
    """Return whether a piece has directions inside that leave some rows as they are."""
    _, values, right = np.linalg.svd(still)
    least = still.shape[1] * 2.0**-53 * float(np.max(values, initial=0.0))
    kernel = right[int(np.sum(values > least)) :].T
    forms = side[:, None] * (across @ kernel)
    # a kink along which these directions do not go has both sides in common
    forms = forms[np.abs(forms).max(axis=1, initial=0.0) > _CLEAR]
    if np.linalg.matrix_rank(forms) == len(forms):
        return True
    from scipy.optimize import linprog

    count = forms.shape[1]
    cost = np.zeros(count + 1)
    cost[-1] = -1.0
    # as far from all boundaries as a direction of bounded entries can be
    rows = np.column_stack([-forms, np.ones(len(forms))])
    ranges = [(-1.0, 1.0)] * count + [(None, 1.0)]
    got = linprog(cost, A_ub=rows, b_ub=np.zeros(len(rows)), bounds=ranges)
    return bool(got.status == 0 and -got.fun > _CLEAR)


def _degree(
    pieces: Floats, signs: Floats, across: Floats, fixed: npt.NDArray[np.bool_]
) -> int | None:
    """Return how many solutions one right-hand side has, all pieces being of one orientation.

    Nearly every right-hand side will do; None where those tried lead too near to boundaries.
    """
    random = np.random.default_rng(1996)
    for _ in range(_RIGHT_HAND_SIDES):
        right = np.where(fixed, 0.0, random.standard_normal(fixed.size))
        steps = np.array([np.linalg.solve(piece, right) for piece in pieces])
        size = np.linalg.norm(steps, axis=1)[:, None] * np.linalg.norm(across, axis=1)
        places = (steps @ across.T) * signs / np.where(size > 0.0, size, 1.0)
        if np.any((np.abs(places) > _ZERO) & (np.abs(places) <= _CLEAR)):
            continue
        inside = steps[np.all(places >= -_ZERO, axis=1)]
        # what lies in the boundary of two pieces is one solution
        scale = float(np.max(np.abs(inside), initial=0.0))
        apart = [k for k in range(len(inside)) if not _known(inside[:k], inside[k], scale)]
        return len(apart)
    return None


def _known(others: Floats, one: Floats, scale: float) -> bool:
    return bool(np.any(np.all(np.abs(others - one) <= _CLEAR * scale, axis=1)))


__all__ = ["Kinks", "regular_at_kinks"]
