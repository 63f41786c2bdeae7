"""Contacts that last, open again, and are hit together, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import nsspice
from nsspice.dvi import (
    DVI,
    Sgn,
    complementarity,
    contact,
    equation,
    multiplier,
    sin,
    states,
    t,
    unknowns,
)

G = 9.81
X, V = states("x", "v")
N = multiplier("n")


def pair(heights, coefficients, stop, rows=1000, masses=(1.0, 1.0)):
    """Return two balls above a floor that do not touch each other."""
    x, v = states("x", "v", size=2)
    n = multiplier("n", size=2)
    rates = [n[k] / masses[k] - G for k in range(2)]
    floor = [contact(n[k], x[k], coefficients[k]) for k in range(2)]
    return DVI({x: v, v: rates}, floor, start={x: list(heights), v: [0.0, 0.0]}).run(
        stop, rows=rows
    )


def test_a_ball_at_rest_leaves_the_others_exact():
    """A closed contact is of index 3; held by its acceleration it takes no steps (5e-3 m else)."""
    for height in (0.0, 1e-3, 0.3):
        sol = pair([height, 20.0], [0.0, 0.0], 1.0)
        fall = 20.0 - G / 2.0 * sol.time**2
        assert np.abs(sol["x[1]"] - fall).max() < 64.0 * np.finfo(float).eps * 20.0
        assert sol["n[0]"][-1] == pytest.approx(G, rel=1e-14)
        assert sol.islands[0].stats["fixed_steps"] == 0


def test_balls_do_not_hear_of_each_other():
    """One comes to rest while the other still flies, and keeps its restitution."""
    both = pair([1.0, 20.0], [0.5, 0.5], 8.0)
    alone = DVI({X: V, V: N - G}, [contact(N, X, 0.5)], start={X: 20.0, V: 0.0}).run(8.0, rows=1000)
    # positions are rounding of what flies: the flights of the lower ball end below 2^-24 of the run
    assert np.abs(both["x[1]"] - alone["x"]).max() < 1e-7 * 20.0 * 2.0**-24 * 8.0
    assert sorted(w.code for w in both.warnings) == ["NS6031", "NS6031"]


def test_two_coefficients_at_once():
    """Hit at one instant, independent balls bounce as each alone."""
    sol = pair([1.0, 1.0], [0.5, 0.8], 0.8)
    hit = math.sqrt(2.0 / G)
    late = sol.time > hit
    for k, e in enumerate((0.5, 0.8)):
        s = sol.time[late] - hit
        assert np.abs(sol[f"x[{k}]"][late] - (e * G * hit * s - G / 2.0 * s**2)).max() < 1e-12


def test_a_stack_that_falls():
    """Two coefficients in one impact: Newton's law for both contacts, solved by hand.

    Masses 1 and 2 fall together onto the floor with e = 1/2; the contact between them was closed,
    so that its relative speed stays zero: both rise with half the speed.
    """
    x, v = states("x", "v", size=2)
    n = multiplier("n", size=2)
    stack = DVI(
        {x: v, v: [n[0] - n[1] - G, n[1] / 2.0 - G]},
        [contact(n[0], x[0], 0.5), contact(n[1], x[1] - x[0], 0.8)],
        start={x: [1.0, 1.0], v: [0.0, 0.0]},
    )
    sol = stack.run(0.6)
    speed = G * math.sqrt(2.0 / G)
    hits = {i.element: i.value for i in sol.impulses}
    assert hits["n[0]"] == pytest.approx(4.5 * speed, rel=1e-12)
    assert hits["n[1]"] == pytest.approx(3.0 * speed, rel=1e-12)
    rise = 0.5 * speed - G * (0.6 - math.sqrt(2.0 / G))
    assert [sol["v[0]"][-1], sol["v[1]"][-1]] == pytest.approx([rise, rise], rel=1e-11)


def test_a_table_that_shakes():
    """The body lifts off where the table falls faster than it, and comes back every period."""
    a, w = 0.05, 20.0
    table = DVI({X: V, V: N - G}, [contact(N, X - a * sin(w * t))], start={X: 0.5, V: 0.0})
    sol = table.run(3.0, rows=300)
    off = math.asin(G / (a * w * w)) / w
    up, speed = a * math.sin(w * off), a * w * math.cos(w * off)

    def gap(s):
        return up + speed * s - G / 2.0 * s * s - a * math.sin(w * (off + s))

    land = off + brentq(gap, 0.05, 0.5, xtol=1e-14)
    period = 2.0 * math.pi / w
    times = np.array([i.time for i in sol.impulses])[2:]
    assert times.size >= 6
    assert np.abs(np.mod(times - land + period / 2.0, period) - period / 2.0).max() < 1e-11
    assert (sol["x"] - a * np.sin(w * sol.time)).min() > -1e-13


def test_a_bounce_after_rest():
    """Restitution counts again after impacts have accumulated: once a period they do."""
    a, w = 0.01, 40.0
    table = DVI({X: V, V: N - G}, [contact(N, X - a * sin(w * t), 0.3)], start={X: 0.5, V: 0.0})
    sol = table.run(3.0, rows=300)
    told = np.array([float(q.message.split("t = ")[1].split(",")[0]) for q in sol.warnings])
    assert told.size > 5
    assert np.abs(np.diff(told)[1:] - 2.0 * math.pi / w).max() < 1e-5
    assert sol.certificate.passed


def test_friction_beside_a_contact():
    """A block slides on the floor: the contact force is its weight, and friction stops it."""
    y, u = states("y", "u")
    block = DVI(
        {X: V, V: N - G, y: u, u: -0.4 * G * Sgn(u)},
        [contact(N, X)],
        start={X: 0.0, V: 0.0, y: 0.0, u: 2.0},
    )
    sol = block.run(1.0)
    assert sol["y"][-1] == pytest.approx(4.0 / (2.0 * 0.4 * G), rel=1e-13)
    assert np.abs(sol["n"] - G).max() < 1e-12


def test_a_ball_that_is_blown_sideways():
    """Friction between bounds takes no impulse: the bounces are those of the ball alone."""
    y, u = states("y", "u")
    ball = DVI(
        {X: V, V: N - G, y: u, u: -0.5 * Sgn(u)},
        [contact(N, X, 0.5)],
        start={X: 1.0, V: 0.0, y: 0.0, u: 0.6},
    )
    sol = ball.run(1.2)
    alone = DVI({X: V, V: N - G}, [contact(N, X, 0.5)], start={X: 1.0, V: 0.0}).run(1.2)
    assert np.abs(sol["x"] - alone["x"]).max() < 1e-13
    assert np.abs(sol["u"] - (0.6 - 0.5 * sol.time)).max() < 1e-12


def test_a_bound_on_a_speed_is_hit_together_with_a_contact():
    """A condition of relative degree one takes its part of the impact, without restitution."""
    n, u = multiplier("n"), multiplier("u")
    x, v, w = states("x", "v", "w")
    # what n gives to the body it takes from w, which a second condition keeps above zero
    both = DVI(
        {x: v, v: n - G, w: u - n},
        [contact(n, x, 0.5), complementarity(u, w)],
        start={x: 1.0, v: 0.0, w: 0.0},
    )
    sol = both.run(0.5)
    speed = G * math.sqrt(2.0 / G)
    assert {i.element: pytest.approx(i.value, rel=1e-12) for i in sol.impulses} == {
        "n": 1.5 * speed,
        "u": 1.5 * speed,
    }
    assert np.abs(sol["w"]).max() < 1e-12


def test_what_has_no_law_is_refused():
    """A contact with restitution that is hit together with a condition on something algebraic."""
    n, u = multiplier("n"), multiplier("u")
    x, v, w = states("x", "v", "w")
    y = unknowns("y")
    both = DVI(
        {x: v, v: n - G, w: u - n},
        [contact(n, x, 0.5), complementarity(u, y), equation(y, w - y)],
        start={x: 1.0, v: 0.0, w: 0.0},
    )
    with pytest.raises(nsspice.UsageError, match="different restitution") as refused:
        both.run(0.6)
    assert refused.value.code == "NS6005"


def test_a_restitution_that_makes_energy_is_refused():
    with pytest.raises(nsspice.UsageError) as refused:
        contact(multiplier("n"), X, 1.5)
    assert refused.value.code == "NS6003"
