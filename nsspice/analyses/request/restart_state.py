"""States from which a run begins other than the DC solution, and sources put in for a run."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...circuit import MnaSystem
from ...problems.csc import Csc
from ...problems.descriptor import Waveform
from ...solvers.polynomial import Polynomial
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


def with_clock(mna: MnaSystem, clock: Polynomial) -> MnaSystem:
    """Return an island that goes no further than a clock is known: a source of no equation."""
    system = mna.system
    other = copy.copy(mna)
    S = system.S
    (rows, columns), ends = S.shape, np.append(S.indptr, S.indptr[-1])
    wider = Csc((rows, columns + 1), ends, S.indices, S.data)
    waveforms = (*system.waveforms, Waveform("held", (), handed=clock))
    other.system = replace(system, S=wider, waveforms=waveforms)
    return other
