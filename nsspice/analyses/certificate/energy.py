"""Where the energy of a run went: stored, delivered, dissipated, lost in jumps, lost by the scheme.

A Runge-Kutta step from z0 with rates k_i at its points z_i = z0 + sum a_ij k_j, ending at
z0 + sum w_i k_i, changes the stored energy by exactly

.. math::

    \\Delta W = \\sum_i w_i z_i^T E k_i
        - \\tfrac12 \\sum_{ij} (w_i a_{ij} + w_j a_{ji} - w_i w_j) k_i^T E k_j,

and what the points' laws say of the first sum is delivered minus dissipated power.  The second
sum is what the scheme takes: half of dz' E dz for the implicit step, zero for a closed form whose
points are the nodes of a quadrature.  Steppers add up the terms of all their steps, recorded or
not; these sums must lead from the first stored energy of the run to the last.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

_SUMS = ("stored", "delivered", "dissipated", "lost", "scheme", "turned", "steps", "of")


@dataclass(slots=True)
class Jumped:
    """Energies of all jumps of a run: change of what is stored, and what sources gave [J]."""

    stored: float = 0.0
    delivered: float = 0.0

    def add(self, before: float, after: float, delivered: float) -> None:
        """Take the energy that is stored before and after a jump, and what the sources gave."""
        self.stored += after - before
        self.delivered += delivered


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
        In jumps [J]: what was stored or delivered and is nowhere afterwards; what the
        shortest implicit steps take, by which an instant is passed over, is lost there, too.
    scheme : float
        Taken by the implicit scheme [J].
    turned : float
        All that was delivered and dissipated over the run, and the largest that was stored [J];
        0 if it is not known.
    drift : float
        Relative error of the sums over the run.
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
    drift: float = 0.0
    steps: int = 0
    of: int = 0
    whole: bool = False

    @classmethod
    def of_run(
        cls, sums: Mapping[str, float], jumped: Jumped, steps: tuple[int, int], kept: bool = True
    ) -> Energy:
        """Return the balance of a run.

        Parameters
        ----------
        sums : mapping
            Energies of all its steps.
        jumped : Jumped
        steps : (int, int)
            Recorded steps, and steps in all.
        kept : bool
            False if some jumps are not reported.
        """
        return cls(
            stored=sums["stored"] + jumped.stored,
            delivered=sums["delivered"] + jumped.delivered,
            dissipated=sums["dissipated"],
            lost=jumped.delivered - jumped.stored + sums["instants"],
            scheme=sums["scheme"],
            turned=sums["turned"],
            drift=sums["drift"],
            steps=steps[0],
            of=steps[1],
            whole=kept,
        )

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
        """Return the sum over islands; the error is the worst."""
        out = cls(whole=True)
        for part in parts:
            out.whole &= part.whole
            for name in _SUMS:
                setattr(out, name, getattr(out, name) + getattr(part, name))
            if worse(part.drift, out.drift):
                out.drift = part.drift
        return out

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping, energies in joules."""
        return {
            "stored": self.stored,
            "delivered": self.delivered,
            "dissipated": self.dissipated,
            "lost_in_jumps": self.lost,
            "scheme": self.scheme,
            "drift": self.drift,
            "steps": self.steps,
            "of": self.of,
        }


def worse(new: float, old: float) -> bool:
    """Return whether an error is worse than the worst so far; nan is the worst of all."""
    return old == old and not new <= old
