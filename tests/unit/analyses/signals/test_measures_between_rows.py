"""Measures do not depend on where the rows fall: what comes and goes between two of them counts.

Measures were taken from lines between the rows and both sides of jumps: a surge that lasts a
thousandth of the distance of the rows became a triangle as wide as they, 50 times its charge.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.analyses import Settings
from nsspice.analyses.transient.measure import evaluate_measures

#: closed forms are integrated to rounding, and instants are sums of some hundred lengths
EXACT = 1e-12
#: errors of sdirk, of some steps in a row
STEPS = 5.0 * Settings().reltol


def measures(text: str, method: str = "auto") -> dict[str, float]:
    run = nsspice.tran(nsspice.read(text), method=method)
    assert run.certificate is not None
    assert run.certificate.passed
    evaluate_measures(run, nsspice.read(text).deck.measures)
    return run.measures


SURGE = """1 uF from 12 V through a closing switch of 1 Ohm: 12 uC in a microsecond
V1 a 0 12
Vg g 0 PULSE(0 1 1m 0 0 5m 10m)
S1 a b g 0 sw
C1 b 0 1u
.model sw SW(VT=0.5 RON=1 ROFF=1g)
.tran 100u 3m uic
.meas tran charge integ -i(v1)
.meas tran energy integ -i(v1)*12
.meas tran peak max -i(v1)
"""


@pytest.mark.parametrize(("method", "error"), [("modewise", EXACT), ("sdirk", STEPS)])
def test_the_charge_of_a_surge(method: str, error: float) -> None:
    found = measures(SURGE, method)
    # all that 1 uF takes up to 12 V, whatever has come through the open switch before
    charge = 12e-6
    assert found["charge"] == pytest.approx(charge, rel=error)
    assert found["energy"] == pytest.approx(12.0 * charge, rel=error)
    # through the open switch 12 pC have come before, of 1 uF
    assert found["peak"] == pytest.approx(12.0 * math.exp(-1e-6), rel=error)


@pytest.mark.parametrize(("method", "error"), [("modewise", EXACT), ("sdirk", STEPS)])
def test_a_level_that_is_crossed_between_two_rows(method: str, error: float) -> None:
    found = measures(
        "RC\nV1 a 0 3\nR1 a b 1k\nC1 b 0 0.2p ic=0.25\n.tran 10n 80n uic\n"
        ".meas tran t when v(b)=1.5 rise=1\n.meas tran mean avg v(b) from=0 to=1n\n",
        method,
    )
    tau = 200e-12
    assert found["t"] == pytest.approx(tau * math.log(2.75 / 1.5), rel=error)
    mean = 3.0 - 2.75 * tau / 1e-9 * (1.0 - math.exp(-1e-9 / tau))
    assert found["mean"] == pytest.approx(mean, rel=error)


@pytest.mark.parametrize(
    ("load", "error"),
    # 1 pF delays the sine by 1 ps of 1.7 ms; a junction is solved for point by point
    [("", EXACT), ("C1 b 0 1p\n", 1e-9), ("D1 b 0 dz\n.model dz D(IS=1e-30)\n", 1e-9)],
)
def test_rows_that_fall_on_the_zeros_of_a_sine(load: str, error: float) -> None:
    """Linear with and without storage, and smooth: what is seen is not what the rows hit."""
    found = measures(
        f"sine\nV1 a 0 SIN(0 0.2 50)\nR1 a b 1\n{load}.tran 10m 100m\n"
        ".meas tran top max v(b)\n.meas tran eff rms v(b)\n.meas tran t when v(b)=0.1 rise=1\n"
    )
    assert found["top"] == pytest.approx(0.2, rel=error)
    assert found["eff"] == pytest.approx(0.2 / math.sqrt(2.0), rel=error)
    assert found["t"] == pytest.approx(math.asin(0.5) / (100.0 * math.pi), rel=error)


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_a_corner_between_two_rows(method: str) -> None:
    """A coil runs empty through its diode, 0.31 of a row after it was switched off."""
    found = measures(
        "coil\nV1 a 0 10\nS1 a b g 0 sw\nD1 0 b\nL1 b c 1m IC=0\nVc c 0 5\n"
        "Vg g 0 PULSE(0 1 0 0 0 1m 1)\n.model sw SW(VT=0.5)\n.tran 0.9m 4.5m uic\n"
        ".meas tran charge integ i(l1)\n.meas tran top max i(l1)\n",
        method,
    )
    assert found["top"] == pytest.approx(5.0, rel=1e-9)
    # up to 5 A in 1 ms, down to 0 in 1 ms
    assert found["charge"] == pytest.approx(5e-3, rel=1e-9)


@pytest.mark.parametrize("leak", ["", "R1 b 0 1g\n"])
def test_a_ripple_whose_rows_are_a_period_apart(leak: str) -> None:
    """A triangle of current makes parabolas of the voltage: equal at all rows and all corners."""
    found = measures(
        "ripple\nI1 0 b PULSE(-0.25 0.25 0 5u 5u 0 10u)\nC1 b 0 1u IC=12\n"
        f"{leak}.tran 10u 100u uic\n.meas tran ripple pp v(b)\n.meas tran top max v(b)\n"
    )
    # 0.125 A in the mean, for half a period; 12 nA through 1 GOhm take 1.2 uV in all
    assert found["ripple"] == pytest.approx(0.625, abs=2e-6 if leak else EXACT * 12.0)
    assert found["top"] == pytest.approx(12.3125, abs=2e-6 if leak else EXACT * 12.0)


def test_a_ripple_far_below_the_voltage() -> None:
    """The valley of a buck converter's output lies 3.7 mV below 12 V, between two switchings."""
    found = measures(
        "half a period\nV1 a 0 24\nL1 a b 100u IC=-0.3\nC1 b 0 100u IC=12\n"
        ".tran 5u 5u uic\n.meas tran low min v(b)\n"
    )
    valley = math.hypot(12.0, 0.3) - 12.0  # the impedance is 1 Ohm
    assert 12.0 - found["low"] == pytest.approx(valley, abs=EXACT * 12.0)


