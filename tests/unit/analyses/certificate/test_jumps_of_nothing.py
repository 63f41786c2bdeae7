"""Jumps of nothing: energy from nowhere, charge in the rounding of what goes round in a loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate.island_check import Examiner
from nsspice.analyses.request.cards import Tran
from nsspice.analyses.request.settings import Settings
from nsspice.analyses.transient.island_runner import IslandRunner

#: 2 V and 0 V are joined at 1 ms by a switch beside a diode
TWO = """two
V1 g 0 PULSE(0 1 1m 0 0 1 2)
C1 a 0 1u IC=2
S1 a b g 0 SW
D1 b a
C2 b 0 1u IC=0
.model SW SW(VT=0.5)
"""


@pytest.fixture(scope="module", params=["modewise", "moreau"])
def runner(request):
    circuit = nsspice.read(TWO)
    step = 1e-5 if request.param == "moreau" else None
    analysis = Tran(stop=2e-3, row_step=1e-4, max_step=step, uic=True)
    settings = Settings(request.param, 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    return runner


def balance(runner, change):
    (jump,) = runner.stepper.jumps
    return Examiner(runner.mna).certificate(1, 0, [change(runner, jump)]).jumps


def columns(runner):
    mna = runner.mna
    nodes = [mna.unknowns.index(name) for name in ("v(a)", "v(b)")]
    return nodes, [mna.pairs.index(name) for name in ("s1", "d1")]


def round_the_loop(amount):
    """Let a charge go round in the switch and the diode."""

    def change(runner, jump):
        _, (switch, diode) = columns(runner)
        multipliers = jump.multipliers.copy()
        multipliers[switch] += amount
        multipliers[diode] += amount
        return replace(jump, multipliers=multipliers)

    return change


def test_the_jump_itself_passes(runner):
    assert balance(runner, round_the_loop(0.0)) < 1e-12
    assert balance(runner, round_the_loop(1.0)) < 1e-8


def test_no_charge_is_lost_in_what_goes_round(runner):
    def change(runner, jump):
        (_, b), _ = columns(runner)
        after = jump.after.copy()
        after[b] = 0.0
        return replace(round_the_loop(1e16)(runner, jump), after=after)

    assert balance(runner, change) > 1e-2


def test_no_jump_goes_too_far(runner):
    """3 V and -1 V: no charge is missing, and 3 uJ have come from nowhere."""

    def change(runner, jump):
        (a, b), (switch, _) = columns(runner)
        after, multipliers = jump.after.copy(), jump.multipliers.copy()
        after[[a, b]] = 3.0, -1.0
        multipliers[switch] += -1e-6 - np.sum(multipliers[[switch]])
        return replace(jump, after=after, multipliers=multipliers)

    assert balance(runner, change) > 1e-2
