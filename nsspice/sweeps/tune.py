"""Which parameters give the measures wanted.

Gauss-Newton's method takes the derivatives from one pass backwards through each run.  Where there
are none, differences do: runs of the exact engine have no error that these would show.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..analyses.gradients.refusals import UNKNOWN
from ..analyses.request.load import need_circuit, read_again
from ..analyses.studies.batch import run
from ..analyses.studies.objective import Objective
from ..circuit import Circuit
from ..errors import Diagnostic, NsspiceError, UsageError
from .points import Floats


@dataclass(frozen=True, slots=True)
class Tuned:
    """The parameters that were found.

    Parameters
    ----------
    parameters : dict of str to float
    measures : dict of str to float
        What they give.
    reached : bool
        True if all goals are met to the tolerance.
    runs : int
    """

    parameters: dict[str, float]
    measures: dict[str, float]
    reached: bool
    runs: int


def measures_of(circuit: Circuit, parameters: Mapping[str, float]) -> dict[str, float]:
    """Return all measures of a deck run with other values of its parameters."""
    other = read_again(circuit.deck, parameters)
    return {name: value for sol in run(other) for name, value in sol.measures.items()}


def _need_parameters(circuit: Circuit, names: Sequence[str]) -> None:
    for name in names:
        if name not in circuit.deck.parameters:
            known = ", ".join(circuit.deck.parameters) or "none"
            raise UsageError(
                Diagnostic("NS4005", f"the deck has no .param {name}", hint=f"it has {known}")
            )


def _need_measures(known: Mapping[str, float], names: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            listed = ", ".join(known) or "none"
            raise UsageError(
                Diagnostic("NS4005", f"the deck has no measure {name}", hint=f"it has {listed}")
            )


def tune(
    circuit: Circuit,
    parameters: Mapping[str, tuple[float, float]],
    goals: Mapping[str, float],
    *,
    reltol: float = 1e-9,
) -> Tuned:
    """Find parameters for which measures have given values, or come nearest to them.

    Least squares of the relative distances from the goals within the bounds, by scipy's trust
    region reflective method.

    Parameters
    ----------
    circuit : Circuit
        With ``.measure`` cards.
    parameters : mapping of str to (float, float)
        Bounds of each ``.param``; the deck's value is the first guess if it lies between.
    goals : mapping of str to float
        Wanted values of measures.
    reltol : float
        A goal is met to this part of it.

    Returns
    -------
    Tuned

    Raises
    ------
    UsageError
        NS4005 for a parameter or measure that the deck does not have, or bounds that leave nothing.

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
    >>> found = tune(circuit, {"r": (100.0, 10e3)}, {"out": 2.0})
    >>> round(found.parameters["r"], 3), found.reached
    (4000.0, True)
    """
    from scipy.optimize import least_squares

    need_circuit(circuit)
    names, wanted = [n.lower() for n in parameters], {n.lower(): v for n, v in goals.items()}
    _need_parameters(circuit, names)
    low, high = (np.array([bounds[k] for bounds in parameters.values()]) for k in (0, 1))
    if not names or not wanted or not np.all(low < high):
        message = "tuning needs goals, and parameters with bounds (lower bound first)"
        raise UsageError(Diagnostic("NS4005", message, hint="as in don=0.1:0.9 and v_avg=12"))
    target = Objective(circuit, wanted, names)
    guess = np.array([circuit.deck.parameters[name] for name in names])
    start = np.where((guess > low) & (guess < high), (guess - low) / (high - low), 0.5)

    def point(share: Floats) -> Floats:
        return np.asarray(low + share * (high - low))

    exact = True
    differences = 0

    def distances(share: Floats) -> Floats:
        nonlocal exact, differences
        if exact:
            try:
                return target.values(point(share))
            except NsspiceError as problem:
                if problem.diagnostics[0].code not in UNKNOWN:
                    raise
                exact = False
        differences += 1
        found = measures_of(circuit, dict(zip(names, point(share).tolist(), strict=True)))
        _need_measures(found, list(wanted))
        return np.array([(found[n] - goal) / (abs(goal) or 1.0) for n, goal in wanted.items()])

    def slopes(share: Floats) -> Floats:
        if exact:
            return np.asarray(target.jacobian(point(share)) * (high - low))
        step = 1e-6  # of the range: half the digits of runs without error
        ways = np.where(share < 0.5, step, -step) * np.eye(share.size)
        here = distances(share)
        return np.array([(distances(share + way) - here) / way.sum() for way in ways]).T

    result = least_squares(
        distances, start, slopes, bounds=(0.0, 1.0), xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    left = distances(result.x)
    found = {
        name: goal + d * (abs(goal) or 1.0)
        for (name, goal), d in zip(wanted.items(), left.tolist(), strict=True)
    }
    if exact:
        found = dict(target.at(point(result.x)).measures)
    reached = bool(np.all(np.abs(left) <= reltol))
    tuned = dict(zip(names, point(result.x).tolist(), strict=True))
    return Tuned(tuned, found, reached, target.runs + differences)
