"""How far a solution lies from the exact one, by its own account."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class ErrorEstimate:
    """How far a solution lies from the exact one, by its own account.

    Parameters
    ----------
    value : float
        Largest error at the rows of the stored quantities (voltages of capacitors and of junctions
        that store charge, currents of inductors), as a share of their range.  What jumps is as
        accurate on both sides of a jump.
    signal : str
        The signal with that error.
    how : str
        How it was found, one sentence.
    order : float
        Observed order in the step, nan if none was observed.
    tolerance : float
        What was asked for, nan if nothing was.
    """

    value: float
    signal: str
    how: str
    order: float = float("nan")
    tolerance: float = float("nan")

    @property
    def reached(self) -> bool:
        """False if a tolerance was asked for and missed."""
        return math.isnan(self.tolerance) or self.value <= self.tolerance

    def describe(self) -> str:
        """Return one line."""
        where = f" of the range of {self.signal}" if self.signal else ""
        text = f"error about {self.value:.1e}{where}: {self.how}"
        return text if self.reached else f"{text}; {self.tolerance:g} was requested"

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {
            "value": self.value,
            "signal": self.signal,
            "how": self.how,
            "order": self.order,
            "tolerance": self.tolerance,
            "reached": self.reached,
        }
