"""Circuits that may have several solutions: active ones, with gain in a loop.

For passive networks (B = A', G + G' and D positive semidefinite) each step is a monotone problem:
its voltages and currents are unique but for what ``undetermined`` counts.  For the others,

- a step has one solution for all data exactly if ``M = D + B K^-1 A`` is a P-matrix: all its
  principal minors are positive (Cottle, Pang, Stone, *The Linear Complementarity Problem*, 1992,
  theorem 3.3.7);
- a mode whose states grow like ``exp(r t)`` with ``r h > 1`` is stepped over: the implicit step
  lands beyond the pole and tends to the unstable equilibrium instead of leaving it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...problems.csc import Csc, weighted_sum
from ...problems.descriptor import DescriptorSystem
from ...problems.passivity import MOST_ROWS
from ...solvers.moreau import Recorded

_MOST_MODES = 16


@dataclass(slots=True)
class Activity:
    """What an active island may do.

    Parameters
    ----------
    several : bool
        A step may have several solutions: the P-test failed, or the island is too large for it.
    growth : float
        Largest real positive rate of a mode that was met [1/s]; 0 if none grows.
    """

    several: bool = False
    growth: float = 0.0


class Watcher:
    """Collects the modes of an active island, and judges it in the end.

    Parameters
    ----------
    system : DescriptorSystem
    H : Csc or None
        Averaging terms of the scheme.
    step : float or None
        Solver step [s], None for a static system.
    """

    def __init__(self, system: DescriptorSystem, H: Csc | None, step: float | None) -> None:
        self.system, self.step = system, step
        terms = [(system.G, 1.0)]
        if step is not None:
            terms.append((system.E, 1.0 / step))
        if H is not None:
            terms.append((H, 1.0))
        self._K = weighted_sum(terms)
        self._modes: set[bytes] = set()
        self._small = system.n + system.m <= MOST_ROWS

    def take(self, records: Recorded) -> None:
        """Note the modes of recorded steps."""
        if self.step is None or not self._small or len(self._modes) >= _MOST_MODES:
            return
        active = records.lam > 0.0
        if records.roles is not None:
            active = np.where(records.roles == 1, True, active & (records.roles == 0))
        packed: npt.NDArray[np.bool_] = np.unique(active, axis=0)
        for row in packed[:_MOST_MODES]:
            self._modes.add(row.tobytes())

    def verdict(self) -> Activity:
        """Return what was found."""
        if not self._small:
            return Activity(several=self.system.m > 0)
        from ...problems.one_solution import may_have_several

        return Activity(may_have_several(self.system, self._K), self._growth())

    def _growth(self) -> float:
        """Return the largest real positive growth rate of the modes met [1/s]."""
        if self.step is None:
            return 0.0
        system, n = self.system, self.system.n
        A, B, D = system.A.dense(), system.B.dense(), system.D.dense()
        E = system.E.dense() / self.step
        worst = 0.0
        for packed in sorted(self._modes):
            on = np.flatnonzero(np.frombuffer(packed, dtype=bool))
            J = np.block([[self._K.dense(), A[:, on]], [B[on], -D[np.ix_(on, on)]]])
            right = np.vstack([E, np.zeros((on.size, n))])
            try:
                factors = np.linalg.eigvals(np.linalg.solve(J, right)[:n])
            except np.linalg.LinAlgError:
                continue
            # the step multiplies by 1/(1 - r h): negative beyond the pole, above 1 before it
            real = factors[np.abs(factors.imag) <= 1e-9 * np.abs(factors)].real
            odd = real[(real < -1e-9) | (real > 1.0 + 1e-9)]
            if odd.size:
                worst = max(worst, float(np.max((1.0 - 1.0 / odd) / self.step)))
        return worst
