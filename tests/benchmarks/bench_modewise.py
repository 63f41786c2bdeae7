"""Cost of the mode-wise engine: some circuits, and its growth with the number of states.

    python tests/benchmarks/bench_modewise.py [--large]

Times are the least of several runs, inside the process: from the assembled system to the last row,
processor time where others use the machine.  Errors are those of the same ladder without its diode,
whose response to a pulse train is known in closed form.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import nsspice
from nsspice.solvers.modewise import ModewiseStepper

BUCK = """buck
Vin in 0 DC 24
S1 in sw g 0 SWITCH
D1 0 sw DI
L1 sw out 100u IC=0
C1 out 0 100u IC=0
Rload out 0 5
Vgate g 0 PULSE(0 1 0 0 0 5u 10u)
.model SWITCH SW(VT=0.5)
.model DI D(ideal)
"""

OSCILLATOR = """bridge oscillator
C0 n1 0 1u IC=10
L1 n1 0 10m IC=0
D1 n1 p DI
D2 0 p DI
D3 n 0 DI
D4 n n1 DI
R1 p n 1k
.model DI D(ideal)
"""


def multiplier(stages: int, model: str) -> str:
    """Return a Cockcroft-Walton multiplier: 10 V, 1 kHz, 1 uF, 100 kOhm per stage."""
    lines = ["multiplier", "V1 in 0 SIN(0 10 1k)", "Rs in a0 1"]
    for s in range(1, stages + 1):
        low = "0" if s == 1 else f"b{s - 1}"
        lines += [
            f"Ca{s} a{s - 1} a{s} 1u IC=0", f"Da{s} {low} a{s} DI",
            f"Db{s} a{s} b{s} DI", f"Cb{s} {low} b{s} 1u IC=0",
        ]  # fmt: skip
    lines += [f"RL b{stages} 0 {100e3 * stages:g}", f".model DI D({model})"]
    return "\n".join(lines) + "\n"


def ladder(states: int) -> str:
    """Return an RC ladder behind a chopped source, with a diode at its end: two modes."""
    lines = ["ladder", "V1 n0 0 PULSE(0 10 0 0 0 5u 10u)"]
    for k in range(1, states + 1):
        lines += [f"R{k} n{k - 1} n{k} 10", f"C{k} n{k} 0 10n IC=0"]
    lines += [f"D1 n{states} d DI", "RD d 0 100", ".model DI D(ideal)"]
    return "\n".join(lines) + "\n"


def ladder_error(states: int) -> float:
    """Return the largest error at the end of the ladder over its 10 V, diode left out."""
    text = ladder(states).split("D1 ")[0]
    stop = 550e-6
    mna = nsspice.read(text).islands[0].assemble(27.0)
    stepper = ModewiseStepper(mna.system, [mna.functional(f"v(n{states})")])
    stepper.plan(0.0, stop, stop / 1000, 0.0, stop / 500)
    stepper.start_charges(0.0, mna.initial_charges(), stop / 1000)
    rows = stepper.advance(502, 60.0)[0].copy()
    # rates and shares of the step response: a uniform ladder, open at its end
    angle = (2 * np.arange(1, states + 1) - 1) * np.pi / (2 * states + 1)
    rate = -2.0 * (1.0 - np.cos(angle)) / (10.0 * 10e-9)
    share = np.sin(states * angle) * np.sin(angle) * 4.0 / (2 * states + 1) / (-rate * 10.0 * 10e-9)
    exact = np.zeros(len(rows))
    for k in range(111):  # edges every 5 us, the first one up
        since = rows[:, 0] - k * 5e-6
        after = since > 0.0
        step = -np.expm1(np.outer(since[after], rate)) @ share
        exact[after] += (10.0 if k % 2 == 0 else -10.0) * step
    return float(np.abs(rows[:, 1] - exact).max()) / 10.0


def measure(text: str, stop: float, rows: int, repeat: int) -> tuple[float, dict[str, float]]:
    """Return the least time [s] and the counters."""
    mna = nsspice.read(text).islands[0].assemble(27.0)
    names = [name for name in mna.unknowns if name.startswith("v(")][-2:]
    outputs = [mna.functional(name) for name in names]
    least = float("inf")
    for _ in range(repeat):
        begin = time.process_time()
        stepper = ModewiseStepper(mna.system, outputs)
        stepper.plan(0.0, stop, stop / 1000, 0.0, stop / rows)
        stepper.start_charges(0.0, mna.initial_charges(), stop / 1000)
        while not stepper.advance(rows + 1, 60.0)[1]:
            pass
        least = min(least, time.process_time() - begin)
    return least, stepper.statistics


def orbit() -> float:
    """Seconds of CPU for the periodic steady state of the buck, and its output points."""
    network = nsspice.read(BUCK.replace("buck", "orbit of a buck", 1) + ".pss\n.end\n")
    nsspice.pss(network)
    spent = []
    for _ in range(10):
        begin = time.process_time()
        nsspice.pss(network, row_step=1e-6)
        spent.append(time.process_time() - begin)
    return min(spent)


def main() -> None:
    """Print the tables."""
    cases = [
        ("buck, 5 ms", BUCK, 5e-3, 20),
        ("bridge oscillator, 5 ms", OSCILLATOR, 5e-3, 20),
        ("multiplier of 4, 50 ms", multiplier(4, "Ron=0.1 Roff=1G"), 50e-3, 5),
        ("multiplier of 4, ideal", multiplier(4, "ideal"), 50e-3, 5),
        ("multiplier of 16, 50 ms", multiplier(16, "Ron=0.1 Roff=1G"), 50e-3, 2),
        ("multiplier of 16, ideal", multiplier(16, "ideal"), 50e-3, 2),
    ]
    if "--large" in sys.argv:
        cases.append(("multiplier of 64, ideal", multiplier(64, "ideal"), 20e-3, 1))
        cases.append(("multiplier of 64, 20 ms", multiplier(64, "Ron=0.1 Roff=1G"), 20e-3, 1))
    print(f"{'circuit':26s} {'ms':>9s} {'segments':>9s} {'modes':>6s} {'us/segment':>11s}")
    for name, text, stop, repeat in cases:
        spent, stats = measure(text, stop, 1, repeat)
        segments = stats["segments"]
        print(
            f"{name:26s} {spent * 1e3:9.3f} {segments:9d} {stats['modes']:6d} "
            f"{spent / segments * 1e6:11.2f}"
        )
    print(f"\n{'states':>6s} {'us/segment':>11s} {'us/row':>8s} {'ms/new mode':>12s} {'error':>8s}")
    for states in (4, 8, 16, 32, 64, 100, 150, 200):
        text = ladder(states)
        short, few = measure(text, 50e-6, 1, 3)
        long, many = measure(text, 550e-6, 1, 3)
        rows, _ = measure(text, 550e-6, 5000, 3)
        segments = many["segments"] - few["segments"]
        print(
            f"{states:6d} {(long - short) / segments * 1e6:11.2f} "
            f"{(rows - long) / 5000 * 1e6:8.2f} {short / max(1, few['reduced']) * 1e3:12.3f} "
            f"{ladder_error(states):8.1e}"
        )
    print(f"\nperiodic steady state of the buck: {orbit() * 1e3:.1f} ms")


if __name__ == "__main__":
    main()
