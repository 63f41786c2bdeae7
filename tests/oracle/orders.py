"""Observed orders of convergence, measured so that switchings do not blur them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from .closed_forms import Floats

Errors = Mapping[str, float]

#: how many nearby steps are averaged, and by how much span/h grows from one to the next: multiples
#: of the golden ratio fall evenly within a step, wherever a switching lies
CLUSTER, GROWTH = 32, 0.6180339887498949


def sup(got: Floats, exact: Floats) -> float:
    """Return the largest deviation."""
    return float(np.abs(got - exact).max())


def mean(got: Floats, exact: Floats) -> float:
    """Return the L1 norm of the deviation divided by the length of the window (uniform grid)."""
    return float(np.abs(got - exact).mean())


def observed(
    errors: Callable[[float], Errors], steps: Sequence[float], span: float | None = None
) -> dict[str, float]:
    """Return the order of every error: least-squares slope of log(error) over log(step).

    Parameters
    ----------
    errors : callable
        Errors by name of a run with the given step [s].
    steps : sequence of float
        Step sizes.
    span : float, optional
        With a time span [s] each step stands for a cluster of nearby ones, over which errors are
        averaged; otherwise where a switching falls within its step would blur the order.
    """
    x, levels = [], []
    for h in steps:
        near = [h] if span is None else [span / (span / h + GROWTH * j) for j in range(CLUSTER)]
        x.append(np.log(np.mean(near)))
        levels.append([errors(step) for step in near])
    out = {}
    for name in levels[0][0]:
        y = np.log([np.mean([r[name] for r in level]) for level in levels])
        out[name] = float(np.polyfit(x, y, 1)[0])
    return out
