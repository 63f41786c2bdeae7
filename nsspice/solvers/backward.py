"""Recorded steps backwards: what a small change anywhere in a run does to functionals of it.

The transposed equations of :mod:`~nsspice.solvers.tangent`.  With the derivatives
:math:`\\bar q` by the charges and :math:`\\bar r_j` by the rates of a step, stage after stage from
the last one,

.. math::

    M_i^T \\eta_i = \\bar x_i + C_i^T \\bar r_i / a_{ii}, \\qquad
    \\bar b_i = (\\eta_i - \\bar r_i) / a_{ii}, \\qquad
    \\bar q \\mathrel{+}= \\bar b_i, \\quad \\bar r_j \\mathrel{+}= a_{ij} \\bar b_i,

where M is the matrix of the stage and x what the functional takes of it: :math:`\\eta` is what a
source in each equation does.  One pass serves any number of parameters.

References: A. Sandu, "On the properties of Runge-Kutta discrete adjoints", ICCS 2006, LNCS 3994,
550, doi:10.1007/11758549_76.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..problems.csc import Floats
from .along_run import Goal, Points, Turn
from .orbit import NoDerivative
from .perturbed import Outputs
from .tangent import Bools, Tangent

#: steps whose matrices are made together
_CHUNK = 128


class Backward:
    """A pass backwards through a recorded run.

    Parameters
    ----------
    tangent : Tangent
    outputs : Outputs
        Without rates.
    goal : Goal
    end : ndarray, shape (r, f)
        Derivatives by what is stored at the end.
    wraps : bool
        The end is the beginning: an edge there is one of the run.
    ending : ndarray, shape (n + m, f), optional
        Derivatives by the unknowns and multipliers at the end.

    Attributes
    ----------
    begin : ndarray, shape (r, f)
        Derivatives by what is stored before the beginning.
    points : Points
    turns : list of Turn
    instants : list of (float, ndarray)
        Ideal edges of sources [s], and derivatives (f,) by these instants; nan where none is known.
    """

    def __init__(
        self,
        tangent: Tangent,
        outputs: Outputs,
        goal: Goal,
        end: Floats,
        wraps: bool,
        ending: Floats | None = None,
    ) -> None:
        self.tangent, self.outputs, self.goal = tangent, outputs, goal
        record = tangent.record
        self.f, self._ending = end.shape[1], ending
        self.turns: list[Turn] = []
        self.instants: list[tuple[float, Floats]] = []
        self._parts: list[Points] = []
        self._weights = goal.places.copy()
        # a place that repeats another one: the first of a start, the last of a whole step
        self.starting: Bools = np.asarray(record.inner[:, 0].any(axis=1))
        self.whole: Bools = np.asarray(record.inner[:, -1, -1] == 0.0)
        w = self._weights
        w[self.starting, 1] += w[self.starting, 0]
        later = np.flatnonzero(tangent.continues)
        w[later - 1, -1] += w[later, 0]
        w[self.starting, 0] = w[later, 0] = 0.0
        w[self.whole, -2] += w[self.whole, -1]
        w[self.whole, -1] = 0.0
        self._charges, self._rates = end.copy(), np.zeros_like(end)
        total = record.begin.size
        # where the end moves with the begin: what the begin brings is added below
        self._wrapped = tangent.r[-1, -1, tangent.stored] @ end
        shift: Floats | None = None
        for last in range(total, 0, -_CHUNK):
            steps = np.arange(max(last - _CHUNK, 0), last)
            shift = self._chunk(steps, shift)
        self.begin = self._charges
        if wraps and goal.edges[0] and shift is not None:
            self.instants.append((float(record.end[-1]), self._wrapped + shift))
        self.points = Points.joined(self._parts)

    def _chunk(self, steps: npt.NDArray[np.intp], shift: Floats | None) -> Floats | None:
        """Go back through some steps; return what a shift of the first one's begin does."""
        tangent, record, stored = self.tangent, self.tangent.record, self.tangent.stored
        n, g, s = tangent.system.n, steps.size, self._weights.shape[1]
        r, m = stored.size, tangent.system.m
        slopes = tangent.slopes(
            record.z[steps].reshape(g * s, n),
            record.u[steps].reshape(g * s, -1),
            record.time[steps].ravel(),
        )
        own = np.diagonal(record.inner[steps], axis1=1, axis2=2).copy()
        real = own > 0.0
        real[self.starting[steps], 0] = False
        a = np.where(real, own, 1.0)
        K = tangent.inverse(slopes, tangent.modes[steps].reshape(g * s, -1), a.ravel())
        K = np.swapaxes(K, 1, 2).reshape(g, s, n + m, n + m)
        weights = self._weights[steps]
        x = np.zeros((g, s, n + m, self.f))
        x[:, :, :n] = self.outputs.z.T @ weights
        by = slopes.by_unknown.reshape(g, s, -1, n)
        x[:, :, :n] += np.swapaxes(by, 2, 3) @ (self.outputs.f.T @ weights)
        x[:, :, n:] = self.outputs.lam.T @ weights
        C = slopes.C.reshape(g, s, n, n)[:, :, stored]
        each = a[:, :, np.newaxis, np.newaxis]
        T = K[:, :, :, :n] @ np.swapaxes(C, 2, 3) / each
        U = (T[:, :, stored] - np.eye(r)) / each
        eta = K @ x
        offsets = eta[:, :, stored] / each
        rates = np.zeros((g, s, r, self.f))
        bases = np.zeros((g, s, r, self.f))
        for j in range(g - 1, -1, -1):
            k = int(steps[j])
            last = s - 2 if self.whole[k] else s - 1
            more = None
            if k + 1 == record.begin.size:
                more = self._ending
            elif tangent.turns[k + 1] or self.goal.edges[k + 1]:
                assert shift is not None
                more = self._event(k, shift)
            if more is not None:
                eta[j, last] += K[j, last] @ more
                offsets[j, last] += (K[j, last] @ more)[stored] / a[j, last]
            own_rates = record.inner[k, -1, :, np.newaxis, np.newaxis] * self._charges
            own_rates[last] += self._rates
            charges, end = self._charges, self._charges
            for i in range(last, 0, -1):
                base = U[j, i] @ own_rates[i] + offsets[j, i]
                bases[j, i] = base
                charges = charges + base
                own_rates[:i] += record.inner[k, i, :i, np.newaxis, np.newaxis] * base
            rates[j] = own_rates
            shift = None
            if tangent.turns[k] or self.goal.edges[k]:
                full = np.where(real[j, :, np.newaxis, np.newaxis], eta[j] + T[j] @ own_rates, 0.0)
                place = slice(j * s, (j + 1) * s)
                timed = slopes.by_source[place], slopes.by_time[place]
                shift = self._shift(k, full, bases[j], weights[j], timed, end)
            self._charges, self._rates = charges, np.zeros_like(charges)
            known = bool(tangent.continues[k])
            if known:
                self._rates = own_rates[0]
            inferred = own_rates[0] if not known and not self.starting[k] else None
            if inferred is not None or tangent.jumps[k] or k in self.goal.begins:
                moved = self._at_begin(k, inferred)
                shift = None if shift is None else shift + moved
        eta += T @ rates
        self._keep(steps, real, eta, bases, weights)
        return shift

    def _keep(
        self,
        steps: npt.NDArray[np.intp],
        real: npt.NDArray[np.bool_],
        eta: Floats,
        bases: Floats,
        weights: Floats,
    ) -> None:
        """Keep what acts at the stages of some steps."""
        tangent, record = self.tangent, self.tangent.record
        n, stored = tangent.system.n, tangent.stored
        kept = np.zeros((*real.shape, n, self.f))
        kept[:, :, stored] = bases
        # the begin of a step that does not continue another has points of its own
        eta, kept, w = eta[real], kept[real], weights[real]
        active = tangent.modes[steps][real][:, :, np.newaxis]
        flows = eta[:, :n]
        self._parts.append(
            Points(
                record.z[steps][real],
                record.rate[steps][real],
                record.lam[steps][real],
                record.u[steps][real],
                record.time[steps][real],
                flows,
                kept,
                np.where(active, -eta[:, n:], 0.0),
                self._by_functions(flows, kept, w),
                w,
            )
        )

    def _by_functions(self, flows: Floats, kept: Floats, weights: Floats) -> Floats:
        found: Floats = self.outputs.f.T @ weights
        return found - self.tangent.F.T @ flows - self.tangent.Q.T @ kept

    def _event(self, k: int, shift: Floats) -> Floats | None:
        """Return what the instant at which step k ends takes of the unknowns there, (n + m, f)."""
        tangent = self.tangent
        total = shift + tangent.r[k, -1, tangent.stored] @ self._charges
        guard = tangent.guard(k) if tangent.turns[k + 1] else None
        if guard is None:
            if not self.goal.edges[k + 1]:
                raise NoDerivative("unproved", float(tangent.record.end[k]))
            self.instants.append((float(tangent.record.end[k]), total))
            return None
        self.turns.append(Turn(k, guard, -total / guard.rate))
        return np.outer(-guard.row / guard.rate, total)

    def _shift(
        self,
        k: int,
        eta: Floats,
        bases: Floats,
        weights: Floats,
        slopes: tuple[Floats, Floats],
        end: Floats,
    ) -> Floats:
        """Return what a shift of the begin of a step does, which ends when it did, shape (f,)."""
        tangent, record, system = self.tangent, self.tangent.record, self.tangent.system
        stored = tangent.stored
        moved = record.inner[k] @ tangent.r[k][:, stored] / tangent.length[k]
        total = self.goal.shifts[k] - moved[-1] @ end
        total -= np.einsum("ir,irf->f", moved, bases)
        # sources and functions of the time at places that move by a part of the shift
        parts = (1.0 - tangent.parts[k])[:, np.newaxis]
        by_source, by_time = slopes
        u = tangent.source_rates(k) * parts
        functions = by_time * parts + np.einsum("ipu,iu->ip", by_source, u)
        kept = np.zeros((len(bases), system.n, self.f))
        kept[:, stored] = bases
        flows = eta[:, : system.n]
        total += np.einsum("in,inf->f", u @ system.S.dense().T, flows)
        total += np.einsum("io,iof->f", u @ self.outputs.u.T, weights)
        own = self._by_functions(flows, kept, weights)
        total += np.einsum("ip,ipf->f", functions, own)
        return np.asarray(total)

    def _at_begin(self, k: int, inferred: Floats | None) -> Floats:
        """Go back through what happens at the begin of a step: jumps, rates, values.

        Returns what a shift of it does there, shape (f,): sources are others.
        """
        tangent, record, outputs = self.tangent, self.tangent.record, self.outputs
        n, m, stored = tangent.system.n, tangent.system.m, tangent.stored
        at = np.array([k])
        slopes, a, inverse = tangent.at_begin(at)
        x = np.zeros((n + m, self.f))
        w = self.goal.begins.get(k, np.zeros((outputs.count, self.f)))
        if inferred is not None:
            w = w + self._weights[k, 0]
        x[:n] = outputs.z.T @ w + slopes.by_unknown[0].T @ (outputs.f.T @ w)
        x[n:] = outputs.lam.T @ w
        flows = np.zeros((n, self.f))
        if inferred is not None:
            flows[stored] = inferred
            x[:n] -= slopes.G[0, stored].T @ inferred
            x[n:] -= tangent.A[stored].T @ inferred
        kept = np.zeros((n, self.f))
        if tangent.jumps[k]:
            x[:n] += slopes.C[0, stored].T @ self._charges
            kept[stored] = -self._charges
            self._charges = np.zeros_like(self._charges)
        eta = inverse[0].T @ x
        self._charges = self._charges + eta[stored] / a[0]
        kept[stored] += eta[stored] / a[0]
        flows += eta[:n]
        active = tangent.modes[k, 1][:, np.newaxis]
        own = self._by_functions(flows, kept, w)
        u = tangent.source_rates(k)[1]
        functions = slopes.by_time[0] + slopes.by_source[0] @ u
        moved = (tangent.system.S.dot(u)) @ flows + functions @ own + (outputs.u @ u) @ w
        # the rates of a start are not known at its begin
        place = np.full(n, np.nan if inferred is None and w.any() else 0.0)
        if inferred is not None:
            place = record.rate[k, 0]
        self._parts.append(
            Points(
                record.first[at],
                place[np.newaxis],
                record.lam[at, 0],
                record.first_u[at],
                record.begin[at],
                flows[np.newaxis],
                kept[np.newaxis],
                np.where(active, -eta[n:], 0.0)[np.newaxis],
                own[np.newaxis],
                w[np.newaxis],
            )
        )
        return np.asarray(moved)
