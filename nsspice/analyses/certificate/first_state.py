"""The first state of a run: its charges and fluxes are those with which the deck begins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...problems.descriptor import DescriptorSystem
from ..signals.curve import Floats

#: part of the largest values to which a solution is known
_ROUNDING = 1e-13


@dataclass(frozen=True, slots=True)
class FirstState:
    """How far the first state is from where a run begins, where no jump was reported.

    Parameters
    ----------
    missed, largest : float
        Largest difference of a charge or flux and largest of them, as roots of energies.
    """

    missed: float
    largest: float

    @classmethod
    def of(cls, system: DescriptorSystem, given: Floats, found: Floats) -> FirstState:
        """Compare charges and fluxes that are ``given``, (n,), with unknowns ``found``, (n,)."""
        if system.smooth is not None and system.smooth.Q.data.size:
            return cls(0.0, 0.0)  # what smooth laws store is no form of the unknowns
        reached = system.E.dot(found)
        own, worth = np.zeros(system.n), np.zeros(system.n)
        diagonal = system.E.indices == system.E.columns
        own[system.E.indices[diagonal]] = system.E.data[diagonal]
        worth[own > 0.0] = 1.0 / np.sqrt(own[own > 0.0])
        largest = np.max(worth * np.maximum(np.abs(given), np.abs(reached)), initial=0.0)
        return cls(float(np.max(worth * np.abs(reached - given), initial=0.0)), float(largest))

    def error(self, turned: float) -> float:
        """Return the relative error: next to what a run has ``turned`` over [J] it may be rounding.

        Examples
        --------
        >>> FirstState(1e-6, 1.0).error(1.0), FirstState(1e-15, 1e-15).error(1.0)
        (1e-06, 0.0)
        """
        if self.missed <= _ROUNDING * math.sqrt(2.0 * turned) or self.largest == 0.0:
            return 0.0
        return self.missed / self.largest
