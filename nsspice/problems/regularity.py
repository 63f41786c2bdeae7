"""Whether a solution is the only one, and whether it moves continuously with the data.

For a static system ``K z + A lam = p``, ``w = q - B z + D lam`` with smooth functions linearised or
bounded:

- *Strong metric regularity* at a point: the solution is locally unique and Lipschitz in p.  In
  complementarity form this is Robinson's condition (S. M. Robinson, *Strongly regular generalized
  equations*, Math. Oper. Res. 5, 1980), for products of monotone graphs what corollary 2.1 and
  theorem 2.2 of R. Cibulka, T. Roubal (2017) ask for: with the pairs that certainly conduct put
  into the equations, those that do neither must give a P-matrix.
- *Uniqueness* for all data: two solutions differ by a vector d with ``H d = 0``, where H has some
  mean slope for every smooth function and every pair; H is regular for all of them if its
  determinant, linear in each slope, has one sign at all their bounds (D. Gale, H. Nikaido, Math.
  Ann. 159, 1965, for Jacobians that are P-matrices).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .csc import Floats
from .descriptor import DescriptorSystem
from .slopes import INF, Ridge, Shape, shapes

#: Minors and determinants below this part of the product of their rows' lengths are zero.
ZERO = 1e-11
_MOST = 14  # rows of a matrix whose principal minors are all formed
_PORTS = 11  # uncertain slopes whose bounds are all combined
_ROWS = 400  # unknowns of a dense matrix
_PROPORTIONAL = 1e-12


def is_p_matrix(matrix: Floats) -> bool | None:
    """Return whether all principal minors are positive; None if that is not decided.

    Small matrices by Schur complements: a matrix is P exactly if its first entry is positive and
    both the rest and the complement of the entry in it are P (M. J. Tsatsomeros, L. Li, *A
    recursive test for P-matrices*, BIT 40, 2000).  Large ones by sufficient conditions: a positive
    definite symmetric part, an H-matrix with positive diagonal, or a diagonal entry that is not
    positive.

    Parameters
    ----------
    matrix : ndarray, shape (m, m)

    Examples
    --------
    >>> is_p_matrix(np.array([[1.0, -3.0], [0.5, 1.0]]))
    True
    >>> is_p_matrix(np.array([[1.0, 2.0], [2.0, 1.0]]))
    False
    """
    m = matrix.shape[0]
    diagonal = np.diag(matrix)
    if m == 0:
        return True
    if not np.all(np.isfinite(matrix)) or np.any(diagonal <= 0.0):
        return False
    if is_positive_definite(matrix) or is_h_matrix(matrix):
        return True
    if m > _MOST:
        return None
    scale = 1.0 / np.sqrt(diagonal)
    return _recursive(matrix * scale[:, None] * scale)


def _recursive(matrix: Floats) -> bool:
    pivot = matrix[0, 0]
    if pivot <= ZERO * np.abs(matrix[0]).max():
        return False
    if matrix.shape[0] == 1:
        return True
    rest = matrix[1:, 1:]
    complement = rest - np.outer(matrix[1:, 0], matrix[0, 1:]) / pivot
    return _recursive(rest) and _recursive(complement)


def is_positive_definite(matrix: Floats) -> bool:
    """Return whether ``x . (M x) > 0`` for all x, by a Cholesky factorisation."""
    try:
        np.linalg.cholesky(matrix + matrix.T - ZERO * np.diag(np.abs(np.diag(matrix))))
    except np.linalg.LinAlgError:
        return False
    return True


def is_h_matrix(matrix: Floats) -> bool:
    """Return whether the diagonal dominates after some positive scaling of the columns."""
    diagonal = np.abs(np.diag(matrix))
    if np.any(diagonal == 0.0):
        return False
    comparison = -np.abs(matrix) / diagonal[:, None]
    np.fill_diagonal(comparison, 1.0)
    try:
        weights = np.linalg.solve(comparison, np.ones(len(diagonal)))
    except np.linalg.LinAlgError:
        return False
    return bool(np.all(weights > 0.0))


@dataclass(frozen=True, slots=True)
class Regularity:
    """Strong metric regularity of a system at a solution.

    Parameters
    ----------
    strong : bool or None
        None if it is not decided (too many pairs in between).
    modulus : float
        Largest change of an unknown per unit of a row's right-hand side, over all modes that the
        solution touches; inf if not regular.
    unknown, row : int
        Where that is reached.
    between : tuple of int
        Pairs that neither conduct nor block: ``lam = w = 0``.
    """

    strong: bool | None
    modulus: float
    unknown: int = -1
    row: int = -1
    between: tuple[int, ...] = ()


def index_sets(
    system: DescriptorSystem,
    z: Floats,
    lam: Floats,
    roles: npt.NDArray[np.uint8] | None = None,
    scale: float = 1e-9,
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Return which pairs conduct and which block at a solution; the others do neither.

    Parameters as of :func:`strong_regularity`; both results have shape (m,).  They alone decide on
    the regularity of a system without smooth functions.

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
    w = system.q - system.B.dot(z) + system.D.dot(lam)
    on = lam > scale * np.abs(lam).max(initial=0.0)
    off = w > scale * max(np.abs(w).max(initial=0.0), np.abs(system.q).max(initial=0.0))
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
    """Judge a solution of a static system.

    Parameters
    ----------
    system : DescriptorSystem
    jacobian : ndarray, shape (p, n)
        Derivatives of the smooth functions at the solution; p = 0 without any.
    z, lam : ndarray, shapes (n,) and (m,)
    roles : ndarray of uint8, shape (m,), optional
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
    K = system.G.dense()
    if system.smooth is not None:
        K = K + system.smooth.F.dense() @ jacobian
    A, B, D = system.A.dense(), system.B.dense(), system.D.dense()
    on, off = index_sets(system, z, lam, roles, scale)
    between = np.flatnonzero(~on & ~off)
    sure = np.flatnonzero(on)
    full = np.block([[K, A], [-B, D]])
    kept = np.concatenate([np.arange(n), n + sure])
    base = full[np.ix_(kept, kept)]
    inverse = _inverse(base)
    if inverse is None:
        return Regularity(False, INF, between=tuple(between.tolist()))
    columns = full[np.ix_(kept, n + between)]
    rows = full[np.ix_(n + between, kept)]
    block = full[np.ix_(n + between, n + between)] - rows @ inverse @ columns
    strong = is_p_matrix(block)
    if not strong:
        return Regularity(strong, INF, between=tuple(between.tolist()))
    modulus, place = 0.0, (0, 0)
    count = len(between) if len(between) <= 6 else 0
    for mode in itertools.product((False, True), repeat=count):
        index = np.concatenate([kept, n + between[: len(mode)][np.array(mode, dtype=bool)]])
        found = _inverse(full[np.ix_(index, index)])
        if found is None:
            return Regularity(False, INF, between=tuple(between.tolist()))
        sizes = np.abs(found[:n, :n])
        best = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
        if sizes[best] > modulus:
            modulus, place = float(sizes[best]), (int(best[0]), int(best[1]))
    return Regularity(True, modulus, *place, tuple(between.tolist()))


