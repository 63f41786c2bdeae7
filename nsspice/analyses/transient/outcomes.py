"""How the run of an island ends before its time, and which sources jump in it."""

from __future__ import annotations

from itertools import pairwise

from ...errors import Diagnostic, UsageError
from ...problems.descriptor import Waveform
from ...solvers.modewise import NotModewise
from ...solvers.stepper import UnsolvedStep
from ..signals.curve import Floats


def refused(number: int, reason: NotModewise) -> UsageError:
    """Return the error of an island that the exact engine cannot handle."""
    return UsageError(
        Diagnostic(
            "NS4020",
            f"method=modewise cannot handle island {number + 1}: {reason}",
            hint="method=auto chooses a method that can",
        )
    )


def jumps(waveform: Waveform) -> bool:
    """Return whether a source may jump.

    Examples
    --------
    >>> jumps(Waveform("pwl", (0.0, 0.0, 1.0, 0.0, 1.0, 5.0)))
    True
    """
    values = waveform.values
    if waveform.handed is not None:
        return True
    if waveform.kind == "pulse":
        return values[3] == 0.0 or values[4] == 0.0
    times = values[::2]
    return waveform.kind == "pwl" and any(a == b for a, b in pairwise(times))


class HighIndex(UnsolvedStep):
    """Steps with error control have met a mode whose index is above 2."""


class Stopped(Exception):
    """A step failed after some rows."""

    def __init__(self, rows: Floats, problem: UnsolvedStep) -> None:
        super().__init__()
        self.rows, self.problem = rows, problem
