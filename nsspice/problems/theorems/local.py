r"""Regularity at a solution of a generalized equation: Theorem 2.2.6 and appendix B.

A system ``K z + A lam = p``, ``w = q - B z + D lam`` with pairs ``0 <= lam perp w >= 0`` is
linearised at a solution; each pair lies on the graph of complementarity, an angle of two half
lines.  Where a pair is at the vertex (lam = w = 0) the graph has

=============================  =============================================================
tangent cone T                 both half lines
paratingent cone               both lines, and ``(s, -t)``, ``(-s, t)`` for s, t >= 0
limiting normal cone N         both lines (exchanged), and the third quadrant
=============================  =============================================================

and elsewhere one line.  The conditions are linear problems over the products of these cones.

Source: R. Cibulka, T. Roubal (2017), Theorem 2.2 (i) to (iii), Corollary 2.1, Theorem 2.4;
T. Roubal (2015), Theorem 2.2.6.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..csc import Floats
from ..descriptor import DescriptorSystem
from ..intervals import bounds
from ..matrices import is_p_matrix
from ..regularity import index_sets, strong_regularity
from ..verdict import Verdict, Witness
from .hypotheses import uniformly_p

_VERTICES = 7  # pairs at the vertex of their graph up to which all pieces are combined
_ZERO = 1e-9  # a direction shorter than this part of what its bounds allow is none

#: a piece of a cone of (dlam, dw): generators, of which some may have both signs
Piece = tuple[tuple[tuple[float, float], bool], ...]
_LAM: Piece = (((1.0, 0.0), True),)  # the line along lam: the pair conducts
_SLACK: Piece = (((0.0, 1.0), True),)
_TANGENT: tuple[Piece, ...] = ((((1.0, 0.0), False),), (((0.0, 1.0), False),))
_PARATINGENT: tuple[Piece, ...] = (
    (((1.0, 0.0), False), ((0.0, -1.0), False)),
    (((-1.0, 0.0), False), ((0.0, 1.0), False)),
)
#: of minus the limiting normal cone
_NORMAL: tuple[Piece, ...] = (
    (((1.0, 0.0), True),),
    (((0.0, 1.0), True),),
    (((1.0, 0.0), False), ((0.0, 1.0), False)),
)


def metric_regularity(
    system: DescriptorSystem, jacobian: Floats, z: Floats, lam: Floats
) -> Verdict:
    """Judge metric regularity at a solution: Theorem 2.2 (i).

    Parameters
    ----------
    system : DescriptorSystem
        Static.
    jacobian : ndarray, shape (p, n)
        Derivatives of the smooth functions.
    z, lam : ndarray, shapes (n,), (m,)

    Examples
    --------
    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.unknown(0))
    >>> system = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).system()
    >>> bool(metric_regularity(system, np.array([[1.0, 0.0]]), np.zeros(2), np.zeros(2)))
    True
    """
    claim = "metrically regular"
    J, _, _ = _linearised(system, jacobian)
    n, m = system.n, system.m
    A, B, D = system.A.dense(), system.B.dense(), system.D.dense()
    on, off = index_sets(system, z, lam)
    cones = _cones(on, off, _NORMAL, normal=True)
    if cones is None:
        return Verdict.undecided(claim, f"more than {_VERTICES} pairs at the vertex of their graph")
    for pieces in itertools.product(*cones):
        # (y, v) with K'y + B'v = 0 and (A'y - D'v, v) in -N
        columns, free = _generators(pieces, m)
        u, v = columns[:m], columns[m:]
        left = np.block([[J.T, B.T @ v], [A.T, -D.T @ v - u]])
        y = _direction(left, left.shape[1], n, free)
        if y is not None:
            text = "a normal direction annihilates the linearised equations"
            return Verdict.no(claim, text, Witness(text, vector=y[:n]))
    return Verdict.yes(claim, "Theorem 2.2 (i): no normal direction annihilates the equations")


def strong_metric_subregularity(
    system: DescriptorSystem, jacobian: Floats, z: Floats, lam: Floats
) -> Verdict:
    """Judge strong metric subregularity, with its modulus: Theorem 2.2 (ii).

    Returns
    -------
    Verdict
        The value of its witness is the modulus in the largest norm: how far the unknowns lie from
        the solution per unit of what is left of the equations.
    """
    return _by_directions(system, jacobian, z, lam, _TANGENT, "strongly metrically subregular")


def _by_directions(
    system: DescriptorSystem,
    jacobian: Floats,
    z: Floats,
    lam: Floats,
    vertex: tuple[Piece, ...],
    claim: str,
) -> Verdict:
    J, A, B = _linearised(system, jacobian)
    n, m = system.n, system.m
    D = system.D.dense()
    on, off = index_sets(system, z, lam)
    cones = _cones(on, off, vertex)
    if cones is None:
        return Verdict.undecided(claim, f"more than {_VERTICES} pairs at the vertex of their graph")
    modulus = 0.0
    for pieces in itertools.product(*cones):
        columns, free = _generators(pieces, m)
        dlam, dw = columns[:m], columns[m:]
        # J b + A dlam = 0, dw + B b - D dlam = 0
        left = np.block([[J, A @ dlam], [B, dw - D @ dlam]])
        b = _direction(left, n, n, free)
        if b is not None:
            text = "a direction of the graph solves the linearised equations"
            return Verdict.no(claim, text, Witness(text, vector=b[:n]))
        modulus = max(modulus, _largest(left, n, n, free))
    text = f"modulus {modulus:.6g}"
    return Verdict.yes(
        claim, "no direction of the graph solves the linearised equations",
        Witness(text, value=modulus),
    )  # fmt: skip


def strong_metric_regularity(
    system: DescriptorSystem, jacobian: Floats, z: Floats, lam: Floats
) -> Verdict:
    """Judge strong metric regularity, with its modulus: Theorem 2.2 (iii), Theorem 2.2.6.

    Returns
    -------
    Verdict
        The value of its witness is the modulus: the largest change of an unknown per unit of a
        right-hand side.
    """
    claim = "strongly metrically regular"
    found = strong_regularity(system, jacobian, z, lam)
    regular = metric_regularity(system, jacobian, z, lam)
    unique = _by_directions(
        system, jacobian, z, lam, _PARATINGENT, "(b): no paratingent direction solves"
    )
    total = Verdict.theorem(
        claim, "Theorem 2.2 (iii): metrically regular, and (b)", {"(a)": regular, "(b)": unique}
    )
    if total and found.strong:
        text = f"modulus {found.modulus:.6g}"
        return Verdict(claim, True, total.reason, Witness(text, value=found.modulus),
                       total.hypotheses)  # fmt: skip
    return total


def theorem_2_2_6(
    system: DescriptorSystem, jacobian: Floats, z: Floats, lam: Floats
) -> dict[str, Verdict]:
    """Return what Theorem 2.2.6 and Theorem 2.2 of appendix B say at a solution, by property."""
    return {
        "metric regularity": metric_regularity(system, jacobian, z, lam),
        "strong metric subregularity": strong_metric_subregularity(system, jacobian, z, lam),
        "strong metric regularity": strong_metric_regularity(system, jacobian, z, lam),
    }


def corollary_2_1(jacobian: Floats) -> Verdict:
    """Judge Corollary 2.1: strong regularity where the Jacobian of f is P and each F_i monotone.

    Parameters
    ----------
    jacobian : ndarray, shape (n, n)
        Of the single-valued part at the solution; each F_i is maximal monotone.

    Examples
    --------
    >>> bool(corollary_2_1(np.array([[2.0, 1.0], [-1.0, 1.0]])))
    True
    """
    return Verdict.theorem(
        "Corollary 2.1 applies",
        "Corollary 2.1: strongly metrically regular, by a P-matrix and monotone graphs",
        {"f'": is_p_matrix(jacobian).named("the Jacobian is a P-matrix")},
    )


def theorem_2_4(system: DescriptorSystem, z: Floats, rows: Sequence[int]) -> Verdict:
    """Judge Theorem 2.4 (ii) by P-matrices: f is only Lipschitz, F_i are maximal monotone.

    Parameters
    ----------
    system : DescriptorSystem
    z : ndarray, shape (n,)
        The solution; where f has a kink there, all of Clarke's Jacobian counts.
    rows : sequence of int
        Rows, and unknowns, of the generalized equation; the others belong to set values.
    """
    G = system.G.dense()[np.ix_(rows, rows)]
    low, high = G.copy(), G.copy()
    if system.smooth is not None:
        found = bounds(system.smooth.tape, [(float(x), float(x)) for x in z])
        F = system.smooth.F.dense()[rows]
        # a product of a matrix of constants with an interval matrix
        plus, minus = np.maximum(F, 0.0), np.minimum(F, 0.0)
        lower = np.where(np.isfinite(found.low[:, :-1]), found.low[:, :-1], -1e300)
        upper = np.where(np.isfinite(found.high[:, :-1]), found.high[:, :-1], 1e300)
        low = low + (plus @ lower + minus @ upper)[:, rows]
        high = high + (plus @ upper + minus @ lower)[:, rows]
    return Verdict.theorem(
        "Theorem 2.4 applies",
        "Theorem 2.4 (ii): strongly metrically regular, all of Clarke's Jacobian being P",
        {"df(z)": uniformly_p(low, high, "all of df(z) are P-matrices")},
    )


def _linearised(system: DescriptorSystem, jacobian: Floats) -> tuple[Floats, Floats, Floats]:
    J = system.G.dense()
    if system.smooth is not None:
        J = J + system.smooth.F.dense() @ jacobian
    return J, system.A.dense(), system.B.dense()


def _cones(
    on: np.ndarray, off: np.ndarray, vertex: tuple[Piece, ...], normal: bool = False
) -> list[tuple[Piece, ...]] | None:
    """Return the pieces of each pair's cone: normals of a line are the other line."""
    found: list[tuple[Piece, ...]] = []
    for conducts, blocks in zip(on.tolist(), off.tolist(), strict=True):
        if conducts:
            found.append((_SLACK if normal else _LAM,))
        elif blocks:
            found.append((_LAM if normal else _SLACK,))
        else:
            found.append(vertex)
    return found if sum(len(c) > 1 for c in found) <= _VERTICES else None