def _inverse(matrix: Floats) -> Floats | None:
    """Return the inverse of a matrix, None if it is singular; rows and columns are scaled first."""
    if matrix.shape[0] == 0:
        return matrix
    rows, columns = np.ones(matrix.shape[0]), np.ones(matrix.shape[0])
    for _ in range(6):
        scaled = np.abs(matrix * rows[:, None] * columns)
        tallest = scaled.max(axis=1)
        if np.any(tallest == 0.0) or np.any(scaled.max(axis=0) == 0.0):
            return None
        rows /= np.sqrt(tallest)
        columns /= np.sqrt((np.abs(matrix * rows[:, None] * columns)).max(axis=0))
    scaled = matrix * rows[:, None] * columns
    values = np.linalg.svd(scaled, compute_uv=False)
    if values[-1] <= 1e-14 * values[0]:
        return None
    return np.asarray(np.linalg.inv(scaled) * columns[:, None] * rows)


@dataclass(frozen=True, slots=True)
class Port:
    """An uncertain slope s in ``H = H0 + s u v'``; pairs have all slopes from 0 to infinity."""

    u: Floats
    v: Floats
    low: float
    high: float
    #: the bounds are slopes themselves, not only limits of slopes
    closed: bool
    #: numbers of the pairs, or of the smooth functions, that it stands for
    owners: tuple[int, ...]
    pair: bool = False


