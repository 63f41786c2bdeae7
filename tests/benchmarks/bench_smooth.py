"""Cost of smooth laws, side by side with ngspice on the same netlists.

Both sides are timed inside their processes, without reading the deck: nsspice around the call of
the analysis, ngspice around its ``run``.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from side_by_side import Stopwatch, alternate, report

import nsspice
from nsspice.circuit import Circuit
from nsspice.compare import ngspice
from nsspice.problems.csc import Floats

NETLISTS = Path(__file__).parents[2] / "netlists"
#: what people run: tolerances as ngspice has them by default
DEFAULTS = {"reltol": 1e-3, "vntol": 1e-6, "abstol": 1e-12, "gmin": 1e-12, "method": "trap"}


class Timed:
    """One program on one deck: seconds of a run and of an accepted point."""

    def __init__(self) -> None:
        self.points = 0
        self.seconds: list[float] = []

    @property
    def per_point(self) -> float:
        return min(self.seconds) / self.points


class Own(Timed):
    """nsspice."""

    def __init__(self, circuit: Circuit, **options: object) -> None:
        super().__init__()
        self.circuit, self.options = circuit, options

    def __call__(self) -> float:
        # ngspice's process has just read its deck; this one has slept meanwhile
        for _ in range(2):
            begin = time.perf_counter()
            found = nsspice.tran(self.circuit, sink=Stopwatch(), keep=False, **self.options)
            spent = time.perf_counter() - begin
        self.seconds.append(spent)
        self.points = max(run.stats["steps"] for run in found.islands)
        return self.seconds[-1]


class Other(Timed):
    """ngspice."""

    def __init__(self, circuit: Circuit, **options: object) -> None:
        super().__init__()
        self.circuit, self.options = circuit, options

    def __call__(self) -> float:
        found = ngspice.run(self.circuit, **self.options)
        self.seconds.append(found.seconds)
        self.points = found.points
        return found.seconds


def race(own: Own, other: Other, rounds: int, title: str) -> None:
    """Run both in turn and print what they took."""
    alternate({"nsspice": own, "ngspice": other}, rounds=rounds)
    rows = []
    for name, side in (("nsspice", own), ("ngspice", other)):
        text = f"{1e3 * min(side.seconds):.1f} ms, {side.points} points"
        rows.append((name, f"{text}, {1e6 * side.per_point:.2f} us each"))
    each = own.per_point / other.per_point
    whole = min(own.seconds) / min(other.seconds)
    report(title, [*rows, ("nsspice / ngspice", f"{each:.2f} a point, {whole:.2f} the run")])


BRIDGE = NETLISTS / "smooth/bridge.net"
#: without a resistor from every node to ground ngspice fails with "timestep too small"
SHUNT = {"rshunt": 1e7}


def test_shockley_bridge_takes_a_quarter_of_the_time_per_point() -> None:
    """Like with like: one implicit solve a point on both sides."""
    circuit = nsspice.read(BRIDGE)
    step = circuit.deck.analyses[0].tmax
    own = Own(circuit, method="moreau")
    other = Other(circuit, **DEFAULTS, max_step=step, **SHUNT)
    race(own, other, 7, f"Shockley bridge, moreau, largest step {step:g} s")
    assert own.per_point <= 0.25 * other.per_point


def test_shockley_bridge_meets_the_error_of_ngspice_in_half_its_time() -> None:
    """The default method solves five stages a point, which are worth other steps than ngspice's."""
    circuit = nsspice.read(BRIDGE)
    card = circuit.deck.analyses[0]
    rows = {"stop": card.tstop, "row_step": card.tstep, "uic": True, "signals": ["v(p,q)"]}
    exact = nsspice.tran(circuit, **rows, method="sdirk", reltol=1e-9)

    def error(time: Floats, values: Floats) -> float:
        return float(np.abs(np.interp(exact.time, time, values) - exact["v(p,q)"]).max())

    found = ngspice.run(circuit, **DEFAULTS, max_step=card.tmax, **SHUNT)
    theirs = error(found.time, found["v(p)"] - found["v(q)"])
    run = nsspice.tran(circuit, **rows, method="sdirk", reltol=1e-4, step=1e-3)
    ours = error(run.time, run["v(p,q)"])
    own = Own(circuit, **rows, method="sdirk", reltol=1e-4, step=1e-3)
    other = Other(circuit, **DEFAULTS, max_step=card.tmax, **SHUNT)
    race(own, other, 7, f"Shockley bridge, sdirk, errors {ours:.1e} V and {theirs:.1e} V")
    assert ours <= theirs
    assert min(own.seconds) <= 0.5 * min(other.seconds)


def adder(**options: object) -> tuple[Own, Other]:
    """Run the adder by nsspice with these options and by ngspice with its defaults."""
    circuit = nsspice.read(NETLISTS / "bipolar/adder_4bit.net")
    step = circuit.deck.analyses[0].tmax
    own, other = Own(circuit, **options), Other(circuit, **DEFAULTS, max_step=step)
    race(own, other, 2, f"adder, 180 transistors, 108 diodes, {options}, largest step {step:g} s")
    return own, other


# like with like: the deck's own method, and control of the error with the tolerance of ngspice
@pytest.mark.parametrize(
    "options", [{"method": "moreau"}, {"method": "sdirk", "reltol": DEFAULTS["reltol"]}]
)
def test_four_bit_adder_is_no_slower(options: dict[str, object]) -> None:
    own, other = adder(**options)
    assert min(own.seconds) <= min(other.seconds)


def test_four_bit_adder_with_a_hundredth_of_the_tolerance() -> None:
    """With the default tolerance, 1e-5, errors are thousands of times less."""
    own, other = adder(method="auto")
    assert min(own.seconds) <= 2.0 * min(other.seconds)
