"""The balance of energy over whole runs: complete at any length, broken by energy from nowhere."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import nsspice
from nsspice.analyses.request.cards import Tran
from nsspice.analyses.request.settings import Settings
from nsspice.analyses.transient.island_runner import IslandRunner
from nsspice.cli.app import app
from nsspice.problems import Csc
from nsspice.solvers.audit import Auditor
from nsspice.solvers.moreau import Records

#: set-valued elements, jumps (the switch joins two capacitors), a source that gives and takes
LINEAR = """linear
V1 a 0 SIN(0 10 1k)
R1 a b {r}
D1 b c
C1 c 0 1u IC=0
L1 b 0 1m IC=0
R2 c 0 1k
S1 c d g 0 SW
C2 d 0 0.5u IC=0
R3 d 0 500
V2 g 0 PULSE(0 1 0 0 0 0.2m 0.5m)
.model SW SW(VT=0.5)
.tran 2e-6 8m 0 2e-6 uic
.end
"""
#: junctions with charges
SMOOTH = """smooth
V1 a 0 SIN(0 10 1k)
R1 a b {r}
D1 b c J
C1 c 0 1u IC=0
R2 c 0 1k
.model J D(IS=1e-12 N=1.5 CJO=1n TT=1u)
.tran 2e-6 8m 0 2e-6 uic
.end
"""
CASES = [(LINEAR, "moreau", 1.0), (LINEAR, "moreau", 0.5), (LINEAR, "sdirk", 1.0),
         (LINEAR, "modewise", 1.0), (SMOOTH, "moreau", 1.0), (SMOOTH, "sdirk", 1.0)]  # fmt: skip


def other(system, factor):
    """Return a system whose conductances are off by a factor."""
    G = system.G
    scaled = Csc.from_triplets(G.shape, G.indices, G.columns, G.data * factor)
    return replace(system, G=scaled)


def finished(text, method, theta, factor=1.0):
    circuit = nsspice.read(text.format(r=50))
    analysis = Tran(stop=8e-3, row_step=2e-6, max_step=2e-6, uic=True)
    settings = Settings(method, theta)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    if factor != 1.0:
        stepper = runner.stepper
        averaging = (None, None) if method == "modewise" else (stepper.H, stepper.Hs)
        Auditor(other(runner.mna.system, factor), *averaging).accompany(stepper)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    return runner


@pytest.mark.parametrize(("text", "method", "theta"), CASES)
def test_the_balance_of_a_sampled_run_contains_every_step(text, method, theta):
    found = finished(text, method, theta).certificate()
    e = found.energy
    assert e.complete
    assert e.steps < e.of
    assert e.drift < 1e-10  # Newton's method ends at 1e-12
    assert e.delivered == pytest.approx(e.stored + e.dissipated + e.lost + e.scheme, rel=1e-9)
    assert found.passed


@pytest.mark.parametrize(("text", "method", "theta"), CASES)
def test_a_millionth_of_the_power_from_nowhere_fails(text, method, theta):
    """All laws of the recorded steps hold; conductances of which the sums know give the energy."""
    found = finished(text, method, theta, 1.0 + 1e-6).certificate()
    assert found.laws < 1e-8
    assert found.energy.drift > 1e-8
    assert not found.passed


def test_two_ways_of_adding_up_agree():
    """The sums of the core, and the powers of all recorded steps by the assembled matrices."""
    circuit = nsspice.read(LINEAR.format(r=50))
    analysis = Tran(stop=8e-3, row_step=2e-6, max_step=2e-6, uic=True)
    runner = IslandRunner(
        circuit, 0, circuit.islands[0], [], analysis, Settings("moreau", 1.0), None, None
    )
    runner.stepper.watch(1)
    runner.start()
    taken = []
    hand_over = runner.examiner.take
    runner.examiner.take = lambda records: (taken.append(Records.of(records)), hand_over(records))
    while runner.advance(1000).shape[0]:
        pass
    energy = runner.certificate().energy
    assert energy.steps == energy.of == runner.stepper.balance["steps"]
    E, G, A, S = (getattr(runner.mna.system, name).dense() for name in "EGAS")
    dissipated = scheme = delivered = 0.0
    for r in taken:
        moving = (r.length > 0.0) & np.isfinite(r.length)
        h, z, dz = r.length[moving, None], r.z[moving], r.change[moving]
        dissipated += np.sum(h * z * (z @ G.T + r.lam[moving] @ A.T))
        delivered += np.sum(h * z * (r.u[moving] @ S.T))
        scheme += 0.5 * np.sum(dz * (dz @ E.T))
    assert energy.dissipated == pytest.approx(dissipated, rel=1e-10)
    assert energy.scheme == pytest.approx(scheme, rel=1e-10)
    assert runner.stepper.balance["delivered"] == pytest.approx(delivered, rel=1e-10)


@pytest.mark.parametrize("method", ["moreau", "sdirk"])
def test_energy_from_nowhere_ends_with_exit_code_3(method, tmp_path, monkeypatch):
    deck = tmp_path / "smooth.net"
    deck.write_text(SMOOTH.format(r=50))
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["run", str(deck), "--method", method]).exit_code == 0
    accompany = Auditor.accompany

    def tampered(self, stepper):
        accompany(Auditor(other(self.system, 1.0 + 1e-6), stepper.H, stepper.Hs), stepper)

    monkeypatch.setattr(Auditor, "accompany", tampered)
    assert CliRunner().invoke(app, ["run", str(deck), "--method", method]).exit_code == 3


@pytest.mark.parametrize("wrong", [1.0, 1.0 + 1e-6])
def test_long_runs_by_small_matrices_are_whole(wrong):
    """1 uF at 10 V through 1 kOhm, 300,000 implicit steps: v' = v / (1 + h / RC)."""
    steps, h = 300_000, 1e-8
    circuit = nsspice.read("discharge\nC1 a 0 1u IC=10\nR1 a 0 1k\n")
    analysis = Tran(stop=steps * h, row_step=1e-4, max_step=h, uic=True)
    runner = IslandRunner(
        circuit, 0, circuit.islands[0], [], analysis, Settings("moreau", 1.0), None, None
    )
    if wrong != 1.0:
        Auditor(other(runner.mna.system, wrong)).accompany(runner.stepper)
    runner.start()
    rows = 0
    while rows < analysis.row_count:  # on a busy machine a call may end before the next row
        rows += runner.advance(1000).shape[0]
    certificate = runner.certificate()
    energy = certificate.energy
    assert energy.complete
    assert energy.steps < energy.of == steps
    if wrong != 1.0:
        assert not certificate.passed
        assert energy.drift > 1e-8
        return
    assert certificate.passed
    left = math.exp(-2.0 * steps * math.log1p(h / 1e-3))
    # h v^2 / R summed from the first new value on; the rest is dz' E dz / 2
    ratio = (1.0 + h / 1e-3) ** -2
    heat = h * 0.1 * ratio * (1.0 - left) / (1.0 - ratio)
    assert energy.stored == pytest.approx(-0.5e-4 * (1.0 - left), rel=1e-10)
    assert energy.dissipated == pytest.approx(heat, rel=1e-10)
    assert energy.scheme == pytest.approx(0.5e-4 * (1.0 - left) - heat, rel=1e-4)


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_an_edge_at_the_end_of_a_run_adds_nothing(method):
    """1 uF through 1 kOhm, 10 V for one time constant, 0 V for another, and an edge after them."""
    deck = "edge\nV1 a 0 PULSE(0 10 0 0 0 1m 2m)\nR1 a b 1k\nC1 b 0 1u\n.tran 0.1m 2m uic\n"
    found = nsspice.tran(nsspice.read(deck), method=method).certificate.energy
    left = 10.0 * (1.0 - math.exp(-1.0))
    assert found.delivered == pytest.approx(10.0 * 1e-6 * left, rel=1e-6)
    assert found.stored == pytest.approx(0.5e-6 * (left * math.exp(-1.0)) ** 2, rel=1e-6)