@dataclass(frozen=True, slots=True)
class Uniqueness:
    """Whether a system has at most one solution, whatever the data.

    Parameters
    ----------
    unique : bool
        Proved.
    reason : str
        One clause that says why, or what stands in the way.
    functions, pairs : tuple of int
        Smooth functions and pairs that stand in the way, if they can be told.
    """

    unique: bool
    reason: str
    functions: tuple[int, ...] = ()
    pairs: tuple[int, ...] = ()


def uniqueness(system: DescriptorSystem) -> Uniqueness:
    """Try to prove that a static system has at most one solution.

    Examples
    --------
    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> def scalar(name):
    ...     tape = TapeBuilder()
    ...     _ = tape.output(tape.op(name, tape.unknown(0)))
    ...     return GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).system()
    >>> uniqueness(scalar("asinh")).unique, uniqueness(scalar("sin")).unique
    (True, False)
    """
    n = system.n
    if n > _ROWS:
        return Uniqueness(False, f"the system has more than {_ROWS} unknowns")
    base, ports, bad = _ports(system)
    if bad:
        return Uniqueness(False, "some functions depend on several quantities at once", bad)
    if not ports:
        fine = _inverse(base) is not None
        return Uniqueness(fine, "the laws are linear and independent" if fine else "free unknowns")
    if len(ports) > _PORTS:
        return _by_monotonicity(base, ports)
    return _by_signs(base, ports)


def _ports(system: DescriptorSystem) -> tuple[Floats, list[Port], tuple[int, ...]]:
    """Return H0, the uncertain slopes, and the functions that are no sums of ridges."""
    n = system.n
    base = system.G.dense()
    ports: list[Port] = []
    A, B = system.A.dense(), system.B.dense()
    groups: dict[tuple[float, ...], list[int]] = {}
    for k in range(system.m):
        joined = np.concatenate([A[:, k], B[k]])
        first = joined[np.flatnonzero(joined)[0]] if joined.any() else 1.0
        # pairs along one direction are one monotone curve
        groups.setdefault(tuple(np.round(joined / first, 12) + 0.0), []).append(k)
    for pairs in groups.values():
        k = pairs[0]
        ports.append(Port(A[:, k], B[k], 0.0, INF, True, tuple(pairs), pair=True))
    bad: list[int] = []
    if system.smooth is not None:
        F = system.smooth.F.dense()
        used = [k for k in range(F.shape[1]) if F[:, k].any()]
        found, ridges = shapes(system.smooth.tape)
        columns: dict[int, Floats] = {}
        owners: dict[int, list[int]] = {}
        for k in used:
            shape = found[k]
            if shape is None:
                bad.append(k)
                continue
            for j, value in shape.linear.items():
                base[:, j] += F[:, k] * value
            for r, value in shape.ridges.items():
                columns[r] = columns.get(r, np.zeros(n)) + F[:, k] * value
                owners.setdefault(r, []).append(k)
        for r, u in columns.items():
            ridge = ridges[r]
            v = np.zeros(n)
            for j, value in ridge.direction.items():
                v[j] = value
            if u.any() and v.any():
                ports.append(Port(u, v, ridge.low, ridge.high, ridge.closed, tuple(owners[r])))
    return base, ports, tuple(bad)


def _by_monotonicity(base: Floats, ports: list[Port]) -> Uniqueness:
    """Many ports: a positive definite base and ports that only add to it."""
    wrong = [p for p in ports if not _adds(p)]
    if wrong:
        smooth = tuple(k for p in wrong if not p.pair for k in p.owners)
        pairs = tuple(k for p in wrong if p.pair for k in p.owners)
        return Uniqueness(
            False, "there are too many nonlinear elements, and some are active", smooth, pairs
        )
    symmetric = 0.5 * (base + base.T)
    values = np.linalg.eigvalsh(symmetric)
    if values[0] < -1e-12 * max(1.0, abs(values[-1])):
        return Uniqueness(False, "the linear part has gain")
    # differences of solutions lie where nothing dissipates, and the rows in which no multiplier
    # can make up for them hold for them too
    columns = np.column_stack([np.zeros(base.shape[0]), *(p.u for p in ports if p.pair)])
    left, sizes, _ = np.linalg.svd(columns)
    rank = int(np.sum(sizes > 1e-12 * max(1.0, sizes[0])))
    tied = left[:, rank:].T @ base
    stacked = np.vstack([symmetric, tied, *(p.v for p in ports if p.low > 0.0 or not p.closed)])
    singular = np.linalg.svd(stacked, compute_uv=False)
    if singular[-1] > 1e-12 * singular[0]:
        return Uniqueness(True, "all laws are monotone")
    return Uniqueness(False, "all laws are monotone, and something is left free")


