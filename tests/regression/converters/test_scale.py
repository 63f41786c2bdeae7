"""Large circuits: right by independent truths, and no more memory for more steps.

The sizes are those of a few seconds; ``tests/benchmarks/bench_scale.py`` has the full ones.
"""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from decks.large import bridges_on_a_grid, mesh, separate_bridges

import nsspice

H = 1e-4


def run(text: str, steps: int, h: float = H, row_count: int | None = None, **options):
    circuit = nsspice.read(text)
    row = steps * h / row_count if row_count else h
    return nsspice.tran(circuit, steps * h, row, step=h, uic=True, **options)


def test_each_of_a_thousand_islands_equals_the_only_one():
    signals = ["v(p0,m0)", "i(v0)"]
    alone = run(separate_bridges(1), 60, signals=signals)
    many = run(
        separate_bridges(1000),
        60,
        signals=[*signals, "v(p517,m517)", "v(p999,m999)", "i(v999)"],
        everything=True,
    )
    assert alone["v(p0,m0)"].max() > 1.0
    for name in many.columns:
        first = "v(p0,m0)" if name.startswith("v") else "i(v0)"
        assert np.array_equal(many[name], alone[first]), name
    assert many.certificate.passed
    assert many.stats["steps"] == 60 * 1000


def test_bridges_on_a_grid_obey_kirchhoff_in_the_written_rows(tmp_path):
    side = 16
    names = [f"v(g{i}_{j})" for i in range(side) for j in range(side)]
    extra = [f"v({x}{k})" for k in range(side * side) for x in "pm"]
    found = run(bridges_on_a_grid(side), 60, signals=["v(s)", "i(v1)", *names, *extra])
    assert found.certificate.passed
    found.to_csv(tmp_path / "grid.csv")
    table = np.genfromtxt(tmp_path / "grid.csv", delimiter=",", names=True, deletechars="")
    rows = np.vstack([table[n] for n in table.dtype.names]).T
    at = {n: k for k, n in enumerate(table.dtype.names)}
    g = rows[:, [at[n] for n in names]].reshape(-1, side, side)
    p, m = (rows[:, [at[f"v({x}{k})"] for k in range(side * side)]] for x in "pm")
    # all that the source delivers to the grid leaves it through the bridges of its nodes
    source = (rows[:, at["v(s)"]] - g[:, 0, 0]) / 0.01
    assert np.allclose(source, -rows[:, at["i(v1)"]], rtol=1e-6, atol=1e-6 * np.abs(source).max())
    into = np.zeros_like(g)
    into[:, 0, 0] += source
    flow = (g[:, :, :-1] - g[:, :, 1:]) / 0.01
    into[:, :, 1:] += flow
    into[:, :, :-1] -= flow
    flow = (g[:, :-1] - g[:, 1:]) / 0.01
    into[:, 1:] += flow
    into[:, :-1] -= flow
    assert np.allclose(into.sum(axis=(1, 2)), source, rtol=0, atol=1e-6 * np.abs(source).max())
    # a bridge takes what its capacitor (implicit Euler) and its load take
    v = (p - m).reshape(-1, side, side)
    load = 100e-6 * np.diff(v, axis=0) / H + v[1:] / 100
    scale = np.abs(source).max()
    assert np.abs(np.abs(into[1:]) - load).max() <= 1e-5 * scale  # 12 digits of v in steps of 10 mS
    # no diode is forward by more than rounding
    ends = g.reshape(-1, side * side)
    for forward in (ends - p, m - ends, -p, m):
        assert forward.max() <= 1e-9 * np.abs(ends).max()


def test_blocking_bridges_float_by_sdirk_as_mode_by_mode():
    # each of them blocks and floats for a part of the time, or rests on one of its diodes: the
    # mode-wise engine, which knows nothing of steps, tells what the voltages across them are
    circuit = nsspice.read(bridges_on_a_grid(5))
    signals = ["v(p0,m0)", "v(p12,m12)", "v(p24,m24)", "v(g4_4)"]
    exact = nsspice.tran(circuit, 20e-3, 1e-4, uic=True, signals=signals, method="modewise")
    for reltol in (1e-4, 1e-6):
        found = nsspice.tran(
            circuit, 20e-3, 1e-4, uic=True, signals=signals, method="sdirk", reltol=reltol
        )
        assert found.certificate.passed
        assert found.certificate.undetermined > 0  # where the bridges float is not unique
        for name in signals:
            error = np.abs(found[name] - exact[name]).max()
            assert error <= reltol * np.ptp(exact[name]), (name, reltol)


def test_mesh_of_diodes_keeps_its_laws():
    side, h = 30, 5e-6
    names = [f"v(n{i}_{j})" for i in range(side) for j in range(side)]
    found = run(mesh(side), 60, h, signals=names)
    assert found.certificate.passed
    v = np.stack([found[n] for n in names], axis=1).reshape(-1, side, side)
    # rows are equal, so nothing flows down the columns, and diodes only lead away from the source
    assert np.abs(v - v[:, :1]).max() <= 1e-10 * np.abs(v).max()
    assert (v[:, :, 1:] - v[:, :, :-1]).min() >= -1e-10 * np.abs(v).max()
    # all diodes of a row conduct at first: one capacitor of side * 1 nF behind 10 Ohm
    k = np.arange(1, 40)
    charge = 0.0
    rc = 10 * side * 1e-9
    for n in k:
        charge = (charge + h / rc * 10 * np.sin(2e3 * np.pi * n * h)) / (1 + h / rc)
        assert abs(v[n, 0, side - 1] - charge) <= 1e-10


@pytest.mark.parametrize("text", [separate_bridges(2), bridges_on_a_grid(5)])
def test_memory_does_not_grow_with_the_number_of_steps(text):
    peaks = []
    for steps in (2000, 8000):
        tracemalloc.start()
        run(text, steps, signals=["v(p0,m0)"], row_count=40)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # the steps that await their examination take up to 4 MiB, however many there are
    assert max(peaks) <= 16 * 2**20
    assert peaks[1] <= peaks[0] + 4 * 2**20
