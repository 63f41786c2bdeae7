"""How far the waveforms of ngspice lie from those of nsspice, at the rows of nsspice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...analyses.request.cards import Tran
from ...analyses.signals.curve import Curve
from ...analyses.signals.signal_names import unit
from ...analyses.solution.solution import Floats, Solution
from ...errors import Diagnostic, UsageError
from .options import Options
from .result import NgspiceRun

#: signals smaller than this share of the largest of their unit are measured against that one
_SMALL = 1e-3


@dataclass(frozen=True, slots=True)
class SignalDistance:
    """The distance of one signal.

    Parameters
    ----------
    signal : str
    maximum, l1, rms : float
        Largest difference, its mean over the window, and the root of the mean square.
    sharp : float
        Largest difference without the slack in time.
    span : float
        What the differences are measured against: the range of the signal in ngspice, at least a
        thousandth of the largest of its unit and a thousand times ngspice's tolerance.
    """

    signal: str
    maximum: float
    l1: float
    rms: float
    sharp: float
    span: float

    def by_name(self, norm: str) -> float:
        """Return ``max``, ``l1`` or ``rms``."""
        return {"max": self.maximum, "l1": self.l1, "rms": self.rms}[norm]

    def share(self, norm: str) -> float:
        """Return ``max``, ``l1`` or ``rms`` as a share of the range."""
        value = self.by_name(norm)
        if value == 0.0:
            return 0.0
        return value / self.span if self.span else float("inf")

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {
            "signal": self.signal,
            "max": _finite(self.maximum),
            "max_without_slack": _finite(self.sharp),
            "l1": _finite(self.l1),
            "rms": _finite(self.rms),
            "range": _finite(self.span),
            "max_share": _finite(self.share("max")),
            "l1_share": _finite(self.share("l1")),
        }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def default_slack(run: NgspiceRun) -> float:
    """Return by how much an instant may differ [s].

    Where ngspice has every law, not at all.  A sharp substitute changes over within a step of
    ngspice instead of at an instant, and an ideal edge is a ramp.
    """
    options = run.translation.options
    if run.translation.exact or not isinstance(run.translation.analysis, Tran):
        return 0.0
    return 2.0 * (options.max_step or 0.0) + (options.edge or 0.0)


def distances(
    solution: Solution,
    run: NgspiceRun,
    signals: Sequence[str],
    window: tuple[float | None, float | None] = (None, None),
    slack: float = 0.0,
) -> list[SignalDistance]:
    """Return the distances of all signals.

    Parameters
    ----------
    solution : Solution
    run : NgspiceRun
    signals : sequence of str
    window : (float or None, float or None)
        Begin and end [s], or of the swept value.
    slack : float
        A row agrees with every value that ngspice takes within this time from it [s].
    """
    rows = rows_of(solution, run, window, slack)
    found = []
    for name in signals:
        x, loose, sharp, at = _differences(solution, run, name, rows, slack)
        span = float(np.ptp(at))
        # rounding is not a range
        if span <= 1e-9 * float(np.max(np.abs(at), initial=0.0)):
            span = float(np.max(np.abs(at), initial=0.0))
        curve, largest = Curve(x, loose), float(loose.max())
        distance = (largest, curve.mean(), curve.rms(), float(sharp.max()), span)
        found.append(SignalDistance(name, *distance))
    return [_floored(one, found, run.translation.options) for one in found]


def _differences(
    solution: Solution, run: NgspiceRun, name: str, rows: Any, slack: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return abscissa, differences with and without slack, and ngspice's values at the rows."""
    own, other = solution[name][rows], run[name]
    if not isinstance(run.translation.analysis, Tran):
        sharp = np.abs(own - other[rows])
        return np.arange(own.size, dtype=np.float64), sharp, sharp, other[rows]
    t = solution.axis[rows]
    at = np.interp(t, run.axis, other)
    sharp = np.abs(own - at)
    if not slack:
        return t, sharp, sharp, at
    low, high = band(run.axis, other, t, slack)
    return t, np.maximum(0.0, np.maximum(own - high, low - own)), sharp, at


def difference(
    solution: Solution, run: NgspiceRun, name: str, slack: float
) -> tuple[Floats, Floats]:
    """Return the rows that can be compared and the difference of one signal there.

    Parameters
    ----------
    solution : Solution
    run : NgspiceRun
    name : str
        The signal.
    slack : float
        [s]
    """
    rows = rows_of(solution, run, (None, None), slack)
    return solution.axis[rows], _differences(solution, run, name, rows, slack)[1]


def _floored(
    one: SignalDistance, everything: Sequence[SignalDistance], options: Options
) -> SignalDistance:
    """Return a distance whose range is neither tiny next to the others of its unit nor noise."""
    largest = max(d.span for d in everything if unit(d.signal) == unit(one.signal))
    noise = options.vntol if unit(one.signal) == "V" else options.abstol
    span = max(one.span, _SMALL * largest, noise / _SMALL)
    return replace(one, span=span)


def rows_of(
    solution: Solution,
    run: NgspiceRun,
    window: tuple[float | None, float | None],
    slack: float,
) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return which rows take part: those of the window for which ngspice has values.

    With ``uic`` ngspice leaves the circuit unsolved at the first instant, and of an edge at the end
    of the run it has one side only.
    """
    axis = solution.axis
    start, stop = window
    inside = np.ones(axis.size, dtype=bool)
    if solution.axis_name:
        inside &= (axis >= start) if start is not None else True
        inside &= (axis <= stop) if stop is not None else True
    if isinstance(run.translation.analysis, Tran):
        end = float(run.axis[-1]) * (1.0 + 1e-12) - slack
        inside &= (axis >= float(run.axis[0])) & (axis <= end)
    if not np.any(inside):
        raise UsageError(
            Diagnostic("NS4011", "there is no row to compare", hint="check --from and --to")
        )
    return inside


def band(x: Floats, y: Floats, at: Floats, slack: float) -> tuple[Floats, Floats]:
    """Return the smallest and the largest value of a broken line near some abscissae.

    Parameters
    ----------
    x, y : ndarray, shape (k,)
        Corners of the line, x rising.
    at : ndarray, shape (m,)
    slack : float
        Half the width of the neighbourhood.

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 2.0])
    >>> low, high = band(x, np.array([0.0, 4.0, 0.0]), np.array([0.75, 2.0]), 0.5)
    >>> low.tolist(), high.tolist()
    ([1.0, 0.0], [4.0, 2.0])
    """
    left = np.interp(at - slack, x, y)
    right = np.interp(at + slack, x, y)
    low, high = np.minimum(left, right), np.maximum(left, right)
    first = np.searchsorted(x, at - slack, "left")
    last = np.searchsorted(x, at + slack, "right")
    some = last > first  # reduceat takes index pairs; equal ones would give a single element
    if np.any(some):
        padded = np.append(y, y[-1])
        pairs = np.column_stack([first[some], last[some]]).ravel()
        low[some] = np.minimum(low[some], np.minimum.reduceat(padded, pairs)[::2])
        high[some] = np.maximum(high[some], np.maximum.reduceat(padded, pairs)[::2])
    return low, high
