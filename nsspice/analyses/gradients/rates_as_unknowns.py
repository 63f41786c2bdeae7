"""Rates that measures are made of, currents of capacitors, as unknowns of a recorded run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...problems.csc import Csc
from ...problems.descriptor import DescriptorSystem, Functional
from ...solvers.intervals import Intervals


def with_rates(
    system: DescriptorSystem, record: Intervals, outputs: Sequence[Functional]
) -> tuple[DescriptorSystem, Intervals, list[Functional]]:
    """Return a system in which rates among outputs are unknowns: ``c z' + d f' - y = 0``."""
    n, smooth = system.n, system.smooth
    rated = [k for k, output in enumerate(outputs) if output.dz or output.df]
    if not rated:
        return system, record, list(outputs)
    size, found = n + len(rated), list(outputs)
    more: dict[str, list[tuple[int, int, float]]] = {"E": [], "G": [], "Q": []}
    columns, none = [], np.zeros((len(rated), record.first.shape[0]))
    for row, k in enumerate(rated, n):
        output = outputs[k]
        more["E"] += [(row, j, factor) for j, factor in output.dz]
        more["Q"] += [(row, j, factor) for j, factor in output.df]
        more["G"].append((row, row, -1.0))
        rates = sum((c * record.rate[:, :, j] for j, c in output.dz), np.zeros(record.time.shape))
        columns.append(rates + sum(c * record.function_rate[:, :, j] for j, c in output.df))
        found[k] = replace(output, dz=(), df=(), z=(*output.z, (row, 1.0)))
    y = np.stack(columns, axis=2)

    def grown(matrix: Csc, shape: tuple[int, int], key: str = "") -> Csc:
        entries = np.array(more.get(key, []), dtype=np.float64).reshape(-1, 3)
        return Csc.from_triplets(
            shape,
            np.concatenate([matrix.indices, entries[:, 0].astype(np.int64)]),
            np.concatenate([matrix.columns, entries[:, 1].astype(np.int64)]),
            np.concatenate([matrix.data, entries[:, 2]]),
        )

    if smooth is not None:
        functions = smooth.F.shape[1]
        F, Q = grown(smooth.F, (size, functions)), grown(smooth.Q, (size, functions), "Q")
        smooth = replace(smooth, F=F, Q=Q)
    system = replace(
        system,
        E=grown(system.E, (size, size), "E"),
        G=grown(system.G, (size, size), "G"),
        A=grown(system.A, (size, system.m)),
        B=grown(system.B, (system.m, size)),
        S=grown(system.S, (size, len(system.waveforms))),
        row_kind=np.append(system.row_kind, np.zeros(len(rated), dtype=np.uint8)),
        smooth=smooth,
        elements=None,
    )
    record = replace(
        record,
        z=np.concatenate([record.z, y], axis=2),
        rate=np.concatenate([record.rate, np.zeros_like(y)], axis=2),
        first=np.concatenate([record.first, none.T], axis=1),
    )
    return system, record, found
