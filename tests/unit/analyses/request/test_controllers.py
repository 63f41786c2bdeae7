"""Digital controllers: what they read and set against recursions on paper, by every engine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

import nsspice
from nsspice import Controller
from nsspice.errors import NetlistError, UsageError

RC = """RC behind a source that a controller sets
Vset u 0 0.25
R1 u x 1k
C1 x 0 1u
.tran 0.1m 4m
"""
PERIOD, TAU = 0.5e-3, 1e-3


class Log:
    """A law that remembers its calls."""

    def __init__(self, law) -> None:
        self.law, self.calls = law, []

    def __call__(self, time, values):
        result = self.law(time, values)
        self.calls.append((time, *values, result))
        return result


def run(deck: str, *controllers: Controller, **options) -> nsspice.Solution:
    return nsspice.tran(nsspice.read(deck), controllers=controllers, **options)


def recursion(
    law, count: int, start: float, before: float, late: int = 0
) -> list[tuple[float, ...]]:
    """The RC under a held input: x decays to it by exp(-T/tau) in each period."""
    x, u, calls = start, before, []
    waiting = [before] * late
    decay = math.exp(-PERIOD / TAU)
    for k in range(count):
        result = law(k * PERIOD, (x,))
        calls.append((k * PERIOD, x, result))
        waiting.append(result)
        u = waiting.pop(0)
        x = u + (x - u) * decay
    return calls


#: engine and what it promises of a linear circuit at the samples
ENGINES = [("modewise", 1e-13), ("sdirk", 1e-5), ("moreau", 2e-2)]


@pytest.mark.parametrize(("method", "error"), ENGINES)
@pytest.mark.parametrize("late", [0, 1])
def test_an_rc_follows_its_recursion(method: str, error: float, late: int) -> None:
    def law(time, values):
        return 1.0 - 2.0 * values[0]

    log = Log(law)
    controller = Controller(PERIOD, ["v(x)"], ["Vset"], log, delay=late * PERIOD)
    solution = run(RC, controller, method=method, step=5e-6 if method == "moreau" else None)
    # the run begins at rest under the deck's value of the source
    wanted = recursion(law, 8, 0.25, 0.25, late)
    assert len(log.calls) == 8
    assert np.abs(np.array(log.calls) - wanted).max() <= error
    assert solution.certificate.passed
    if method == "moreau":  # an implicit step ends before the source is set
        return
    # a sample is what is there just before the instant; rows show what was set
    u = solution["v(u)"]
    assert u[5] == pytest.approx(wanted[1 - late][2], abs=error)


def test_delay_and_offset_need_be_no_multiples_of_the_period() -> None:
    log = Log(lambda time, values: 1.0)
    solution = run(RC, Controller(1e-3, ["v(x)"], ["vset"], log, delay=0.3e-3, offset=0.5e-3))
    assert [call[0] for call in log.calls] == pytest.approx([0.5e-3, 1.5e-3, 2.5e-3, 3.5e-3])
    assert log.calls[0][1] == 0.25
    t = solution.time
    wanted = np.where(t < 0.8e-3, 0.25, 1.0 - 0.75 * np.exp(-np.maximum(t - 0.8e-3, 0.0) / TAU))
    assert solution["v(x)"] == pytest.approx(wanted, abs=1e-13)


def test_two_controllers_of_different_rates_and_islands() -> None:
    deck = """an island that is read, one that is set, one that does both
