"""Whether a static system has at most one solution, for any values of the sources.

Two solutions of ``K z + A lam = p``, ``w = q - B z + D lam`` differ by a vector d with ``H d = 0``.
H has some mean slope for every smooth function, and for every pair some r >= 0 (infinity included)
with ``dw = -r dlam``.  Each appears in H as ``s u v'``, so that the determinant is linear in each;
H is regular for all of them if its determinant has one sign at all their bounds.  That is what the
P-property says of the matrix that leads from one choice of bounds to the opposite one (D. Gale, H.
Nikaido, Math. Ann. 159, 1965; S. R. Mohan, R. Sridhar, Math. Programming 87, 2000).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .csc import Floats
from .descriptor import DescriptorSystem
from .enclosure import INF
from .matrices import is_p0_matrix, is_p_matrix
from .parallel import Parallels, parallels
from .regularity import ZERO, inverses
from .slopes import shapes
from .verdict import Verdict, Witness

CLAIM = "at most one solution"
_PORTS = 12  # uncertain slopes whose bounds are all combined: 4096 determinants
_ROWS = 400  # unknowns of a dense matrix
_PROPORTIONAL = 1e-12
#: slopes between bounds that are tried, until H is regular: in units, and as parts of an interval
_UNITS, _PARTS = (1.0, 1e-3, 1e3, 1e-6), (0.5, 0.3, 0.77, 0.1)


@dataclass(frozen=True, slots=True)
class Port:
    """An uncertain slope s in ``H = H0 + s u v'``.

    Parameters
    ----------
    u, v : ndarray, shape (n + m,)
    low, high : float
        Bounds of the slope.
    closed : bool
        The bounds are slopes themselves, not only limits of slopes.
    owners : tuple of int
        Numbers of the pairs, or of the smooth functions, that it stands for.
    pair : bool
    """

    u: Floats
    v: Floats
    low: float
    high: float
    closed: bool
    owners: tuple[int, ...]
    pair: bool = False


@dataclass(frozen=True, slots=True)
class Uniqueness:
    """Whether a system has at most one solution, for any data.

    Parameters
    ----------
    verdict : Verdict
    functions, pairs : tuple of int
        Smooth functions and pairs that prevent a proof, if they are known.
    """

    verdict: Verdict
    functions: tuple[int, ...] = ()
    pairs: tuple[int, ...] = ()

    @property
    def unique(self) -> bool:
        """True if it is proved."""
        return bool(self.verdict)

    @property
    def reason(self) -> str:
        """One clause that says why, or what prevents a proof."""
        return self.verdict.reason


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
    if system.n > _ROWS:
        return _open(f"the system has more than {_ROWS} unknowns")
    beside = parallels(system)
    base, ports, bad = _ports(system, beside)
    if bad:
        return _open("some functions depend on several quantities at once", bad)
    found = _judged(system, base, ports)
    if found.unique and beside.shared:
        text = "ideal elements in parallel share their current in any way"
        witness = Witness(f"pairs {beside.shared[0]} and {beside.shared[1]}", beside.shared)
        return Uniqueness(Verdict.no(CLAIM, text, witness), (), beside.shared)
    return found


def _judged(system: DescriptorSystem, base: Floats, ports: list[Port]) -> Uniqueness:
    if not ports:
        if inverses(base[None]) is not None:
            return _proved("the laws are linear and independent")
        return _open("free unknowns")
    if len(ports) <= _PORTS:
        return _by_signs(base, ports)
    found = _by_monotonicity(system, base, ports)
    return found if found is not None else _by_minors(base, ports)


def _proved(reason: str) -> Uniqueness:
    return Uniqueness(Verdict.yes(CLAIM, reason))


def _open(reason: str, functions: Sequence[int] = (), pairs: Sequence[int] = ()) -> Uniqueness:
    return Uniqueness(Verdict.undecided(CLAIM, reason), tuple(functions), tuple(pairs))


def _ports(
    system: DescriptorSystem, beside: Parallels
) -> tuple[Floats, list[Port], tuple[int, ...]]:
    """Return H0, the uncertain slopes, and the functions that are not sums of ridges."""
    n, kept = system.n, beside.kept
    size = n + len(kept)
    A, B, D = (
        system.A.dense()[:, kept],
        system.B.dense()[kept],
        system.D.dense()[np.ix_(kept, kept)],
    )
    base = np.block([[system.G.dense(), A], [-B, D]])
    ports: list[Port] = []
    for place, pair in enumerate(kept):
        unit = np.zeros(size)
        unit[n + place] = 1.0
        owners = (pair, *beside.merged.get(pair, ()))
        ports.append(Port(unit, unit, 0.0, INF, True, owners, pair=True))
    bad: list[int] = []
    if system.smooth is not None:
        F = system.smooth.F.dense()
        used = [k for k in range(F.shape[1]) if F[:, k].any()]
        found, ridges = shapes(system.smooth.tape)
        columns: dict[int, Floats] = {}
        owned: dict[int, list[int]] = {}
        for k in used:
            shape = found[k]
            if shape is None:
                bad.append(k)
                continue
            for j, value in shape.linear.items():
                base[:n, j] += F[:, k] * value
            for r, value in shape.ridges.items():
                columns[r] = columns.get(r, np.zeros(n)) + F[:, k] * value
                owned.setdefault(r, []).append(k)
        for r, column in columns.items():
            ridge = ridges[r]
            u, v = np.zeros(size), np.zeros(size)
            u[:n] = column
            for j, value in ridge.direction.items():
                v[j] = value
            if u.any() and v.any():
                ports.append(Port(u, v, ridge.low, ridge.high, ridge.closed, tuple(owned[r])))
    return base, ports, tuple(bad)


def _by_monotonicity(
    system: DescriptorSystem, base: Floats, ports: list[Port]
) -> Uniqueness | None:
    """Many ports: a positive semidefinite base and ports that only add to it; None if they do not.

    Differences of solutions then lie where nothing dissipates.
    """
    if not all(_adds(p) for p in ports):
        return None
    symmetric = 0.5 * (base + base.T)
    values = np.linalg.eigvalsh(symmetric)
    if values[0] < -1e-12 * max(1.0, abs(values[-1])):
        return None
    n = system.n
    # differences are zero where nothing dissipates, and rows without multipliers hold for them
    columns = np.column_stack([np.zeros(n), base[:n, n:]])
    left, sizes, _ = np.linalg.svd(columns)
    rank = int(np.sum(sizes > 1e-12 * max(1.0, sizes[0])))
    tied = left[:, rank:].T @ base[:n, :n]
    # slopes of zero may be those of a difference: such a port says nothing
    sure = [p.v[:n] for p in ports if not p.pair and (p.low > 0.0 or not p.closed)]
    stacked = np.vstack([symmetric[:n, :n], tied, *sure])
    singular = np.linalg.svd(stacked, compute_uv=False)
    if not singular[-1] > 1e-12 * singular[0]:
        return _open("all laws are monotone, and something is left free")
    # with all unknowns determined, multipliers that no series resistance parts may still share
    free = np.vstack([base[:n, n:], symmetric[n:, n:]])
    if free.shape[1] and _rank(free) < free.shape[1]:
        owners = [k for p in ports if p.pair for k in p.owners]
        return _open("all laws are monotone, and ideal elements form loops", (), owners)
    return _proved("all laws are monotone")


def _rank(matrix: Floats) -> int:
    sizes = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(sizes > 1e-12 * sizes[0])) if sizes.size and sizes[0] > 0.0 else 0


def _adds(port: Port) -> bool:
    """Return whether ``u v'`` is positive semidefinite and so are all slopes."""
    size = float(port.v @ port.v)
    factor = float(port.u @ port.v) / size if size else 0.0
    same = np.abs(port.u - factor * port.v).max() <= _PROPORTIONAL * np.abs(port.u).max()
    return bool(same) and factor > 0.0 and port.low >= 0.0


