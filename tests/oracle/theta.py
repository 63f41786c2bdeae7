"""Smooth rates of the reference network, derived densely from element replacement.

For theta < 1 the scheme averages only the linear state equation ``x' = A x + B u``.  Its rates are
found here by rebuilding the network of the normal tree: every tree capacitor becomes a voltage
source of its state, every cotree inductor a current source of its state, other capacitors are
opened, other inductors shorted, and each pair is either shut (w = 0) or open (l = 0) for good.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nsspice.problems.descriptor import DescriptorSystem

from .residual import Floats

Terms = Sequence[tuple[int, float]]


def reference_rates(
    system: DescriptorSystem,
    capacitors: Sequence[Terms],
    inductors: Sequence[Terms],
    shut: Sequence[int],
) -> tuple[Floats, Floats, Floats]:
    """Return ``(P, Phi_x, Phi_u)``: rates = Phi_x x + Phi_u u, put into rows by P.

    Parameters
    ----------
    capacitors : sequence
        Voltages of the tree capacitors as combinations of z.
    inductors : sequence
        Currents of the cotree inductors as combinations of z (one unknown each).
    shut : sequence of int
        Pairs whose slack is the multiplier of the DLCP form (zero in the reference network).
    """
    n, p = system.n, system.S.shape[1]
    states = [_row(c, n) for c in capacitors] + [_row(c, n) for c in inductors]
    k = len(states)
    X: Floats = np.array(states).reshape(k, n)
    on = list(shut)
    A, B, D = system.A.dense()[:, on], system.B.dense()[on], system.D.dense()[np.ix_(on, on)]
    s = len(on)
    # unknowns: z, l of the shut pairs, rates (capacitor currents, inductor voltages)
    matrix = np.block(
        [
            [system.G.dense(), A, X.T],
            [B, -D, np.zeros((s, k))],
            [X, np.zeros((k, s + k))],
        ]
    )
    forcing = np.zeros((n + s + k, k + p))
    forcing[n + s :, :k] = np.eye(k)
    forcing[:n, k:] = system.S.dense()
    scale = np.abs(matrix).max(axis=1)
    scale = np.where(scale > 0, scale, 1.0)[:, None]
    answer, *_ = np.linalg.lstsq(matrix / scale, forcing / scale, rcond=1e-13)
    gap = np.abs(matrix @ answer - forcing)[:, :k].max(initial=0.0)
    if gap > 1e-6:
        raise ValueError("the reference network contradicts its states: no normal tree")
    rates: Floats = np.asarray(answer[n + s :], dtype=float)
    return X.T, rates[:, :k], rates[:, k:]


def theta_terms(
    system: DescriptorSystem,
    theta: float,
    capacitors: Sequence[Terms],
    inductors: Sequence[Terms],
    shut: Sequence[int],
) -> tuple[Floats, Floats]:
    """Return the dense (H, Hs) of the step equation; both zero for theta = 1."""
    P, on_state, on_source = reference_rates(system, capacitors, inductors, shut)
    return (1 - theta) * P @ on_state @ P.T, (1 - theta) * P @ on_source


def _row(terms: Terms, n: int) -> Floats:
    row = np.zeros(n)
    for j, c in terms:
        row[j] += c
    return row
