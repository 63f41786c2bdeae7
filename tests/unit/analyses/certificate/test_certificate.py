"""The certificate is computed apart from the solver, and sees what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate.certificate import TOLERANCE, Certificate
from nsspice.analyses.certificate.energy import Energy
from nsspice.analyses.certificate.island_check import Examiner
from nsspice.analyses.request.cards import Tran
from nsspice.analyses.request.settings import Settings
from nsspice.analyses.transient.island_runner import IslandRunner
from nsspice.problems.csc import Csc
from nsspice.problems.descriptor import DescriptorSystem
from nsspice.solvers.audit import Auditor
from nsspice.solvers.intervals import Intervals
from nsspice.solvers.moreau import Records

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
    return runner, Records.of(runner.stepper.take_records())


def verdict(runner, records) -> Certificate:
    theta = {"H": runner.stepper.H, "Hs": runner.stepper.Hs}
    examiner = Examiner(runner.mna, **theta)
    examiner.take(records)
    steps, sums = runner.stepper.statistics["steps"], runner.stepper.balance
    return examiner.certificate(steps, 0, runner.stepper.jumps, runner.charges, sums=sums)


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


#: ideal switch and diode: switchings by a source, and a diode that ends by itself
CHOPPER = """chopper, discontinuous
V1 in 0 10
S1 in sw g 0 SW
D1 0 sw
L1 sw out 100u IC=0
C1 out 0 10u IC=0
R1 out 0 50
V2 g 0 PULSE(0 1 0 0 0 3u 10u)
.model SW SW(VT=0.5)
"""


def finish(runner) -> None:
    """Let the engine go on to the end; a block that takes too long holds no rows."""
    while not runner.stepper.advance(1000, 1.0)[1]:
        pass


def exact(text=CHOPPER, stop=100e-6):
    """Return the runner of a mode-wise run and its intervals, untouched."""
    circuit = nsspice.read(text)
    analysis = Tran(stop=stop, row_step=stop / 10, uic=True)
    settings = Settings("modewise", 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    runner.start()
    finish(runner)
    return runner, Intervals.of(runner.stepper.take_intervals())


def exact_verdict(runner, intervals) -> Certificate:
    examiner = Examiner(runner.mna)
    examiner.take_intervals(intervals)
    steps, sums = runner.stepper.statistics["segments"], runner.stepper.balance
    return examiner.certificate(steps, 0, runner.stepper.jumps, runner.charges, sums=sums)


def test_an_exact_run_passes_with_a_complete_balance():
    found = exact_verdict(*exact())
    assert found.passed
    e = found.energy
    assert e.complete
    assert e.drift < 1e-11  # slow rates: 3e-11 at most
    assert e.scheme == 0.0
    assert e.delivered == pytest.approx(e.stored + e.dissipated + e.lost, rel=1e-9)


@pytest.mark.parametrize("name", ["first", "z", "rate", "lam", "u", "weight"])
def test_a_single_wrong_number_fails_an_exact_run(name):
    runner, intervals = exact()
    array = getattr(intervals, name).copy()
    flat = array[array.shape[0] // 2].reshape(-1)
    # where the interval begins only what is stored counts
    at = runner.mna.unknowns.index("v(out)") if name == "first" else int(np.argmax(np.abs(flat)))
    flat[at] *= 1.0 + 1e-5
    assert not exact_verdict(runner, replace(intervals, **{name: array})).passed


def test_a_rate_that_belongs_to_another_motion_is_seen():
    """Rates and currents that agree with each other, but not with where the state goes."""
    runner, intervals = exact()
    k, j = 5, runner.mna.unknowns.index("v(out)")
    z = intervals.z.copy()
    z[k, -1] += 1e-5 * z[k, -1, j] * (np.arange(z.shape[2]) == j)
    assert not exact_verdict(runner, replace(intervals, z=z)).passed


def test_a_conducting_diode_with_reverse_current_is_seen_in_an_exact_run():
    runner, intervals = exact()
    pair = runner.mna.pairs.index("d1")
    lam = intervals.lam.copy()
    assert intervals.lam[:, :, pair].max() > 0.01
    lam[3, 2, pair] = -1e-6
    assert exact_verdict(runner, replace(intervals, lam=lam)).complementarity > 1e-6


def test_energies_of_a_charged_capacitor_are_those_of_the_book():
    """1 uF to 5 V through 1 kOhm in 20 time constants: 25 uJ given, half of it stored."""
    sol = nsspice.tran(
        nsspice.read("rc\nV1 a 0 5\nR1 a b 1k\nC1 b 0 1u IC=0\n"), stop=20e-3, uic=True
    )
    assert sol.islands[0].method == "modewise"
    e = sol.certificate.energy
    assert e.complete
    # what is left after 20 time constants is 2e-9 of all
    assert e.delivered == pytest.approx(25e-6, rel=1e-8)
    assert e.dissipated == pytest.approx(12.5e-6, rel=1e-8)
    assert e.stored == pytest.approx(12.5e-6, rel=1e-8)


def test_energies_of_a_resonance_are_those_of_its_closed_form():
    """A sine of 1 V at resonance: 1 mH, 1 mF and 1 Ohm in series, from rest."""
    deck = "rlc\nV1 a 0 SIN(0 1 159.15494309189535)\nR1 a b 1\nL1 b c 1m IC=0\nC1 c 0 1m IC=0\n"
    sol = nsspice.tran(nsspice.read(deck), stop=25e-3, uic=True)
    e = sol.certificate.energy
    assert e.complete
    t = np.linspace(0.0, 25e-3, 400_001)  # trapezoids of a smooth function: 1e-9
    w, d = 1e3, 500.0
    ring = np.sqrt(w * w - d * d)
    i = np.sin(w * t) - np.exp(-d * t) * w * np.sin(ring * t) / ring
    assert e.dissipated == pytest.approx(np.trapezoid(i * i, t), rel=1e-7)
    assert e.delivered == pytest.approx(np.trapezoid(i * np.sin(w * t), t), rel=1e-7)


def test_an_exact_jump_enters_the_balance():
    """Two equal capacitors, one charged to 2 V, joined at 1 ms: 1 uJ of 2 uJ is lost."""
    text = "two\nV1 g 0 PULSE(0 1 1m 0 0 1 2)\nC1 a 0 1u IC=2\nS1 a b g 0 SW\nC2 b 0 1u IC=0\n"
    sol = nsspice.tran(
        nsspice.read(text + "R1 b 0 1G\n.model SW SW(VT=0.5)\n"), stop=2e-3, row_step=1e-4, uic=True
    )
    assert sol.islands[0].method == "modewise"
    assert sol.certificate.passed
    assert sol.certificate.energy.complete
    assert sol.certificate.energy.lost == pytest.approx(1e-6, rel=1e-6)  # 1 GOhm takes 1e-9 J


def test_laws_of_long_exact_runs_are_sampled_and_energies_are_whole():
    runner, intervals = exact(stop=20e-3)
    segments = runner.stepper.statistics["segments"]
    assert segments > 4000
    # one in 256, after some at the beginning
    assert 4 <= int(intervals.steps.sum()) < 24 + segments / 256
    found = exact_verdict(runner, intervals)
    assert found.passed
    assert found.energy.complete
    assert found.energy.drift < 1e-12


def cockcroft_walton(stages=16, **values):
    """Return a multiplier, with other values of some elements: a new mode at most switchings."""
    lines = ["multiplier", "V1 in 0 SIN(0 10 1k)", f"Rs in a0 {values.get('Rs', 1.0)!r}"]
    for s in range(1, stages + 1):
        low = "0" if s == 1 else f"b{s - 1}"
        for name, nodes in ((f"Ca{s}", f"a{s - 1} a{s}"), (f"Cb{s}", f"{low} b{s}")):
            lines.append(f"{name} {nodes} {values.get(name, 1e-6)!r} IC=0")
        lines += [f"Da{s} {low} a{s} DI", f"Db{s} a{s} b{s} DI"]
    lines += [f"RL b{stages} 0 {values.get('RL', 1e6)!r}", ".model DI D(Ron=0.1 Roff=1G)"]
    return "\n".join(lines) + "\n"


def test_energies_of_many_large_modes_are_whole():
    """16 stages, a new mode each time; forms of each would cost several times the run."""
    runner, intervals = exact(cockcroft_walton(), 2e-3)
    found = exact_verdict(runner, intervals)
    assert found.passed
    e = found.energy
    assert e.complete
    assert e.of > 150
    # 34 nodes, rates from 1/s to 1e7/s
    assert e.drift < 1e-9
    assert e.delivered == pytest.approx(e.stored + e.dissipated, rel=1e-9)
    charges = runner.mna.system.E.dot(runner.stepper.state[0])
    assert e.stored == pytest.approx(0.5 * float(charges @ runner.stepper.state[0]), rel=1e-9)


@pytest.mark.parametrize(
    "wrong", [{"Ca3": 1.000001e-6}, {"Cb16": 1.000001e-6}, {"Rs": 1.000001}, {"RL": 1.01e6}]
)
def test_energies_of_many_large_modes_under_other_laws_fail(wrong):
    """A millionth of a capacitor or of Rs; the load takes a ten-thousandth of the energy."""
    circuit = nsspice.read(cockcroft_walton())
    other = nsspice.read(cockcroft_walton(**wrong)).islands[0].assemble(27.0)
    analysis = Tran(stop=2e-3, row_step=2e-4, uic=True)
    settings = Settings("modewise", 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    Auditor(other.system).accompany(runner.stepper)
    runner.start()
    finish(runner)
    assert runner.stepper.balance["drift"] > TOLERANCE


#: a junction with charge, and an ideal diode whose current ends by itself
CLAMP = """junction and ideal diode
V1 a 0 SIN(0 5 1k)
R1 a b 100
D1 b c J
C1 c 0 1u IC=0
R2 c 0 1k
D2 a d
L1 d e 1m IC=0
R3 e 0 50
.model J D(IS=1e-14 N=1 CJO=10p TT=10n)
"""


RELAY = """a capacitor charged to 7 V, discharged to 3 V, and again
V1 in 0 10
R1 in c 1k
C1 c 0 1u IC=0
S1 c d c 0 SX
R2 d 0 50
.model SX SW(VT=5 VH=2)
"""


def stepped(text=CLAMP, stop=2e-3):
    """Return the runner of a run with error control and its steps, untouched."""
    circuit = nsspice.read(text)
    analysis = Tran(stop=stop, row_step=stop / 10, uic=True)
    settings = Settings("sdirk", 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    return runner, Intervals.of(runner.stepper.take_intervals())


def stepped_verdict(runner, intervals) -> Certificate:
    examiner = Examiner(runner.mna)
    examiner.take_intervals(intervals)
    steps = int(runner.stepper.statistics["steps"])
    sums = runner.stepper.balance
    return examiner.certificate(steps, 0, runner.stepper.jumps, runner.charges, sums=sums)


def test_a_run_with_error_control_passes():
    runner, intervals = stepped(stop=2e-3)
    found = stepped_verdict(runner, intervals)
    assert found.passed
    assert found.energy.steps >= 64


def test_steps_that_are_cut_at_the_threshold_of_a_switch_are_recorded_and_pass():
    """Steps do not pass over thresholds: the end of one that is cut there is no stage."""
    runner, intervals = stepped(RELAY, stop=5e-3)
    assert stepped_verdict(runner, intervals).passed
    assert np.count_nonzero(intervals.weight[:, -1] > 0.0) >= 4


@pytest.mark.parametrize("name", ["first", "z", "rate", "lam", "u", "weight"])
def test_a_single_wrong_number_fails_a_run_with_error_control(name):
    runner, intervals = stepped()
    array = getattr(intervals, name).copy()
    row = int(np.argmax(np.abs(intervals.lam).max(axis=(1, 2))))  # where the ideal diode conducts
    flat = array[row].reshape(-1)
    # what begins and what moves is judged for stored unknowns alone
    stored = name in ("first", "rate")
    at = runner.mna.unknowns.index("v(c)") if stored else int(np.argmax(np.abs(flat)))
    flat[at] *= 1.0 + 1e-4
    assert not stepped_verdict(runner, replace(intervals, **{name: array})).passed


@pytest.mark.parametrize("order", [2, 4])
def test_the_energy_that_the_stages_take_is_known(order):
    """1 uF through 1 kOhm from 5 V: all of 12.5 uJ goes into the resistor or the scheme."""
    deck = f"rc\nR1 a 0 1k\nC1 a 0 1u IC=5\n.options order={order}\n"
    sol = nsspice.tran(
        nsspice.read(deck), stop=20e-3, step=1e-3, uic=True, method="sdirk", reltol=1
    )
    e = sol.certificate.energy
    assert sol.certificate.passed
    assert e.complete
    assert e.stored == pytest.approx(-12.5e-6, rel=1e-9)
    assert e.dissipated + e.scheme == pytest.approx(12.5e-6, rel=1e-9)
    # with steps of a whole time constant the error of order 4 is some 1e-3
    assert e.dissipated == pytest.approx(12.5e-6, rel=0.1 if order == 2 else 5e-3)
    assert e.scheme != 0.0


@pytest.mark.parametrize("method", ["moreau", "modewise", "sdirk"])
@pytest.mark.parametrize("volts", [1e-300, 1e-308, 1e-310])
def test_a_source_of_a_denormal_voltage_has_few_digits_and_a_certificate(method, volts):
    """The last digit of its currents is 5e-324 A, which is more than 1e-8 of them."""
    deck = f"tiny\nV1 a 0 SIN(0 {volts!r} 1k)\nR1 a b 1k\nC1 b 0 1u\n"
    run = nsspice.tran(nsspice.read(deck), stop=1e-3, row_step=1e-5, method=method)
    assert run.certificate.passed


def test_a_source_of_few_last_digits_is_solved_or_refused_by_name():
    deck = "tiny\nV1 a 0 SIN(0 1e-322 1k)\nR1 a b 1k\nC1 b 0 1u\n"
    with pytest.raises(nsspice.NsspiceError, match="no solution was found") as refusal:
        nsspice.tran(nsspice.read(deck), stop=1e-3, row_step=1e-5, method="moreau")
    assert refusal.value.code == "NS3002"


@pytest.mark.parametrize(("volts", "holds"), [(1.0, True), (1.001, False)])
def test_right_after_a_jump_currents_pass_a_floating_capacitor(volts, holds):
    """2 A into one of its nodes, 1 Ohm to ground at both: 1 V each, whatever its own current is."""

    def matrix(shape, *entries):
        rows, columns, values = (list(part) for part in zip(*entries, strict=True))
        return Csc.from_triplets(shape, rows, columns, values)

    c = 1e-6
    system = DescriptorSystem(
        matrix((2, 2), (0, 0, c), (0, 1, -c), (1, 0, -c), (1, 1, c)),
        matrix((2, 2), (0, 0, 1.0), (1, 1, 1.0)),
        Csc.zeros((2, 0)),
        Csc.zeros((0, 2)),
        Csc.zeros((0, 0)),
        np.zeros(0),
        matrix((2, 1), (0, 0, 1.0)),
        row_kind=np.zeros(2, np.uint8),
    )
    auditor = Auditor(system)
    z, still = np.full((1, 2), volts), np.zeros((1, 2))
    # a negative length: the state right after a jump
    after = np.full(1, -1e-9)
    none, source = np.zeros((1, 0)), np.full((1, 1), 2.0)
    auditor.check(Records(np.zeros(1), after, z, still, none, source, np.zeros((1, 1)), None))
    assert (auditor.result()["laws"] < TOLERANCE) == holds


def test_steps_that_take_the_energy_of_a_run_are_refused() -> None:
    """All laws may hold at the points of steps into which the energy itself has gone."""
    assert Certificate(1e-14, 0.0, 3, taken=0.09).passed
    assert not Certificate(1e-14, 0.0, 3, taken=0.11).passed


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
@pytest.mark.parametrize("resistance", ["1e8", "1e10"])
def test_no_step_takes_the_energy_of_a_coil(resistance: str, tolerance: float) -> None:
    """Order 2 dropped the current of a coil onto an open switch instead of turning the diode on.

    Its smoothed estimate forgave that, and up to 0.28 of the energy went into the steps themselves.
    """
    deck = """panel and boost converter
