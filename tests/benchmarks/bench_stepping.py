"""Cost of a time step, side by side with ngspice.

The bounds are ratios to ngspice in the same run.  They come from the aims on the machine the
project was planned on: 100 ns against 3000 ns a point for the bridge oscillator, 80 us against 912
us for a multiplier with 2000 diodes.
"""

from __future__ import annotations

import itertools
import math

from benchmark_decks import bridge_oscillator, multiplier
from side_by_side import alternate, ngspice_point, nsspice_step, report

JUNCTION = "D(IS=1e-14 N=0.05)"


def step_of_multiplier(diodes: int) -> float:
    return nsspice_step(lambda t: multiplier(diodes, stop=t), 4e-3)


def test_bridge_oscillator_is_thirty_times_faster_than_ngspice() -> None:
    sharp = bridge_oscillator(JUNCTION)
    cost = alternate(
        {
            "nsspice": lambda: nsspice_step(lambda t: bridge_oscillator(stop=t), 0.5, theta=0.5),
            "ngspice": lambda: ngspice_point(sharp),
        },
        rounds=9,
    )
    ratio = cost["ngspice"] / cost["nsspice"]
    rows = [(name, f"{1e9 * value:.0f} ns per step") for name, value in cost.items()]
    report(
        "bridge oscillator, h = 1 us, theta = 0.5, all signals", [*rows, ("ratio", f"{ratio:.1f}")]
    )
    assert ratio >= 30


def test_multiplier_is_eleven_times_faster_than_ngspice() -> None:
    sharp = multiplier(2000, JUNCTION, stop=2e-4)
    cost = alternate(
        {"nsspice": lambda: step_of_multiplier(2000), "ngspice": lambda: ngspice_point(sharp)},
        rounds=3,
    )
    ratio = cost["ngspice"] / cost["nsspice"]
    rows = [(name, f"{1e6 * value:.1f} us per step") for name, value in cost.items()]
    report("multiplier, 2000 diodes, h = 1 us, 4 ms", [*rows, ("ratio", f"{ratio:.1f}")])
    assert ratio >= 912 / 80


def test_cost_of_a_multiplier_grows_almost_linearly() -> None:
    sizes = (20, 200, 2000, 20000)
    cost = alternate({str(k): (lambda k=k: step_of_multiplier(k)) for k in sizes}, rounds=3)
    values = [cost[str(k)] for k in sizes]
    exponents = [math.log10(b / a) for a, b in itertools.pairwise(values)]
    rows = [
        (f"{k} diodes", f"{1e6 * v:.2f} us per step") for k, v in zip(sizes, values, strict=True)
    ]
    report("multipliers, h = 1 us, 4 ms, all signals", rows)
    overall = math.log(values[-1] / values[0]) / math.log(sizes[-1] / sizes[0])
    print(f"  exponents {', '.join(f'{e:.2f}' for e in exponents)}; overall {overall:.2f}")
    assert overall <= 1.15
