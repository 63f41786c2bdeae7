"""Laws with an infinite slope at their own zero: what they empty is empty after a finite time.

``C v' = -k sgn(v) |v|**p`` has the solution ``v**(1-p) = v0**(1-p) - (1-p) k t / C`` until it is
zero.
Newton's method alone goes to and fro between two points there.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

METHODS = ["sdirk", "moreau"]
# one implicit step of h errs by h/2 times what the slope changes: about h, relative to the level
# and the time of emptying; with error control by reltol a step
TOLERANCE = {"sdirk": 1e-4, "moreau": 1e-2}


def level(time: np.ndarray, power: float, rate: float = 1.0) -> np.ndarray:
    """The level of a tank that begins with one."""
    left = np.maximum(1.0 - (1.0 - power) * rate * time, 0.0)
    return left ** (1.0 / (1.0 - power))


def run(deck: str, method: str) -> nsspice.Solution:
    solution = nsspice.read(deck).run(method=method)[0]
    assert solution.certificate.passed
    return solution


LAWS = {
    "sgn(v(a))*sqrt(abs(v(a)))": 0.5,
    "sqrt(max(v(a),0))": 0.5,
    "sgn(v(a))*pwr(abs(v(a)),0.5)": 0.5,
    "sgn(v(a))*abs(v(a))**(1/3)": 1.0 / 3.0,
    "sgn(v(a))*pwr(abs(v(a)),0.1)": 0.1,
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("law", LAWS)
def test_a_tank_empties(law: str, method: str):
    solution = run(f"tank\nC1 a 0 1 IC=1\nB1 a 0 I={law}\n.tran 5m 4 uic\n", method)
    expected = level(solution.time, LAWS[law])
    assert solution["v(a)"] == pytest.approx(expected, abs=TOLERANCE[method])
    if "max" not in law:  # which lets a level below zero stand
        assert abs(solution["v(a)"][-1]) < 1e-12


@pytest.mark.parametrize("method", METHODS)
def test_an_empty_tank_fills_again(method: str):
    deck = """tank with a pulse of inflow
C1 a 0 1 IC=1
I1 0 a PULSE(0 0.5 5 1m 1m 10 40)
B1 a 0 I=sgn(v(a))*sqrt(abs(v(a)))
.tran 10m 20 uic
"""
    solution = run(deck, method)
    # the inflow q gives s = sqrt(v) with t = -2 (s + q ln(1 - s/q)): after ten seconds s = q to
    # 2e-5; then the level falls as before, from q**2
    after = solution.time > 15.01
    s = np.maximum(0.5 - (solution.time[after] - 15.0015) / 2.0, 0.0)
    assert solution["v(a)"][after] == pytest.approx(s**2, abs=TOLERANCE[method])


@pytest.mark.parametrize("method", METHODS)
def test_two_tanks_come_to_one_level(method: str):
    """The difference d of the levels obeys d' = -(1 + 1/2) sqrt d."""
    deck = """two tanks
C1 a 0 1 IC=1
C2 b 0 2 IC=0
B1 a b I=sgn(v(a)-v(b))*sqrt(abs(v(a)-v(b)))
.tran 5m 4 uic
"""
    solution = run(deck, method)
    expected = level(solution.time, 0.5, 1.5)
    difference = solution["v(a)"] - solution["v(b)"]
    assert difference == pytest.approx(expected, abs=TOLERANCE[method])
    assert solution["v(a)"][-1] == pytest.approx(1.0 / 3.0, rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_two_tanks_one_behind_the_other_empty(method: str):
    deck = """two tanks and an outflow
C1 a 0 1 IC=1
C2 b 0 2 IC=0
B1 a b I=sgn(v(a)-v(b))*sqrt(abs(v(a)-v(b)))
B2 b 0 I=0.5*sgn(v(b))*sqrt(abs(v(b)))
.tran 10m 12 uic
"""
    solution = run(deck, method)
    assert abs(solution["v(a)"][-1]) < 1e-12
    assert abs(solution["v(b)"][-1]) < 1e-12


@pytest.mark.parametrize("method", METHODS)
def test_a_law_that_jumps_is_not_mistaken_for_a_steep_one(method: str):
    """Dry friction without a set-valued law has no solution once the mass rests.

    The exponential keeps the law on the tape; ``sgn`` alone would be two switches.
    """
    with pytest.raises(nsspice.NsspiceError, match="Newton's method found no solution"):
        nsspice.read(
            "jump\nV1 z 0 0\nC1 a 0 1 IC=1\nB1 a 0 I=sgn(v(a))*exp(v(z))\n.tran 10m 2 uic\n"
        ).run(method=method)


@pytest.mark.parametrize("method", METHODS)
def test_dry_friction_by_switches_comes_to_rest(method: str) -> None:
    """v = 1 - t until it is zero; there two comparators slide, which a step sees late by itself."""
    deck = "jump\nC1 a 0 1 IC=1\nB1 a 0 I=sgn(v(a))\n.tran 10m 2 uic\n"
    solution = nsspice.read(deck).run(method=method)[0]
    expected = np.maximum(1.0 - solution.time, 0.0)
    assert np.abs(solution["v(a)"] - expected).max() <= {"sdirk": 1e-6, "moreau": 1.001e-2}[method]
