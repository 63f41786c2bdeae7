"""Runs of Pulsim 2, in a process of its own: a Python with pulsim prints JSON, one line per run.

usage: PYTHON_WITH_PULSIM tests/benchmarks/pulsim_runs.py
"""

from __future__ import annotations

import functools
import json
import sys
import time
from typing import Any

import numpy as np
import pulsim

G_ON, G_OFF = 1e9, 1e-12
PERIOD = 10e-6


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


def boost(drop: float = 0.0) -> tuple[Any, Any]:
    """Return the converter of netlists/converters/boost.net."""
    b = pulsim.CircuitBuilder()
    b.add_voltage_source("Vin", "in", "gnd", 12.0)
    b.add_inductor("L1", "in", "sw", 100e-6, 0.0)
    b.add_switch("S1", "sw", "gnd", G_ON, G_OFF)
    b.add_diode("D1", "sw", "out", G_ON, G_OFF, drop)
    b.add_capacitor("C1", "out", "gnd", 100e-6, 0.0)
    b.add_resistor("R1", "out", "gnd", 20.0)
    return b, pulsim.NativePwm2Switch(PERIOD, 0.5, 2)


def lc_bridge(drop: float = 0.0) -> tuple[Any, Any]:
    """Return the oscillator of netlists/converters/lc_bridge_charger.net."""
    b = pulsim.CircuitBuilder()
    b.add_capacitor("C1", "top", "gnd", 1e-6, 100.0)
    b.add_inductor("L1", "top", "acp", 1e-3, 0.0)
    for name, anode, cathode in (
        ("D1", "acp", "p"), ("D2", "gnd", "p"), ("D3", "n", "acp"), ("D4", "n", "gnd")
    ):  # fmt: skip
        b.add_diode(name, anode, cathode, G_ON, G_OFF, drop)
    b.add_voltage_source("Vbat", "p", "n", 12.0)
    return b, None


def half_wave(drop: float = 0.0) -> tuple[Any, Any]:
    """Return the rectifier of netlists/rectifiers/half_wave_capacitor.net."""
    b = pulsim.CircuitBuilder()
    b.add_sine_voltage_source("V1", "in", "gnd", 0.0, 10.0, 50.0)
    b.add_diode("D1", "in", "out", G_ON, G_OFF, drop)
    b.add_capacitor("C1", "out", "gnd", 100e-6, 0.0)
    b.add_resistor("R1", "out", "gnd", 1e3)
    return b, None


def full_bridge(drop: float = 0.0) -> tuple[Any, Any]:
    """Return the rectifier of netlists/rectifiers/full_bridge_capacitor.net, n being ground."""
    b = pulsim.CircuitBuilder()
    b.add_sine_voltage_source("V1", "acp", "acn", 0.0, 325.0, 50.0)
    for name, anode, cathode in (
        ("D1", "acp", "p"), ("D2", "acn", "p"), ("D3", "gnd", "acp"), ("D4", "gnd", "acn")
    ):  # fmt: skip
        b.add_diode(name, anode, cathode, G_ON, G_OFF, drop)
    b.add_capacitor("C1", "p", "gnd", 220e-6, 0.0)
    b.add_resistor("R1", "p", "gnd", 500.0)
    return b, None


def run(name: str, made: Any, node: str, stop: float, **options: Any) -> dict[str, Any]:
    """Run once to warm up and thrice for the time; return times and the wanted node's voltage."""
    best = float("inf")
    for turn in range(4):
        builder, gate = made()
        if gate is not None:
            # the fixed step wants a plain function
            plain = pulsim.make_pwm_switch_fn(1.0 / PERIOD, 0.5, 0, 2)
            options["switch_fn"] = plain if "dt" in options else gate
        begin = time.perf_counter()
        result = pulsim.simulate(builder, stop, **options)
        spent = time.perf_counter() - begin
        best = min(best, spent) if turn else best
    t, v = np.asarray(result.times), np.asarray(result.v(node))
    return {"name": name, "seconds": best, "t": t.tolist(), "v": v.tolist()}


def main() -> None:
    """Print one line per run."""
    for deck, made, node, stop in (
        ("buck", buck, "out", 5e-3),
        ("dcm_rectifier", dcm_rectifier, "c", 5e-3),
        ("boost", boost, "out", 5e-3),
        ("lc_bridge", lc_bridge, "top", 500e-6),
        ("half_wave", half_wave, "out", 60e-3),
        ("full_bridge", full_bridge, "p", 60e-3),
    ):
        for engine, options in (
            ("dsed", {"engine": "dsed"}),
            ("dsed rtol=1e-10", {"engine": "dsed", "rtol": 1e-10, "atol": 1e-13}),
            ("dsed, threshold 1 uV", {"engine": "dsed", "drop": 1e-6}),
            ("fixed step 100 ns", {"dt": 1e-7}),
        ):
            drop = options.pop("drop", None)
            if drop is not None and deck in ("buck", "dcm_rectifier"):
                continue  # they run without
            make = made if drop is None else functools.partial(made, drop)
            try:
                found = run(f"{deck}: {engine}", make, node, stop, **options)
            except Exception as error:  # what a peer refuses is part of the result
                found = {"name": f"{deck}: {engine}", "error": str(error)[:200]}
            json.dump(found, sys.stdout)
            print(flush=True)


if __name__ == "__main__":
    main()
