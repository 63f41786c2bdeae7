"""States from which a run begins where neither the DC solution nor initial values are meant."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...circuit import MnaSystem
from ...problems.descriptor import Waveform
from ..signals.curve import Floats


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


def with_gates(mna: MnaSystem, gates: Sequence[bool]) -> MnaSystem:
    """Return an island whose switches are in these states before the start."""
    pairs = zip(mna.system.switches, gates, strict=True)
    switches = tuple(replace(s, closed=gate != s.inverted) for s, gate in pairs)
    if switches == mna.system.switches:
        return mna
    other = copy.copy(mna)
    other.system = replace(mna.system, switches=switches)
    return other
