"""No accepted step is left out: implicit steps, modes that leave something open; bounded memory."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from decks.chattering import MODULATOR

import nsspice
from nsspice.analyses.certificate.island_check import Examiner
from nsspice.analyses.request.cards import Tran
from nsspice.analyses.request.settings import Settings
from nsspice.analyses.transient import island_runner
from nsspice.analyses.transient.island_runner import IslandRunner
from nsspice.cli.app import app
from nsspice.solvers.intervals import Intervals
from nsspice.solvers.modewise import ModewiseStepper
from nsspice.solvers.moreau import Records

#: a ball on a rigid floor: the mode in which it rests has an index above 2
pytestmark = pytest.mark.usefixtures("runs_return")

IMPACT = (Path(__file__).parents[4] / "netlists/thesis/ex414_rigid_impact.net").read_text()
#: which of the parallel diodes carries the current is open
OPEN = """open
V1 a 0 SIN(0 10 50)
D1 a b
D2 a b
R1 b c 1
L1 c d 1m
C1 d 0 100u IC=0
R2 d 0 100
.tran 1e-4 0.04 uic
.end
"""


def finished(text, method, stop, longest=None):
    """Return the runner of a whole run, and what it has recorded, untouched."""
    circuit = nsspice.read(text)
    analysis = Tran(stop=stop, row_step=stop / 400, uic=True)
    settings = Settings(method, longest or stop / 400)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    runner._wait = 1 << 40
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    intervals = Intervals.of(runner.stepper.take_intervals())
    return runner, intervals, Records.of(runner.stepper.take_records())


def verdict(runner, intervals, records):
    examiner = Examiner(runner.mna)
    examiner.take_intervals(intervals)
    examiner.take(records)
    return examiner.certificate(1, 0, runner.stepper.jumps, runner.charges)


def test_implicit_steps_of_the_mode_wise_engine_are_all_checked():
    runner, intervals, records = finished(IMPACT, "modewise", 2.0)
    count = runner.stepper.statistics["fixed_steps"]
    assert count > 100
    assert records.time.size == count
    assert verdict(runner, intervals, records).passed


@pytest.mark.parametrize("name", ["z", "change", "lam", "u"])
def test_a_wrong_implicit_step_fails(name):
    runner, intervals, records = finished(IMPACT, "modewise", 2.0)
    array = getattr(records, name).copy()
    array[array.shape[0] // 2] += 1e-6 * np.abs(array).max()
    assert not verdict(runner, intervals, replace(records, **{name: array})).passed


def test_single_implicit_steps_of_sdirk_are_all_checked():
    runner, intervals, records = finished(MODULATOR, "sdirk", 20e-6, 0.5e-6)
    assert runner.stepper.statistics["forced"] > 0
    # the states right after jumps stand among them, with negative lengths
    assert np.sum(records.length > 0.0) == runner.stepper.statistics["forced"]
    assert verdict(runner, intervals, records).passed


def test_modes_of_sdirk_that_leave_something_open_are_checked():
    runner, intervals, records = finished(OPEN, "sdirk", 0.04, 1.0)
    assert runner.stepper.statistics["undetermined"] > 50
    both = [runner.mna.pairs.index(name) for name in ("d1", "d2")]
    ends = intervals.lam[:, -1][:, both]
    # every step is recorded at first, those with current too
    assert np.sum(ends.sum(axis=1) > 0.1) > 10
    assert verdict(runner, intervals, records).passed
    for name in "z", "rate", "lam":
        array = getattr(intervals, name).copy()
        k = int(np.argmax(ends.sum(axis=1)))
        array[k, -1] += 1e-6 * np.abs(array[k, -1]).max()
        wrong = replace(intervals, **{name: array})
        assert not verdict(runner, wrong, records).passed


def test_a_wrong_implicit_step_ends_with_exit_code_3(tmp_path, monkeypatch):
    deck = tmp_path / "chatter.net"
    deck.write_text(IMPACT)
    take = ModewiseStepper.take_records

    def tampered(self):
        records = Records.of(take(self))
        z = records.z.copy()
        z[-1:] *= 1.0 + 1e-6
        return replace(records, z=z)

    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["run", str(deck), "--method", "modewise"]).exit_code == 0
    monkeypatch.setattr(ModewiseStepper, "take_records", tampered)
    result = CliRunner().invoke(app, ["run", str(deck), "--method", "modewise"])
    assert result.exit_code == 3
    assert (tmp_path / "chatter.csv").exists()


@pytest.mark.parametrize("method", ["moreau", "modewise", "sdirk"])
def test_records_of_all_islands_together_are_bounded(method, monkeypatch):
    bound, islands = 4000, 40
    text = "many\n" + "".join(
        f"V{k} a{k} 0 SIN(0 10 {50 + k})\nD{k} a{k} b{k}\nC{k} b{k} 0 1u\nR{k} b{k} 0 10k\n"
        for k in range(islands)
    )
    monkeypatch.setattr(island_runner, "_WAIT", bound)
    runners, waiting = set(), []
    advance = IslandRunner.advance

    def watched(self, rows):
        block = advance(self, rows)
        runners.add(self)
        waiting.append(sum(runner.stepper.waiting for runner in runners))
        return block

    monkeypatch.setattr(IslandRunner, "advance", watched)
    sol = nsspice.tran(nsspice.read(text), stop=0.2, row_step=1e-4, step=1e-4, method=method)
    assert len(runners) == islands
    assert sol.certificate.passed
    assert max(waiting) <= bound


def test_a_ramp_that_begins_with_the_last_row():
    """The piece of it behind the end serves the row: its sources are those of its own instants."""
    deck = """ramp
V1 a 0 PULSE(0 5 0 6.58u 6.58u 263u 658u)
Rs a b 11
R2 c b 133
R3 d c 2k
R4 e d 6k
C1 d b 0.29u
R5 e b 92
.tran 6.58u 1.974m uic
.end
"""
    run = nsspice.tran(nsspice.read(deck), method="modewise")
    assert run.certificate.passed
    assert run["v(a)"][-1] == 0.0