@dataclass(frozen=True, slots=True)
class _Ends:
    """Rows of ``I + (S - S0) R`` with the slopes S at their bounds.

    The sign of their determinant is that of H.
    """

    low: Floats
    high: Floats

    @classmethod
    def of(cls, base: Floats, ports: list[Port]) -> _Ends | None:
        """Return the rows, None if H is singular for slopes between the bounds."""
        u = np.column_stack([p.u for p in ports])
        v = np.vstack([p.v for p in ports])
        for unit, part in zip(_UNITS, _PARTS, strict=True):
            slopes = np.array([_between(p.low, p.high, unit, part) for p in ports])
            inverse = inverses((base + (u * slopes) @ v)[None])
            if inverse is not None:
                reduced = v @ inverse[0] @ u
                low = _rows(reduced, np.array([p.low for p in ports]), slopes)
                return cls(low, _rows(reduced, np.array([p.high for p in ports]), slopes))
        return None


def _rows(reduced: Floats, bounds: Floats, slopes: Floats) -> Floats:
    """Return the rows at some bounds, each of length one; those of infinite slopes are limits."""
    finite = np.isfinite(bounds)
    change = np.where(finite, bounds, 0.0) - slopes
    rows = np.where(
        finite[:, None],
        np.eye(len(bounds)) + change[:, None] * reduced,
        np.sign(bounds)[:, None] * reduced,
    )
    lengths = np.linalg.norm(rows, axis=1)
    return np.asarray(rows / np.where(lengths > 0.0, lengths, 1.0)[:, None])


