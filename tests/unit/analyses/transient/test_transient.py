"""Transients against closed forms: starts, islands, streaming, interruption, failure."""

from __future__ import annotations

import signal

import numpy as np
import pytest

import nsspice
from nsspice.analyses.request.row_sinks import Sink
from nsspice.errors import InfeasibleError, NetlistError, UsageError

RC = """RC
V1 in 0 1
R1 in out 1k
C1 out 0 1u {ic}
{cards}
"""


#: implicit Euler errs by h/(2 RC) x exp(-x) of the 0.75 V that decay, at most at x = t/RC = 1
EULER = 0.75 * 0.5e-3 * np.exp(-1.0) * 1.001


def rc(ic: str = "", cards: str = "") -> nsspice.Circuit:
    return nsspice.read(RC.format(ic=ic, cards=cards))


def test_without_uic_it_starts_from_the_dc_solution():
    sol = nsspice.tran(rc("IC=0.3"), 1e-3)
    assert sol["v(out)"] == pytest.approx(np.ones(sol.time.size), abs=1e-12)


def test_with_uic_it_starts_from_the_initial_values():
    sol = nsspice.tran(rc("IC=0.25"), 1e-3, step=1e-6, uic=True)
    assert sol["v(out)"][0] == pytest.approx(0.25, abs=1e-6)
    exact = 1.0 - 0.75 * np.exp(-sol.time / 1e-3)
    assert sol["v(out)"] == pytest.approx(exact, abs=EULER)


@pytest.mark.parametrize("uic", [False, True])
def test_ic_cards_set_the_first_voltages(uic):
    sol = nsspice.tran(rc("", ".ic v(out)=0.25"), 1e-3, step=1e-6, uic=uic)
    exact = 1.0 - 0.75 * np.exp(-sol.time / 1e-3)
    assert sol["v(out)"] == pytest.approx(exact, abs=EULER)


def test_ic_of_an_element_goes_before_ic_cards():
    sol = nsspice.tran(rc("IC=0.5", ".ic v(out)=0.25"), 1e-3, uic=True)
    assert sol["v(out)"][0] == pytest.approx(0.5, abs=1e-6)


def test_ic_cards_hold_other_nodes_at_the_start_as_well():
    """A floating capacitor: the held node charges it to 3 V, then it keeps that charge."""
    circuit = nsspice.read("held\nV1 a 0 1\nC1 a b 1u\nC2 b 0 1u\n.ic v(b)=-2\n.tran 1u 10u\n")
    sol = nsspice.tran(circuit)
    assert sol["v(a,b)"] == pytest.approx(3.0 * np.ones(sol.time.size), abs=1e-9)


@pytest.mark.parametrize("held", [0.0, 1.0])
def test_an_inductor_across_a_held_node_begins_without_a_current(held):
    """It got half of what flows at 0 V, and NS3001 at 1 V; at 1 V ngspice gives it 1e10 A."""
    deck = "tank\nV1 a 0 5\nR1 a b 100\nL1 b 0 500m\nC1 b 0 10u\n.tran 1u 1m\n"
    sol = nsspice.tran(nsspice.read(f"{deck}.ic v(b)={held}\n"))
    # v'' + v'/RC + v/LC = 0 from v(0) and v'(0) = (5 - v)/RC
    slow, fast = np.sort(np.roots([1.0, 1.0 / (100 * 1e-5), 1.0 / (0.5 * 1e-5)]))[::-1]
    rate = (5.0 - held) / (100 * 1e-5)
    one = (rate - fast * held) / (slow - fast)
    exact = one * np.exp(slow * sol.time) + (held - one) * np.exp(fast * sol.time)
    assert sol["v(b)"] == pytest.approx(exact, abs=1e-10)
    assert abs(sol["i(l1)"][0]) < 1e-15


def test_first_order_with_theta_one_and_second_with_a_half():
    errors = {}
    for theta in (1.0, 0.5):
        for step in (2e-5, 1e-5):
            sol = nsspice.tran(rc("IC=0"), 1e-3, 1e-4, step=step, theta=theta, uic=True)
            exact = 1.0 - np.exp(-sol.time[1:] / 1e-3)
            errors[theta, step] = np.max(np.abs(sol["v(out)"][1:] - exact))
    assert errors[1.0, 2e-5] / errors[1.0, 1e-5] == pytest.approx(2.0, rel=0.05)
    assert errors[0.5, 2e-5] / errors[0.5, 1e-5] == pytest.approx(4.0, rel=0.1)


def test_rows_and_the_late_start():
    sol = nsspice.tran(rc(), 1e-3, 3e-4, start=1e-4)
    assert sol.time.tolist() == pytest.approx([1e-4, 4e-4, 7e-4, 1e-3])


