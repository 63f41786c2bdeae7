"""The certificate is computed apart from the solver, and sees what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nsspice
from nsspice.analyses.cards import Tran
from nsspice.analyses.certificate import Certificate
from nsspice.analyses.energy import Energy
from nsspice.analyses.examiner import Examiner
from nsspice.analyses.island_runner import IslandRunner
from nsspice.analyses.settings import Settings

DECK = """rectifier with a ripple
V1 a 0 SIN(0 10 50)
D1 a b
R1 b c 1
L1 c d 1m
C1 d 0 100u IC=0
R2 d 0 100
"""


def recorded(text=DECK, theta=1.0):
    """Return the runner of a whole run and its records, untouched."""
    circuit = nsspice.read(text)
    analysis = Tran(stop=0.04, row_step=1e-4, uic=True)
    settings = Settings("moreau", theta)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    return runner, runner.stepper.take_records()


def verdict(runner, records) -> Certificate:
    theta = {"H": runner.stepper.H, "Hs": runner.stepper.Hs}
    examiner = Examiner(runner.mna, **theta)
    examiner.take(records)
    stats = runner.stepper.statistics
    return examiner.certificate(stats["steps"], 0, runner.stepper.jumps, runner.charges)


@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_a_good_run_passes_with_a_complete_balance(theta):
    found = verdict(*recorded(theta=theta))
    assert found.passed
    assert found.energy.complete
    assert found.energy.drift < 1e-13
    e = found.energy
    assert e.delivered == pytest.approx(e.stored + e.dissipated + e.lost + e.scheme, rel=1e-9)


@pytest.mark.parametrize("name", ["z", "change", "lam", "u"])
def test_a_single_wrong_number_fails_it(name):
    runner, records = recorded()
    array = getattr(records, name).copy()
    row = 217
    column = int(np.argmax(np.abs(array[row])))
    array[row, column] *= 1.0 + 1e-5
    assert not verdict(runner, replace(records, **{name: array})).passed


def test_a_gap_between_two_steps_fails_the_balance_of_the_run():
    """Each step alone is right, but one of them is missing."""
    runner, records = recorded()
    half = records.time.size // 2
    cut = np.r_[0:half, half + 1 : records.time.size]
    shorter = replace(
        records,
        **{
            k: getattr(records, k)[cut]
            for k in ("time", "length", "z", "change", "lam", "u", "source_change")
        },
    )
    examiner = Examiner(runner.mna)
    examiner.take(shorter)
    found = examiner.certificate(shorter.time.size - 1, 0, runner.stepper.jumps, runner.charges)
    assert found.energy.complete
    assert found.laws < 1e-8
    assert not found.passed


def test_nan_never_passes():
    runner, records = recorded()
    z = records.z.copy()
    z[100, 0] = np.nan
    found = verdict(runner, replace(records, z=z))
    assert not found.passed
    assert not Certificate.total([found, Certificate(0.0, 0.0, 1)]).passed
    assert not Certificate.total([Certificate(0.0, 0.0, 1), found]).passed


def test_a_conducting_diode_with_reverse_current_is_seen():
    runner, records = recorded()
    lam = records.lam.copy()
    lam[3, 0] = -1.0
    assert verdict(runner, replace(records, lam=lam)).complementarity > 0.1


def test_energy_adds_up_over_islands():
    total = Energy.total([Energy(1.0, 2.0, steps=3, of=3), Energy(1.0, 0.0, steps=1, of=2)])
    assert (total.stored, total.delivered, total.complete) == (2.0, 2.0, False)


def test_energy_lost_in_a_jump_is_that_of_the_book():
    """Two equal capacitors, one charged to 2 V: half of the energy is lost."""
    text = "two\nV1 g 0 PULSE(0 1 1m 0 0 1 2)\nC1 a 0 1u IC=2\nS1 a b g 0 SW\nC2 b 0 1u IC=0\n"
    sol = nsspice.tran(
        nsspice.read(text + ".model SW SW(VT=0.5)\n"),
        stop=2e-3,
        row_step=1e-4,
        uic=True,
        method="moreau",
    )
    (jump,) = sol.jumps
    assert jump.before == pytest.approx(2e-6, rel=1e-12)
    assert jump.lost == pytest.approx(1e-6, rel=1e-9)
    assert {m.element: (m.before, m.after) for m in jump.stores} == {
        "c1": (pytest.approx(2e-6), pytest.approx(1e-6)),
        "c2": (0.0, pytest.approx(1e-6)),
    }
    assert sol.certificate.energy.lost == pytest.approx(1e-6, rel=1e-9)


def test_parallel_capacitors_lose_energy_at_the_start():
    """1 uF at 3 V beside 2 uF at 0 V: 4.5 uJ before, 3 uC on 3 uF after: 1.5 uJ."""
    sol = nsspice.tran(
        nsspice.read("par\nC1 a 0 1u IC=3\nC2 a 0 2u IC=0\nR1 a 0 1MEG\n"), stop=1e-6, uic=True
    )
    # what is already one node has no impulse of its own: the charge is that of the node
    assert sol["v(a)"][0] == pytest.approx(1.0, rel=1e-9)
    assert sol.certificate.passed
