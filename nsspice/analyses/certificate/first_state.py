"""The first state of a run: its charges and fluxes are those with which the deck begins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...problems.descriptor import DescriptorSystem
from ..signals.curve import Floats
from .charge_paths import unexplained
from .written_rows import ITERATED, KNOWN, TOLERANCE


@dataclass(frozen=True, slots=True)
class FirstState:
    """How far the first state is from where a run begins, where the engine reported no jump.

    Parameters
    ----------
    missed, largest : float
        Largest difference of a charge or flux beyond rounding, and largest of them, as roots of
        energies.
    unexplained : float
        The part of the differences that no impulses through conducting pairs explain.
    """

    missed: float
    largest: float
    unexplained: float = 1.0

    @classmethod
    def of(cls, system: DescriptorSystem, given: Floats, found: Floats) -> FirstState:
        """Compare charges and fluxes that are ``given``, (n,), with unknowns ``found``, (n,)."""
        smooth = system.smooth
        if smooth is not None and smooth.Q.data.size:
            return cls(0.0, 0.0)  # what smooth laws store is not a form of the unknowns
        reached = system.E.dot(found)
        own, worth = system.E.diagonal(), np.zeros(system.n)
        worth[own > 0.0] = 1.0 / np.sqrt(own[own > 0.0])
        largest = np.max(worth * np.maximum(np.abs(given), np.abs(reached)), initial=0.0)
        part = KNOWN if smooth is None else ITERATED
        off = np.abs(reached - given) - part * system.E.abs().dot(_sizes(system, found))
        missed = float(np.max(worth * off, initial=0.0))
        if missed <= TOLERANCE * largest:  # no run refuses it
            return cls(max(missed, 0.0), float(largest))
        fluxes = (np.asarray(system.row_kind) == 1) & (off > 0.0)
        rest = 1.0 if fluxes.any() else unexplained(system, reached - given, found)
        return cls(missed, float(largest), rest)

    def error(self, turned: float) -> float:
        """Return the error relative to the largest, or to what a run has ``turned`` over [J].

        Examples
        --------
        >>> FirstState(1e-6, 1.0).error(1.0), FirstState(1e-6, 1.0, 0.0).error(1.0)
        (7.071067811865475e-07, 0.0)
        """
        largest = max(self.largest, math.sqrt(2.0 * turned))
        return self.missed / largest * min(1.0, self.unexplained) if largest > 0.0 else 0.0


def _sizes(system: DescriptorSystem, found: Floats) -> Floats:
    """Return by which each unknown is rounded: the largest of its kind, and what it drives."""
    kinds = np.asarray(system.row_kind)
    volts, amperes = (float(np.max(np.abs(found[kinds == k]), initial=0.0)) for k in (0, 1))
    siemens = float(np.max(np.abs(system.G.diagonal()[kinds == 0]), initial=0.0))
    return np.where(kinds == 1, amperes + siemens * volts, volts)
