"""Crossovers and margins of a loop gain."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Crossing:
    """Where the loop gain crosses a level.

    Parameters
    ----------
    frequency : float
        [Hz]
    margin : float
        Phase margin [deg] where the magnitude is 1, gain margin [dB] where the phase is -180 deg.
    """

    frequency: float
    margin: float


@dataclass(frozen=True, slots=True)
class LoopReport:
    """Crossovers and margins within the frequencies of the analysis.

    Parameters
    ----------
    crossovers : tuple of Crossing
        Where the magnitude is 1.
    reversals : tuple of Crossing
        Where the phase is an odd multiple of 180 deg.
    """

    crossovers: tuple[Crossing, ...]
    reversals: tuple[Crossing, ...]

    @property
    def phase_margin(self) -> float | None:
        """The least phase margin [deg], None without a crossover."""
        return min((c.margin for c in self.crossovers), key=abs, default=None)

    @property
    def gain_margin(self) -> float | None:
        """The least gain margin [dB], None if the phase does not reach -180 deg."""
        return min((c.margin for c in self.reversals), key=abs, default=None)

    def margins(self) -> dict[str, float]:
        """Return margins and first crossover [Hz] by name, nan where there is none."""
        first = self.crossovers[0].frequency if self.crossovers else None
        found = {
            "phase_margin": self.phase_margin,
            "gain_margin": self.gain_margin,
            "crossover": first,
        }
        return {name: math.nan if v is None else float(v) for name, v in found.items()}

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        return {
            "crossovers": [[c.frequency, c.margin] for c in self.crossovers],
            "reversals": [[c.frequency, c.margin] for c in self.reversals],
            "phase_margin": self.phase_margin,
            "gain_margin": self.gain_margin,
        }
