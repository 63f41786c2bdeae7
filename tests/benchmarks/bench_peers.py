"""nsspice beside Pulsim 2 on the same circuits: errors against one reference, times in the process.

Pulsim is run where a Python with it is named, PULSIM_PYTHON=/path/to/python make bench; where it is
absent the report says so.
"""

from __future__ import annotations

import json
import os
import subprocess
import time
from pathlib import Path

import numpy as np
from bench_modewise import measure
from side_by_side import report

import nsspice

HERE = Path(__file__).parent
NETS = HERE.parents[1] / "netlists"
DCM = """rectifier with a choke, discontinuous current
V1 a 0 SIN(0 10 1k)
L1 a b 2m IC=0
D1 b c
C1 c 0 10u IC=0
R1 c 0 100
.tran 10u 5m uic
"""
DECKS = {
    "buck": ((NETS / "converters/buck.net").read_text(), "v(out)"),
    "dcm_rectifier": (DCM, "v(c)"),
    "boost": ((NETS / "converters/boost.net").read_text(), "v(out)"),
    "lc_bridge": ((NETS / "converters/lc_bridge_charger.net").read_text(), "v(top)"),
    "half_wave": ((NETS / "rectifiers/half_wave_capacitor.net").read_text(), "v(out)"),
    "full_bridge": ((NETS / "rectifiers/full_bridge_capacitor.net").read_text(), "v(p)"),
}


def ours(text: str, signal: str) -> tuple[dict[str, tuple[float, float]], float, float]:
    """Return error (against the exact engine) and least time of three runs of each method.

    With the end of the run [s] and the largest value.
    """
    circuit = nsspice.read(text)
    exact = nsspice.tran(circuit, method="modewise", signals=[signal])
    found = {}
    for name, options in (
        ("modewise", {"method": "modewise"}),
        ("sdirk 1e-4", {"method": "sdirk", "reltol": 1e-4}),
        ("sdirk 1e-8", {"method": "sdirk", "reltol": 1e-8}),
    ):
        best = float("inf")
        for _ in range(3):
            begin = time.perf_counter()
            run = nsspice.tran(circuit, signals=[signal], **options)
            best = min(best, time.perf_counter() - begin)
        found[name] = (float(np.abs(run[signal] - exact[signal]).max()), best)
    stop = float(exact.time[-1])
    found["its engine alone, 1000 rows"] = (0.0, measure(text, stop, 1000, 5)[0])
    return found, stop, float(np.abs(exact[signal]).max())


def test_nsspice_and_pulsim() -> None:
    python = os.environ.get("PULSIM_PYTHON")
    runs = []
    if python:
        done = subprocess.run(
            [python, str(HERE / "pulsim_runs.py")], capture_output=True, text=True, check=True
        )
        runs = [json.loads(line) for line in done.stdout.splitlines()]
    for deck, (text, signal) in DECKS.items():
        circuit = nsspice.read(text)
        found, stop, scale = ours(text, signal)
        rows = [(n, f"error {e:.1e} V, {1e3 * s:.2f} ms") for n, (e, s) in found.items()]
        for run in (r for r in runs if r["name"].startswith(deck)):
            name = "Pulsim" + run["name"][len(deck) :]
            if "error" in run:
                rows.append((name, f"refused: {run['error']}"))
                continue
            # at Pulsim's own points; the last may lie beyond the end by rounding
            t = np.minimum(np.array(run["t"]), stop)
            fine = nsspice.tran(
                circuit, stop, stop / 50_000, uic=True, method="modewise", signals=[signal]
            )
            at = np.interp(t, fine.time, fine[signal])
            error = float(np.abs(np.array(run["v"]) - at).max())
            rows.append((name, f"error {error:.1e} V, {1e3 * run['seconds']:.2f} ms"))
        if not python:
            rows.append(("Pulsim", "absent: PULSIM_PYTHON names no Python that has it"))
        report(f"{deck}, {1e3 * stop:g} ms", rows)
        assert found["modewise"][1] < 0.1
        # two methods that share no code agree
        assert found["sdirk 1e-8"][0] < 1e-6 * scale
