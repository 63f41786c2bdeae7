"""Descriptor systems in which switches are held as they are: currents of their own, or nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .csc import Csc
from .descriptor import DescriptorSystem, SmoothTerms, Waveform

_ONE = Waveform("dc", (1.0,))


def held(
    system: DescriptorSystem, closed: Mapping[int, bool]
) -> tuple[DescriptorSystem, tuple[list[int], list[int]]]:
    """Return a system in which some switches are held closed or open.

    Parameters
    ----------
    system : DescriptorSystem
    closed : mapping of int to bool
        By pair.

    Returns
    -------
    (DescriptorSystem, (list of int, list of int))
        With a current more for each closed one, and the pairs that are left and those that have
        become such currents.  A thyristor that conducts remains a diode.

    Examples
    --------
    1 V across 1 Ohm and an ideal switch:

    >>> from nsspice.problems.descriptor import Switch
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> system = DescriptorSystem(none((1, 1)), one, one, one, none((1, 1)), np.zeros(1), one,
    ...     (Waveform("dc", (1.0,)),), (Switch(0, ((0, 1.0),), 0.5, 0.5),))
    >>> held(system, {0: True})[0].n, held(system, {0: False})[0].n
    (2, 1)
    """
    latching = {s.pair for s in system.switches if s.latching}
    wired = [k for k, on in closed.items() if on and k not in latching]
    left = [k for k in range(system.m) if k not in closed or (closed[k] and k in latching)]
    A, B, D = system.A.dense(), system.B.dense(), system.D.dense()
    count = len(wired)
    G = np.block([[system.G.dense(), A[:, wired]], [-B[wired], D[np.ix_(wired, wired)]]])
    E = np.zeros(G.shape)
    E[: system.n, : system.n] = system.E.dense()
    data = np.zeros((count, 1))
    data[:, 0] = -system.q[wired]
    number = {k: i for i, k in enumerate(left)}
    kept = [s for s in system.switches if s.pair not in closed]
    smooth = system.smooth
    if smooth is not None:
        none = np.zeros((count, smooth.F.shape[1]))
        F, Q = (Csc.from_dense(np.vstack([x.dense(), none])) for x in (smooth.F, smooth.Q))
        smooth = SmoothTerms(smooth.tape, F, Q)
    sources = np.block(
        [
            [system.S.dense(), np.zeros((system.n, 1))],
            [np.zeros((count, system.S.shape[1])), data],
        ]
    )
    inner = DescriptorSystem(
        E=Csc.from_dense(E),
        G=Csc.from_dense(G),
        A=Csc.from_dense(np.vstack([A[:, left], D[np.ix_(wired, left)]])),
        B=Csc.from_dense(np.hstack([B[left], -D[np.ix_(left, wired)]])),
        D=Csc.from_dense(D[np.ix_(left, left)]),
        q=system.q[left],
        S=Csc.from_dense(sources),
        waveforms=(*system.waveforms, _ONE),
        switches=tuple(replace(s, pair=number[s.pair]) for s in kept),
        row_kind=np.concatenate([system.row_kind, np.ones(count, np.uint8)]),
        smooth=smooth,
    )
    return inner, (left, wired)


__all__ = ["held"]
