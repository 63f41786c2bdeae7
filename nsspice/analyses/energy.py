"""Where the energy of a run went: stored, delivered, dissipated, lost in jumps, lost by the scheme.

A Runge-Kutta step from z0 with rates k_i at its points z_i = z0 + sum a_ij k_j, ending at
z0 + sum w_i k_i, changes the stored energy by exactly

.. math::

    \\Delta W = \\sum_i w_i z_i^T E k_i
        - \\tfrac12 \\sum_{ij} (w_i a_{ij} + w_j a_{ji} - w_i w_j) k_i^T E k_j,

and what the points' laws say of the first sum is delivered minus dissipated power.  The second
sum is what the scheme takes: half of dz' E dz for the implicit step, zero for a closed form whose
points are the nodes of a quadrature.  The balance is asserted for every recorded step.  Steppers
add up the terms of all their steps, recorded or not; these sums, or those of the records where
nothing was left out, must lead from the first stored energy of the run to the last.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

_SUMS = ("stored", "delivered", "dissipated", "lost", "scheme", "turned", "steps", "of")


@dataclass(slots=True)
class Energy:
    """The energy balance of a run.

    Parameters
    ----------
    stored : float
        Change of the stored energy over the steps and all jumps [J].
    delivered : float
        By independent sources [J].
    dissipated : float
        In resistors, controlled sources and set-valued elements [J].
    lost : float
        In jumps [J]: what was stored or delivered and is nowhere afterwards.
    scheme : float
        Taken by the implicit scheme [J].
    turned : float
        All that was delivered and dissipated over the run, and the largest that was stored [J];
        0 if it is not known.
    imbalance : float
        Worst relative error of the balance of a step.
    drift : float
        Relative error of the sums over the run, 0 unless they contain all steps.
    steps, of : int
        Recorded steps, and steps in all.
    whole : bool
        The energies are those of the whole run, not of the recorded steps alone.
    """

    stored: float = 0.0
    delivered: float = 0.0
    dissipated: float = 0.0
    lost: float = 0.0
    scheme: float = 0.0
    turned: float = 0.0
    imbalance: float = 0.0
    drift: float = 0.0
    steps: int = 0
    of: int = 0
    whole: bool = False

    @classmethod
    def from_checks(
        cls,
        result: Mapping[str, Any],
        steps: int,
        balance: Mapping[str, float] | None = None,
        kept: bool = True,
    ) -> Energy:
        """Return the balance of a run of so many steps.

        Parameters
        ----------
        result : mapping
            What the checks have found in the records.
        steps : int
            Steps of the run.
        balance : mapping, optional
            Sums over all of them.
        kept : bool
            False if some jumps are not among the records.
        """
        out = cls(**result["energy"], of=steps)
        if balance is not None:
            out.stored = balance["stored"] + result["jumps_stored"]
            out.delivered = balance["delivered"] + result["jumps_delivered"]
            out.dissipated, out.scheme = balance["dissipated"], balance["scheme"]
            out.turned = balance["turned"]
            out.drift, out.whole = balance["drift"], kept
        elif out.steps == steps and kept:
            out.drift, out.whole = result["drift"], True
        return out

    @property
    def complete(self) -> bool:
        """True if the sums are those of the run."""
        return self.whole

    @property
    def taken(self) -> float:
        """The share of what the run has turned over that its steps themselves have taken."""
        return self.share(self.scheme)

    def share(self, energy: float) -> float:
        """Return an energy [J] as a share of what the run has turned over."""
        return abs(energy) / self.turned if self.turned > 0.0 else 0.0

    @classmethod
    def total(cls, parts: Iterable[Energy]) -> Energy:
        """Return the sum over islands; the imbalance is the worst."""
        out = cls(whole=True)
        for part in parts:
            out.whole &= part.whole
            for name in _SUMS:
                setattr(out, name, getattr(out, name) + getattr(part, name))
            for name in ("imbalance", "drift"):
                if worse(getattr(part, name), getattr(out, name)):
                    setattr(out, name, getattr(part, name))
        return out

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping, energies in joules."""
        return {
            "stored": self.stored,
            "delivered": self.delivered,
            "dissipated": self.dissipated,
            "lost_in_jumps": self.lost,
            "scheme": self.scheme,
            "imbalance": self.imbalance,
            "drift": self.drift,
            "steps": self.steps,
            "of": self.of,
        }


def worse(new: float, old: float) -> bool:
    """Return whether an error is worse than the worst so far; nan is the worst of all."""
    return old == old and not new <= old
