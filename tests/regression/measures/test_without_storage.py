"""Measures of circuits that store nothing: closed forms, whatever the rows.

Signals between rows are known to a tenth of ``reltol`` of their largest value; a kink counts with
the square of the piece that holds it, so that integrals are much more accurate than that.
"""

from __future__ import annotations

import math

import pytest

import nsspice

#: accuracy of signals between rows, as a part of reltol
SHARE = 0.1

#: an ideal diode clips a sine of 5 V at 1 V; a junction beside it keeps the island from the exact
#: engine, and takes no part
CLIPPED = """clipped sine
V1 a 0 SIN(0 5 1k)
R1 a b 1
D1 b c di
V2 c 0 1
R9 a q 1k
D9 q 0 dj
.model di D(ideal)
.model dj D(IS=1e-12)
.tran 10u 3m
.measure tran mean AVG i(D1)
.measure tran eff RMS i(D1)
.measure tran charge INTEG i(D1) from=0 to=1m
.measure tran top MAX i(D1)
.measure tran low MIN v(b)
.measure tran rise WHEN i(D1)=2 rise=2
.measure tran fall WHEN v(b)=0.5 fall=3
.measure tran power AVG i(D1)*v(c)
"""
#: the diode begins to conduct at this angle
ALPHA = math.asin(0.2)
_MEAN = (10.0 * math.cos(ALPHA) - (math.pi - 2.0 * ALPHA)) / (2.0 * math.pi)
#: the mean of (5 sin x - 1)^2 from ALPHA to pi - ALPHA
_SQUARE = (
    25.0 * (0.5 * (math.pi - 2.0 * ALPHA) + 0.5 * math.sin(2.0 * ALPHA))
    - 20.0 * math.cos(ALPHA)
    + (math.pi - 2.0 * ALPHA)
) / (2.0 * math.pi)
EXACT = {
    "mean": _MEAN,
    "eff": math.sqrt(_SQUARE),
    "charge": 1e-3 * _MEAN,
    "top": 4.0,
    "low": -5.0,
    "rise": 1e-3 + 1e-3 * math.asin(0.6) / (2.0 * math.pi),
    "fall": 2e-3 + 1e-3 * (math.pi - math.asin(0.1)) / (2.0 * math.pi),
    "power": _MEAN,
}


@pytest.mark.parametrize("method", ["auto", "sdirk", "moreau"])
@pytest.mark.parametrize("rows", ["100u", "10u", "0.7u"])
@pytest.mark.parametrize("reltol", [1e-3, 1e-5, 1e-8])
@pytest.mark.parametrize("junction", [True, False])
def test_a_clipped_sine(method: str, rows: str, reltol: float, junction: bool) -> None:
    deck = CLIPPED.replace(".tran 10u", f".tran {rows}")
    if not junction:
        deck = deck.replace("R9 a q 1k\nD9 q 0 dj\n", "")
    found = nsspice.read(deck).run(method=method, reltol=reltol)[0].measures
    for name, exact in EXACT.items():
        # an instant is off by the error of the signal over its slope: at most one period for 5 of
        # the largest value here
        size = 1e-3 if name in ("rise", "fall") else max(abs(exact), 5.0 * (name != "charge"))
        assert found[name] == pytest.approx(exact, rel=0.0, abs=SHARE * reltol * size), name


@pytest.mark.parametrize("rows", ["100m", "10m", "1m"])
def test_a_law_of_the_time(rows: str) -> None:
    deck = (
        "exponential\nB1 a 0 V=exp(time)\nR1 a 0 1\n"
        f".tran {rows} 3\n.measure tran mean AVG v(a)\n.measure tran eff RMS v(a)\n"
        ".measure tran t WHEN v(a)=10\n.measure tran top MAX v(a)\n"
    )
    found = nsspice.read(deck).run()[0].measures
    assert found["mean"] == pytest.approx(math.expm1(3.0) / 3.0, rel=1e-6)
    assert found["eff"] == pytest.approx(math.sqrt(math.expm1(6.0) / 6.0), rel=1e-6)
    assert found["t"] == pytest.approx(math.log(10.0), rel=1e-6)
    assert found["top"] == pytest.approx(math.exp(3.0), rel=1e-12)


@pytest.mark.parametrize("method", ["auto", "sdirk"])
def test_short_pulses_of_a_current_that_the_rows_show(method: str) -> None:
    """1 V / 1 Ohm above a threshold 2 mV below the top of a sine: a fiftieth of a period."""
    deck = (
        "tops of a sine\nV1 a 0 SIN(0 1 1k)\nR1 a b 1\nD1 b c di\nV2 c 0 0.998\n"
        "R9 a q 1k\nD9 q 0 dj\n.model di D(ideal)\n.model dj D(IS=1e-12)\n"
        ".tran 5u 20m\n.measure tran charge INTEG i(D1)\n.measure tran top MAX i(D1)\n"
    )
    found = nsspice.read(deck).run(method=method)[0].measures
    alpha = math.asin(0.998)
    exact = 20.0 * (2.0 * math.cos(alpha) - 0.998 * (math.pi - 2.0 * alpha)) / (2000.0 * math.pi)
    # the current is known to 1e-6 of its largest value, 2 mA, over the 20 ms of the run at most
    assert found["charge"] == pytest.approx(exact, rel=0.0, abs=1e-6 * 2e-3 * 20e-3)
    assert found["top"] == pytest.approx(0.002, rel=1e-6)


STEPS = """steps of a source that only a resistor loads
Vc cin 0 PULSE(-2 5 4u 0 0 25u 64u)
Rc cin 0 139
.measure tran after FIND i(rc) WHEN v(cin)=-0.17 cross=2
.measure tran second WHEN v(cin)=-0.17 cross=2
.measure tran first FIND i(rc) WHEN v(cin)=-0.17 cross=1
.measure tran one MAX i(rc) from=10u to=10u
.measure tran none PP i(rc) from=29u to=29u
.measure tran end FIND i(rc) at=192u
.tran 3.2u 192u
"""


@pytest.mark.parametrize("method", ["auto", "sdirk", "moreau"])
@pytest.mark.parametrize("junction", [True, False])
def test_an_instant_at_which_a_source_jumps(method: str, junction: bool) -> None:
    deck = STEPS
    if junction:
        deck = deck.replace("139\n", "139\nD1 0 q dj\nR1 q cin 1k\n.model dj D(IS=1e-14)\n", 1)
    found = nsspice.read(deck).run(method=method)[0].measures
    # a jump has its value after it: 5 V from 4 us to 29 us, then -2 V
    assert found["second"] == pytest.approx(29e-6, rel=1e-12)
    assert found["after"] == pytest.approx(-2.0 / 139.0, rel=1e-9)
    assert found["first"] == pytest.approx(5.0 / 139.0, rel=1e-9)
    assert found["one"] == pytest.approx(5.0 / 139.0, rel=1e-9)
    assert found["none"] == 0.0
    assert found["end"] == pytest.approx(-2.0 / 139.0, rel=1e-9)
