"""Jumps of charge and flux are exact, whatever the step."""

from __future__ import annotations

import pytest
from oracle.core import transient

STEPS = [1e-5, 1e-9]


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_capacitor_is_charged_through_a_diode_at_once(h, theta):
    run = transient("jump\nV1 a 0 10\nD1 a b\nC1 b 0 1u IC=0\n", h, 3, ["v(b)"], theta)
    assert run["v(b)"][1:] == pytest.approx(10.0, rel=1e-12)
    charge = {i.element: i.value for i in run.solution.impulses}
    assert charge["d1"] == pytest.approx(10e-6, rel=1e-9)


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_inductor_current_is_cut_by_a_diode_at_once(h, theta):
    run = transient("cut\nL1 a 0 1m IC=1\nD1 a 0\n", h, 3, ["i(l1)", "v(a)"], theta)
    assert run["i(l1)"][1:] == pytest.approx(0.0, abs=1e-12)
    flux = {i.element: i.value for i in run.solution.impulses}
    assert flux["l1"] == pytest.approx(-1e-3, rel=1e-9)


@pytest.mark.parametrize("h", STEPS)
def test_unequal_capacitors_share_their_charge(h):
    deck = "share\nC1 a 0 1u IC=6\nD1 a b\nC2 b 0 2u IC=0\n"
    run = transient(deck, h, 3, ["v(a)", "v(b)"])
    assert run["v(a)"][1:] == pytest.approx(2.0, rel=1e-12)
    assert run["v(b)"][1:] == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize("h", STEPS)
def test_unequal_inductors_in_series_keep_their_flux(h):
    deck = "series\nL1 0 a 1m IC=3\nL2 a 0 2m IC=0\n"
    run = transient(deck, h, 3, ["i(l1)", "i(l2)"])
    assert run["i(l1)"][1:] == pytest.approx(1.0, rel=1e-12)
    assert run["i(l2)"][1:] == pytest.approx(1.0, rel=1e-12)


def test_source_step_across_a_capacitor_moves_it_within_the_instant():
    deck = "step\nV1 a 0 PULSE(0 5 1m 0 0 1m 4m)\nD1 a b\nC1 b 0 1u IC=0\nR1 b 0 1k\n"
    run = transient(deck, 1e-4, 20, ["v(b)"])
    assert run["v(b)"][9] == pytest.approx(0.0, abs=1e-12)
    assert run["v(b)"][11] == pytest.approx(5.0, rel=1e-12)
