"""What tolerances of parameters do to measures: corners and samples of a sweep."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analyses.request.load import need_circuit
from ..analyses.request.notebook_progress import Progress
from ..analyses.request.targets import nominal, target_of
from ..circuit import Circuit
from ..errors import Diagnostic, UsageError
from .points import Floats, How, Points, Tolerance, corners, samples
from .run import sweep

if TYPE_CHECKING:
    from concurrent.futures import Executor

_QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)


@dataclass(frozen=True, slots=True)
class Spread:
    """What a measure does over a tolerance.

    Parameters
    ----------
    measure : str
    nominal, low, high : float
        With the parameters as they are, and the least and largest value met anywhere.
    mean, deviation : float
        Of the random runs.
    quantiles : tuple of (float, float)
        Shares of the random runs, and the values below which they lie.
    failed : int
        Runs that have no such value: they are left out.
    """

    measure: str
    nominal: float
    low: float
    high: float
    mean: float
    deviation: float
    quantiles: tuple[tuple[float, float], ...]
    failed: int = 0


def tolerance(
    circuit: Circuit,
    parameters: Mapping[str, float],
    *,
    runs: int = 200,
    seed: int = 0,
    how: How = "random",
    workers: int | None = None,
    executor: Executor | str | Any | None = None,
    progress: Progress | None = None,
) -> list[Spread]:
    """Find how far tolerances spread the measures of a deck.

    All corners are run (of more than eight names those in which one is at its end), and values
    between them, evenly distributed.

    Parameters
    ----------
    circuit : Circuit
        With ``.measure`` cards.
    parameters : mapping of str to float
        Relative tolerance of each ``.param``, element or model parameter: 0.05 for 5 %.
    runs : int
        Random runs.
    seed : int
        The same seed gives the same values.
    how : str
        ``random``, ``latin`` or ``sobol`` samples.
    workers, executor, progress
        As for :func:`nsspice.sweep`.

    Returns
    -------
    list of Spread
        One for each measure.

    Raises
    ------
    UsageError
        NS4005 for a name that the deck does not have; the error of the deck itself, if it cannot
        be run as it is.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''divider
    ... .param r=1k
    ... V1 a 0 10
    ... R1 a b {r}
    ... R2 b 0 1k
    ... .op
    ... .measure op out find v(b) at=0
    ... ''')
    >>> (out,) = tolerance(circuit, {"r": 0.1}, runs=5)
    >>> round(out.low, 6), round(out.high, 6)
    (4.761905, 5.263158)
    """
    need_circuit(circuit)
    laws = {name.lower(): Tolerance(share) for name, share in parameters.items()}
    own = {name: nominal(circuit, target_of(circuit, name)) for name in laws}
    parts = [np.array([[*own.values()]]), corners(laws, own.__getitem__).values]
    if runs:
        drawn = samples(laws, runs, how=how, seed=seed, nominal=own.__getitem__)
        parts.append(drawn.values)
    points = Points(tuple(laws), np.vstack(parts))
    table = sweep(circuit, points, workers=workers, executor=executor, progress=progress)
    if table.interrupted:
        raise KeyboardInterrupt
    if table.failures and table.failures[0].point == 0:
        first = table.failures[0]
        hint = "nsspice run it first"
        raise UsageError(Diagnostic(first.code, first.message, hint=hint))
    return [_spread(name, table[name], len(points) - runs) for name in table.measures]


def _spread(measure: str, column: Floats, first: int) -> Spread:
    """Return the spread of one measure; its random runs begin with the row ``first``."""
    drawn = column[first:][np.isfinite(column[first:])]
    return Spread(
        measure,
        float(column[0]),
        float(np.nanmin(column)),
        float(np.nanmax(column)),
        float(drawn.mean()) if drawn.size else math.nan,
        float(drawn.std(ddof=1)) if drawn.size > 1 else math.nan,
        tuple((q, float(np.quantile(drawn, q))) for q in _QUANTILES) if drawn.size else (),
        int(np.isnan(column).sum()),
    )
