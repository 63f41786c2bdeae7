"""Wrong runs of each engine do not pass: laws, states, modes and values off by a millionth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle.node_voltages import potentials_of

import nsspice
from nsspice.analyses.certificate.island_check import Examiner, sampling
from nsspice.analyses.request.cards import Tran
from nsspice.analyses.request.settings import Settings
from nsspice.analyses.transient.island_runner import IslandRunner
from nsspice.solvers.intervals import Intervals
from nsspice.solvers.moreau import Records

#: a boost converter: switchings by a source, a diode that ends by itself, a resonance beside
BOOST = """boost
V1 in 0 10
L1 in sw {l} IC=0
S1 sw 0 g 0 SW
D1 sw out D
C1 out 0 10u IC=10
R1 out 0 {r}
V2 g 0 PULSE(0 1 0 0 0 3u 10u)
.model SW SW(VT=0.5)
.model D D(Vfwd={drop})
"""
USUAL = {"l": 100e-6, "r": 200.0, "drop": 0.7}
STOP = 100e-6
METHODS = ("moreau", "modewise", "sdirk")


def run(method, **values):
    """Return the runner of a whole run and what it has recorded."""
    circuit = nsspice.read(BOOST.format(**{**USUAL, **values}))
    step = 1e-7 if method == "moreau" else None
    analysis = Tran(stop=STOP, row_step=STOP / 10, max_step=step, uic=True)
    settings = Settings(method, 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    steps = Records.of(runner.stepper.take_records()) if method != "modewise" else None
    intervals = None
    if method != "moreau":
        intervals = Intervals.of(runner.stepper.take_intervals())
    return runner, steps, intervals


def verdict(runner, steps, intervals):
    examiner = Examiner(runner.mna)
    if intervals is not None:
        examiner.take_intervals(intervals)
    if steps is not None:
        examiner.take(steps)
    return examiner.certificate(1, 0, runner.stepper.jumps, runner.charges)


def changed(method, steps, intervals, name, change):
    """Apply a change to one array of all recorded steps, or intervals."""
    if method == "moreau":
        array = getattr(steps, name).copy()
        change(array)
        return replace(steps, **{name: array}), intervals
    array = getattr(intervals, name).copy()
    change(array)
    return steps, replace(intervals, **{name: array})


@pytest.mark.parametrize("method", METHODS)
def test_the_right_run_passes(method):
    found = verdict(*run(method))
    assert found.laws < 1e-8
    assert found.passed


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "wrong",
    [
        # an inductance, a resistance, and a voltage that the diode takes from nowhere
        {"l": 100e-6 * (1.0 + 1e-6)},
        {"r": 200.0 * (1.0 + 1e-6)},
        {"drop": 0.7 - 1e-5},
    ],
)
def test_a_run_under_other_laws_fails(method, wrong):
    runner, steps, intervals = run(method, **wrong)
    right = run(method)[0]
    runner.mna = right.mna
    assert not verdict(runner, steps, intervals).passed


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("unknown", ["v(out)", "i(l1)"])
def test_a_state_that_is_off_by_a_millionth_fails(method, unknown):
    runner, steps, intervals = run(method)
    j = runner.mna.unknowns.index(unknown)
    steps_in_time = steps.length > 0.0 if method == "moreau" else intervals.begin >= 0.0
    k = np.flatnonzero(steps_in_time)[steps_in_time.sum() // 2]

    def shift(z):
        # one step, or one interval, moved as a whole: its rates are as they were
        z[k][..., j] += 1e-6 * np.abs(z[..., j]).max()

    wrong = changed(method, steps, intervals, "z", shift)
    assert not verdict(runner, *wrong).passed


@pytest.mark.parametrize("method", METHODS)
def test_a_diode_in_the_wrong_mode_for_one_step_fails(method):
    runner, steps, intervals = run(method)
    pair = runner.mna.pairs.index("d1")

    def cut(lam):
        conducts = [k for k in range(len(lam)) if np.all(lam[k][..., pair] > 0.01)]
        assert conducts
        lam[conducts[len(conducts) // 2]][..., pair] = 0.0

    wrong = changed(method, steps, intervals, "lam", cut)
    assert not verdict(runner, *wrong).passed


def test_a_step_in_another_mode_breaks_the_signs_alone():
    """All equations of the step hold with the diode cut off; only its voltage tells."""
    runner, steps, _ = run("moreau")
    system, pair = runner.mna.system, runner.mna.pairs.index("d1")
    lam, roles = steps.lam, steps.roles
    k = next(k for k in range(1, lam.shape[0]) if lam[k, pair] > 0.01 and steps.length[k] > 0.0)
    active = [i for i in range(system.m) if i != pair and roles[k, i] == 1]
    n, h = system.n, steps.length[k]
    E, G, A, B = (m.dense() for m in (system.E, system.G, system.A, system.B))
    matrix = np.block(
        [[E / h + G, A[:, active]], [B[active], np.zeros((len(active), len(active)))]]
    )
    before = steps.z[k] - steps.change[k]
    rhs = np.r_[E @ before / h + system.S.dot(steps.u[k]), system.q[active]]
    x = np.linalg.solve(matrix, rhs)
    z, change, l = steps.z.copy(), steps.change.copy(), lam.copy()
    z[k], change[k], l[k] = x[:n], x[:n] - before, 0.0
    l[k, active] = x[n:]
    wrong = replace(steps, z=z, change=change, lam=l)
    found = verdict(runner, wrong, None)
    assert found.laws < 1e-8
    assert found.complementarity > 1e-3
    assert not found.passed


def test_sampling_of_these_runs_is_complete():
    """What is changed above is looked at: every step is recorded."""
    assert sampling(STOP / 1e-7, 10) == (1, 1)


def stepped(text, analysis):
    """Return the runner of a deck after implicit steps to the end, and what it recorded of them."""
    circuit = nsspice.read(text)
    settings = Settings("moreau", 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    return runner, Records.of(runner.stepper.take_records())


def test_a_network_at_rest_is_not_free_of_laws():
    """0.7 A circulate in a short: a microvolt across it is no rounding, 1e-20 V are."""
    text = "rest\nL1 a 0 38m IC=0\nL2 0 a 0.3m IC=-0.7\nD1 0 a\nD2 a 0\n"
    runner, steps = stepped(text, Tran(stop=1e-6, row_step=1e-7, uic=True))
    a = runner.mna.unknowns.index("v(a)")
    for volts, passes in (1e-20, True), (1e-6, False):
        z = steps.z.copy()
        z[steps.length > 0.0, a] = volts
        assert verdict(runner, replace(steps, z=z), None).passed is passes


def test_a_diode_of_a_part_that_hardly_conducts_is_not_free_of_its_voltage():
    """Beside a node of 4 A its voltage has the rounding of that in 1 kOhm, but no microvolt."""
    text = (
        "part\nV1 n1 0 10\nR1 n2 0 14\nC1 n2 0 6u IC=0.8\nR2 n1 n2 13\n"
        "D1 n2 f2\nD2 f1 f2\nR3 f2 f3 1k\nD3 f3 f4\nD4 n1 f4\nD5 f1 0\nI1 n2 0 1\n"
    )
    runner, steps = stepped(text, Tran(stop=3e-4, row_step=5e-5, max_step=5e-5, uic=True))
    nodes = runner.mna.layout.nodes
    part, clamp = [nodes["f2"], nodes["f3"]], nodes["f1"]
    tree = potentials_of(runner.mna)
    for volts, passes in (1e-14, True), (1e-6, False):
        z = steps.z @ tree.T
        # nothing holds the clamp either: as high as its diode to ground lets it go
        z[steps.length > 0.0, clamp] = 0.0
        z[np.ix_(steps.length > 0.0, part)] = z[steps.length > 0.0, clamp][:, None] - volts
        found = verdict(runner, replace(steps, z=np.linalg.solve(tree, z.T).T.copy()), None)
        assert found.laws < 1e-8
        assert found.passed is passes


@pytest.mark.parametrize("unknown", ["v(out)", "i(l1)"])
def test_a_state_that_changes_between_two_segments_fails(unknown):
    """All points of both hold: nothing but their difference tells, recorded or not."""
    runner, _, intervals = run("modewise")
    segments = runner.stepper.statistics["segments"]
    assert intervals.boundaries == segments > intervals.begin.size // 2
    j = runner.mna.unknowns.index(unknown)

    def shift(z):
        z[0, j] += 1e-6 * np.abs(z[:, j]).max()

    _, wrong = changed("modewise", None, intervals, "boundary_begin", shift)
    found = verdict(runner, None, wrong)
    assert found.laws < 1e-8
    assert not found.passed


def test_states_that_vanish_wherever_a_segment_ends_are_no_changes():
    """The current of a half-wave rectifier: what is left at its zeros is rounding."""
    text = "half-wave\nV1 in 0 SIN(0 10 50)\nD1 in out\nL1 out r 20m IC=0\nR1 r 0 10\n"
    run = nsspice.tran(nsspice.read(text), stop=100e-3, uic=True)
    assert run.islands[0].method == "modewise"
    assert run.certificate.passed


def test_a_potential_between_coils_is_not_free_right_after_a_jump():
    """No law without storage has it; the rates of both currents tell it: 2/3 of 10 V."""
    text = "coils\nV1 a 0 PULSE(0 10 1u 0 0 1 2)\nL1 a b 1m IC=0\nL2 b c 2m IC=0\nR1 c 0 5\n"
    runner, steps = stepped(text, Tran(stop=3e-6, row_step=1e-6, max_step=1e-7, uic=True))
    between = runner.mna.layout.nodes["b"]
    tree = potentials_of(runner.mna)
    jumped = (steps.length < 0.0) & (steps.time > 0.0)
    assert (steps.z @ tree.T)[jumped, between] == pytest.approx(20 / 3, rel=1e-9)
    for volts, passes in (1e-9, True), (5.0, False):
        z = steps.z @ tree.T
        z[jumped, between] += volts
        found = verdict(runner, replace(steps, z=np.linalg.solve(tree, z.T).T.copy()), None)
        assert found.passed is passes
