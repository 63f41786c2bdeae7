"""Periodic steady state of the collection's buck, by Pulsim 2: time and error by step.

Run by the Python that has it: ``PULSIM_PYTHON tools/peers/pulsim_steady.py``.  The exact state at
the rising edge is that of two matrix exponentials.
"""

from __future__ import annotations

import time

import numpy as np
import pulsim

PERIOD, VIN, L, C, R = 10e-6, 24.0, 100e-6, 100e-6, 5.0
G_ON, G_OFF = 1e9, 1e-12  # [S] of its diode and switch, ideal in the deck
REPEATS = 4


def build() -> pulsim.CircuitBuilder:
    """Return the circuit."""
    b = pulsim.CircuitBuilder()
    b.add_voltage_source("Vin", "in", "gnd", VIN)
    b.add_switch("S1", "in", "sw", G_ON, G_OFF)
    b.add_diode("D1", "gnd", "sw", G_ON, G_OFF, 0.0)
    b.add_inductor("L1", "sw", "out", L, 0.0)
    b.add_capacitor("C1", "out", "gnd", C, 0.0)
    b.add_resistor("R1", "out", "gnd", R)
    return b


def flow(drive: float) -> np.ndarray:
    """Return the affine map of half a period."""
    A = np.array([[0.0, -1.0 / L, drive / L], [1.0 / C, -1.0 / (R * C), 0.0], [0.0, 0.0, 0.0]])
    A *= 0.5 * PERIOD / 2**10
    term, total = np.eye(3), np.eye(3)
    for k in range(1, 20):
        term = term @ A / k
        total = total + term
    return np.linalg.matrix_power(total, 2**10)


def main() -> None:
    """Print a line per step."""
    on = flow(VIN)
    whole = flow(0.0) @ on
    low = np.linalg.solve(np.eye(2) - whole[:2, :2], whole[:2, 2])
    high = (on @ np.append(low, 1.0))[0]
    print("steps a period | ms | least current off by | ripple off by | mean of v(out) off by")
    for count in (100, 1000, 10_000):
        drive, best = pulsim.NativePwm2Switch(PERIOD, 0.5, 2), np.inf
        options = {"dt": PERIOD / count, "switch_fn": drive}
        for _ in range(REPEATS):
            begin = time.perf_counter()
            found = pulsim.steady_state(build(), period=PERIOD, **options)
            best = min(best, time.perf_counter() - begin)
        start = found.snapshot
        run = pulsim.simulate(
            build(), float(start.t) + PERIOD, engine="pwl", resume_from=start, **options
        )
        t, v, i = (np.asarray(x) for x in (run.times, run.v("out"), run.i("L1")))
        print(
            f"{count} | {1e3 * best:.1f} | {abs(i.min() - low[0]):.1e} A | "
            f"{abs(np.ptp(i) - (high - low[0])):.1e} A | "
            f"{abs(np.trapezoid(v, t) / PERIOD - 12.0):.1e} V"
        )


if __name__ == "__main__":
    main()
