"""Jumps of recorded runs with wrong impulses: each must fail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate.impulse_signs import impulse_error
from nsspice.analyses.certificate.written_rows import TOLERANCE
from nsspice.problems.descriptor import DescriptorSystem
from nsspice.solvers.modewise import ModewiseStepper
from nsspice.solvers.stepper import Jump

#: 1 uF at 5 V is switched across 2 uF through a diode
CHARGES = """two capacitors and a diode
C1 a 0 1u IC=5
S1 a b g 0 sw
D1 b c d
C2 c 0 2u
R1 c 0 1meg
V1 g 0 PULSE(0 1 1m 0 0)
.model sw SW(VT=0.5)
.model d D(ideal)
.tran 10u 2m uic
"""
#: the current of an inductor is cut; a diode takes it over by way of a second one
FLUXES = """a cut inductor
V1 a 0 10
S1 a b g 0 sw
L1 b c 1m
R1 c 0 10
L2 d b 2m
D1 0 d d
V2 g 0 PULSE(1 0 1m 0 0)
.model sw SW(VT=0.5)
.model d D(ideal)
.tran 10u 2m uic
"""


def jump_of(text: str) -> tuple[DescriptorSystem, Jump, float]:
    """Return the jump of a run at 1 ms, and what the run has moved [J]."""
    circuit = nsspice.read(text)
    mna = circuit.islands[0].assemble()
    stepper = ModewiseStepper(mna.system, ())
    stepper.plan(0.0, 2e-3, 1e-5, 0.0, 1e-5)
    charges, _ = mna.initial_state({})
    stepper.start_charges(0.0, charges, 1e-5)
    done = False
    while not done:
        _, done = stepper.advance(64)
    found = [jump for jump in stepper.jumps if jump.time > 0.0]
    assert len(found) == 1
    return mna.system, found[0], 1e-5


@pytest.mark.parametrize("text", [CHARGES, FLUXES], ids=["charges", "fluxes"])
def test_a_right_jump_passes(text: str) -> None:
    system, jump, moved = jump_of(text)
    assert impulse_error(system, [jump], moved) < 1e-8


def test_a_charge_does_not_pass_a_diode_backward() -> None:
    system, jump, moved = jump_of(CHARGES)
    # 1 uF x 5 V is shared: 10/3 uC pass, and with the other sign they would pass backward
    assert np.max(jump.multipliers) == pytest.approx(10e-6 / 3.0, rel=1e-9)
    wrong = replace(jump, multipliers=-jump.multipliers, unknowns=-jump.unknowns)
    assert impulse_error(system, [wrong], moved) > 0.1


def test_no_forward_impulse_stands_across_a_blocking_diode() -> None:
    system, jump, moved = jump_of(FLUXES)
    # the flux of 1 mH is shared with 2 mH: an impulse stands across the switch that opened
    assert np.max(np.abs(jump.unknowns)) > 1e-4
    diode = next(k for k in range(system.m) if k not in system.switched)
    row = system.B.dense()[diode]
    wrong = replace(jump, unknowns=jump.unknowns + 1e-4 * row / (row @ row))
    assert impulse_error(system, [wrong], moved) > 1e-3


def test_both_impulses_in_one_pair() -> None:
    system, jump, moved = jump_of(FLUXES)
    charges = jump.multipliers.copy()
    opened = next(iter(system.switched))
    charges[opened] = 1e-3
    assert impulse_error(system, [replace(jump, multipliers=charges)], moved) > 1e-3


#: 1 nF behind a diode of its own, beside 1 mF
BESIDE = CHARGES.replace("R1 c 0 1meg", "R1 c 0 1meg\nC3 e 0 1n\nD3 b e d\nC4 h 0 1m IC=100")


def test_a_charge_that_passes_a_gap_fails_however_small_it_is() -> None:
    """Both capacitors go on at 5/3 V; then the small one has 10 mV less: 1e-12 J of 5 J."""
    system, jump, _ = jump_of(BESIDE)
    assert impulse_error(system, [jump], 5.0) < 1e-8
    small = int(np.argmin(np.where(system.E.diagonal() > 0.0, system.E.diagonal(), np.inf)))
    after = jump.after.copy()
    after[small] -= 0.01
    assert impulse_error(system, [replace(jump, after=after)], 5.0) > 100.0 * TOLERANCE
