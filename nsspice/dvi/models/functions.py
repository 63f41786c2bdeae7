r"""Differential variational inequalities given by Python functions: the slow path.

Each step of (3.5) is the variational inequality over :math:`\mathbb{R}^n \times K` of

.. math::

    H(x, u) = \begin{pmatrix} x - x_i - h f(t_m, x_m, u) \\ g(t_{i+1}, x, u) \end{pmatrix}

with ``x_m = theta x + (1 - theta) x_i``, solved by Newton's method on its natural map.

Source: T. Roubal (2015), section 3.3.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...analyses.certificate.certificate import Certificate
from ...analyses.solution.solution import IslandRun, Solution
from ..terms.errors import wrong
from ..terms.sets import Cone, SecondOrderCone, Set
from .projection import newton
from .vi import differences

Floats = npt.NDArray[np.float64]
Function = Callable[[float, Floats, Floats], Any]


class FunctionDVI:
    """A DVI whose f and g are Python functions of ``(t, x, u)``.

    Parameters
    ----------
    f, g : callable
        Rates, shape (n,), and the function of the inequality, shape (m,).
    K : Set or sequence of Set
        One interval or second-order cone for all components of u, or one interval for each.
    x0 : array_like, shape (n,)
    u0 : array_like, shape (m,)
        Starting point of Newton's method.
    df, dg : callable, optional
        Derivatives with respect to ``(x, u)``, shapes (n, n + m) and (m, n + m); finite differences
        without them.
    at : float
        Instant of the start [s].

    Raises
    ------
    UsageError
        NS6003 if shapes do not fit, NS6005 for a polyhedron.

    Examples
    --------
    A block with dry friction, once more, as ``v' = -u`` and ``-v`` in the normal cone of [-1, 1]:

    >>> block = FunctionDVI(lambda t, x, u: -u, lambda t, x, u: -x, Cone(-1.0, 1.0), [3.0], [0.0])
    >>> sol = block.run(5.0, step=0.01)
    >>> bool(abs(sol["x[0]"][-1]) < 1e-12)
    True
    """

    def __init__(
        self,
        f: Function,
        g: Function,
        K: Set | Sequence[Set],
        x0: npt.ArrayLike,
        u0: npt.ArrayLike,
        *,
        df: Function | None = None,
        dg: Function | None = None,
        at: float = 0.0,
    ) -> None:
        self.x0 = np.atleast_1d(np.asarray(x0, dtype=np.float64))
        self.u0 = np.atleast_1d(np.asarray(u0, dtype=np.float64))
        self.f, self.g, self.df, self.dg, self.at = f, g, df, dg, float(at)
        n, m = self.x0.size, self.u0.size
        sets = [K] if isinstance(K, SecondOrderCone) else [K] * m if isinstance(K, Cone) else K
        if not isinstance(sets, Sequence) or not all(
            isinstance(part, Cone | SecondOrderCone) for part in sets
        ):
            raise wrong("NS6005", "K of a function must be an interval or a second-order cone", "")
        whole = np.arange(n, n + m)
        self._blocks: list[tuple[npt.NDArray[np.int64], Set]]
        if isinstance(K, SecondOrderCone):
            self._blocks = [(whole, K)]
        elif len(sets) != m:
            raise wrong("NS6003", f"{len(sets)} sets for {m} components of u", "")
        else:
            self._blocks = [(whole[k : k + 1], part) for k, part in enumerate(sets)]
        for name, size, value in (
            ("f", n, f(self.at, self.x0, self.u0)),
            ("g", m, g(self.at, self.x0, self.u0)),
        ):
            if np.shape(np.atleast_1d(value)) != (size,):
                raise wrong(
                    "NS6003", f"{name} returns the shape {np.shape(value)}, not ({size},)", ""
                )

    def run(self, stop: float, *, step: float, theta: float = 1.0, variant: int = 1) -> Solution:
        """Return the trajectory by fixed steps.

        Parameters
        ----------
        stop, step : float
            Length of the run and of a step [s].
        theta : float
            Weight of the new state in f.
        variant : int
            1: the inequality at the new state, 2: at the old one.

        Raises
        ------
        NumericalError
            NS6020 if a step has no solution.
        """
        if not 0.0 <= theta <= 1.0 or variant not in (1, 2):
            raise wrong("NS6004", f"theta = {theta}, variant = {variant}", "0 to 1, and 1 or 2")
        if not (np.isfinite([stop, step]).all() and 0.0 < step <= stop):
            raise wrong("NS6004", f"steps of {step} in a run of {stop}", "give 0 < step <= stop")
        begun = clock.perf_counter()
        count = max(1, int(np.ceil(stop / step * (1.0 - 1e-12))))
        h, n = stop / count, self.x0.size
        times = self.at + h * np.arange(count + 1, dtype=np.float64)
        table = np.zeros((count + 1, n + self.u0.size))
        table[0] = np.concatenate([self.x0, self.u0])
        worst = 0.0
        for k in range(count):
            begin = table[k].copy()
            if variant == 2:  # the inequality first, and its u in the step
                begin[n:], residual = self._inequality(table[k], float(times[k + 1]))
                worst = max(worst, residual)
            H, J = self._step(begin, float(times[k]), h, theta, variant)
            table[k + 1], residual = newton(H, J, self._blocks, begin)
            worst = max(worst, residual)
        names = [f"x[{k}]" for k in range(n)] + [f"u[{k}]" for k in range(self.u0.size)]
        stats = {"steps": count, "residual": worst}
        run = IslandRun(
            1, "DVI", "Python functions", "scheme", n + self.u0.size, self.u0.size, theta, h, stats
        )
        return Solution(
            "tran",
            "",
            "time",
            times,
            {name: table[:, j] for j, name in enumerate(names)},
            names,
            islands=[run],
            certificate=Certificate(worst, worst, count),
            wall_time=clock.perf_counter() - begun,
        )

    def _inequality(self, old: Floats, end: float) -> tuple[Floats, float]:
        """Return a solution u of the inequality at an old state, and its residual."""
        n, x = self.x0.size, old[: self.x0.size]
        blocks = [(index - n, K) for index, K in self._blocks]

        def g(u: Floats) -> Floats:
            return np.atleast_1d(np.asarray(self.g(end, x, u), dtype=np.float64))

        dg = self.dg
        if dg is None:
            return newton(g, lambda u: differences(g, u), blocks, old[n:])
        return newton(g, lambda u: np.atleast_2d(dg(end, x, u))[:, n:], blocks, old[n:])

    def _step(
        self, begin: Floats, t: float, h: float, theta: float, variant: int
    ) -> tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]:
        """Return H and its derivative for a step; of variant 2 u is that of ``begin``."""
        n = self.x0.size
        old, given = begin[:n], begin[n:]
        middle, end = t + theta * h, t + h

        def H(y: Floats) -> Floats:
            x, u = y[:n], y[n:]
            mean = theta * x + (1.0 - theta) * old
            rate = np.atleast_1d(self.f(middle, mean, u))
            last = self.g(end, x, u) if variant == 1 else u - given
            return np.concatenate([x - old - h * rate, np.atleast_1d(last)])

        df, dg = self.df, self.dg
        if df is None or dg is None:
            return H, lambda y: differences(H, y)

        def J(y: Floats) -> Floats:
            x, u = y[:n], y[n:]
            by_f = np.atleast_2d(df(middle, theta * x + (1.0 - theta) * old, u))
            out = np.eye(y.size)
            out[:n] -= h * np.hstack([theta * by_f[:, :n], by_f[:, n:]])
            if variant == 1:
                out[n:] = np.atleast_2d(dg(end, x, u))
            return out

        return H, J
