"""Runs of equations that once were wrong without a word, each against its closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.dvi import (
    DVI,
    VI,
    RegularityLost,
    contact,
    cos,
    equation,
    log,
    multiplier,
    sin,
    states,
    t,
    tan,
    unknowns,
)

X, V, TH, OM = states("x"), states("v"), states("th"), states("om")
U = multiplier("u")
P = unknowns("p")


def fork():
    """Return x' = -x - u with u^3 = u x from x = 2.25, u = 3/2, which has u = sqrt(x).

    With r = sqrt(x) it is r' = -(r + 1)/2, hence r = 5/2 exp(-t/2) - 1 until r = 0, where three
    branches meet.
    """
    return DVI({X: -X - U}, [equation(U, U**3 - U * X)], start={X: 2.25, U: 1.5})


@pytest.mark.parametrize("stop", [1.0, 1.7])
def test_a_branch_is_kept(stop):
    """0.139 was returned for 0.0047 at 1.7 s: a trial step had crossed to another branch."""
    solution = fork().run(stop, rows=100)
    r = 2.5 * np.exp(-0.5 * solution.time) - 1.0
    # 1e-10 a step, an interpolant of order 7; errors of u are those of x over 2 u
    assert np.abs(solution["x"] - r**2).max() < 1e-8
    assert np.abs(solution["u"] - r).max() < 1e-8 / (2.0 * r[-1])
    assert solution.certificate.passed


def test_a_branch_ends_where_three_meet():
    with pytest.raises(RegularityLost) as lost:
        fork().run(3.0)
    assert lost.value.time == pytest.approx(2.0 * math.log(2.5), abs=1e-6)


def test_a_start_of_an_unknown_is_followed_or_refused():
    """The engine with error control took u = 0, another branch."""
    with pytest.raises(nsspice.UsageError, match="NS6004"):
        fork().run(1.0, method="sdirk")
    steps = fork().run(1.0, method="moreau", step=1e-3)
    assert steps["u"][0] == pytest.approx(1.5, abs=1e-2)
    assert steps["x"][-1] == pytest.approx((2.5 * math.exp(-0.5) - 1.0) ** 2, abs=5e-3)  # O(step)


def test_steps_are_held_against_the_integral_of_their_rates():
    """Right states miss nothing, those of the branch u = 0 miss what u adds."""
    problem = fork().to_ode()
    times = np.array([0.0, 0.25, 0.5])

    def right(s):
        return np.array([(2.5 * math.exp(-0.5 * s) - 1.0) ** 2])

    def wrong(s):
        return np.array([2.25 * math.exp(-s)])

    for states_of, missed in ((right, 0.0), (wrong, 0.2)):
        table = np.array([states_of(s) for s in times]).T
        found = problem._defect(times, states_of, table, problem)
        # Gauss's rule is exact to rounding for exponentials over such steps
        assert found == pytest.approx(missed, abs=0.1 if missed else 1e-14)


@pytest.mark.parametrize(
    ("rate", "instant"),
    [
        (1.0 / (1.0 - t) ** 2, 1.0),  # of one sign: no divisor changes its own
        (-X + 1.0 / (1.0 - t), 1.0),
        (-X + tan(t), math.pi / 2.0),
        (X / (t - 0.75), 0.75),
        (-X + log(1.5 - t), 1.5),
    ],
)
@pytest.mark.parametrize("method", ["auto", "moreau"])
def test_a_pole_in_time_is_not_stepped_over(rate, instant, method):
    problem = DVI({X: rate}, start={X: 0.5})
    with pytest.raises(nsspice.errors.NumericalError) as refused:
        problem.run(2.0, method=method)
    assert refused.value.time == pytest.approx(instant, abs=1e-9)
    before = problem.run(0.5 * instant, method=method)
    assert before.certificate.passed


def test_a_divisor_that_keeps_away_from_zero_is_no_pole():
    """x' = 1/(2 + sin t)."""
    # the integral over a period is 2 pi/sqrt(3)
    whole = DVI({X: 1.0 / (2.0 + sin(t))}, start={X: 0.0}).run(2.0 * math.pi)
    assert whole["x"][-1] == pytest.approx(2.0 * math.pi / math.sqrt(3.0), rel=1e-8)
    assert whole.certificate.passed


def test_equations_of_index_three_are_refused_by_name():
    """A mass on a given path: the force is in the second derivative of the equation."""
    problem = DVI({X: V, V: U - X}, [equation(U, X - sin(t))], start={X: 0.0, V: 1.0})
    with pytest.raises(nsspice.UsageError, match="equation of u is of index 3"):
        problem.run(1.0)
    # the second derivative of x = sin t is v' = -sin t: u - x + sin t = 0, so u = 0
    reduced = DVI({X: V, V: U - X}, [equation(U, U - X + sin(t))], start={X: 0.0, V: 1.0}).run(1.0)
    assert np.abs(reduced["x"] - np.sin(reduced.time)).max() < 1e-9
    # of index 2: x' = v with a given x makes v the derivative of it
    second = DVI({X: U}, [equation(U, X - sin(t))], start={X: 0.0}).run(1.0)
    assert np.abs(second["x"] - np.sin(second.time)).max() < 1e-9


@pytest.mark.parametrize("mu", [0.0, 0.5, 1.5])
@pytest.mark.parametrize("angle", [0.3, 1.2])
def test_a_rod_above_the_floor_falls_from_where_it_is(mu, angle):
    """Its contact is open by 5 cm, and does not matter before it has fallen as far."""
    x, u, y, w = states("slide"), states("u"), states("y"), states("w")
    n = multiplier("n")
    rates = {x: u, y: w, TH: OM, u: -mu * n, w: n - 9.81, OM: 3.0 * n * (mu * sin(TH) - cos(TH))}
    start = {x: 0.0, y: 0.05 + math.sin(angle), TH: angle, u: 1.0, w: 0.0, OM: 0.0}
    rod = DVI(rates, [contact(n, y - sin(TH))], start=start).run(0.05, rows=50)
    gap = rod["y"] - np.sin(rod["th"])
    assert np.abs(gap - (0.05 - 9.81 / 2.0 * rod.time**2)).max() < 1e-10
    assert not rod.impulses


def test_a_start_that_an_engine_loses_is_refused(monkeypatch):
    """Whatever the reason: a run that begins elsewhere is not the run that was asked for."""
    from nsspice.dvi.runs import engines

    kept = engines.run_interval

    def damaged(assembly, outputs, plan, z0, **options):
        return kept(assembly, outputs, plan, 0.0 * z0, **options)

    monkeypatch.setattr("nsspice.dvi.runs.trajectory.run_interval", damaged)
    with pytest.raises(nsspice.errors.NumericalError, match="instead of 0"):
        DVI({X: -X + cos(X)}, start={X: 0.5}).run(1.0)


@pytest.mark.parametrize("points", [101, 102])
@pytest.mark.parametrize("g", [(t - 0.5) * P - (t - 0.5), (t - 0.5) * P - (t - 0.5) * cos(P)])
def test_a_path_is_not_followed_through_a_singular_point(g, points):
    """At t = 1/2 every p is a solution; the grid has a point there, or two beside it."""
    with pytest.raises(RegularityLost) as lost:
        VI(g, of=P).track(np.linspace(0.0, 1.0, points))
    assert lost.value.time == pytest.approx(0.5, abs=0.01)
