"""The mode-wise engine on every linear-element waveform of the thesis, to 1e-11 of its scale."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import nsspice

ROOT = Path(__file__).parents[2]
DATA = ROOT / "netlists/thesis/data"
NETS = ROOT / "netlists/thesis"
TOLERANCE = 1e-11  # what is asked for; rounding in the references themselves reaches 1e-13

#: netlist, reference, time column, (signal, column) ...
CASES = [
    ("ex231_zener_inductor", "ex231_corrected", "t", [("i(l1)", "x_xa-1"), ("i(l2)", "x_xa-3")]),
    ("ex411_coulomb_case1", "ex411_coulomb", "t_s", [("i(l1)", "v_case1")]),
    ("ex411_coulomb_case2_m1", "ex411_coulomb", "t_s", [("i(l1)", "v_case2_m1")]),
    ("ex411_coulomb_case2_m2", "ex411_coulomb", "t_s", [("i(l1)", "v_case2_m2")]),
    ("ex412_dry_friction_spring", "ex412_fig43", "t_s", [("v(n3)", "x1"), ("i(l1)", "x2")]),
    ("ex414_compliant_contact", "ex414_compliant", "t_s", [("v(x)", "x1_m"), ("v(v)", "x2_m_s")]),
    ("ex423_zener_rlc", "ex423_zener_rlc", "t_s", [("v(n3)", "q_C"), ("i(l1)", "i_A")]),
    ("ex424_bridge_thesis", "ex424_bridge_thesis", "t_s", [("v(n1)", "vC_V"), ("i(l1)", "iL_A")]),
]

#: netlist -> element and exact switching times (closed forms; see the README of the data)
EVENTS = {
    "ex231_zener_inductor": [0.4501836112948736, 5.833001695884712, 1.1871514384667667],
    "ex411_coulomb_case1": [6.727828746177369],
    "ex411_coulomb_case2_m1": [1.9035060779874402],
    "ex411_coulomb_case2_m2": [1.9680486202770378],
    "ex412_dry_friction_spring": [11.160722964978902],
    "ex414_compliant_contact": [1.2126269905709468],
    "ex423_zener_rlc": [1.2923886840006404, 4.919987412469077, 8.547586140937511],
}


def table(name: str) -> dict[str, np.ndarray]:
    with (DATA / f"{name}.csv").open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    values = np.array([[float(x) for x in row] for row in rows])
    return dict(zip(header, values.T, strict=True))


def solve(net: str, reference: dict[str, np.ndarray], time: str):
    """Return the solution on the grid of the reference, and which of its rows that grid has."""
    grid = reference[time]
    circuit = nsspice.read(NETS / f"{net}.net")
    # the round number behind the grid: its differences have lost digits
    step = float(f"{np.min(np.diff(grid)[np.diff(grid) > 1e-9 * grid[-1]]):.9g}")
    card = next(c for c in circuit.deck.analyses if hasattr(c, "tstop"))
    stop = min(float(grid[-1]), float(card.tstop))
    sol = nsspice.tran(circuit, stop=stop, row_step=step, uic=True, method="modewise")
    assert sol.islands[0].method == "modewise"
    place = np.rint(grid / step).astype(int)
    inside = place < sol.time.size
    good = inside & (np.abs(sol.time[np.where(inside, place, 0)] - grid) < 1e-12 * stop)
    assert good.sum() > 0.9 * (grid <= stop).sum()
    return sol, place[good], good


@pytest.mark.parametrize(("net", "name", "time", "signals"), CASES, ids=[c[0] for c in CASES])
def test_waveform(net, name, time, signals):
    reference = table(name)
    sol, place, good = solve(net, reference, time)
    for signal, column in signals:
        expected = reference[column][good]
        scale = np.abs(expected).max()
        assert np.abs(sol[signal][place] - expected).max() <= TOLERANCE * scale, signal
    assert sol.certificate.passed


@pytest.mark.parametrize("net", EVENTS)
def test_switching_times(net):
    circuit = nsspice.read(NETS / f"{net}.net")
    times = [e.time for e in nsspice.tran(circuit, method="modewise").events]
    for expected in EVENTS[net]:
        assert min(abs(t - expected) for t in times) <= 1e-12 * expected