def _generators(pieces: Sequence[Piece], m: int) -> tuple[Floats, list[bool]]:
    """Return the generators as columns of (dlam, dw), and which have both signs."""
    columns, free = [], []
    for k, piece in enumerate(pieces):
        for (a, b), both in piece:
            column = np.zeros(2 * m)
            column[k], column[m + k] = a, b
            columns.append(column)
            free.append(both)
    return (np.column_stack(columns) if columns else np.zeros((0, 0))), free


def _direction(left: Floats, count: int, n: int, free: Sequence[bool]) -> Floats | None:
    """Return a solution ``left (b, s) = 0``, s >= 0 where not free; None without any.

    One of its first ``count`` entries is not 0.
    """
    found: list[Floats] = []
    size = _largest(left, count, n, free, slack=0.0, found=found)
    return found[0] if size > _ZERO else None


def _largest(
    left: Floats,
    count: int,
    n: int,
    free: Sequence[bool],
    slack: float = 1.0,
    found: list[Floats] | None = None,
) -> float:
    """Return the largest of some entries with ``|left (b, s)| <= slack``, by linear programs.

    Without slack directions are of any length, and entries are cut at 1.
    """
    from scipy.optimize import linprog

    size = np.max(np.abs(left), axis=1)
    rows = left[size > 0.0]
    if slack == 0.0:
        rows = rows / size[size > 0.0, None]
    cut = 1.0 if slack == 0.0 else None
    ranges = [(None if cut is None else -cut, cut)] * n
    ranges += [(-cut if both and cut else (None if both else 0.0), cut) for both in free]
    largest = 0.0
    for k in range(count):
        for sign in (1.0, -1.0):
            cost = np.zeros(left.shape[1])
            cost[k] = -sign
            if slack == 0.0:
                got = linprog(cost, A_eq=rows, b_eq=np.zeros(len(rows)), bounds=ranges)
            else:
                both = np.vstack([rows, -rows])
                got = linprog(cost, A_ub=both, b_ub=np.full(len(both), slack), bounds=ranges)
            if got.status == 3:
                return np.inf
            if got.x is not None and abs(float(got.x[k])) > largest:
                largest = abs(float(got.x[k]))
                if found is not None:
                    found[:] = [np.asarray(got.x)]
    return largest