Vsin a 0 SIN(0 1 100)
Ra a 0 1k
Vout b 0 0
Rb b 0 1k
Iset 0 c 0
Cc c 0 1m IC=0
.tran 0.1m 10m uic
"""
    slow, fast = Log(lambda t, v: 2.0 * v[0]), Log(lambda t, v: 1.0 if v[0] < 1.0 else -1.0)
    solution = run(
        deck,
        Controller(2e-3, ["v(a)"], ["vout"], slow),
        Controller(1e-3, ["v(c)", "v(b)"], ["iset"], fast),
    )
    for time, value, _ in slow.calls:
        assert value == pytest.approx(math.sin(200.0 * math.pi * time), abs=1e-12)
    # 1 A into 1 mF for 1 ms is 1 V: up, then down and up again
    assert [call[1] for call in fast.calls] == pytest.approx(
        [0.0] + [1.0, 0.0] * 4 + [1.0], abs=1e-12
    )
    # what the slow one sets at an instant is seen by the fast one at its next sample
    assert fast.calls[3][2] == pytest.approx(2.0 * math.sin(0.4 * math.pi), abs=1e-12)
    assert solution.certificate.passed
    assert len(solution.islands) == 3


BUCK = """buck with a digital controller of its duty
Vin in 0 24
Vduty d 0 0.3
Vtri tri 0 PULSE(0 1 0 10u 0 0 10u)
Bg g 0 V={v(d)>v(tri)}
S1 in sw g 0 ideal
D1 0 sw
L1 sw out 100u IC=2.4
C1 out 0 100u IC=11.5
R1 out 0 5
.model ideal SW(VT=0.5)
.tran 1u 1m uic
"""


class Integral:
    """An integral controller with a limit; its state is its own."""

    def __init__(self) -> None:
        self.sum = 0.5

    def __call__(self, time, values):
        self.sum += 0.02 * (12.0 - values[0]) / 24.0
        return min(max(self.sum + 0.3 * (12.0 - values[0]) / 24.0, 0.0), 0.95)


def buck_samples(count: int) -> np.ndarray:
    """i and v of the buck by matrix exponentials from edge to edge; current never falls to zero."""
    A = np.array([[0.0, -1.0 / 100e-6], [1.0 / 100e-6, -1.0 / (5.0 * 100e-6)]])
    law, state, rows = Integral(), np.array([2.4, 11.5]), []

    def advance(x: np.ndarray, volts: float, time: float) -> np.ndarray:
        whole = np.zeros((3, 3))
        whole[:2, :2], whole[0, 2] = A, volts / 100e-6
        return (expm(whole * time) @ np.append(x, 1.0))[:2]

    for k in range(count):
        duty = law(k * 10e-6, (state[1],))
        rows.append((state[1], duty))
        # v(d) > v(tri) from the beginning of the ramp to duty times the period
        state = advance(advance(state, 24.0, duty * 10e-6), 0.0, (1.0 - duty) * 10e-6)
        assert state[0] > 0.0
    return np.array(rows)


@pytest.mark.parametrize(("method", "error"), [("modewise", 1e-11), ("sdirk", 1e-4)])
def test_a_buck_follows_matrix_exponentials(method: str, error: float) -> None:
    log = Log(Integral())
    solution = run(BUCK, Controller(10e-6, ["v(out)"], ["vduty"], log), method=method)
    wanted = buck_samples(100)
    assert solution.certificate.passed
    assert np.abs(np.array(log.calls)[:, 1:] - wanted).max() <= error


def test_a_smooth_circuit_is_sampled_as_its_rows_are() -> None:
    deck = RC.replace("R1 u x 1k", "D1 u x djunc\nRx x 0 1k") + ".model djunc D(IS=1n RS=1)\n"
    log = Log(lambda t, v: 1.0 + t / 1e-3)
    solution = run(deck, Controller(PERIOD, ["v(x)", "i(d1)"], ["vset"], log, offset=PERIOD))
    assert solution.islands[0].method == "sdirk"
    x = np.interp([call[0] for call in log.calls], solution.time, solution["v(x)"])
    # v(x) is continuous: a row at the instant shows the sample
    assert [call[1] for call in log.calls] == pytest.approx(x, abs=1e-9)


def test_none_leaves_a_source_as_it_is() -> None:
    values = iter([0.5, None, None, 2.0, None, None, None, None])
    solution = run(RC, Controller(PERIOD, [], ["vset"], lambda t, v: next(values)))
    u = solution["v(u)"]
    assert [u[k] for k in (1, 7, 14, 16, 30)] == [0.5, 0.5, 0.5, 2.0, 2.0]


def test_measures_of_a_controlled_run() -> None:
    deck = RC + ".measure tran half WHEN v(x)=0.5\n"
    circuit = nsspice.read(deck)
    controller = Controller(1.0, [], ["vset"], lambda t, v: 1.0)
    solution = nsspice.tran(circuit, controllers=[controller])
    assert float(np.interp(0.5, solution["v(x)"], solution.time)) == pytest.approx(
        TAU * math.log(0.75 / 0.5), rel=1e-3
    )


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"period": 0.0}, UsageError),
        ({"period": math.nan}, UsageError),
        ({"delay": -1e-3}, UsageError),
        ({"offset": math.inf}, UsageError),
        ({"reads": "v(x)"}, UsageError),
        ({"reads": ["v(nowhere)"]}, NetlistError),
        ({"writes": ["r1"]}, UsageError),
        ({"writes": ["nobody"]}, NetlistError),
        ({"writes": ["vset", "VSET"]}, UsageError),
        ({"step": 7}, UsageError),
        ({"step": lambda t, v: "fast"}, UsageError),
        ({"step": lambda t, v: (1.0, 2.0)}, UsageError),
        ({"step": lambda t, v: math.nan}, UsageError),
    ],
)
def test_refused(options, error) -> None:
    given = {"period": PERIOD, "reads": ["v(x)"], "writes": ["vset"], "step": lambda t, v: 1.0}
    with pytest.raises(error):
        run(RC, Controller(**{**given, **options}))


def test_two_controllers_may_not_set_one_source() -> None:
    one = Controller(PERIOD, [], ["vset"], lambda t, v: 1.0)
    with pytest.raises(UsageError, match="two controllers set vset"):
        run(RC, one, one)


def test_an_error_of_the_function_is_the_callers() -> None:
    def broken(time, values):
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        run(RC, Controller(PERIOD, [], ["vset"], broken))


@pytest.mark.parametrize(("method", "error"), [("modewise", 1e-13), ("sdirk", 1e-9)])
def test_currents_are_read_at_the_start(method: str, error: float) -> None:
    log = Log(lambda time, values: None)
    deck = RC.replace("C1 x 0 1u", "C1 x 0 1u IC=0")
    run(deck, Controller(1.0, ["i(c1)", "i(r1)"], ["vset"], log), method=method, uic=True)
    # 0.25 V across 1 kOhm charge the capacitor at once
    assert log.calls[0][1:3] == pytest.approx([0.25e-3, 0.25e-3], abs=error)


def test_the_current_of_a_junction_is_read_at_the_start() -> None:
    log = Log(lambda time, values: None)
    deck = "junction\nVset u 0 1\nR1 u x 1k\nD1 x 0 djunc\nC1 x 0 1n\n.tran 1u 10u\n"
    deck += ".model djunc D(IS=1n)\n"
    run(deck, Controller(1.0, ["i(d1)", "v(x)"], ["vset"], log))
    _, current, volts, _ = log.calls[0]
    assert current == pytest.approx((1.0 - volts) / 1e3, rel=1e-6)
    assert current == pytest.approx(1e-9 * math.expm1(volts / 0.0258649), rel=1e-3)


#: a diode, a switch with hysteresis and two stores: every kind of state
_MEMORIES = """oscillator with a memory
Vin in 0 1
R1 in c 1k
C1 c 0 1u IC=0
S1 c d c 0 relay
D1 d e
L1 e 0 10m IC=0
.model relay SW(VT=0.5 VH=0.3 RON=10)
"""


@pytest.mark.parametrize("method", [None, "sdirk"])
def test_a_state_comes_back_to_the_last_digit(method):
    circuit = nsspice.read(_MEMORIES)
    sim = nsspice.start(circuit, ["vin"], uic=True, method=method)
    sim["vin"] = 2.0
    for _ in range(7):
        sim.advance(0.3e-3)
    there = sim.state()
    before = sim.signals
    ways = []
    for level in (2.0, 0.5, 2.0):
        sim.restore(there)
        assert sim.signals == before
        assert (sim.time, sim.inputs) == (there.time, {"vin": 2.0})
        sim["vin"] = level
        ways.append(sim.advance(0.7e-3).signals)
    assert ways[0] == ways[2] != ways[1]
    # from the beginning, and in another simulation of the circuit
    other = nsspice.start(circuit, ["vin"], uic=True, method=method)
    first = other.state()
    assert other.restore(there).signals == before
    assert other.certificate.passed
    assert other.restore(first).time == 0.0
    assert other.signals == nsspice.start(circuit, ["vin"], uic=True, method=method).signals


def test_a_state_of_another_circuit_is_refused():
    one = nsspice.start(nsspice.read(_MEMORIES), ["vin"], uic=True)
    two = nsspice.start(nsspice.read(_MEMORIES), ["vin"], uic=True)
    with pytest.raises(nsspice.UsageError):
        two.restore(one.state())
