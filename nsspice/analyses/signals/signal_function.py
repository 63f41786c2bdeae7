"""Signals as functions of time: polynomials in pieces as an engine knows them, or lines of rows.

A piece holds the values at the points of Chebyshev and Lobatto, through which one polynomial goes;
it is evaluated by the barycentric formula, which keeps all digits (J.-P. Berrut, L. N. Trefethen,
"Barycentric Lagrange interpolation", SIAM Review 46 (2004), doi:10.1137/S0036144502417715).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from ...netlist.expressions.expression import Expression
from .signal_names import canonical

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

#: Instants that differ by so many units in the last place are one.
_SAME = 4.0 * np.finfo(np.float64).eps


@lru_cache
def places(count: int) -> Floats:
    """Return the points of a piece, as parts of it.

    Examples
    --------
    >>> places(3).round(12).tolist()
    [0.0, 0.5, 1.0]
    """
    half = 0.5 * np.pi * np.arange(count) / max(count - 1, 1)
    return np.asarray(np.sin(half) ** 2)


@lru_cache
def _weights(count: int) -> Floats:
    weights = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    weights[[0, -1]] *= 0.5
    return weights


def basis(count: int, at: Floats) -> Floats:
    """Return the factors of the values at ``count`` points in those ``at`` parts of a piece.

    Parameters
    ----------
    count : int
    at : ndarray, shape (...)

    Returns
    -------
    ndarray, shape (..., count)
    """
    apart = at[..., np.newaxis] - places(count)
    hit = apart == 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = _weights(count) / apart
        factors = terms / terms.sum(axis=-1, keepdims=True)
    on = hit.any(axis=-1)
    if on.any():
        factors[on] = hit[on]
    return np.asarray(factors)


@lru_cache
def slopes(count: int) -> Floats:
    """Return the matrix that takes the values at the points of a piece to the derivatives there.

    Per length of the piece, shape (count, count).

    Examples
    --------
    >>> x = places(4)
    >>> bool(np.allclose(slopes(4) @ x**3, 3.0 * x**2))
    True
    """
    x, w = places(count), _weights(count)
    apart = x[:, np.newaxis] - x + np.eye(count)
    matrix = w / w[:, np.newaxis] / apart
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


@dataclass(frozen=True, slots=True)
class Pieces:
    """Some quantities in k pieces, one after the other in time.

    Parameters
    ----------
    begin, length : ndarray, shape (k,)
        A length is more accurate than the difference of two instants.
    values : ndarray, shape (c, k, n)
        Of each quantity at the points of each piece.
    """

    begin: Floats
    length: Floats
    values: Floats

    @property
    def end(self) -> Floats:
        """Where the pieces end, shape (k,)."""
        return self.begin + self.length

    @property
    def points(self) -> int:
        """How many points a piece has."""
        return int(self.values.shape[2])

    @classmethod
    def of_rows(cls, x: Floats, columns: Floats) -> Pieces:
        """Return lines between rows; an abscissa that appears twice is a jump.

        Parameters
        ----------
        x : ndarray, shape (k,)
            Rising or falling.
        columns : ndarray, shape (c, k)

        Examples
        --------
        >>> Pieces.of_rows(np.array([0.0, 1.0, 1.0, 3.0]), np.array([[0.0, 1.0, 5.0, 6.0]])).values
        array([[[0., 1.],
                [5., 6.]]])
        """
        if x.size > 1 and x[-1] < x[0]:
            x, columns = x[::-1], columns[:, ::-1]
        k = np.flatnonzero(np.diff(x) > 0.0)
        if k.size == 0:  # a single point
            k = np.zeros(min(x.size, 1), dtype=np.intp)
            return cls(x[k], np.zeros(k.size), np.stack([columns[:, k]] * 2, axis=-1))
        return cls(x[k], x[k + 1] - x[k], np.stack([columns[:, k], columns[:, k + 1]], axis=-1))

    @classmethod
    def of_record(cls, table: Floats, count: int) -> Pieces:
        """Return what an engine has kept of ``count`` quantities, one piece in a row.

        Where it has left a gap, a line goes from the end of one piece to the begin of the next.
        """
        points = (table.shape[1] - 2) // max(count, 1)
        values = table[:, 2:].reshape(-1, count, points).transpose(1, 0, 2)
        found = cls(table[:, 0], table[:, 1], values)
        gap = np.flatnonzero(found.begin[1:] - found.end[:-1] > _SAME * np.abs(found.begin[1:]))
        if not gap.size:
            return found
        left, right = values[:, gap, -1:], values[:, gap + 1, :1]
        lines = left + (right - left) * places(points)
        length = found.begin[gap + 1] - found.end[gap]
        return cls(
            np.insert(found.begin, gap + 1, found.end[gap]),
            np.insert(found.length, gap + 1, length),
            np.insert(values, gap + 1, lines, axis=1),
        )

    def within(self, start: float, stop: float) -> Pieces:
        """Return the pieces that reach into a window; of one instant those that touch it."""
        if start < stop:
            keep = (self.end > start) & (self.begin < stop)
        else:
            near = _SAME * abs(start)  # the last piece may end before the run by rounding
            keep = (self.end >= start - near) & (self.begin <= stop + near)
        return Pieces(self.begin[keep], self.length[keep], self.values[:, keep])

    def at(self, instants: Floats) -> Floats:
        """Return the values at some instants, shape (k, c); not a number where there is no piece.

        Examples
        --------
        >>> line = Pieces(np.zeros(1), np.array([2.0]), np.array([[[1.0, 5.0]]]))
        >>> line.at(np.array([0.5, 3.0])).tolist()
        [[2.0], [nan]]
        """
        index = np.searchsorted(self.end, instants)
        inside = index < self.begin.size
        inside[inside] = self.begin[index[inside]] <= instants[inside]
        index = index[inside]
        found = np.full((instants.size, self.values.shape[0]), np.nan)
        part = (instants[inside] - self.begin[index]) / self.length[index]
        factors = basis(self.points, np.clip(part, 0.0, 1.0))
        found[inside] = np.einsum("kn,ckn->kc", factors, self.values[:, index])
        return found

    def cut(self, edges: Floats, points: int) -> Floats:
        """Return the values at the points of the pieces between ``edges``, shape (c, k, points)."""
        middle = 0.5 * (edges[:-1] + edges[1:])
        index = np.clip(np.searchsorted(self.end, middle), 0, self.begin.size - 1)
        part = edges[:-1, np.newaxis] + np.diff(edges)[:, np.newaxis] * places(points)
        at = (part - self.begin[index, np.newaxis]) / self.length[index, np.newaxis]
        factors = basis(self.points, np.clip(at, 0.0, 1.0))
        return np.asarray(np.einsum("kpn,ckn->ckp", factors, self.values[:, index]))


#: what swings by less than this part of its size does not turn
_STILL = 1e-9
_HALVINGS = 52


def turning_points(pieces: Pieces) -> Floats:
    """Return the points at which some quantity has an extreme inside a piece, with all quantities.

    Returns
    -------
    ndarray, shape (k, 1 + c)
        Instant first, in order.

    Examples
    --------
    >>> x = places(5)
    >>> parabola = Pieces(np.zeros(1), np.array([2.0]), (x * (1.0 - x))[np.newaxis, np.newaxis])
    >>> turning_points(parabola).round(12).tolist()
    [[1.0, 0.25]]
    """
    values, points = pieces.values, places(pieces.points)
    rates = values @ slopes(pieces.points).T
    size = np.abs(values).max(axis=(1, 2), initial=0.0)[:, np.newaxis]
    swings = np.ptp(values, axis=2) > _STILL * size
    turns = (rates[..., :-1] * rates[..., 1:] < 0.0) & swings[..., np.newaxis]
    column, piece, node = np.nonzero(turns)
    mine = rates[column, piece]
    low, high, first = points[node], points[node + 1], mine[np.arange(node.size), node]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        before = np.einsum("kn,kn->k", basis(pieces.points, middle), mine) * first > 0.0
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    found = np.einsum("kn,ckn->kc", basis(pieces.points, low), values[:, piece])
    rows = np.column_stack([pieces.begin[piece] + low * pieces.length[piece], found])
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    # several quantities turn at one instant
    apart = np.diff(rows[:, 0], prepend=-np.inf) > _SAME * np.abs(rows[:, 0])
    return np.asarray(rows[apart])


def aligned(parts: Sequence[Pieces]) -> Pieces:
    """Return the quantities of several records, which cover the same window, as one."""
    if len(parts) == 1:
        return parts[0]
    edges = np.unique(np.concatenate([np.concatenate([p.begin, p.end]) for p in parts]))
    keep = np.diff(edges, prepend=-np.inf) > _SAME * np.abs(edges)
    edges = edges[keep]
    points = max(p.points for p in parts)
    values = np.concatenate([p.cut(edges, points) for p in parts])
    return Pieces(edges[:-1], np.diff(edges), values)


#: Returns signals by name from the recorded quantities, shape (c, ...).
Combine = Callable[[Floats], Mapping[str, Floats]]


@dataclass(frozen=True, slots=True)
class Motion:
    """Signals over a window.

    Parameters
    ----------
    pieces : Pieces
        Of quantities whose values between the points are those of polynomials.
    combine : callable
        Makes the signals of them: sums, and products of voltages and currents.
    axis : str
        What the pieces are pieces of: ``time``, or a swept quantity.
    """

    pieces: Pieces
    combine: Combine
    axis: str = "time"

    @classmethod
    def of_rows(cls, x: Floats, signals: Mapping[str, Floats], axis: str = "time") -> Motion:
        """Return signals that are lines between rows."""
        names = list(signals)
        columns = np.array([signals[n] for n in names], dtype=np.float64)
        pieces = Pieces.of_rows(x, columns.reshape(len(names), x.size))
        return cls(pieces, lambda c: dict(zip(names, c, strict=True)), axis)

    def signals(self, index: Indices, at: Floats) -> dict[str, Floats]:
        """Return the signals at parts of some pieces.

        Parameters
        ----------
        index : ndarray of int, shape (k,)
        at : ndarray, shape (p,) or (k, p)
            Parts of all of the pieces alike, or of each.
        """
        pieces = self.pieces
        values, factors = pieces.values[:, index], basis(pieces.points, at)
        columns = values @ factors.T if at.ndim == 1 else np.einsum("kpn,ckn->ckp", factors, values)
        begin, length = (v[index, np.newaxis] for v in (pieces.begin, pieces.length))
        return {**self.combine(columns), self.axis: begin + at * length}


@dataclass(frozen=True, slots=True)
class Trace:
    """An expression of signals over a window, as a function of the axis.

    Parameters
    ----------
    motion : Motion
    expression : Expression
    constants : mapping of str to float
        Names in the expression that are not signals.
    other : Expression or None
        What is subtracted.
    """

    motion: Motion
    expression: Expression
    constants: Mapping[str, float] = field(default_factory=dict)
    other: Expression | None = None

    @property
    def linear(self) -> bool:
        """True for a single signal: what is recorded are sums of polynomials of the axis."""
        node = self.expression.node
        plain = node.op == "var" and canonical(str(node.value))[:2] in ("v(", "i(")
        return plain and self.other is None

    def at(self, index: Indices, at: Floats) -> Floats:
        """Return the values, shape (k, p), at parts (p,) or (k, p) of the pieces (k,)."""
        signals = self.motion.signals(index, at)
        names = self.expression.variables() | (self.other.variables() if self.other else set())
        known = {n: signals[canonical(n)] for n in names if n not in self.constants}
        known |= {n: np.asarray(v) for n, v in self.constants.items()}
        shape = (index.size, at.shape[-1])
        with np.errstate(all="ignore"):
            found = np.asarray(self.expression.evaluate(known), dtype=np.float64)
            if self.other is not None:
                found = found - np.asarray(self.other.evaluate(known), dtype=np.float64)
        return np.broadcast_to(found, shape)