def _between(low: float, high: float, unit: float, part: float) -> float:
    if np.isinf(low) and np.isinf(high):
        return unit
    if np.isinf(high):
        return low + unit
    if np.isinf(low):
        return high - unit
    return low + part * (high - low)


def _by_signs(base: Floats, ports: list[Port]) -> Uniqueness:
    """One sign of the determinant at all bounds of all slopes."""
    ends = _Ends.of(base, ports)
    if ends is None:
        return _open("something is left free in every mode")
    choices = np.array(list(itertools.product((False, True), repeat=len(ports))))
    matrices = np.where(choices[:, :, None], ends.high, ends.low)
    values = np.linalg.det(matrices)
    signs = np.where(np.abs(values) <= ZERO, 0.0, np.sign(values))
    if signs.min() < 0.0 < signs.max():
        return _culprits(ports)
    # bounds that are only limits may be singular, as long as no bound of the others is
    closed = [k for k, p in enumerate(ports) if p.closed]
    groups = choices[:, closed] @ (1 << np.arange(len(closed)))
    regular = np.zeros(1 << len(closed), dtype=bool)
    np.logical_or.at(regular, groups.astype(np.int64), signs != 0.0)
    if not regular.all():
        flat = {k for p in ports if not p.pair and p.closed and p.low <= 0.0 for k in p.owners}
        return _open("some mode leaves a voltage or current free", sorted(flat))
    return _proved("every mode has a regular Jacobian of one orientation")


def _by_minors(base: Floats, ports: list[Port]) -> Uniqueness:
    """Many ports: the P-property of the matrix between opposite bounds."""
    ends = _Ends.of(base, ports)
    if ends is None:
        return _open("something is left free in every mode")
    closed = [k for k, p in enumerate(ports) if p.closed]
    reason = "some mode leaves a voltage or current free"
    everywhere = np.ones(len(ports), dtype=bool)
    # all bounds on one side give the matrix of the problem, or its inverse: most easily judged
    for high in (everywhere, ~everywhere, _regular(ends)):
        inverse = inverses(np.where(high[:, None], ends.high, ends.low)[None])
        if inverse is None:
            continue
        between = np.where(high[:, None], ends.low, ends.high) @ inverse[0]
        found = is_p_matrix(between, noise=ZERO)
        if not found and len(closed) < len(ports):
            attained = is_p_matrix(between[np.ix_(closed, closed)], noise=ZERO)
            if attained and is_p0_matrix(between):
                found = attained
        if found:
            return _proved(f"every mode has a regular Jacobian of one orientation: {found.reason}")
        if found.holds is False:
            return _culprits([ports[k] for k in found.witness.rows] if found.witness else ports)
        reason = found.reason
    return _open(reason, *_wrong(ports))


def _regular(ends: _Ends) -> npt.NDArray[np.bool_]:
    """Return a choice of bounds, True for the upper one, at which H is regular.

    A determinant that is linear in a slope, and not zero between its bounds, is not zero at one of
    them: take the better one, slope by slope (the inverse is updated by rank one).
    """
    count = len(ends.low)
    matrix, inverse = np.eye(count), np.eye(count)
    high = np.zeros(count, dtype=bool)
    for k in range(count):
        ratios = ends.low[k] @ inverse[:, k], ends.high[k] @ inverse[:, k]
        high[k] = abs(ratios[1]) > abs(ratios[0])
        row = ends.high[k] if high[k] else ends.low[k]
        change = (row - matrix[k]) @ inverse
        inverse = inverse - np.outer(inverse[:, k], change) / ratios[int(high[k])]
        matrix[k] = row
    return high


def _culprits(ports: list[Port]) -> Uniqueness:
    return _open("the Jacobian changes its orientation between modes or slopes", *_wrong(ports))


def _wrong(ports: list[Port]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the functions and the pairs that may prevent a proof."""
    wrong = [p for p in ports if not _adds(p)] or ports
    return (
        tuple(sorted({k for p in wrong if not p.pair for k in p.owners})),
        tuple(sorted({k for p in wrong if p.pair for k in p.owners})),
    )
