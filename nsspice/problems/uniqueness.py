"""Whether a static system has at most one solution, whatever its sources do.

Two solutions of ``K z + A lam = p``, ``w = q - B z + D lam`` differ by a vector d with ``H d = 0``,
where H has some mean slope for every smooth function and every pair; H is regular for all of them
if its determinant, linear in each slope, has one sign at all their bounds (D. Gale, H. Nikaido,
Math. Ann. 159, 1965, for Jacobians that are P-matrices).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from .csc import Floats
from .descriptor import DescriptorSystem
from .regularity import ZERO, inverses
from .slopes import INF, shapes

_PORTS = 11  # uncertain slopes whose bounds are all combined
_ROWS = 400  # unknowns of a dense matrix
_PROPORTIONAL = 1e-12


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
        fine = inverses(base[None]) is not None
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
        inverse = inverses((base + (u * slopes) @ v)[None])
        if inverse is not None:
            return v @ inverse[0] @ u, slopes
    return None


def _between(low: float, high: float, unit: float) -> float:
    if np.isinf(low) and np.isinf(high):
        return unit
    if np.isinf(high):
        return low + unit
    if np.isinf(low):
        return high - unit
    return 0.5 * (low + high)
