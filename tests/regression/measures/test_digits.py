"""``.measure`` has the digits of the engine: closed forms to 1e-12, steps to the tolerance."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.analyses.solution.window_statistics import trace_of
from nsspice.netlist.expressions.expression import Expression

#: 50 Hz through a diode, with rows of 1.3 ms
RECTIFIER = """rectified sine
V1 a 0 SIN(0 10 50)
D1 a b
R1 b 0 100
C1 b c 1u IC=0
R2 c 0 1
.tran 1.3m 100m uic
.meas tran mean AVG v(b)
.meas tran eff RMS v(b)
.meas tran top MAX v(b)
.meas tran area INTEG v(b) from=1m to=17m
.meas tran power AVG v(a)*i(r1)
.meas tran folded AVG abs(v(a))
.meas tran t WHEN v(a)=5 fall=2
.meas tran at MAX_AT v(a) from=25m to=39m
.meas tran slope DERIV v(a) at=3.3m
.meas tran mid FIND v(a) at=3.3m
"""
OMEGA = 100.0 * math.pi


def test_a_sine_in_closed_form() -> None:
    found = nsspice.read(RECTIFIER).run()[0].measures
    exact = {
        "folded": 20.0 / math.pi,
        "t": (math.pi - math.asin(0.5) + 2.0 * math.pi) / OMEGA,
        "at": 0.025,
        "slope": 10.0 * OMEGA * math.cos(3.3e-3 * OMEGA),
        "mid": 10.0 * math.sin(3.3e-3 * OMEGA),
        "top": 10.0,
    }
    for name, value in exact.items():
        assert found[name] == pytest.approx(value, rel=1e-12), name


@pytest.mark.parametrize(("rows", "reltol"), [("1.3m", 1e-9), ("0.02m", 1e-6)])
def test_steps_agree_to_their_tolerance_whatever_the_rows(rows: str, reltol: float) -> None:
    circuit = nsspice.read(RECTIFIER.replace("1.3m", rows))
    exact = nsspice.read(RECTIFIER).run()[0].measures
    found = circuit.run(method="sdirk", reltol=reltol)[0].measures
    for name, value in exact.items():
        # some hundred steps and twenty switchings
        assert found[name] == pytest.approx(value, rel=100.0 * reltol), name


def test_rows_do_not_change_a_digit() -> None:
    coarse = nsspice.read(RECTIFIER).run()[0].measures
    fine = nsspice.read(RECTIFIER.replace("1.3m", "7u")).run()[0].measures
    assert coarse == pytest.approx(fine, rel=1e-12)


def test_stiff_modes_between_two_rows() -> None:
    """1 pF through 1 Ohm beside 1 mF: charges of both, 1e9 time constants of the first in a row."""
    deck = (
        "stiff\nV1 a 0 PULSE(0 5 1m 0 0 1 2)\nR1 a b 1\nC1 b 0 1p\nR2 a c 1k\nC2 c 0 1m\n"
        ".tran 1m 3m\n.meas tran fast INTEG i(r1)\n.meas tran slow INTEG i(r2)\n"
        ".meas tran top MAX i(r1)\n.meas tran t WHEN v(b)=2.5 rise=1\n"
        ".meas tran heat INTEG v(a,b)*i(r1)\n"
    )
    found = nsspice.read(deck).run()[0].measures
    assert found["fast"] == pytest.approx(5e-12, rel=1e-9)
    assert found["slow"] == pytest.approx(-5e-3 * math.expm1(-2e-3), rel=1e-11)
    assert found["top"] == pytest.approx(5.0, rel=1e-12)
    # an instant of 1 ms has a rounding of 2e-19 s
    assert found["t"] - 1e-3 == pytest.approx(math.log(2.0) * 1e-12, abs=4e-19)
    assert found["heat"] == pytest.approx(12.5e-12, rel=1e-9)


def test_ringing_that_is_faster_than_the_rows() -> None:
    """10 kHz for 20 ms with rows of 1 ms: energies and extremes of the closed form."""
    deck = "tank\nL1 a 0 1m IC=0\nC1 a 0 {1/(1m*(2*pi*10k)**2)} IC=2\n.tran 1m 20m uic\n"
    sol = nsspice.read(deck).run()[0]
    assert np.ptp(sol["v(a)"]) < 1e-9
    assert sol.maximum("v(a)") == pytest.approx(2.0, rel=1e-12)
    assert sol.minimum("v(a)") == pytest.approx(-2.0, rel=1e-12)
    assert sol.rms("v(a)") == pytest.approx(math.sqrt(2.0), rel=1e-11)
    assert sol.average("v(a)") == pytest.approx(0.0, abs=1e-11)
    assert sol.crossings("v(a)", 1.0).size == 400
    fall = sol.crossings("v(a)", 1.0, "fall", 5e-3, 6e-3)
    assert fall == pytest.approx(5e-3 + (np.arange(10) + 1.0 / 6.0) * 1e-4, rel=1e-12)


def test_a_signal_that_was_not_asked_for() -> None:
    deck = (
        "divider\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nR2 b c 1k\nC1 c 0 1u\n.save v(a)\n.tran 0.4m 4m\n"
    )
    sol = nsspice.read(deck).run()[0]
    assert "v(b,c)" not in sol
    # from the DC solution 0: the forced current less what decays with 2 ms
    trace = trace_of(sol, Expression.parse("v(b,c) - 1k*i(c1)"))
    assert trace.motion.pieces.points == 12
    assert sol.maximum("abs(v(b,c) - 1k*i(c1))") < 1e-12
    with pytest.raises(nsspice.UsageError, match=r"there is no signal v\(q\)"):
        sol.average("v(q)")


def test_a_window_of_one_instant_is_a_value() -> None:
    deck = "sine\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\nC1 a 0 1n\n.tran 1m 1m\n"
    sol = nsspice.read(deck).run()[0]
    for statistic in (sol.average, sol.rms, sol.maximum, sol.minimum):
        assert statistic("v(a)", 0.25e-3, 0.25e-3) == pytest.approx(1.0, rel=1e-12)
    assert sol.integral("v(a)", 0.25e-3, 0.25e-3) == 0.0
    with pytest.raises(nsspice.UsageError, match="NS4005"):
        sol.average("v(a)", 2e-3, 3e-3)