def test_static_islands_are_solved_mode_by_mode():
    circuit = nsspice.read(
        "two islands\nV1 a 0 SIN(0 1 50)\nD1 a b\nR1 b 0 1k\nV2 c 0 1\nR2 c d 1k\nC2 d 0 1u\n"
        ".tran 1m 20m\n"
    )
    sol = nsspice.tran(circuit)
    assert [i.method for i in sol.islands] == ["modewise", "modewise"]
    assert sol.islands[0].stats["segments"] <= 3
    assert sol["v(b)"] == pytest.approx(np.maximum(np.sin(100 * np.pi * sol.time), 0.0), abs=1e-12)
    assert sol["v(b,d)"] == pytest.approx(sol["v(b)"] - 1.0, abs=1e-12)
    assert sol.certificate.passed


def test_power_is_voltage_times_current_and_balances():
    sol = nsspice.tran(rc("IC=0"), 1e-3, uic=True, signals=["p(v1)", "p(r1)", "p(c1)"])
    total = sol["p(v1)"] + sol["p(r1)"] + sol["p(c1)"]
    assert total[1:] == pytest.approx(np.zeros(total.size - 1), abs=1e-12)
    assert sol.columns == ["p(v1)", "p(r1)", "p(c1)"]


def test_extra_signals_are_recorded_but_not_shown():
    sol = nsspice.tran(rc(), 1e-3, signals=["v(out)"], extra=["i(r1)", "v(out)"])
    assert sol.columns == ["v(out)"]
    assert list(sol.signals) == ["v(out)", "i(r1)"]


def test_saves_of_the_deck():
    assert nsspice.tran(rc("", ".save v(out) i(r1)"), 1e-3).columns == ["v(out)", "i(r1)"]


def test_unknown_signals_are_told_together():
    with pytest.raises(NetlistError) as caught:
        nsspice.tran(rc(), 1e-3, signals=["v(oout)", "i(r2)"])
    assert len(caught.value.diagnostics) == 2


def test_without_a_card_a_stop_time_is_needed():
    with pytest.raises(UsageError, match=r"no \.tran card"):
        nsspice.tran(rc())


def test_options_of_the_deck_and_of_the_caller():
    circuit = rc("", ".options theta=0.5")
    assert nsspice.tran(circuit, 1e-3).islands[0].theta == 0.5
    assert nsspice.tran(circuit, 1e-3, theta=1.0).islands[0].theta == 1.0
    with pytest.raises(UsageError, match="method"):
        nsspice.tran(rc("", ".options method=modwise"), 1e-3)


def test_methods_of_other_programs_are_passed_over_with_a_warning():
    (sol,) = rc("", ".options method=gear\n.tran 1u 10u").run()
    assert [w.code for w in sol.warnings] == ["NS4052"]


class Recorder(Sink):
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.blocks: list[np.ndarray] = []
        self.closed = False

    def open(self, names):
        self.names = list(names)

    def write(self, block):
        self.blocks.append(block.copy())

    def close(self):
        self.closed = True


def test_sinks_get_all_rows_and_the_solution_may_forget_them():
    whole = nsspice.tran(rc("IC=0"), 1e-3, 1e-6, uic=True)
    sink = Recorder()
    ends = nsspice.tran(rc("IC=0"), 1e-3, 1e-6, uic=True, sink=sink, keep=False)
    assert sink.closed
    assert sink.names == ["time", *whole.columns]
    assert np.array_equal(np.concatenate(sink.blocks), whole.table()[1])
    assert ends.row_count == 1001
    assert ends.time.tolist() == [0.0, 1e-3]


