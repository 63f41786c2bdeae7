"""Runs of Pulsim 2, in a process of its own: a Python with pulsim prints JSON, one line per run.

usage: PYTHON_WITH_PULSIM tests/benchmarks/pulsim_runs.py
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np
import pulsim

G_ON, G_OFF = 1e9, 1e-12
STOP, PERIOD = 5e-3, 10e-6


def buck() -> tuple[Any, Any]:
    """Return the buck converter of netlists/converters/buck.net and the law of its switch."""
    b = pulsim.CircuitBuilder()
    b.add_voltage_source("Vin", "in", "gnd", 24.0)
    b.add_switch("S1", "in", "sw", G_ON, G_OFF)
    b.add_diode("D1", "gnd", "sw", G_ON, G_OFF, 0.0)
    b.add_inductor("L1", "sw", "out", 100e-6, 0.0)
    b.add_capacitor("C1", "out", "gnd", 100e-6, 0.0)
    b.add_resistor("R1", "out", "gnd", 5.0)
    # its own fast law: switch 0 in the first half of a period, then 1, which is the diode
    gate = pulsim.NativePwm2Switch(PERIOD, 0.5, 2)
    return b, gate


def dcm_rectifier() -> tuple[Any, Any]:
    """Return a rectifier with a choke whose current is interrupted."""
    b = pulsim.CircuitBuilder()
    b.add_sine_voltage_source("V1", "a", "gnd", 0.0, 10.0, 1000.0)
    b.add_inductor("L1", "a", "b", 2e-3, 0.0)
    b.add_diode("D1", "b", "c", G_ON, G_OFF, 0.0)
    b.add_capacitor("C1", "c", "gnd", 10e-6, 0.0)
    b.add_resistor("R1", "c", "gnd", 100.0)
    return b, None


def run(name: str, made: Any, node: str, **options: Any) -> dict[str, Any]:
    """Run once to warm up and thrice for the time; return times and the wanted node's voltage."""
    best = float("inf")
    for turn in range(4):
        builder, gate = made()
        if gate is not None:
            # the fixed step wants a plain function
            plain = pulsim.make_pwm_switch_fn(1.0 / PERIOD, 0.5, 0, 2)
            options["switch_fn"] = plain if "dt" in options else gate
        begin = time.perf_counter()
        result = pulsim.simulate(builder, STOP, **options)
        spent = time.perf_counter() - begin
        best = min(best, spent) if turn else best
    t, v = np.asarray(result.times), np.asarray(result.v(node))
    return {"name": name, "seconds": best, "t": t.tolist(), "v": v.tolist()}


def main() -> None:
    """Print one line per run."""
    for deck, made, node in (("buck", buck, "out"), ("dcm_rectifier", dcm_rectifier, "c")):
        for engine, options in (
            ("dsed", {"engine": "dsed"}),
            ("dsed rtol=1e-10", {"engine": "dsed", "rtol": 1e-10, "atol": 1e-13}),
            ("fixed step 100 ns", {"dt": 1e-7}),
        ):
            try:
                found = run(f"{deck}: {engine}", made, node, **options)
            except Exception as error:  # what a peer refuses is part of the result
                found = {"name": f"{deck}: {engine}", "error": str(error)[:200]}
            json.dump(found, sys.stdout)
            print(flush=True)


if __name__ == "__main__":
    main()
