"""Josephy-Newton steps on an assembled static problem with data given from outside.

References: N. H. Josephy, *Newton's method for generalized equations* (1979); A. L. Dontchev,
R. T. Rockafellar, *Implicit Functions and Solution Mappings* (Springer, 2014), ch. 6.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ... import _core
from ...devices.waves import wave_values
from ...problems.csc import Csc
from ...solvers.compiled import core_tape
from ...solvers.mlcp import solve_mlcp
from ..terms.errors import unsolved
from .assembly import Assembly

Floats = npt.NDArray[np.float64]

_MOST = 60
#: of two Newton steps: below 1/2 the start lies where Newton's method converges quadratically to
#: the one solution around it (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, sec. 2.1)
_CONTRACTS = 0.25
#: a Newton step below so many rounding units of the largest unknown changes nothing that is known
_UNITS = 32.0 * 2.0**-53
#: quadratic convergence squares what is left: from here on the next step is below rounding
_CLOSE = 2.0**-26
#: of a sum, per term (Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.1)
_ROUNDING = 2.0**-52


class NotNear(Exception):
    """Newton's method does not contract from the last solution."""


class StepProblem:
    """One static problem solved again and again, each time near the last solution.

    Parameters
    ----------
    assembly : Assembly
        Its signals may be names that end in ``#old``, which are given.
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        system = assembly.system
        self.point = np.zeros(system.n), np.zeros(system.m)
        self.residual, self.solved = 0.0, 0
        #: solutions far from the last one are none: Newton's method has to contract at once
        self.near = False
        self._G = system.G.dense()
        self._A, self._B, self._D = (x.dense() for x in (system.A, system.B, system.D))
        self._active = np.zeros(system.m, dtype=bool)
        self._S = system.S.dense()
        self._data: tuple[Floats, Floats] = (np.zeros((1, 0)), np.zeros(1))
        self._F = None if system.smooth is None else system.smooth.F.dense()

    def solve(self, old: Mapping[str, float], begin: float, end: float) -> dict[str, float]:
        """Return the variables by name.

        Parameters
        ----------
        old : mapping of str to float
            The variables of the last step.
        begin, end : float
            Its instant and the new one [s].

        Raises
        ------
        NumericalError
            NS6020 without a solution.
        """
        assembly = self.assembly
        system = assembly.system
        data = self._S @ self._signals(old, begin, end)
        z, lam = self.point
        if system.smooth is None:
            z, lam = self._linear(self._G, data, end)
        else:
            given = np.array([[_given(name, old, begin) for name in assembly.given]])
            z, lam = self._newton(data, given, end, z, lam)
        self.point = z, lam
        row, many = z[None], lam[None]
        return {name: float(assembly.read(name, row, many)[0]) for name in assembly.places}

    def _signals(self, old: Mapping[str, float], begin: float, end: float) -> Floats:
        values = []
        for signal in self.assembly.signals:
            if signal == "1":
                values.append(1.0)
            elif signal == "time":
                values.append(end)
            elif signal.endswith("#old"):
                values.append(_given(signal, old, begin))
            else:
                values.append(float(wave_values(signal, np.array([end]))[0]))
        return np.array(values)

    def _linear(self, K: Floats, b: Floats, time: float) -> tuple[Floats, Floats]:
        """Return unknowns and multipliers of the complementarity problem with the matrix K."""
        self.solved += 1
        again = self._same_mode(K, b)
        if again is not None:
            return again
        system = self.assembly.system
        found = solve_mlcp(
            Csc.from_dense(K), system.A, system.B, system.D, b, system.q,
            row_kind=system.row_kind, start=self.point,
        )  # fmt: skip
        if not found.solved:
            raise unsolved(
                f"the step to t = {time:.9g} has no solution (residual "
                f"{max(found.residual_rows, found.residual_complementarity):.2g})",
                "use a shorter step, or theta=1",
                time=time,
                residual=found.residual_rows,
            )
        self.residual = max(self.residual, found.residual_rows, found.residual_complementarity)
        self._active = found.lam > 0.0
        return found.z, found.lam

    def _same_mode(self, K: Floats, b: Floats) -> tuple[Floats, Floats] | None:
        """Return the solution in the mode of the last one, None where its signs are not met."""
        on = np.flatnonzero(self._active)
        n, system = b.size, self.assembly.system
        J = np.empty((n + on.size, n + on.size))
        J[:n, :n], J[:n, n:] = K, self._A[:, on]
        J[n:, :n], J[n:, n:] = self._B[on], -self._D[np.ix_(on, on)]
        right = np.concatenate([b, system.q[on]])
        try:
            x = np.linalg.solve(J, right)
        except np.linalg.LinAlgError:
            return None
        defect = np.abs(J @ x - right)
        size = np.abs(J) @ np.abs(x) + np.abs(right)
        bound = _ROUNDING * (n + on.size)
        if not np.all(defect <= bound * size):
            return None
        z, lam = x[:n], np.zeros(system.m)
        lam[on] = x[n:]
        w = system.q - self._B @ z + self._D @ lam
        w[on] = 0.0
        if np.any(lam < 0.0) or np.any(w < 0.0):
            return None
        if size.size:
            self.residual = max(self.residual, float(np.max(defect / np.maximum(size, 1e-300))))
        return z, lam

    def _newton(
        self, data: Floats, given: Floats, time: float, z: Floats, lam: Floats
    ) -> tuple[Floats, Floats]:
        assert self._F is not None
        self._data = given, np.array([time])
        change, first = np.inf, np.inf
        for count in range(_MOST):
            values, J = self._evaluated(z)
            K = self._G + self._F @ J
            self.point = z, lam
            new, lam = self._linear(K, data - self._F @ (values - J @ z), time)
            moved = float(np.max(np.abs(new - z), initial=0.0))
            z, size = new, float(np.max(np.abs(new), initial=0.0))
            if not J.any():  # functions of the data alone: the problem was linear
                return z, lam
            if self.near and count == 1 and moved > _CONTRACTS * first and moved > _CLOSE * size:
                raise NotNear
            first = moved if count == 0 else first
            # steps that shrink no more are rounding of the functions themselves
            stalled = moved >= 0.5 * change and moved <= _CLOSE * size
            if moved <= _UNITS * size or stalled:
                return z, lam
            change = moved
        raise unsolved(
            f"Newton's method does not converge in the step to t = {time:.9g} (last change "
            f"{moved:.2g})",
            "use a shorter step",
            time=time,
        )

    def _evaluated(self, z: Floats) -> tuple[Floats, Floats]:
        """Return the smooth functions at a point, shape (p,), and their derivatives (p, n)."""
        smooth = self.assembly.system.smooth
        assert smooth is not None
        values, places, slopes = _core.tape_values(core_tape(smooth.tape), z[None], *self._data)
        values, slopes = np.asarray(values).ravel(), np.asarray(slopes).ravel()
        J = np.zeros((values.size, z.size))
        for entry, (function, variable) in enumerate(places):
            if variable < z.size:
                J[function, variable] += slopes[entry]
        return values, J

    def matrix(self) -> Floats:
        """Return the matrix of the linearised equations at the last solution, shape (n, n)."""
        if self._F is None:
            return self._G
        return np.asarray(self._G + self._F @ self._evaluated(self.point[0])[1])

    def jacobian(self, z: Floats) -> Floats:
        """Return the derivatives of the smooth functions at the data of the last solution."""
        return self._evaluated(z)[1]


def _given(name: str, old: Mapping[str, float], begin: float) -> float:
    return begin if name == "time#old" else old[name[: -len("#old")]]
