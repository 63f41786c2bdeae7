"""Trajectories of nsspice.dvi against closed forms: engines, schemes and their orders, impacts."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import nsspice
from nsspice import dvi
from nsspice.dvi import (
    DLCP,
    DMVI,
    DNCP,
    DVI,
    VI,
    Cone,
    FunctionDVI,
    Sgn,
    complementarity,
    contact,
    cos,
    equation,
    multiplier,
    sin,
    states,
    t,
)

X, V = states("x", "v")
N = multiplier("n")


def orders(errors):
    return [math.log2(a / b) for a, b in pairwise(errors)]


# ------------------------------------------------------------------ schemes beside smooth terms


def pendulum() -> DVI:
    """x'' = -sin x with dry friction at the hinge, up to its first stop."""
    return DVI({X: V, V: -sin(X) - 0.1 * Sgn(V)}, start={X: 1.5, V: 1.0})


@pytest.mark.parametrize(
    ("options", "order"),
    [
        ({"theta": 1.0}, 1),
        ({"theta": 0.0}, 1),
        ({"theta": 0.5}, 2),
        ({"theta": 0.5, "theta_on": "multipliers"}, 2),
        ({"theta": 1.0, "coefficients": "old"}, 1),
    ],
)
def test_orders_of_theta_beside_smooth_terms(options, order):
    """Before the first stop Sgn is constant and the schemes have the orders of smooth problems."""
    exact = pendulum().run(0.5, rows=100, reltol=1e-12)
    assert exact.islands[0].method == "sdirk"
    errors = []
    for steps in (25, 50, 100):
        run = pendulum().run(0.5, method="moreau", step=0.5 / steps, **options)
        errors.append(np.abs(run["x"] - exact["x"][:: 100 // steps]).max())
    # the first term of the error, its next one is h times smaller: 10 % at these steps
    assert orders(errors)[-1] == pytest.approx(order, abs=0.1)


def test_time_of_the_load_decides_on_order_two():
    forced = DVI({X: cos(3.0 * t) - X}, start={X: 1.0})
    exact = forced.run(2.0, rows=80)
    found = {}
    for time in ("average", "new"):
        errors = [
            np.abs(
                forced.run(2.0, method="moreau", theta=0.5, step=2.0 / n, time=time)["x"]
                - exact["x"][:: 80 // n]
            ).max()
            for n in (20, 40, 80)
        ]
        found[time] = orders(errors)[-1]
    assert found["average"] == pytest.approx(2.0, abs=0.1)
    assert found["new"] == pytest.approx(1.0, abs=0.1)


def test_theta_acts_on_the_form_in_which_a_problem_is_written():
    """4.2.4 with everyday values: resistors inside D leave order 1, inside A order 2."""
    R, C0, L = 1e3, 1e-6, 1e-2
    D = [[1 / R, 1 / R, -1, 0], [1 / R, 1 / R, 0, -1], [1, 0, 0, 0], [0, 1, 0, 0]]
    printed = DLCP(
        [[0.0, -1 / C0], [1 / L, 0.0]],
        [[0.0, 0.0, -1 / C0, 1 / C0], [0.0] * 4],
        [[0.0, 0.0], [0.0, 0.0], [-1.0, 0.0], [1.0, 0.0]],
        D,
        x0=[10.0, 0.0],
    )
    exact = printed.run(2e-3, rows=800)
    for problem, order in ((printed, 1), (printed.pivot([0, 2]), 2)):
        assert np.abs(problem.run(2e-3, rows=800)["x[0]"] - exact["x[0]"]).max() < 1e-12
        errors = [
            np.abs(
                problem.run(2e-3, theta=0.5, step=2e-3 / n)["x[0]"] - exact["x[0]"][:: 800 // n]
            ).max()
            for n in (400, 800)
        ]
        assert orders(errors)[0] == pytest.approx(order, abs=0.15)
    with pytest.raises(nsspice.UsageError) as refused:
        printed.pivot([2])
    assert refused.value.code == "NS6005"


def test_slacks_at_the_average_and_at_the_old_state():
    friction = DVI({V: -9.81 * Sgn(V)}, start={V: -3.0})
    for options in ({"theta_on": "slacks", "theta": 0.5}, {"variant": 2}):
        run = friction.run(1.0, method="moreau", step=1e-3, **options)
        assert np.abs(run["v"][-1]) < 0.02  # chatters, by a step's worth of speed
    assert run.warnings[0].code == "NS6030"


# ------------------------------------------------------------------ engines


def test_storage_that_is_not_symmetric_is_exact_too():
    E = np.array([[1.0, 1.0], [0.0, 1.0]])
    A, B, C = np.array([[-1.0, 2.0], [-2.0, -1.0]]), np.array([[0.0], [1.0]]), [[0.0, 1.0]]
    inverse = np.linalg.inv(E)
    general = DLCP(A, B, C, [[1.0]], x0=[1.0, -1.0], E=E).run(3.0)
    plain = DLCP(inverse @ A, inverse @ B, C, [[1.0]], x0=[1.0, -1.0]).run(3.0)
    assert general.islands[0].method == "modewise"
    assert np.abs(general["x[0]"] - plain["x[0]"]).max() < 1e-13


def test_capacitors_whose_current_controls_something_are_exact():
    deck = """a source follows the current of a capacitor