def _adds(port: Port) -> bool:
    """Return whether ``u v'`` is positive semidefinite and so are all slopes."""
    size = float(port.v @ port.v)
    factor = float(port.u @ port.v) / size if size else 0.0
    same = np.abs(port.u - factor * port.v).max() <= _PROPORTIONAL * np.abs(port.u).max()
    return bool(same) and factor > 0.0 and port.low >= 0.0


def _by_signs(base: Floats, ports: list[Port]) -> Uniqueness:
    """One sign of the determinant at all bounds of all slopes."""
    u = np.column_stack([p.u for p in ports])
    v = np.vstack([p.v for p in ports])
    middle = _middle(base, u, v, ports)
    if middle is None:
        return Uniqueness(False, "something is left free in every mode")
    reduced, slopes = middle  # V H^-1 U at the slopes in the middle
    count = len(ports)
    ends = []
    for k, port in enumerate(ports):
        unit = np.eye(count)[k]
        rows = []
        for bound in (port.low, port.high):
            if np.isinf(bound):
                rows.append(np.sign(bound) * reduced[k])
            else:
                rows.append(unit + (bound - slopes[k]) * reduced[k])
        ends.append(rows)
    closed = [k for k, p in enumerate(ports) if p.closed]
    signs: dict[tuple[int, ...], set[int]] = {}
    for choice in itertools.product((0, 1), repeat=count):
        matrix = np.array([ends[k][c] for k, c in enumerate(choice)])
        lengths = np.linalg.norm(matrix, axis=1)
        sign = 0
        if np.all(lengths > 0.0):
            value = float(np.linalg.det(matrix / lengths[:, None]))
            sign = 0 if abs(value) <= ZERO else int(np.sign(value))
        signs.setdefault(tuple(choice[k] for k in closed), set()).add(sign)
    if any(-1 in found and 1 in found for found in signs.values()) or (
        any(1 in s for s in signs.values()) and any(-1 in s for s in signs.values())
    ):
        return _culprits(ports)
    if any(found == {0} for found in signs.values()):
        return Uniqueness(False, "some mode leaves a voltage or current free")
    return Uniqueness(True, "every mode has a regular Jacobian of one orientation")


def _culprits(ports: list[Port]) -> Uniqueness:
    wrong = [p for p in ports if not _adds(p)] or ports
    return Uniqueness(
        False,
        "the Jacobian changes its orientation between modes or slopes",
        tuple(sorted({k for p in wrong if not p.pair for k in p.owners})),
        tuple(sorted({k for p in wrong if p.pair for k in p.owners})),
    )


def _middle(base: Floats, u: Floats, v: Floats, ports: list[Port]) -> tuple[Floats, Floats] | None:
    """Return ``V H^-1 U`` and the slopes at which H is best to invert."""
    for unit in (1.0, 1e-3, 1e3, 1e-6):
        slopes = np.array([_between(p.low, p.high, unit) for p in ports])
        inverse = _inverse(base + (u * slopes) @ v)
        if inverse is not None:
            return v @ inverse @ u, slopes
    return None


def _between(low: float, high: float, unit: float) -> float:
    if np.isinf(low) and np.isinf(high):
        return unit
    if np.isinf(high):
        return low + unit
    if np.isinf(low):
        return high - unit
    return 0.5 * (low + high)


__all__ = [
    "Regularity",
    "Ridge",
    "Shape",
    "Uniqueness",
    "is_h_matrix",
    "is_p_matrix",
    "is_positive_definite",
    "strong_regularity",
    "uniqueness",
]
