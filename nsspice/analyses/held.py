"""Systems in which voltage sources hold some unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..problems.csc import Csc
from ..problems.descriptor import DescriptorSystem, Waveform
from .curve import Floats


def hold(
    system: DescriptorSystem, voltages: Mapping[int, float], loose: Sequence[int] = ()
) -> DescriptorSystem:
    """Return the system with voltage sources from some nodes to ground, one row more for each.

    Parameters
    ----------
    system : DescriptorSystem
    voltages : mapping of int to float
        Voltage [V] by unknown.
    loose : sequence of int
        Currents that are zero, whatever their laws say.

    Examples
    --------
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> system = DescriptorSystem(one, one, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))
    >>> hold(system, {0: 5.0}).G.dense().tolist()
    [[1.0, 1.0], [-1.0, 0.0]]
    """
    n, m, p, k = system.n, system.m, len(system.waveforms), len(voltages)
    nodes = np.fromiter(voltages, dtype=np.int64, count=k)
    new = n + np.arange(k)
    ones = np.ones(k)

    def grown(
        matrix: Csc,
        shape: tuple[int, int],
        rows: npt.NDArray[Any],
        cols: npt.NDArray[Any],
        values: Floats,
    ) -> Csc:
        return Csc.from_triplets(
            shape,
            np.concatenate([matrix.indices, rows]).astype(np.int64),
            np.concatenate([matrix.columns, cols]).astype(np.int64),
            np.concatenate([matrix.data, values]),
        )

    nothing, cut = np.zeros(0), np.array(loose, dtype=np.int64)
    stay = ~np.isin(system.G.indices, cut)
    laws = Csc.from_triplets(
        (n, n),
        np.concatenate([system.G.indices[stay], cut]),
        np.concatenate([system.G.columns[stay], cut]),
        np.concatenate([system.G.data[stay], np.ones(len(cut))]),
    )
    return replace(
        system,
        E=grown(system.E, (n + k, n + k), nothing, nothing, nothing),
        G=grown(
            laws,
            (n + k, n + k),
            np.concatenate([nodes, new]),
            np.concatenate([new, nodes]),
            np.concatenate([ones, -ones]),
        ),
        A=grown(system.A, (n + k, m), nothing, nothing, nothing),
        B=grown(system.B, (m, n + k), nothing, nothing, nothing),
        S=grown(system.S, (n + k, p + k), new, p + np.arange(k), -ones),
        smooth=None
        if system.smooth is None
        else replace(
            system.smooth,
            F=grown(system.smooth.F, (n + k, system.smooth.F.shape[1]), nothing, nothing, nothing),
            Q=grown(system.smooth.Q, (n + k, system.smooth.Q.shape[1]), nothing, nothing, nothing),
        ),
        waveforms=(*system.waveforms, *(Waveform("dc", (v,)) for v in voltages.values())),
        row_kind=np.concatenate([system.row_kind, np.ones(k, np.uint8)]),
    )
