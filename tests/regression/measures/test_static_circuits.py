"""Circuits without storage: what lies between the rows counts as everywhere else.

With rows of a whole period the average of a rectified sine was 3 % off, its maximum 5 %, and
``--tol`` told an error of 0.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nsspice

DECK = Path(__file__).with_name("st2.net").read_text()
#: the same with a junction
SMOOTH = DECK.replace("D1 a b", "D1 a b d\n.model d D(IS=1e-14)").replace("0.5 ", "0.1 ")


@pytest.fixture(scope="module")
def ideal() -> nsspice.Solution:
    return nsspice.read(DECK).run()[0]


def test_measures_of_a_rectified_sine_are_exact(ideal: nsspice.Solution) -> None:
    found = ideal.measures
    assert found["avg"] == pytest.approx(1.0 / math.pi, rel=1e-12)
    assert found["rms"] == pytest.approx(0.5, rel=1e-12)
    assert found["mx"] == pytest.approx(1.0, rel=1e-12)
    assert found["mn"] == pytest.approx(0.0, abs=1e-12)
    assert found["q"] == pytest.approx(1e-3 / math.pi, rel=1e-12)
    # from 30 to 150 degrees: a third of a period
    assert found["pw"] == pytest.approx(1e-5 / 3.0, rel=1e-12)


def test_switching_instants_are_those_of_the_diode(ideal: nsspice.Solution) -> None:
    times = np.array([event.time for event in ideal.events])
    assert times == pytest.approx(5e-6 * np.arange(1, 200), rel=1e-12)
    (island,) = ideal.islands
    assert island.method == "modewise"
    assert island.regularity is not None
    assert island.regularity.kind == "unique"


def test_all_points_show_breakpoints_and_extremes() -> None:
    sol = nsspice.tran(nsspice.read(DECK), all_points=True)
    for instants in (5e-6 * np.arange(201), 1e-5 * np.arange(100) + 2.5e-6):
        beside = np.abs(np.subtract.outer(instants, sol.time)).min(axis=1)
        assert beside.max() < 1e-15
    assert sol["v(b)"].max() == pytest.approx(1.0, abs=1e-12)


def test_a_tolerance_tells_the_error_that_was_found() -> None:
    error = nsspice.read(DECK).run(tol=1e-6)[0].error
    assert error is not None
    assert 0.0 < error.value < 1e-12
    assert "exact engine" in error.how


@pytest.mark.parametrize("reltol", [1e-5, 1e-8])
def test_smooth_laws_are_followed_to_the_tolerance(reltol: float) -> None:
    # v = i + vt ln(1 + i / IS), at so many points of a period that their mean is the integral
    vt = 1.380649e-23 * 300.15 / 1.602176634e-19
    volts = np.sin(2.0 * math.pi * (np.arange(1 << 14) + 0.5) / (1 << 14))
    drop = np.minimum(volts, 0.7)
    for _ in range(200):
        law = 1e-14 * np.expm1(drop / vt)
        drop -= (law - (volts - drop)) / ((law + 1e-14) / vt + 1.0)
    current = volts - drop
    sol = nsspice.read(SMOOTH).run(reltol=reltol)[0]
    assert sol.measures["avg"] == pytest.approx(current.mean(), rel=reltol)
    assert sol.measures["rms"] == pytest.approx(np.sqrt((current**2).mean()), rel=reltol)
    assert sol.measures["mx"] == pytest.approx(current.max(), rel=1e-6)


@pytest.mark.parametrize("smooth", [False, True])
def test_a_law_with_a_kink_between_the_rows(smooth: bool) -> None:
    """The mean of |sin - 1/2|, whatever the rows see of its kinks.

    With all else linear the kinks are pairs and the mean is exact; a product of signals leaves them
    on the tape, where steps follow the law to their tolerance.
    """
    law = "v(one)*abs(v(a)-0.5)" if smooth else "abs(v(a)-0.5)"
    deck = f"abs\nV1 a 0 SIN(0 1 1k)\nV2 one 0 1\nB1 b 0 V={law}\nR1 b 0 1\n.tran 0.5m 1m\n"
    sol = nsspice.read(deck).run(reltol=1e-9)[0]
    assert ("point by point" in {island.method for island in sol.islands}) == smooth
    # by hand: the angle a = asin(1/2), 2 (cos a + a / 2) / pi
    exact = 2.0 * (math.cos(math.pi / 6.0) + math.pi / 12.0) / math.pi
    assert sol.average("v(b)") == pytest.approx(exact, rel=1e-6 if smooth else 1e-12)
    assert sol.minimum("v(b)") == pytest.approx(0.0, abs=1e-3 if smooth else 1e-12)


def test_a_method_that_cannot_is_not_replaced_in_silence() -> None:
    with pytest.raises(nsspice.UsageError, match="NS4020"):
        nsspice.read(SMOOTH).run(method="modewise")
    (island,) = nsspice.read(DECK).run(method="moreau")[0].islands
    assert island.method == "point by point"
    assert "without stored energy" in island.note


def test_steps_with_error_control_find_the_instants_of_static_circuits() -> None:
    """They were replaced by points, and events at these were a thousandth of the run late."""
    exact, found = (nsspice.read(DECK).run(method=method)[0] for method in ("modewise", "sdirk"))
    assert found.islands[0].method == "sdirk"
    assert found.islands[0].note == ""
    # at both ends the sine is zero, and has or has not begun
    inside = [[e for e in run.events if 1e-6 < e.time < 0.999e-3] for run in (found, exact)]
    changes = [[e.change for e in events] for events in inside]
    assert changes[0] == changes[1]
    assert len(changes[0]) == 199
    # a guard counts as negative beyond 1e-11 of 1 V, the sine passes that with its slope at zero
    times = [np.array([e.time for e in events]) for events in inside]
    assert np.abs(times[0] - times[1]).max() <= 1.1e-11 / (2.0 * math.pi * 1e5)


def test_hysteresis_switches_at_its_thresholds_not_at_rows() -> None:
    deck = """comparator with hysteresis
V1 g 0 SIN(0 1 1k)
V2 a 0 1
S1 a b g 0 sw
R1 b 0 1
.model sw SW(VT=0.1 VH=0.4)
.tran 0.3m 3m
"""
    sol = nsspice.read(deck).run()[0]
    on, off = math.asin(0.5) / (2e3 * math.pi), (math.pi + math.asin(0.3)) / (2e3 * math.pi)
    assert sol.average("v(b)") == pytest.approx((off - on) / 1e-3, rel=1e-12)
    assert sol.crossings("v(b)", 0.5, "rise") == pytest.approx(on + 1e-3 * np.arange(3), rel=1e-12)


def test_the_start_is_one_of_several_solutions() -> None:
    """Two inverters that hold each other have two states; .nodeset says which."""
    latch = "latch\nE1 a 0 TABLE {v(b)} = (0,5) (2,5) (3,0) (5,0)\nR1 a x 1k\nR2 x 0 1meg\n"
    latch += "E2 b 0 TABLE {v(x)} = (0,5) (2,5) (3,0) (5,0)\nR3 b 0 1k\n.tran 1u 5u\n"
    for a in (5.0, 0.0):
        sol = nsspice.read(latch + f".nodeset v(a)={a} v(x)={a} v(b)={5.0 - a}\n").run()[0]
        assert sol["v(a)"] == pytest.approx(np.full(6, a), abs=1e-6)
