"""Euler-Newton path following for generalized equations.

Both methods follow z(t) with ``p(t) in g(z) + F(z)`` by a predictor and a corrector that each solve
one problem in which g alone is linearised.  For strongly regular solutions the error on the grid is
O(h^4), between grid points O(h), that of the predictor alone O(h^2).

References: R. Cibulka, T. Roubal, *Solution stability and path-following for a class of generalized
equations* (2017), (21) and (22); T. Roubal, *Non-smooth analysis in engineering and economics*
(2015), (3.2) and (3.4); A. L. Dontchev, M. I. Krastanov, R. T. Rockafellar, V. M. Veliov, *An
Euler-Newton continuation method for tracking solution trajectories of parametric variational
inequalities*, SIAM J. Control Optim. 51 (2013) 1823-1840.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..problems.generalized import GeneralizedEquation
from .generalized import Data, Path, follow, rows


def track(
    problem: GeneralizedEquation,
    t: npt.ArrayLike,
    p: Data,
    *,
    rate: Data | None = None,
    errors: npt.ArrayLike | None = None,
    correctors: int | None = None,
    start: npt.ArrayLike | None = None,
) -> Path:
    """Follow a path of solutions over a grid.

    Parameters
    ----------
    problem : GeneralizedEquation
    t : array_like, shape (k,)
        Grid, usually uniform.
    p : callable or array_like, shape (k, n)
        ``p(t)``, or its values on the grid: measured values will do.
    rate : callable or array_like, shape (k, n), optional
        ``p'(t)``.  With it the predictor is (3.2): data of the old point and their rate; without it
        (3.4): data of the new point.
    errors : array_like, shape (k - 1, n), optional
        What is added to p in each predictor: errors of size O(h^2) keep the order.
    correctors : int, optional
        Newton steps after the predictor; 1, or 3 if g has kinks, by default.
    start : array_like, shape (n,), optional
        First point of the path, taken as it is (an error O(h^4) keeps the order); solved for
        without it.

    Returns
    -------
    Path

    Raises
    ------
    RegularityLost
        If a linearised problem has no solution, or the equations do not hold at a point: the path
        has ended, or the step is too long.
    ValueError
        If data are not finite.

    Examples
    --------
    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.op("asinh", tape.unknown(0)))
    >>> problem = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),))
    >>> t = 0.01 * np.arange(1001)
    >>> path = track(problem, t, lambda s: 4.0 * np.sin(s), start=[0.0])
    >>> p = 4.0 * np.sin(t)
    >>> exact = np.sinh(p - np.clip(p, -1.0, 1.0))
    >>> f"{abs(path.z[:, 0] - exact).max():.4e}"
    '2.2500e-07'
    """
    times = np.ascontiguousarray(t, dtype=np.float64)
    none = np.zeros_like(problem.offsets())
    options = {
        "by_rate": rate is not None,
        "rates": None if rate is None else rows(problem, times, rate, none),
        "errors": None,
        "correctors": correctors,
    }
    if errors is not None:
        options["errors"] = rows(problem, times[1:], errors, none)
    return follow(problem, times, p, start=start, tracking=options)
