"""Systems in which voltage sources hold some unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ...problems.csc import Csc
from ...problems.descriptor import DescriptorSystem, Waveform
from ..signals.curve import Floats

Terms = tuple[tuple[int, float], ...]
_NONE = (np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))


def hold(
    system: DescriptorSystem, voltages: Sequence[tuple[Terms, float]], loose: Sequence[int] = ()
) -> DescriptorSystem:
    """Return the system with voltage sources across some voltages, one row more for each.

    Parameters
    ----------
    system : DescriptorSystem
    voltages : sequence of (terms, float)
        Each as a combination of unknowns, and its value [V].
    loose : sequence of int
        Currents that are zero, regardless of their laws.

    Examples
    --------
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> system = DescriptorSystem(one, one, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))
    >>> hold(system, [(((0, 1.0),), 5.0)]).G.dense().tolist()
    [[1.0, 1.0], [-1.0, 0.0]]
    """
    n, m, p, k = system.n, system.m, len(system.waveforms), len(voltages)
    flat = [(index, n + j, sign) for j, (terms, _) in enumerate(voltages) for index, sign in terms]
    ends, rows, signs = (np.array(part) for part in zip(*flat, strict=True)) if flat else _NONE
    new = n + np.arange(k)

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
            np.concatenate([ends, rows]),
            np.concatenate([rows, ends]),
            np.concatenate([signs, -signs]),
        ),
        A=grown(system.A, (n + k, m), nothing, nothing, nothing),
        B=grown(system.B, (m, n + k), nothing, nothing, nothing),
        S=grown(system.S, (n + k, p + k), new, p + np.arange(k), -np.ones(k)),
        smooth=None
        if system.smooth is None
        else replace(
            system.smooth,
            F=grown(system.smooth.F, (n + k, system.smooth.F.shape[1]), nothing, nothing, nothing),
            Q=grown(system.smooth.Q, (n + k, system.smooth.Q.shape[1]), nothing, nothing, nothing),
        ),
        waveforms=(*system.waveforms, *(Waveform("dc", (v,)) for _, v in voltages)),
        row_kind=np.concatenate([system.row_kind, np.ones(k, np.uint8)]),
        elements=None if system.elements is None else system.elements.beside_currents(k),
    )
