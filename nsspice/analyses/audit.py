"""The laws of a circuit, checked at points of a run by code that shares nothing with its solver.

Any engine hands over points in blocks: unknowns z, multipliers, sources, and the rates of stored
charge and flux that its scheme gives.  Checked are

.. math::

    \\dot q + G z + A \\lambda = S u, \\qquad w = q_0 - B z + D \\lambda, \\qquad
    0 \\le \\lambda \\perp w \\ge 0

(Kirchhoff's laws and the element laws row by row, signs and products of the set-valued ones), each
relative to the currents and voltages that meet in it.  The products are formed here from the
assembled arrays; no factor, map, scaling or residual of the solver takes part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..problems.csc import Csc, Floats
from ..problems.descriptor import DescriptorSystem
from ..solvers.moreau import Jump, Records, function_values

#: Share of the largest current (voltage) so far that a smaller one is measured by.
FLOOR = 1e-6
#: Share of ``E z / h`` below which nothing can be resolved: with a tolerance of 1e-8, 45 units of
#: rounding of the stored quantity.
ROUNDING = 1e-6
#: The same right after a jump: values there are limits of short steps, known to 1e-5 (this times
#: the tolerance of 1e-8) of the largest.
AFTER_JUMP = 1e3
#: A slack is a difference of voltages that solving a large network leaves with rounding errors of
#: 1e-12 of the largest: a hundred times the share of rows.
PAIRS = 100.0
_DENSE = 80  # up to this size products with full matrices are faster


@dataclass(frozen=True, slots=True)
class Points:
    """Some points of a run.

    Parameters
    ----------
    z : ndarray, shape (k, n)
    lam : ndarray, shape (k, m)
    u : ndarray, shape (k, p)
        Sources on the side of the point.
    rates : ndarray, shape (k, n)
        Rate of the charge (flux) of each row [A or V]; nan where it is not known.
    resolution : ndarray, shape (k, n)
        Size of the terms whose difference ``rates`` is; 0 for rates that are not differences.
    roles : ndarray of uint8, shape (k, m), or None
        0 complementary pair, 1 closed (w = 0), 2 open (lam = 0); None if all are complementary.
    f : ndarray, shape (k, p), or None
        Smooth functions, None without any.
    """

    z: Floats
    lam: Floats
    u: Floats
    rates: Floats
    resolution: Floats
    roles: npt.NDArray[np.uint8] | None = None
    f: Floats | None = None


class Product:
    """Products of one sparse matrix, and of its absolute values, with many vectors at once.

    Examples
    --------
    >>> p = Product(Csc.from_dense(np.array([[1.0, -2.0]])))
    >>> p(np.array([[1.0, 1.0], [3.0, 1.0]])).tolist(), p.sizes(np.array([[1.0, 1.0]])).tolist()
    ([[-1.0], [1.0]], [[3.0]])
    """

    def __init__(self, matrix: Csc) -> None:
        self.shape = matrix.shape
        self.empty = matrix.data.size == 0
        self._full: Floats | None = None
        self._sizes: Floats
        if max(matrix.shape) <= _DENSE:
            self._full = matrix.dense().T.copy()
            self._sizes = np.abs(self._full)
            return
        order = np.argsort(matrix.indices, kind="stable")
        rows = matrix.indices[order]
        self._columns, self._data = matrix.columns[order], matrix.data[order]
        self._rows, self._starts = np.unique(rows, return_index=True)

    def __call__(self, x: Floats) -> Floats:
        """Return the products with the rows of ``x``, shape (k, nrows)."""
        if self._full is not None:
            return np.asarray(x @ self._full)
        return self._sum(self._data * x[:, self._columns])

    def sizes(self, x: Floats) -> Floats:
        """Return the sums of the magnitudes of the terms, shape (k, nrows)."""
        if self._full is not None:
            return np.asarray(np.abs(x) @ self._sizes)
        return self._sum(np.abs(self._data * x[:, self._columns]))

    def _sum(self, terms: Floats) -> Floats:
        out = np.zeros((terms.shape[0], self.shape[0]))
        if not self.empty:
            out[:, self._rows] = np.add.reduceat(terms, self._starts, axis=1)
        return out


class Auditor:
    """Checks the points of one island.

    Parameters
    ----------
    system : DescriptorSystem
    H, Hs : Csc, optional
        Averaging terms of a theta scheme, shapes (n, n) and (n, p); its rates contain them.

    Examples
    --------
    A current of 1 A into 2 Ohm gives 2 V; 3 V miss the law of currents by 0.5 of 1.5 + 1 A:

    >>> half, none = Csc.from_triplets((1, 1), [0], [0], [0.5]), Csc.zeros
    >>> system = DescriptorSystem(none((1, 1)), half, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), Csc.from_triplets((1, 1), [0], [0], [1.0]), row_kind=np.zeros(1, np.uint8))
    >>> one, zero = np.ones((1, 1)), np.zeros((1, 1))
    >>> for volts in 2.0, 3.0:
    ...     auditor = Auditor(system)
    ...     auditor.check(Points(volts * one, np.zeros((1, 0)), one, zero, zero))
    ...     print(auditor.laws)
    0.0
    0.2
    """

    def __init__(
        self, system: DescriptorSystem, H: Csc | None = None, Hs: Csc | None = None
    ) -> None:
        self.system = system
        self.E, self.G = Product(system.E), Product(system.G)
        self.A, self.B, self.D = Product(system.A), Product(system.B), Product(system.D)
        self.S = Product(system.S)
        self.H = Product(H) if H is not None and H.data.size else None
        self.Hs = Product(Hs) if Hs is not None and Hs.data.size else None
        self.F = Product(system.smooth.F) if system.smooth is not None else None
        self.Q = Product(system.smooth.Q) if system.smooth is not None else None
        kinds = system.row_kind
        self._kinds = (kinds == 0, kinds == 1)  # laws of currents, laws of voltages
        self._touched = Product(_pattern(system.A, kinds == 0))
        #: rows that hold at every instant: no charge or flux in them
        self.algebraic = np.ones(system.n, dtype=bool)
        self.algebraic[system.E.indices] = False
        if system.smooth is not None:
            self.algebraic[system.smooth.Q.indices] = False
        #: largest current and voltage so far
        self._largest = [0.0, 0.0]
        #: largest charge and flux, longest step [s]
        self._stored, self._length = [0.0, 0.0], 0.0
        #: worst relative errors, and where: time and row or pair
        self.laws, self.complementarity = 0.0, 0.0
        self.worst_row, self.worst_pair = -1, -1
        self.checks = 0

    def points(self, records: Records, frozen: float | None = None) -> Points:
        """Return recorded steps as points, with the rates that their scheme gives.

        Parameters
        ----------
        records : Records
        frozen : float, optional
            The time that smooth functions see [s], if that of the records counts something else.
        """
        z, change = records.z, records.change
        length = records.length[:, None]
        static = np.isinf(records.length)
        contents = self.E.sizes(z)
        self._length = max(self._length, float(np.max(records.length[~static], initial=0.0)))
        rates = self.E(change) / length
        resolution = (contents + self.E.sizes(z - change)) / length
        f = None
        if self.F is not None and self.Q is not None:
            f = self._functions(z, records.u, records.time, frozen)
            if not self.Q.empty:
                earlier = records.time - np.where(static, 0.0, np.abs(records.length))
                before = self._functions(
                    z - change, records.u - records.source_change, earlier, frozen
                )
                stored = self.Q.sizes(f) + self.Q.sizes(before)
                rates += self.Q(f - before) / length
                resolution += stored / length
                contents = contents + stored
        for kind, rows in enumerate(self._kinds):
            most = float(np.max(contents[:, rows], initial=0.0))
            self._stored[kind] = max(self._stored[kind], most)
        if self.H is not None:
            rates += self.H(change)
        if self.Hs is not None:
            rates += self.Hs(records.source_change)
        rates[static] = 0.0
        unknown = records.length < 0.0
        if unknown.any():  # the state after a jump: only laws without storage can be checked
            rates[unknown] = np.where(self.algebraic, 0.0, np.nan)
            np.abs(resolution, out=resolution)
        return Points(z, records.lam, records.u, rates, resolution, records.roles, f)

    def _functions(self, z: Floats, u: Floats, t: Floats, frozen: float | None) -> Floats:
        assert self.system.smooth is not None
        clock = t if frozen is None else np.full_like(t, frozen)
        return function_values(self.system.smooth.tape, z, u, clock)

    def check(self, points: Points) -> None:
        """Take a block of points into the worst errors."""
        if points.z.shape[0] == 0:
            return
        self.checks += points.z.shape[0]
        scale = self._check_rows(points)
        if self.system.m:
            self._check_pairs(points, scale)

    def jump_error(self, moved: Floats, jump: Jump, stored: Floats) -> float:
        """Return the relative error of the balance of charge and flux over a jump.

        What moved into each row, shape (n,), plus what impulses brought there vanishes; ``stored``
        is the size of what was there.
        """
        unknowns, multipliers = jump.unknowns[None, :], jump.multipliers[None, :]
        brought = self.G(unknowns) + self.A(multipliers)
        sizes = stored[None, :] + np.abs(moved) + self.G.sizes(unknowns) + self.A.sizes(multipliers)
        sizes += self.E.sizes(jump.after[None, :])
        # what ordinary currents and voltages carry in a step is no impulse
        for kind, rows in enumerate(self._kinds):
            sizes[:, rows] += self._length * self._largest[kind]
        for kind, rows in enumerate(self._kinds):
            here = float(np.max(sizes[:, rows], initial=0.0))
            self._stored[kind] = max(self._stored[kind], here)
            sizes[:, rows] = self._stored[kind]
        return float(np.max(_ratio(np.abs(moved + brought), sizes)))

    def _check_rows(self, points: Points) -> Floats:
        """Check the rows of z; return their scales, shape (k, n)."""
        rates = points.rates
        known = ~np.isnan(rates)
        floor = _floor(points)
        rates = np.where(known, rates, 0.0)
        error = rates + self.G(points.z) + self.A(points.lam) - self.S(points.u)
        scale = np.abs(rates) + self.G.sizes(points.z)
        scale += self.A.sizes(points.lam) + self.S.sizes(points.u)
        if self.F is not None and points.f is not None:
            error += self.F(points.f)
            scale += self.F.sizes(points.f)
        error = np.abs(error)
        for kind, rows in enumerate(self._kinds):
            # what has decayed keeps the rounding of what it was
            here = float(np.max(scale[:, rows], initial=0.0))
            self._largest[kind] = max(self._largest[kind], here)
            scale[:, rows] = np.maximum(scale[:, rows], floor * self._largest[kind])
        allowed = np.maximum(scale, ROUNDING * points.resolution)
        ratio = np.where(known, _ratio(error, allowed), 0.0)
        worst = float(np.max(ratio, initial=0.0))
        if worse(worst, self.laws):
            self.laws = worst
            self.worst_row = int(np.argmax(np.max(ratio, axis=0)))
        return allowed

    def _check_pairs(self, points: Points, scale: Floats) -> None:
        """Check signs and products of the pairs."""
        lam = points.lam
        w = self.system.q - self.B(points.z) + self.D(lam)
        volts = np.abs(self.system.q) + self.B.sizes(points.z) + self.D.sizes(lam)
        amperes = np.maximum(np.abs(lam), self._touched(scale))
        for kind, size in enumerate((amperes, volts)):
            self._largest[kind] = max(self._largest[kind], float(np.max(size)))
            # a pair's voltage is a difference of several; rows may hold more than pairs do, be it
            # only the rounding of what they store
            here = np.max(scale[:, self._kinds[kind]], axis=1, keepdims=True, initial=0.0)
            floor = np.maximum(PAIRS * _floor(points) * self._largest[kind], FLOOR * here)
            np.maximum(size, floor, out=size)
        ratio = np.abs(np.minimum(_ratio(lam, amperes), _ratio(w, volts)))
        if points.roles is not None:
            ratio = np.where(points.roles == 1, np.abs(_ratio(w, volts)), ratio)
            ratio = np.where(points.roles == 2, np.abs(_ratio(lam, amperes)), ratio)
        worst = float(np.max(ratio, initial=0.0))
        if worse(worst, self.complementarity):
            self.complementarity = worst
            self.worst_pair = int(np.argmax(np.max(ratio, axis=0)))


def _floor(points: Points) -> Floats:
    """Return the share of the largest value that a small one is measured by, shape (k, 1)."""
    return np.where(np.isnan(points.rates).any(axis=1, keepdims=True), AFTER_JUMP, FLOOR)


def worse(new: float, old: float) -> bool:
    """Return whether an error is worse than the worst so far; nan is the worst of all."""
    return old == old and not new <= old


def _ratio(error: Floats, scale: Floats) -> Floats:
    """Return ``error / scale``, 0 where both vanish."""
    out: Floats = np.divide(error, scale, out=np.zeros_like(error), where=(scale > 0.0))
    out[~np.isfinite(error) | ~np.isfinite(scale)] = np.nan
    return out


def _pattern(matrix: Csc, rows: npt.NDArray[np.bool_]) -> Csc:
    """Return, for each column, ones in those of its stored rows that are chosen, transposed."""
    keep = rows[matrix.indices]
    columns = matrix.columns[keep]
    count = np.bincount(columns, minlength=matrix.shape[1])
    # the mean of the scales of the rows that a pair feeds, so that one product gives it
    return Csc.from_triplets(
        (matrix.shape[1], matrix.shape[0]), columns, matrix.indices[keep], 1.0 / count[columns]
    )
