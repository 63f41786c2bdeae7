"""Where a path of solutions ends, and what a followed path does with the steps it is given."""

from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.problems import Cone, GeneralizedEquation, Sign, TapeBuilder
from nsspice.solvers.generalized import NoValue, RegularityLost, solve
from nsspice.solvers.stepper import UnsolvedStep
from nsspice.solvers.tracker import track

NETLISTS = Path(__file__).parents[3] / "netlists"
ARGSINH = """argsinh in series with a practical diode
V1 a 0 SIN(0 4 0.15915494309189535)
R1 a b V={asinh(i)}
D1 b 0 practical
.model practical D(Vfwd=1 Vrev=1)
.tran 0.1 10
"""


@pytest.mark.parametrize("method", [None, "euler-newton", "euler-newton-rate"])
@pytest.mark.parametrize("rows", ["0.5m", "0.25m"])
def test_loss_of_regularity_is_named_with_its_time(method, rows):
    """Thesis 4.3.1 with kappa = 1: at t = 3/8 the first agent has no money, and no price is one."""
    deck = (NETLISTS / "thesis/ex431_equilibrium.net").read_text()
    circuit = nsspice.read(deck.replace("0.5m 1", f"{rows} 0.4"), params={"kappa": 1.0})
    with pytest.raises(nsspice.RegularityError) as caught:
        nsspice.tran(circuit, method=method)
    error = caught.value
    assert error.code == "NS3009"
    assert error.time == pytest.approx(0.375, abs=1e-12)
    assert "t = 0.375 s" in str(error)
    assert "v(k1)" in str(error)
    # nothing is shown where there is nothing
    partial = error.partial
    assert partial.time[-1] < 0.375
    money = 1.0 + np.sin(4.0 * np.pi * partial.time)
    assert np.all(partial["v(m1)"] > 0.1 * money)


def test_a_lost_path_is_no_solution():
    """v = i^3/3 - i folds at i = -1; beyond, solutions exist, and the path has to jump to them."""
    deck = "fold\nV1 a 0 PWL(0 -3 1 3)\nR1 a 0 V={i*i*i/3-i}\n.tran 20m 1\n"
    with pytest.raises(nsspice.NumericalError) as caught:
        nsspice.tran(nsspice.read(deck), method="euler-newton")
    assert caught.value.code in ("NS3008", "NS3002")


@pytest.mark.parametrize("method", ["euler-newton", "euler-newton-rate", None])
def test_steps_asked_for_are_taken(method):
    """The grid error is of order four in the step, and not that of the output points."""
    circuit = nsspice.read(ARGSINH)
    errors = []
    for step in (0.1, 0.01):
        solution = nsspice.tran(circuit, method=method, step=step)
        assert solution.islands[0].stats["steps"] == pytest.approx(10.0 / step, abs=2)
        assert solution.time.size == 101
        p = 4.0 * np.sin(solution.time)
        exact = np.sinh(p - np.clip(p, -1.0, 1.0))
        errors.append(np.abs(solution["i(d1)"] - exact).max())
    if method is None:
        assert max(errors) < 1e-11  # solved at each point
    else:
        # a factor of 10 in the step is 10^4 in the error, of which kinks leave half at least
        assert errors[1] < 2.0 * errors[0] * 1e-4
        assert errors[1] == pytest.approx({"euler-newton": 2.25e-7}.get(method, 2.0e-7), rel=0.01)


def problem(function, *pieces):
    tape = TapeBuilder()
    tape.output(function(tape, tape.unknown(0)))
    return GeneralizedEquation(tape.finish(), pieces)


def test_whole_numbers_are_numbers():
    identity = lambda tape, z: z  # noqa: E731 - the shortest g there is
    assert solve(problem(identity, (0, Sign(-1, 1))), [0.0], [[2.0]]).z[0, 0] == 1.0
    assert solve(problem(identity, (0, Cone(0, 1))), [0.0], [[2.0]]).z[0, 0] == 1.0


def test_failures_are_told_apart():
    """Data that are not finite, a pole at the start, a proved conflict, and a search in vain."""
    identity = problem(lambda tape, z: z)
    with pytest.raises(ValueError, match=r"component 0 of the data at 0\.5 is nan"):
        solve(identity, [0.0, 0.5], [[0.0], [np.nan]])
    pole = problem(lambda tape, z: tape.op("inv", z))
    with pytest.raises(NoValue, match="no finite value") as caught:
        solve(pole, [0.0], [[2.0]])
    assert caught.value.functions == (0,)
    assert solve(pole, [0.0], [[2.0]], start=[1.0]).z[0, 0] == pytest.approx(0.5)
    with pytest.raises(UnsolvedStep, match="was found") as caught:
        solve(problem(lambda tape, z: tape.op("atan", z)), [0.0], [[2.0]])
    assert caught.value.certificate is None
    # z in [0, 1] and in [2, 3] at once
    twice = problem(lambda tape, z: z, (0, Cone(0, 1)), (0, Cone(2, 3)))
    with pytest.raises(UnsolvedStep, match="contradict") as caught:
        solve(twice, [0.0], [[0.5]])
    assert caught.value.certificate is not None


def test_a_path_that_ends_is_not_followed_further():
    """z^2 = p down to p < 0, and 1/z = p through p = 0: both were followed to residuals of 1."""
    t = np.linspace(0.0, 1.0, 11)
    square = problem(lambda tape, z: tape.op("square", z))
    with pytest.raises(RegularityLost) as caught:
        track(square, t, lambda s: [0.25 - 0.5 * s], start=[0.5])
    lost = caught.value
    assert lost.time == pytest.approx(0.6)  # at 0.5 is the last solution, z = 0
    assert lost.unknown == 0
    # dz/dp = 1/(2 z)
    assert lost.modulus == pytest.approx(0.5 / lost.path.z[-1, 0], rel=1e-9)
    pole = problem(lambda tape, z: tape.op("inv", z))
    with pytest.raises(RegularityLost):
        track(pole, t, lambda s: [0.5 - s], start=[2.0])
    with pytest.raises(RegularityLost):
        track(problem(lambda tape, z: z), t, lambda s: [s], start=[5.0])