V1 in 0 SIN(0 10 50)
R1 in a 100
C1 a 0 10u IC=0
F1 0 b C1 0.5
R2 b 0 200
D1 b c
C2 c 0 1u IC=0
R3 c 0 1k
.tran 20u 20m uic
"""
    circuit = nsspice.read(deck)
    exact = nsspice.tran(circuit, method="modewise")
    steps = nsspice.tran(circuit, method="sdirk", reltol=1e-11)
    assert exact.certificate.passed
    assert np.abs(exact["v(c)"] - steps["v(c)"]).max() < 1e-8 * np.abs(steps["v(c)"]).max()


def test_dmvi_with_a_kink_is_a_play():
    """u in (x - Sgn(u)): x' = -u moves only while |x| > 1."""
    u = multiplier("u")
    problem = DMVI({X: -u}, g={u: u - X}, phi=abs(u), start={X: 3.0})
    sol = problem.run(10.0)
    assert np.abs(sol["x"] - (1.0 + 2.0 * np.exp(-sol.time))).max() < 1e-12
    assert problem.verdict()["existence"]


def test_dncp_against_its_reduction():
    u = multiplier("u")
    problem = DNCP({X: u - X}, {u: u**3 + u - X - 1.0}, start={X: 2.0})
    steps = problem.run(3.0, rows=50, reltol=1e-11)
    reduced = problem.to_ode().run(3.0, rows=50)
    assert np.abs(steps["x"] - reduced["x"]).max() < 1e-9


def test_functions_take_the_slow_path_to_the_same_steps():
    block = DVI({X: V, V: -X - Sgn(V)}, start={X: -2, V: 2})

    def f(time, x, u):
        return np.array([x[1], -x[0] - u[0]])

    def g(time, x, u):
        return np.array([-x[1]])

    slow = FunctionDVI(f, g, Cone(-1.0, 1.0), [-2.0, 2.0], [0.0])
    exact = FunctionDVI(
        f, g, Cone(-1.0, 1.0), [-2.0, 2.0], [0.0],
        df=lambda time, x, u: np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, -1.0]]),
        dg=lambda time, x, u: np.array([[0.0, -1.0, 0.0]]),
    )  # fmt: skip
    for options in ({}, {"theta": 0.5}, {"variant": 2}):
        known = block.run(3.0, method="moreau", step=0.02, **options)
        for problem in (slow, exact):
            run = problem.run(3.0, step=0.02, **options)
            assert np.abs(run["x[0]"] - known["x"]).max() < 1e-9


def test_a_selection_ends_where_it_is_no_longer_regular():
    u = multiplier("u")
    root = DVI({X: -1.0 + 0 * u}, [equation(u, u**2 - X)], start={X: 1.0, u: 1.0})
    half = root.to_ode().run(0.5)
    assert np.abs(half["u"] - np.sqrt(1.0 - half.time)).max() < 1e-10
    with pytest.raises(nsspice.NumericalError) as ended:
        root.to_ode().run(1.5)  # x = 0 at t = 1: no root beyond
    assert ended.value.code in ("NS6020", "NS6021")


# ------------------------------------------------------------------ impacts


def flights(e: float, stop: float, g: float = 9.81):
    speed = math.sqrt(2.0 * g)
    begin, up = speed / g, e * speed
    found = []
    while begin < stop and up > 1e-13:
        found.append((begin, up))
        begin, up = begin + 2.0 * up / g, e * up
    return found


@pytest.mark.parametrize("e", [0.3, 0.6, 1.0])
def test_restitution_against_the_closed_form(e):
    ball = DVI({X: V, V: N - 9.81}, [contact(N, X, e)], start={X: 1.0, V: 0.0})
    sol = ball.run(4.0)
    exact = np.where(sol.time < math.sqrt(2 / 9.81), 1.0 - 4.905 * sol.time**2, 0.0)
    for begin, up in flights(e, 4.0):
        s = sol.time - begin
        inside = (s >= 0.0) & (s < 2.0 * up / 9.81)
        exact[inside] = (up * s - 4.905 * s**2)[inside]
    assert np.abs(sol["x"] - exact).max() < 1e-12
    assert sol["x"].min() > -1e-12
    assert sol.certificate.passed
    told = [w for w in sol.warnings if w.code == "NS6031"]
    assert bool(told) == (e < 1.0)
    if told:
        end = math.sqrt(2 / 9.81) * (1.0 + 2.0 * e / (1.0 - e))
        assert float(told[0].message.split("t = ")[1].split(",")[0]) == pytest.approx(end, abs=1e-9)