def test_a_mean_between_rows_that_are_near_beside_the_time_constant() -> None:
    """What rises to a part of its final value bends little beside that, and much beside itself."""
    found = measures(
        "coil\nV1 a 0 34\nR1 a b 0.5\nL1 b 0 2m IC=0\n.tran 30u 30u uic\n"
        ".meas tran mean avg i(l1)\n"
    )
    x = 30e-6 / 4e-3
    assert found["mean"] == pytest.approx(68.0 * (1.0 + math.expm1(-x) / x), rel=1e-11)


@pytest.mark.parametrize(
    ("method", "error"),
    # 1 pF through 1 Ohm to 1 GOhm is charged 1e-12 s late, of 1e-5 s
    [("modewise", 1e-6), ("sdirk", STEPS), ("moreau", 1e-6)],
)
def test_products_of_lines_are_no_lines(method: str, error: float) -> None:
    """A switch that turns off: its voltage rises to 100 V while its current falls from 3 A."""
    found = measures(
        "loss\nV1 a 0 PWL(0 0 10u 100)\nR1 a 0 1k\nC1 a 0 1p\nI1 0 b PWL(0 3 10u 0)\nVb b 0 0\n"
        "R2 a b 1g\n.tran 10u 10u 0 10u\n"
        ".meas tran loss integ v(a)*i(vb)\n.meas tran top max v(a)*i(vb)\n"
        ".meas tran square avg v(a)*v(a)\n.meas tran bent avg abs(v(a)-50)\n"
        ".meas tran t when v(a)*v(a)=2500\n",
        method,
    )
    assert found["loss"] == pytest.approx(100.0 * 3.0 * 10e-6 / 6.0, rel=error)
    assert found["top"] == pytest.approx(75.0, rel=error)
    assert found["square"] == pytest.approx(1e4 / 3.0, rel=error)
    assert found["bent"] == pytest.approx(25.0, rel=error)
    assert found["t"] == pytest.approx(5e-6, rel=error)


def test_parts_that_know_nothing_of_each_other() -> None:
    """A surge in one, a slow discharge in the other: each keeps its own points."""
    found = measures(
        SURGE.replace(".tran", "C9 z 0 1m IC=2\nR9 z 0 10\n.tran")
        + ".meas tran slow integ v(z)/10\n.meas tran both integ v(z)+v(b)\n"
    )
    assert found["charge"] == pytest.approx(12e-6, rel=EXACT)
    slow = 2e-3 * (1.0 - math.exp(-0.3))
    assert found["slow"] == pytest.approx(slow, rel=EXACT)
    # through 1 GOhm it rises to 12 uV before it is charged within 1 us
    before = 12.0 * (1e-3 + 1e3 * math.expm1(-1e-6))
    after = 12.0 * 2e-3 - 12.0 * math.exp(-1e-6) * 1e-6
    assert found["both"] == pytest.approx(10.0 * slow + before + after, rel=EXACT)


def test_the_rows_themselves_stay_as_they_are() -> None:
    plain = nsspice.tran(nsspice.read(SURGE.split(".meas")[0]))
    measured = nsspice.tran(nsspice.read(SURGE))
    assert np.array_equal(plain.axis, measured.axis)
    assert all(np.array_equal(plain[name], measured[name]) for name in plain.columns)


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_what_is_measured_is_recorded_when_it_is(method: str) -> None:
    plain = SURGE.split(".meas")[0]

    def recorded(card: str) -> tuple[float, float] | None:
        run = nsspice.tran(nsspice.read(plain + card), method=method)
        if run.recording is None:
            return None
        (pieces,) = run.recording.pieces
        assert run.recording.names == [("i(v1)",)]
        return float(pieces.begin[0]), float(pieces.end[-1])

    assert recorded(".meas tran v find v(b) at=2m\n") is None
    within = recorded(".meas tran v integ -i(v1) from=0.9m to=1.05m\n")
    # of a run with fixed steps those are recorded that end in the window
    assert within == pytest.approx((0.9e-3, 1.05e-3), abs=100e-6 if method == "moreau" else 1e-12)


def test_a_mean_between_two_edges_of_a_gate() -> None:
    """Of a ramp, with rows a hundred times as far apart as the edges: the value half-way.

    The gate rises through 1 V after 2.2 us and falls through it after 5.8 us; the ramp is 1 V/us.
    """
    text = """window by events
V1 g 0 PULSE(0 5 2u 1u 1u 2u 100u)
V2 r 0 PWL(0 0 1m 1000)
R1 g 0 1k
R2 r 0 1k
.tran 100u 1m
.meas mean avg v(r) trig v(g)=1 rise=1 targ v(g)=1 fall=1
.meas tran charge integ i(r2) trig v(g) val=1 rise=1 targ v(g) val=1 fall=1
"""
    measures = nsspice.read(text).run()[0].measures
    assert measures["mean"] == pytest.approx(4.0, rel=1e-9)
    assert measures["charge"] == pytest.approx(4e-3 * 3.6e-6, rel=1e-9)
