"""Where the energy of a run went: stored, delivered, dissipated, lost in jumps, lost by the scheme.

The implicit step is not neutral: what it takes from the stored energy is known exactly,

.. math::

    \\Delta W = z_1^T E\\, \\Delta z - \\tfrac12 \\Delta z^T E\\, \\Delta z, \\qquad
    z_1^T(E \\Delta z + h H \\Delta z + h H_s \\Delta u) + h z_1^T G z_1 + h z_1^T A \\lambda
    = h z_1^T S u,

so that stored + dissipated + (1/2)|dz|^2_E (+ what the averaging of theta < 1 adds) = delivered
holds for every step up to rounding.  That identity is asserted for every recorded step; where all
steps were recorded, the sums over the run must also lead from the first to the last stored energy.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..problems.csc import Floats
from ..solvers.moreau import Records
from .audit import FLOOR, Auditor, Points, worse


@dataclass(slots=True)
class Energy:
    """The energy balance of a run.

    Parameters
    ----------
    stored : float
        Change of the stored energy over the recorded steps and all jumps [J].
    delivered : float
        By independent sources [J].
    dissipated : float
        In resistors, controlled sources and set-valued elements [J].
    lost : float
        In jumps [J]: what was stored or delivered and is nowhere afterwards.
    scheme : float
        Taken by the implicit scheme [J].
    imbalance : float
        Worst relative error of the balance of a step.
    drift : float
        Relative error of the sums over the run, 0 unless every step was recorded.
    steps, of : int
        Recorded steps, and steps in all.
    """

    stored: float = 0.0
    delivered: float = 0.0
    dissipated: float = 0.0
    lost: float = 0.0
    scheme: float = 0.0
    imbalance: float = 0.0
    drift: float = 0.0
    steps: int = 0
    of: int = 0

    @property
    def complete(self) -> bool:
        """True if every step was recorded, so that the sums are those of the run."""
        return self.steps == self.of

    @classmethod
    def total(cls, parts: Iterable[Energy]) -> Energy:
        """Return the sum over islands; the imbalance is the worst."""
        out = cls()
        for part in parts:
            for name in ("stored", "delivered", "dissipated", "lost", "scheme", "steps", "of"):
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
            "drift": self.drift if self.complete else None,
            "steps": self.steps,
            "of": self.of,
        }


class Ledger:
    """Adds up the energies of one island from its recorded steps.

    Parameters
    ----------
    auditor : Auditor
        Of the island; its products are used.
    """

    def __init__(self, auditor: Auditor) -> None:
        self.auditor = auditor
        self.energy = Energy()
        self._first: float | None = None
        self._last = 0.0
        #: by steps, and by jumps between the first and the last of them
        self._moved, self._jumped = 0.0, 0.0
        self._scale, self._rounding, self._largest = 0.0, 0.0, 0.0

    def stored(self, z: Floats) -> Floats:
        """Return the stored energy [J] of unknowns, shape (k, n)."""
        return _dot(0.5 * z, self.auditor.E(z))

    def step(self, records: Records, points: Points) -> None:
        """Take recorded steps, with the points made of them."""
        audit, energy = self.auditor, self.energy
        finite = np.isfinite(records.length) & (records.length > 0.0)
        energy.steps += int(np.count_nonzero(finite))
        if not finite.any():
            return
        z, dz = records.z[finite], records.change[finite]
        lam, h = records.lam[finite], records.length[finite]
        edz = audit.E(dz)
        moved = _dot(z, edz)
        half = 0.5 * _dot(dz, edz)
        scheme = half.copy()
        if audit.H is not None:
            scheme += h * _dot(z, audit.H(dz))
        if audit.Hs is not None:
            scheme += h * _dot(z, audit.Hs(records.source_change[finite]))
        dissipated = h * (_dot(z, audit.G(z)) + _dot(z, audit.A(lam)))
        delivered = h * _dot(z, audit.S(records.u[finite]))
        change = moved - half
        if audit.F is not None and points.f is not None:
            # what smooth elements store cannot be told from what they dissipate
            rates = points.rates[finite] - edz / h[:, None]
            dissipated += h * (_dot(z, audit.F(points.f[finite])) + _dot(z, rates))
        error = np.abs(change + scheme + dissipated - delivered)
        # the same sums with all terms positive: how far rounding can go
        size = _dot(np.abs(z), audit.E.sizes(dz)) + h * (
            _dot(np.abs(z), audit.G.sizes(z) + audit.A.sizes(lam))
            + _dot(np.abs(z), audit.S.sizes(records.u[finite]))
        )
        size += h * FLOOR * _dot(np.abs(z), points.resolution[finite])
        if audit.F is not None and points.f is not None:
            size += h * _dot(np.abs(z), audit.F.sizes(points.f[finite]))
        self._largest = max(self._largest, float(np.max(size)))
        size = np.maximum(size, FLOOR * self._largest)
        ratio = np.divide(error, size, out=np.zeros_like(error), where=size > 0.0)
        worst = float(np.max(ratio))
        if worse(worst, energy.imbalance):
            energy.imbalance = worst
        self._moved += float(np.sum(change))
        energy.stored += float(np.sum(change))
        energy.scheme += float(np.sum(scheme))
        energy.dissipated += float(np.sum(dissipated))
        energy.delivered += float(np.sum(delivered))
        self._scale += float(np.sum(np.abs(delivered) + np.abs(dissipated)))
        self._rounding += float(np.sum(size))
        if self._first is None:
            self._first = float(self.stored((z[0] - dz[0])[None, :])[0])
        self._last = float(self.stored(z[-1:])[0])

    def jump(self, before: float, after: float, delivered: float, inside: bool) -> float:
        """Take a jump; return the energy lost in it [J].

        Parameters
        ----------
        before, after : float
            Stored energies [J].
        delivered : float
            By sources during the jump [J].
        inside : bool
            False for a jump before the first recorded step.
        """
        lost = before + delivered - after
        self.energy.lost += lost
        self.energy.stored += after - before
        self.energy.delivered += delivered
        self._scale += abs(delivered) + abs(after - before)
        if inside:
            self._jumped += after - before
        return lost

    def close(self, steps: int) -> Energy:
        """Return the balance of a run of so many steps."""
        energy = self.energy
        energy.of = steps
        if energy.complete and self._first is not None:
            error = abs(self._last - self._first - self._moved - self._jumped)
            scale = self._scale + abs(self._first) + abs(self._last) + FLOOR * self._rounding
            energy.drift = error / scale if scale > 0.0 else 0.0
        return energy


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->i", a, b))
