"""Period, Floquet multipliers and stability of a periodic steady state."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Periodic:
    """What is known about a periodic steady state beyond its waveforms.

    Parameters
    ----------
    period : float
        [s]
    multipliers : tuple of complex
        Floquet multipliers of all islands, the largest first.
    steps, periods : int
        Steps of Newton's method, and periods run.
    residual : float
        Change over the period, relative to the largest energy coordinates.
    free : tuple of str
        Elements whose charge or flux no law pulls back: it is that of the start.
    tolerance : float
        To which multipliers are known; smaller ones are left out.
    """

    period: float
    multipliers: tuple[complex, ...]
    steps: int
    periods: int
    residual: float
    free: tuple[str, ...] = ()
    tolerance: float = 1e-9

    @property
    def verdict(self) -> str:
        """``stable``, or how the orbit is left.

        Examples
        --------
        >>> Periodic(1e-5, (-1.2 + 0j, 0.3 + 0j), 2, 5, 0.0).verdict
        'unstable: period doubling'
        """
        if not self.multipliers:
            return "stable"
        # what a free charge or flux has is not an instability
        largest = max(self.multipliers, key=abs)
        if abs(largest) <= 1.0 + self.tolerance:
            return "neutral" if abs(largest) >= 1.0 - self.tolerance else "stable"
        if abs(largest.imag) > self.tolerance * abs(largest):
            return "unstable: Neimark-Sacker"
        return "unstable: period doubling" if largest.real < 0.0 else "unstable: fold"

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        return {
            "period": self.period,
            "multipliers": [[m.real, m.imag] for m in self.multipliers],
            "verdict": self.verdict,
            "iterations": self.steps,
            "periods": self.periods,
            "residual": self.residual,
            "free": list(self.free),
            "tolerance": self.tolerance,
        }
