"""The ladders of ngspice: what bounds its error is its longest step, not its tolerance alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from .problem import Problem
from .reference import Reference
from .report import Measurement
from .timer import Timer

#: ladders by name: what distinguishes them.  ngspice's own integration method is the trapezoid, and
#: its own tolerance 1e-3; with Gear's method sharp diodes do not ring.
LADDERS: Mapping[str, Mapping[str, Any]] = {
    "ngspice": {"method": "gear", "reltol": 1e-3},
    "ngspice-trap": {"method": "trap", "reltol": 1e-3},
    "ngspice-tight": {"method": "trap", "reltol": 1e-6},
    "ngspice-junction": {"method": "gear", "reltol": 1e-3, "junction": 0.01},
}

#: longest steps, in units of the usual one
_STEPS = (4.0, 1.0, 1.0 / 4.0, 1.0 / 16.0)
_PATIENCE = 10.0  # [s] with one run of ngspice at least, its start included


def measure(
    problem: Problem,
    name: str,
    reference: Reference,
    limit: float,
    timer: Timer,
    say: Callable[[str], None],
) -> list[Measurement]:
    """Run one ladder of ngspice from coarse to fine.

    Parameters
    ----------
    problem : Problem
    name : str
        Of ``LADDERS``.
    reference : Reference
    limit : float
        The ladder ends before a run that would take longer [s]; one that does all the same is given
        up, after 10 s at least.
    timer : Timer
    say : callable
        Called with a sentence before each run.

    Returns
    -------
    list of Measurement
        Also of runs that failed; none if ngspice would do the same as in another ladder.
    """
    from .. import ngspice
    from ..ngspice.translate import usual_step

    rows, nan = problem.analysis.rows(), float("nan")
    found: list[Measurement] = []

    def once(step: float) -> ngspice.NgspiceRun:
        return ngspice.run(
            problem.circuit,
            problem.analysis,
            problem.signals,
            max_step=step,
            timeout=max(_PATIENCE, limit),
            **LADDERS[name],
        )

    def time(step: float) -> float:
        return once(step).seconds

    for part in _STEPS:
        step = part * usual_step(problem.analysis)
        say(f"{name} h<={step:.3g}")
        try:
            run = once(step)
        except ngspice.NgspiceError as failure:
            note = f"fails: {failure.reason}"
            found.append(Measurement(name, "h<", step, 0, nan, nan, nan, nan, note))
            if failure.reason == "time-out":
                break  # shorter steps take no less time
            continue
        if run.translation.exact and name == "ngspice-junction":
            return []  # no set-valued diode: the same runs once more
        seconds = timer.least(name, step, run.seconds, partial(time, step))
        table = np.column_stack([np.interp(rows, run.time, run[s]) for s in problem.signals])
        error, l1 = reference.distance(table)
        found.append(Measurement(name, "h<", step, run.points, error, l1, seconds))
        if 4.0 * seconds > limit:
            break
    return found
