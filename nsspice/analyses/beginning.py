"""States from which a run begins where neither the DC solution nor initial values are meant."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..circuit import MnaSystem
from ..problems.descriptor import Waveform
from .curve import Floats


@dataclass(frozen=True, slots=True)
class Beginning:
    """The first state of one island.

    Parameters
    ----------
    charges : ndarray, shape (n,)
        Charges [C] and fluxes [V s] before t = 0.
    gates : list of bool
        States of its switches.
    energy : float
        Stored in it [J].
    """

    charges: Floats
    gates: list[bool]
    energy: float


def with_waveforms(mna: MnaSystem, waveforms: Sequence[Waveform]) -> MnaSystem:
    """Return an island with other sources; the one that is assembled is kept for others."""
    if tuple(waveforms) == mna.system.waveforms:
        return mna
    other = copy.copy(mna)
    other.system = replace(mna.system, waveforms=tuple(waveforms))
    return other
