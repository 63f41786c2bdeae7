"""Pulsim 2 on one deck: reads its description from the input, prints a line of JSON per run.

Run by the Python that has it: ``PULSIM_PYTHON tools/peers/pulsim_runs.py < deck.json``.
"""

from __future__ import annotations

import json
import math
import sys
import time
import warnings
from typing import Any

import numpy as np
import pulsim

G_ON, G_OFF = 1e9, 1e-12  # [S] where the deck's diodes and switches are ideal
THRESHOLDS = (0.0, 1e-6, 1e-3)  # [V] of diodes: the event-driven engine refuses many without
REPEATS = 4  # the first warms up
SHORT = 0.1  # [s] longer runs are not repeated
MOST_POINTS = 20_000


def build(deck: list[dict[str, Any]], threshold: float) -> tuple[Any, dict[str, Any]]:
    """Return the circuit and the arguments that drive its switch."""
    b = pulsim.CircuitBuilder()
    drive: dict[str, Any] = {}
    switches = [e for e in deck if e["kind"] in "sd"]
    for e in deck:
        name = e["name"]
        p, n = ("gnd" if node == "0" else node for node in e["nodes"])
        match e["kind"]:
            case "r":
                b.add_resistor(name, p, n, e["value"])
            case "c":
                b.add_capacitor(name, p, n, e["value"], e["ic"] or 0.0)
            case "l":
                b.add_inductor(name, p, n, e["value"], e["ic"] or 0.0)
            case "v" if e["amplitude"]:
                b.add_sine_voltage_source(
                    name, p, n, e["dc"], e["amplitude"], e["frequency"], e["phase"]
                )
            case "v":
                b.add_voltage_source(name, p, n, e["dc"])
            case "d":
                on = 1.0 / e["ron"] if e["ron"] else G_ON
                off = 1.0 / e["roff"] if e["roff"] else G_OFF
                b.add_diode(name, p, n, on, off, (e["vfwd"] or 0.0) + threshold)
            case "s":
                b.add_switch(name, p, n, G_ON, G_OFF)
                # its own fast law: the switch in the first part of a period, then the diode
                drive = {
                    "native": pulsim.NativePwm2Switch(e["period"], e["duty"], len(switches)),
                    "plain": pulsim.make_pwm_switch_fn(
                        1.0 / e["period"], e["duty"], switches.index(e), len(switches)
                    ),
                }
    return b, drive


def run(job: dict[str, Any], threshold: float, options: dict[str, Any]) -> dict[str, Any]:
    """Run until the time is known; return it with the waveforms."""
    best, result = math.inf, None
    for turn in range(REPEATS):
        builder, drive = build(job["elements"], threshold)
        if drive:
            options["switch_fn"] = drive["plain" if options["engine"] == "pwl" else "native"]
        begin = time.perf_counter()
        result = pulsim.simulate(builder, job["stop"], **options)
        spent = time.perf_counter() - begin
        best = min(best, spent) if turn else spent
        if spent > SHORT:
            break
    t = np.asarray(result.times)
    thin = max(1, math.ceil(len(t) / MOST_POINTS))
    values = {}
    for signal in job["signals"]:
        kind, names = signal[0], signal[2:-1].split(",")
        if kind == "i":
            wave = np.asarray(result.i(names[0]))
        else:
            wave = sum(
                sign * np.asarray(result.v(node))
                for sign, node in zip((1.0, -1.0), names, strict=False)
                if node != "0"
            )
        values[signal] = wave[::thin].tolist()
    return {"seconds": best, "steps": len(t) - 1, "t": t[::thin].tolist(), "values": values}


def ladders(row: float, stop: float) -> list[tuple[str, str, list[float], Any]]:
    """Return name, parameter, its values and the options made of one, for each engine."""

    def event_driven(tolerance: float) -> dict[str, Any]:
        return {"engine": "dsed", "rtol": tolerance, "atol": 1e-3 * tolerance}

    def controlled(tolerance: float) -> dict[str, Any]:
        return {"engine": "trbdf2", "rtol": tolerance, "atol": 1e-3 * tolerance, "dt": row}

    def capped(step: float) -> dict[str, Any]:
        # its longest step is 10 us unless told otherwise: slow rectifiers gain from a longer one
        return {"engine": "dsed", "rtol": 1e-8, "atol": 1e-11, "dt": step}

    def fixed(step: float) -> dict[str, Any]:
        return {"engine": "pwl", "dt": step}

    return [
        ("pulsim-dsed", "rtol", [1e-4, 1e-8], event_driven),
        ("pulsim-dsed", "h<", [stop / 20.0, stop / 500.0], capped),
        ("pulsim-trbdf2", "rtol", [1e-3, 1e-5, 1e-8], controlled),
        ("pulsim-fixed", "h", [row / 4**k for k in range(12)], fixed),
    ]


def first_that_runs(job: dict[str, Any], options: dict[str, Any]) -> tuple[dict[str, Any], float]:
    """Return a run and the threshold that it took."""
    for threshold in THRESHOLDS:
        try:
            return run(job, threshold, options), threshold
        except Exception:
            if threshold == THRESHOLDS[-1] or options["engine"] != "dsed":
                raise
    raise AssertionError


def main() -> None:
    """Run the ladders; each ends before a run that would take longer than the limit."""
    warnings.simplefilter("ignore")
    job = json.load(sys.stdin)
    for name, parameter, values, make in ladders(job["row"], job["stop"]):
        last = 0.0
        for value in values:
            if 4.0 * last > job["limit"]:
                break
            line: dict[str, Any] = {"method": name, "parameter": parameter, "value": value}
            try:
                found, threshold = first_that_runs(job, make(value))
                line |= found
                last = found["seconds"]
                if threshold:
                    line["method"] += f"+{1e6 * threshold:g}uV"
            except Exception as error:  # what a peer refuses is part of the result
                line["note"] = f"fails: {str(error).strip().splitlines()[0][:100]}"
            print("\n" + json.dumps(line), flush=True)
            if "note" in line and name != "pulsim-dsed":
                break


if __name__ == "__main__":
    main()
