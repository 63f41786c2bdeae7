"""A slow check of the mode-wise engine on the unreduced equations, in numpy.

The engine says which pairs are active between two rows; with them the original equations

    E z' + G z + A_a lam = S u(t),    q_a - B_a z + D_aa lam = 0

are integrated by the three-stage Radau IIA method (order 5, Hairer & Wanner 1996, IV.5), twice,
with its own error estimate.  Nothing of the engine's reduction is used: no energy coordinates, no
eigenvalues, no closed form.  A mode that holds at both ends, whose multipliers and slacks stay
nonnegative, and whose stored charges and fluxes agree, is the solution: it is unique for passive
networks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nsspice.circuit import MnaSystem
from nsspice.problems import Functional
from nsspice.solvers.modewise import ModewiseStepper

from .waveforms import Source

_ROOT = np.sqrt(6.0)
NODES = np.array([(4 - _ROOT) / 10, (4 + _ROOT) / 10, 1.0])
_V = np.vander(NODES, 3, increasing=True)
#: a_ij = integral of the j-th Lagrange polynomial from 0 to c_i
STAGES = np.array([NODES ** (k + 1) / (k + 1) for k in range(3)]).T @ np.linalg.inv(_V)


#: of sums of some ten terms
_ROUNDING = 64.0 * np.finfo(float).eps


@dataclass
class Interval:
    """Between two events: ends, the worst negative guard, the error and its estimate."""

    start: float
    stop: float
    negative: float
    error: float
    estimate: float


class Check:
    """Runs the engine row by row and checks the intervals between events.

    Parameters
    ----------
    mna : MnaSystem
    stop : float
        [s]
    rows : int
    """

    def __init__(self, mna: MnaSystem, stop: float, rows: int) -> None:
        system = mna.system
        self.n, self.m = system.n, system.m
        self.E, self.G, self.A = (x.dense() for x in (system.E, system.G, system.A))
        self.B, self.D, self.S = (x.dense() for x in (system.B, system.D, system.S))
        self.q = system.q
        self.sources = [Source(w, 0.0, 1.1 * stop) for w in system.waveforms]
        self.switched = {s.pair for s in system.switches}  # thyristors too: they block forward
        outputs = [Functional(z=((j, 1.0),)) for j in range(self.n)]
        outputs += [Functional(lam=((j, 1.0),)) for j in range(self.m)]
        self.stepper = ModewiseStepper(system, outputs)
        self.stepper.plan(0.0, stop, stop / 1000, 0.0, stop / rows)
        self.stepper.start_charges(0.0, mna.initial_charges(), stop / 1000)
        self.rows, self.stop = rows, stop
        #: largest current and voltage seen
        self.sizes = np.zeros(2)
        #: largest charge and flux seen
        self.scale = np.zeros(2)
        self.kind = system.row_kind

    def u(self, t: float) -> np.ndarray:
        """Return the source values."""
        return np.array([source.value(t, "right") for source in self.sources])

    def intervals(self) -> list[Interval]:
        """Return all intervals between neighbouring rows without an event."""
        found = []
        before, segment = None, -1
        for _ in range(self.rows + 1):
            row = self.stepper.advance(1, 10.0)[0][0].copy()
            stats = self.stepper.statistics
            z = row[1 : self.n + 1]
            charge = np.abs(self.E @ z)
            for kind in (0, 1):
                self.scale[kind] = max(self.scale[kind], charge[self.kind == kind].max(initial=0))
            if before is not None and stats["segments"] == segment and not stats["fixed_steps"]:
                found.append(self.check(before, row))
            before, segment = row, stats["segments"]
        return found

    def check(self, first: np.ndarray, last: np.ndarray) -> Interval:
        """Integrate from one row to the next."""
        n = self.n
        active = np.flatnonzero(self.stepper.active)
        t0, t1 = first[0], last[0]
        coarse = self.radau(first[1 : n + 1], t0, t1, active, 4)
        fine = self.radau(first[1 : n + 1], t0, t1, active, 8)
        negative = max(self.negative(first), self.negative(last))

        def off(x: np.ndarray, y: np.ndarray) -> float:
            return self.off(x - y, t1 - t0)

        return Interval(t0, t1, negative, off(fine, last[1 : n + 1]), off(fine, coarse))

    def off(self, change: np.ndarray, length: float) -> float:
        """Return the size of a change of the unknowns, in charges and fluxes by the largest.

        Where nothing is stored rounding has no measure: what the largest voltages and currents
        would store and move within the time is known to their rounding.
        """
        current, voltage = self.sizes
        largest = np.where(self.kind == 0, voltage, current)
        moved = np.where(self.kind == 0, current, voltage) * length
        rounding = _ROUNDING * (np.abs(self.E) @ largest + moved)
        beyond = np.maximum(np.abs(self.E @ change) - rounding, 0.0)
        scale = np.where(self.kind == 0, self.scale[0], self.scale[1])
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.max(np.where(beyond > 0.0, beyond / scale, 0.0), initial=0.0))

    def negative(self, row: np.ndarray) -> float:
        """Return how far multipliers and slacks fall below zero, relative to their kind."""
        z, lam = row[1 : self.n + 1], row[self.n + 1 :]
        w = self.q - self.B @ z + self.D @ lam
        worst = 0.0
        node = self.kind == 0
        # currents: of branches and pairs, and what moves the charges within the run
        currents = np.abs(np.concatenate([z[~node], lam, [self.scale[0] / self.stop]]))
        self.sizes = np.maximum(self.sizes, [currents.max(), np.abs(z[node]).max(initial=0.0)])
        sizes = self.sizes
        for k in range(self.m):
            if k not in self.switched:
                for value_, size in ((lam[k], sizes[0]), (w[k], sizes[1])):
                    worst = max(worst, -value_ / (size + 1e-300))
        return worst

    def radau(
        self, z0: np.ndarray, t0: float, t1: float, active: np.ndarray, steps: int
    ) -> np.ndarray:
        """Return the unknowns at t1 with the given pairs active."""
        n, k = self.n, active.size
        size, h = n + k, (t1 - t0) / steps
        K = np.zeros((size, size))
        K[:n, :n], K[:n, n:] = self.G, self.A[:, active]
        K[n:, :n], K[n:, n:] = -self.B[active], self.D[np.ix_(active, active)]
        M = np.zeros((size, size))
        M[:n, :n] = self.E
        big = np.kron(np.eye(3), M) + h * np.kron(STAGES, K)
        # laws that are not differentiated hold at the stages themselves
        algebraic = ~M.any(axis=1)
        for i in range(3):
            rows = i * size + np.flatnonzero(algebraic)
            big[rows] = 0.0
            big[rows, i * size : (i + 1) * size] = K[algebraic]
        row, col = np.ones(3 * size), np.ones(3 * size)
        for _ in range(8):
            scaled = np.abs(row[:, None] * big * col)
            row /= np.sqrt(np.where((m := scaled.max(axis=1)) > 0.0, m, 1.0))
            col /= np.sqrt(np.where((m := scaled.max(axis=0)) > 0.0, m, 1.0))
        inverse = col[:, None] * np.linalg.pinv(row[:, None] * big * col, rcond=1e-13) * row
        z = z0
        for s in range(steps):
            times = t0 + (s + NODES) * h
            force = np.array([np.append(self.S @ self.u(t), -self.q[active]) for t in times])
            right = np.tile(np.append(self.E @ z, np.zeros(k)), (3, 1)) + h * STAGES @ force
            right[:, algebraic] = force[:, algebraic]
            x = inverse @ right.ravel()
            x += inverse @ (right.ravel() - big @ x)
            z = x[2 * size : 2 * size + n]
        return z