Iph 0 pv 8
Rs pv pvs 0.2
.model dpv D(IS=1e-8 N=60)
Cin pvs 0 100u IC=25
L1 pvs x 200u
S1 x 0 g 0 sw
D1 x o
Cb o 0 200u IC=48
Vb b 0 48
Vs s 0 PULSE(0 1 0 19.9u 0.05u 0 20u)
Bd d 0 V=limit(0.4+0.05*(v(pvs)-28),0.05,0.9)
Bg g 0 V=if(v(d)>v(s),1,0)
.model sw SW(VT=0.5 RON=1m ROFF=1e8)
.tran 1u 2m uic
"""
    deck = deck.replace("ROFF=1e8", f"ROFF={resistance}")
    right = nsspice.tran(nsspice.read(deck), reltol=1e-6)
    run = nsspice.tran(nsspice.read(deck + ".options order=2\n"), reltol=tolerance)
    assert run.certificate is not None
    assert run.certificate.passed
    # the share that a step of the order two takes is its relative error
    assert run.certificate.taken < tolerance
    # errors of 100 periods, a step or two in each, add up at worst
    assert run["v(o)"][-1] == pytest.approx(right["v(o)"][-1], rel=100 * tolerance)


@pytest.mark.parametrize("end", [4.0, 3.5])
def test_a_mass_that_comes_to_rest_by_friction_is_certified(end: float) -> None:
    """In its last step but one nothing is left of it but rounding, and what the change of the
    energy and the damping have in common is all: the check found an error of 1e-4.

    The bridge carries up to 50 mA either way: dry friction. 80 mA accelerate 1 mF by 30 V/s, the
    friction alone slows it by 50 V/s.
    """
    deck = f"""dry friction
C1 w 0 1m IC=0
D1 w x
D2 y w
D3 0 x
D4 y 0
I1 x y 0.05
I2 0 w PULSE(0 0.08 3 0 0 {end - 3.0} 10)
.tran 10m 6 uic
"""
    solution = nsspice.read(deck).run(method="moreau")[0]
    top = 30.0 * (end - 3.0)
    after = solution.time > end
    expected = np.maximum(top - 50.0 * (solution.time[after] - end), 0.0)
    assert solution["v(w)"][after] == pytest.approx(expected, abs=1e-9)
    assert solution.certificate.passed
