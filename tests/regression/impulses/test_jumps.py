"""Jumps of charge and flux are exact, whatever the step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle.core import transient

import nsspice

STEPS = [1e-5, 1e-9]


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_capacitor_is_charged_through_a_diode_at_once(h, theta):
    run = transient("jump\nV1 a 0 10\nD1 a b\nC1 b 0 1u IC=0\n", h, 3, ["v(b)"], theta)
    assert run["v(b)"][1:] == pytest.approx(10.0, rel=1e-12)
    charge = {i.element: i.value for i in run.solution.impulses}
    assert charge["d1"] == pytest.approx(10e-6, rel=1e-9)


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_a_mirror_passes_twice_the_charge_of_its_diode(method):
    """10 V step into 1 uF: 10 uC through the diode, 20 uC through F1, 5 V across 4 uF."""
    deck = "mirror\nV1 a 0 PULSE(0 10 1m 0 0 1 2)\nD1 a b\nC1 b 0 1u\nF1 0 c D1 2\nC2 c 0 4u\n"
    run = nsspice.tran(nsspice.read(deck + ".tran 10u 2m uic\n"), method=method)
    charge = {i.element: i.value for i in run.impulses}
    assert charge == pytest.approx({"d1": 10e-6, "v1": -10e-6, "f1": 20e-6}, rel=1e-9)
    assert run["v(c)"][-1] == pytest.approx(5.0, rel=1e-9)


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


#: three wagons of 1 kg: capacitors are masses (their voltages speeds), gaps close at speed, and the
#: contact, a diode, brakes one and pushes the other
WAGONS = """wagons
C1 v1 0 1 IC=6
C2 v2 0 1 IC=0
C3 v3 0 1 IC=0
Ca a 0 1 IC=1
Ga a 0 v1 v2 1
Ea ae 0 a 0 1
Va as 0 DC 0
D1 as ae
F1 v1 0 Va -1
F2 0 v2 Va -1
Cb b 0 1 IC=0.001
Gb b 0 v2 v3 1
Eb be 0 b 0 1
Vb bs 0 DC 0
D2 bs be
F3 v2 0 Vb -1
F4 0 v3 Vb -1
.end
"""


@pytest.mark.parametrize("method", ["modewise", "moreau", "sdirk"])
@pytest.mark.parametrize("h", [0.25, 0.01, 1e-3])
def test_impacts_are_reported_where_they_happen(method, h):
    """6 m/s, then 3 of two, then 2 of three: momentum 6, energies 18, 9, 6 J; the second impact
    follows after 1/3 ms, within the step of the first one but for the shortest.
    """
    run = nsspice.tran(nsspice.read(WAGONS), 1.0, h, step=h, uic=True, method=method)
    first, second = run.jumps
    assert first.time == pytest.approx(1 / 6, rel=1e-12)
    assert second.time == pytest.approx(1 / 6 + 1e-3 / 3, rel=1e-9)
    gap = 0.5 * 0.001**2  # what the capacitor of the second gap holds
    assert [first.before, first.after, second.before, second.after] == pytest.approx(
        [18 + gap, 9 + gap, 9, 6], rel=1e-8
    )
    assert [first.lost, second.lost] == pytest.approx([9, 3], rel=1e-8)
    impulses = [{i.element: i.value for i in jump.impulses} for jump in run.jumps]
    assert impulses[0]["d1"] == pytest.approx(3, rel=1e-8)
    # between the impacts sdirk holds the contact to its tolerance, 1e-5 of 3 m/s
    held = 3e-5 if method == "sdirk" else 1e-7
    assert impulses[1]["d1"] == pytest.approx(1, rel=held)
    assert impulses[1]["d2"] == pytest.approx(2, rel=held)
    assert "d2" not in impulses[0]
    for name in ("v(v1)", "v(v2)", "v(v3)"):
        assert run[name][-1] == pytest.approx(2, rel=held)
    assert min(run["v(a)"].min(), run["v(b)"].min()) > -1e-9
    assert run.certificate.passed


@pytest.mark.parametrize("method", ["modewise", "moreau", "sdirk"])
def test_rows_stand_on_both_sides_of_an_impact(method):
    circuit = nsspice.read(WAGONS)
    run = nsspice.tran(circuit, 1.0, 0.05, step=0.05, uic=True, method=method, all_points=True)
    for jump, before, after in zip(run.jumps, (6.0, 3.0), (3.0, 2.0), strict=True):
        at = np.flatnonzero(np.abs(run.time - jump.time) <= 1e-12)
        assert run["v(v1)"][at[0]] == pytest.approx(before, rel=1e-9)
        assert run["v(v1)"][at[-1]] == pytest.approx(after, rel=1e-7)


@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_a_landing_is_an_impact_of_first_order_and_the_weight_stays(theta):
    """From 5 m with 9.81 m/s^2: 9.9045 m/s; afterwards the floor carries the weight, no impulse."""
    deck = (
        "landing\nCm v 0 1 IC=0\nIg 0 v DC 9.81\nCh x 0 1 IC=5\nG1 x 0 v 0 1\nEx xe 0 x 0 1\n"
        "Vs s 0 DC 0\nD1 s xe\nF1 v 0 Vs -1\n"
    )
    speed = math.sqrt(2 * 9.81 * 5)
    for h in (0.02, 0.002):
        run = transient(deck, h, round(2 / h), ["v(v)", "v(x)", "i(d1)"], theta).solution
        (jump,) = run.jumps
        assert jump.time == pytest.approx(speed / 9.81, abs=h / 2 if theta == 1.0 else h**2)
        assert jump.lost == pytest.approx(speed**2 / 2, rel=1.1 * h)
        assert abs(run["v(v)"][-1]) < 1e-9
        assert run["i(d1)"][-1] == pytest.approx(9.81, rel=1e-9)
