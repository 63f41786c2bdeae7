"""References of circuits that are dear: a single tight run is one, with what it is known to."""

from __future__ import annotations

import math

import pytest

import nsspice
from nsspice.compare.cost import make_reference
from nsspice.compare.cost.problem import GivenUp, Problem
from nsspice.errors import Diagnostic, NumericalError

RECTIFIER = """smooth rectifier
V1 a 0 SIN(0 5 1k)
R0 a b 10
D1 b c DX
C1 c 0 1u IC=0
R1 c 0 1k
.model DX D(IS=1e-12)
.tran 50u 1m uic
"""


@pytest.fixture
def runs(monkeypatch, clock):
    """Let each controlled run seem to take 5 s; return the tolerances in the order of the runs.

    ``runs.fails`` are tolerances at which it finds no solution.
    """
    run = Problem.run

    class Runs(list):
        fails: tuple[float, ...] = ()

    seen = Runs()

    def slow(self, settings, limit=float("inf")):
        if settings.method != "sdirk":
            return run(self, settings)
        seen.append(settings.reltol)
        if settings.reltol in seen.fails:
            raise NumericalError(Diagnostic("NS3004", "none"))
        return run(self, settings)[0], 5.0

    monkeypatch.setattr(Problem, "run", slow)
    return seen


def test_a_single_tight_run_is_compared_with_a_looser_one(runs):
    problem = Problem.of(nsspice.read(RECTIFIER))
    reference = make_reference(problem)  # 20 s for the next tolerance are more than 6 s
    assert runs == [1e-7, 1e-6]
    assert "reltol 1e-07" in reference.how
    assert "10 times the tolerance" in reference.how
    finer = make_reference(problem, limit=10.0)
    assert runs[2:] == [1e-7, 1e-8, 1e-9, 1e-10, 1e-11][: len(runs) - 2]
    assert finer.error < reference.error
    error, _ = reference.distance(finer.graph.low)
    assert 0.0 < error <= reference.error < 1e-4


def test_where_tight_runs_fail_looser_ones_serve(runs):
    runs.fails = (1e-7, 1e-6)
    reference = make_reference(Problem.of(nsspice.read(RECTIFIER)))
    assert runs == [1e-7, 1e-6, 1e-5, 1e-4]
    assert "reltol 1e-05" in reference.how
    assert 0.0 < reference.error < 1e-2


def test_what_nothing_is_compared_with_is_not_known(runs):
    runs.fails = (1e-6, 1e-5, 1e-4, 1e-3)
    reference = make_reference(Problem.of(nsspice.read(RECTIFIER)))
    assert math.isnan(reference.error)
    assert "its error is not known" in reference.how
    runs.fails = (1e-7, *runs.fails)
    with pytest.raises(NumericalError, match="NS3002"):
        make_reference(Problem.of(nsspice.read(RECTIFIER)))


def test_runs_of_the_reference_go_on_with_a_ladder_that_is_cut_short(runs):
    report = nsspice.cost(nsspice.read(RECTIFIER), methods=["sdirk", "moreau"], limit=2.0)
    rows = report.ladders()["sdirk"]
    # 5 s at the first tolerance: the ladder itself ends there
    assert [row.value for row in rows] == [1e-2, 1e-6, 1e-7]
    errors = [row.error for row in rows]
    assert errors[0] > errors[1] >= errors[2] == report.reference.error
    assert [row.seconds for row in rows] == [5.0, 5.0, 5.0]


@pytest.mark.soak
def test_a_realistic_buck_has_a_curve():
    """It ended in NS3002, although a run takes 5 s: a second tight one was not begun."""
    report = nsspice.cost(nsspice.read(REAL), methods=["sdirk", "moreau"])
    assert report.reference.error < 1e-5
    assert len(report.ladders()["sdirk"]) >= 2


REAL = """Realistic buck
Vin in 0 24
Vg g 0 PULSE(0 1 0 10n 10n 5u 10u)
S1 in sw g 0 mos
D1 0 sw dsch
D2 0 sw body
L1 sw out 100u IC=0 Rser=50m Cpar=10p
C1 out 0 100u IC=0 Rser=20m Lser=5n
R1 out 0 5
Rleak out 0 1meg
.model mos SW(VT=0.5 Ron=10m Roff=1meg)
.model dsch D(Ron=20m Vfwd=0.4 Roff=100k)
.model body D(IS=1e-12 N=1.2 RS=5m CJO=200p TT=20n)
.tran 1u 5m uic
"""


@pytest.fixture
def slow_runs(monkeypatch, clock):
    """Let controlled runs that are tighter than 1e-5 take too long; return the tolerances tried."""
    run, seen = Problem.run, []

    def slow(self, settings, limit=float("inf")):
        if settings.method == "sdirk":
            seen.append(settings.reltol)
            assert limit == 6.0
            if settings.reltol < 0.9e-5:
                raise GivenUp(Diagnostic("NS3002", "given up after 6 s, 1 % of the run done"))
        return run(self, settings, limit)

    monkeypatch.setattr(Problem, "run", slow)
    return seen


def test_where_tight_runs_take_too_long_the_loosest_comes_first(slow_runs):
    deck = RECTIFIER.replace("IS=1e-12", "ideal Vfwd=0.7")
    reference = make_reference(Problem.of(nsspice.read(deck)))
    assert slow_runs == [1e-7, 1e-3, 1e-4, 1e-5, 1e-6]
    assert "the exact mode-wise engine" in reference.how
    assert "reltol 1e-05" in reference.how
    assert [run.tolerance for run in reference.runs] == [1e-3, 1e-4, 1e-5]
    assert 0.0 < reference.error < 1e-2