def test_two_masses_exchange_momentum():
    """Newton's law at an impact of unequal masses: momentum stays, relative speed times -e."""
    x, v = states("x", "v", size=2)
    m = (1.0, 3.0)
    hit = contact(N, x[1] - x[0], restitution=0.5)
    pair = DVI({x: v, v: [-N / m[0], N / m[1]]}, [hit], start={x: [0.0, 1.0], v: [2.0, 0.0]})
    sol = pair.run(1.0)
    after = 0.5 + 0.5 * 2.0 * np.array([-3.0, 1.0]) / 4.0  # centre of mass: 0.5 m/s
    assert np.abs([sol["v[0]"][-1], sol["v[1]"][-1]] - after).max() < 1e-13
    assert sol.impulses[0].value == pytest.approx(3.0 * after[1], abs=1e-13)
    assert sol.impulses[0].time == pytest.approx(0.5, abs=1e-14)


def test_a_moving_floor_and_a_start_later_on():
    """The gap depends on the time; from t = 1 on as from t = 0 with a shifted floor."""
    late = DVI({X: V, V: N - 9.81}, [contact(N, X - sin(t))], start={X: 2.0, V: 0.0}, at=1.0)
    early = DVI({X: V, V: N - 9.81}, [contact(N, X - sin(t + 1.0))], start={X: 2.0, V: 0.0})
    a, b = late.run(2.0, rows=200), early.run(2.0, rows=200)
    assert a.time[0] == 1.0
    assert np.abs(a["x"] - b["x"]).max() < 1e-10
    assert np.all(a["x"] - np.sin(a.time) > -1e-9)


# ------------------------------------------------------------------ static problems along the time


def test_a_vi_follows_a_circle_in_a_box():
    """Projection of a moving point on a box: kinks of the path do not matter on the grid."""
    q = dvi.unknowns("q", 2)
    problem = VI(q - np.array([1.5 * cos(t), 1.5 * sin(t)]), within={q: dvi.Box(-1.0, 1.0)}, of=q)
    times = np.linspace(0.0, 6.0, 61)
    path = problem.track(times)
    exact = np.clip(1.5 * np.array([np.cos(times), np.sin(times)]), -1.0, 1.0)
    assert np.abs(path[q] - exact).max() < 1e-14  # linear in q: the predictor is exact
    assert path.at(q[0], 0.05) == pytest.approx(1.0)
    with pytest.raises(nsspice.UsageError) as refused:
        problem.track(times, predictor="best")
    assert refused.value.code == "NS6004"


def test_regularity_is_lost_at_a_fold():
    """q^2 = 1 - t from q = 1: at t = 1 both roots meet."""
    q = dvi.unknowns("q")
    with pytest.raises(dvi.RegularityLost) as lost:
        VI(q**2 + t - 1.0, of=q).track(np.linspace(0.0, 1.5, 151), start={q: 1.0})
    assert lost.value.time == pytest.approx(1.0, abs=1e-3)
    assert lost.value.unknown == "q"
    assert lost.value.code == "NS6021"


def test_complementarity_of_a_multiplier_inside_a_function():
    """A multiplier in a nonlinear term gets an unknown beside it: x' = -x + atan(u)."""
    u = multiplier("u")
    problem = DVI({X: dvi.atan(u) - X}, [complementarity(u, X + u - 2.0)], start={X: 0.0})
    steps = problem.run(2.0, rows=40, reltol=1e-11)
    reduced = problem.to_ode().run(2.0, rows=40)
    assert np.abs(steps["x"] - reduced["x"]).max() < 1e-9
    assert np.abs(steps["u"] - np.maximum(2.0 - steps["x"], 0.0)).max() < 1e-9


def test_starts_that_conditions_do_not_allow():
    """Positions cannot jump; speeds can, by an impulse that is told, with restitution too."""
    with pytest.raises(nsspice.UsageError) as refused:
        DVI({X: V, V: N - 9.81}, [contact(N, X)], start={X: -0.5, V: 0.0}).run(1.0)
    assert refused.value.code == "NS6005"
    for e in (0.0, 0.5):
        ball = DVI({X: V, V: N / 2.0 - 9.81}, [contact(N, X, e)], start={X: 0.0, V: -1.0})
        sol = ball.run(0.05)
        assert sol.impulses[0].value == pytest.approx((1.0 + e) * 2.0, abs=1e-9)
        assert sol["v"][1] == pytest.approx(e - (9.81 * sol.time[1] if e else 0.0), abs=1e-9)
        assert np.abs(sol["n"]).max() < 100.0
    relay = DLCP([[0.0]], [[1.0]], [[1.0]], [[0.0]], p=[-1.0], x0=[-0.5])
    sol = relay.run(1.0)  # a state of relative degree one jumps to the boundary
    assert sol.impulses[0].value == pytest.approx(0.5, abs=1e-9)
    assert np.abs(sol["x[0]"]).max() < 1e-9