def test_progress_grows_to_one():
    shares: list[float] = []
    nsspice.tran(rc(), 1e-3, 1e-6, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_ctrl_c_keeps_the_rows_so_far():
    def progress(share: float) -> None:
        if share > 0.3:
            raise KeyboardInterrupt

    sol = nsspice.tran(rc("IC=0"), 1.0, 1e-6, uic=True, progress=progress)
    assert sol.interrupted
    assert 0.3e6 < sol.time.size < 1e6
    assert sol.time[-1] == pytest.approx((sol.time.size - 1) * 1e-6)
    assert sol["v(out)"][-1] == pytest.approx(1.0, abs=1e-3)


CONTRADICTION = """a source across a diode from half time on
V1 a 0 PWL(0 -1 1m -1 1.1m 1)
D1 a 0
C1 b 0 1u
R1 a b 1k
.tran 10u 2m
"""


def test_a_contradiction_names_elements_and_time_and_keeps_the_rows():
    with pytest.raises(InfeasibleError) as caught:
        nsspice.tran(nsspice.read(CONTRADICTION))
    error = caught.value
    assert {"v1", "d1"} <= set(error.elements)
    assert error.time == pytest.approx(1.05e-3, rel=1e-12)  # where the ramp passes zero
    assert "line" in str(error) or ":2:1" in str(error)
    assert isinstance(error.partial, nsspice.Solution)
    assert error.partial.time[-1] == pytest.approx(1.04e-3, rel=1e-12)  # the row before
    assert error.partial["v(a)"][0] == -1.0


@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_a_contradiction_of_implicit_steps_is_proved(theta):
    """A ramp passes zero in the step that ends at 1.001 ms; the proof knows what theta adds."""
    deck = "short\nV1 a 0 PULSE(-1 1 1m 1u 1u 1 2)\nR1 a b 1\nC1 b 0 1u\nD1 a 0\n.tran 10u 2m uic\n"
    with pytest.raises(InfeasibleError) as caught:
        nsspice.tran(nsspice.read(deck), method="moreau", theta=theta)
    assert set(caught.value.elements) == {"v1", "d1"}
    assert caught.value.time == pytest.approx(1.001e-3, rel=1e-12)


def test_a_contradiction_at_the_start():
    with pytest.raises(InfeasibleError, match="at the start") as caught:
        nsspice.tran(nsspice.read("bad\nV1 a 0 1\nD1 a 0\nC1 a 0 1u\n"), 1e-3)
    assert {"v1", "d1"} <= set(caught.value.elements)


def test_a_failure_in_one_island_leaves_complete_rows_of_all():
    circuit = nsspice.read(
        CONTRADICTION.replace(".tran", "V2 x 0 1\nR2 x y 1k\nC2 y 0 1u\n.tran")
        + "V3 p 0 PWL(0 -1 0.5m -1 0.6m 1)\nD3 p 0\n"
    )
    with pytest.raises(InfeasibleError) as caught:
        nsspice.tran(circuit)
    assert {"v3", "d3"} <= set(caught.value.elements)  # the earlier of the two failures
    partial = caught.value.partial
    assert partial.time[-1] == pytest.approx(0.54e-3, rel=1e-12)  # the row before
    assert partial["v(y)"] == pytest.approx(np.ones(partial.time.size))
    assert partial["v(a)"] == pytest.approx(-np.ones(partial.time.size))


def test_a_signal_of_the_system_stops_it_between_two_blocks():
    def progress(share: float) -> None:
        if share > 0.3 and not sent:
            sent.append(share)
            signal.raise_signal(signal.SIGINT)

    sent: list[float] = []
    sol = nsspice.tran(rc("IC=0"), 1.0, 1e-6, uic=True, progress=progress)
    assert sol.interrupted
    assert sol.time.size == pytest.approx(sent[0] * 1e6, abs=2)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_impulses_are_told_with_their_charge():
    """A capacitor of 1 uF at 10 V closed onto an empty one: 5 uC pass the ideal switch."""
    circuit = nsspice.read(
        "charge sharing\nC1 a 0 1u IC=10\nS1 a b g 0 sw\nC2 b 0 1u IC=0\nR1 b 0 1meg\n"
        "Vg g 0 PULSE(0 1 1m 0 0 1 2)\n.model sw SW(VT=0.5)\n.tran 0.1m 2m uic\n"
    )
    sol = nsspice.tran(circuit)
    (impulse,) = [p for p in sol.impulses if p.element == "s1"]
    assert impulse.time == 1e-3
    assert impulse.unit == "A s"
    assert abs(impulse.value) == pytest.approx(5e-6, rel=1e-12)
    # 2 uF discharge through 1 MOhm for 1 ms
    assert sol["v(a)"][-1] == pytest.approx(5.0 * np.exp(-1e-3 / 2.0), rel=1e-12)


def test_an_ordinary_run_reports_no_impulses():
    circuit = nsspice.read(
        "buck\nVin in 0 24\nS1 in sw g 0 sw\nD1 0 sw\nL1 sw out 100u IC=0\nC1 out 0 100u IC=0\n"
        "R1 out 0 5\nVg g 0 PULSE(0 1 0 0 0 5u 10u)\n.model sw SW(VT=0.5)\n.tran 1u 1m uic\n"
    )
    sol = nsspice.tran(circuit)
    assert sol.impulses == []
    assert sol.certificate.passed


def test_temperature_and_values():
    circuit = nsspice.read("r\nV1 a 0 1\nR1 a b 1k tc1=0.01\nR2 b 0 1k\nC1 b 0 1n\n")
    cold = nsspice.tran(circuit, 1e-3)
    warm = nsspice.tran(circuit, 1e-3, temperature=127.0)
    assert cold["v(b)"][-1] == pytest.approx(0.5)
    assert warm["v(b)"][-1] == pytest.approx(1 / 3)
    other = nsspice.tran(circuit, 1e-3, values={"r2": 3e3})
    assert other["v(b)"][-1] == pytest.approx(0.75)
