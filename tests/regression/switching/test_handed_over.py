"""Runs that closed forms would follow for too long are handed over to steps with error control."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.transient import island_runner

#: tenths of a nanohenry and a picofarad ring at 50 GHz while mains charge a capacitor: the diode
#: rectifies each period of it
SNUBBER = """a tenth of both beside a mains period
V1 in 0 SIN(0 300 50)
L1 in a 0.1n IC=0
D1 a o
C2 a o 0.1p IC=0
C1 o 0 1m IC=0
R1 o 0 100
.tran 20u 8m uic
.measure tran mean AVG v(o) FROM=0 TO=8m
"""


@pytest.fixture(scope="module")
def found() -> dict[str, nsspice.Solution]:
    circuit = nsspice.read(SNUBBER)
    return {m: nsspice.tran(circuit, method=m) for m in ("auto", "sdirk")}


def test_steps_take_over_where_they_need_an_eighth_of_the_work(found) -> None:
    auto, steps = found["auto"], found["sdirk"]
    (island,) = auto.islands
    assert island.method == "sdirk"
    assert "have overtaken" in island.note
    assert island.note in auto.summary()
    assert auto.certificate.passed
    # the whole of it is the run by steps, and rows shown before agree within its tolerance
    assert island.stats == steps.islands[0].stats
    assert np.array_equal(auto.time, steps.time)
    late = auto.time > 2e-3
    assert np.array_equal(auto["v(o)"][late], steps["v(o)"][late])
    assert np.abs(auto["v(o)"] - steps["v(o)"]).max() < 1e-5 * 300


def test_it_does_not_depend_on_how_fast_the_machine_is(found, monkeypatch) -> None:
    monkeypatch.setattr(island_runner, "BUDGET", 1e-4)
    slow = nsspice.tran(nsspice.read(SNUBBER))
    assert slow.islands[0].note == found["auto"].islands[0].note
    assert np.array_equal(slow["v(o)"], found["auto"]["v(o)"])


def test_beside_another_island_and_for_measures() -> None:
    deck = SNUBBER + "V2 x 0 SIN(0 1 1k)\nR2 x y 1k\nC3 y 0 1u\n"
    (run,) = nsspice.read(deck).run()
    assert [i.method for i in run.islands] == ["sdirk", "modewise"]
    (alone,) = nsspice.read(SNUBBER).run(method="sdirk")
    assert run.measures["mean"] == pytest.approx(alone.measures["mean"], rel=1e-9)
    assert np.array_equal(run.time, alone.time)


def test_a_long_run_with_few_events_per_step_stays_exact() -> None:
    """A chopper of 30,000 periods: steps need more than a segment for each event."""
    deck = """chopper
V1 a 0 PULSE(0 1 0 1n 1n 5u 10u)
R1 a b 1
D1 b c
C1 c 0 1u IC=0
R2 c 0 10
.tran 1m 0.3 uic
"""
    run = nsspice.tran(nsspice.read(deck))
    (island,) = run.islands
    assert island.method == "modewise"
    assert island.stats["doublings"] >= 1
    assert island.note == ""
