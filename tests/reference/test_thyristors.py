"""Ideal thyristors against closed forms: phase control, overlap of phases, forced commutation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from decks.fired_at_rest import FIRED_AT_REST
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle.agreement import compare
from oracle.thyristor_bridge import intervals, signals
from scipy.optimize import brentq

import nsspice
from nsspice.circuit import build
from nsspice.netlist import parse_text

RECTIFIERS = Path(__file__).parents[2] / "netlists" / "rectifiers"
OMEGA = 2 * np.pi * 50


def test_the_six_pulse_bridge_at_every_row():
    run = nsspice.tran(nsspice.read(RECTIFIERS / "thyristor_bridge.net"))
    found = intervals(0.1)
    exact = np.array([signals(t, found) for t in run.time[:-1]])
    # rounding of 30 instants of 1e-16 s and of both programs, at 4e6 A/s and 500 V
    for column, name in enumerate(("i(l1)", "v(p,n)", "i(d1)", "i(la)")):
        size = np.max(np.abs(exact[:, column]))
        assert np.max(np.abs(run[name][:-1] - exact[:, column])) < 1e-12 * size, name


@pytest.mark.parametrize("reltol", [1e-4, 1e-6, 1e-8])
def test_the_bridge_by_controlled_steps(reltol: float):
    run = nsspice.tran(
        nsspice.read(RECTIFIERS / "thyristor_bridge.net"), method="sdirk", reltol=reltol
    )
    found = intervals(0.1)
    exact = np.array([signals(t, found)[0] for t in run.time[:-1]])
    assert np.max(np.abs(run["i(l1)"][:-1] - exact)) < 3 * reltol * np.max(exact)


def half_wave(alpha: float, width: float, resistance: float, inductance: float) -> str:
    return f"""half wave
V1 a 0 SIN(0 100 50)
D1 a b g thyristor
Vg g b PULSE(0 5 {alpha / OMEGA!r} 0 0 {width!r} 20m)
L1 b c {inductance!r}
R1 c 0 {resistance!r}
.model thyristor SCR(Vgt=1)
.tran 0.5m 20m
"""


@settings(max_examples=60, deadline=None)
@given(
    alpha=st.floats(0.05, 3.0),
    width=st.floats(1e-6, 5e-3),
    resistance=st.floats(0.5, 50.0),
    tau=st.floats(1e-5, 30e-3),
)
def test_firing_angle_and_extinction(alpha: float, width: float, resistance: float, tau: float):
    inductance = tau * resistance
    z = np.hypot(resistance, OMEGA * inductance)
    phi = np.arctan2(OMEGA * inductance, resistance)

    def current(th: float) -> float:
        return (
            100 / z * (np.sin(th - phi) - np.sin(alpha - phi) * np.exp((alpha - th) / OMEGA / tau))
        )

    end = brentq(current, max(np.pi, alpha + 1e-3), 2 * np.pi, xtol=1e-15)
    circuit = nsspice.read(half_wave(alpha, width, resistance, inductance))
    run = nsspice.tran(circuit)
    angles = OMEGA * run.time
    exact = np.array([current(th) if alpha <= th < end else 0.0 for th in angles])
    assert np.max(np.abs(run["i(l1)"] - exact)) < 1e-11 * 100 / z
    again = nsspice.tran(circuit, method="sdirk", reltol=1e-7)
    assert np.max(np.abs(again["i(l1)"] - exact)) < 1e-6 * 100 / z


CHOPPER = """voltage-commutated chopper: the second thyristor turns the first one off
V1 in 0 100
D1 in out g1 thyristor
V2 g1 out PULSE(0 5 50u 0 0 20u 1m)
D2 x out g2 thyristor
V3 g2 out PULSE(0 5 400u 0 0 20u 1m)
C1 x in 20u IC=100
D3 0 out
I1 out 0 10
.model thyristor SCR(Vgt=1)
.tran 5u 1m uic
"""


def test_a_charged_capacitor_commutates_a_constant_current():
    run = nsspice.tran(nsspice.read(CHOPPER))
    t = run.time
    # 10 A freewheel, then pass the first one; they discharge 20 uF from 100 V to -100 V in 400 us,
    # until the freewheeling diode takes over
    fired = (t > 400e-6) & (t < 800e-6)
    expected = np.where(fired, 200 - 10 * (t - 400e-6) / 20e-6, 0.0)
    expected[(t > 50e-6) & (t < 400e-6)] = 100.0
    away = (np.abs(t - 50e-6) > 1e-9) & (np.abs(t - 400e-6) > 1e-9)
    assert np.max(np.abs(run["v(out)"] - expected)[away]) < 1e-10
    assert np.all(run["i(d1)"][t > 400.1e-6] == 0.0)
    assert run["i(d2)"][fired] == pytest.approx(10.0, rel=1e-12)
    assert np.all(run["i(d2)"][t > 800.1e-6] == 0.0)
    assert run["i(d3)"][-1] == pytest.approx(10.0, rel=1e-12)


REGULATOR = """two thyristors back to back
V1 a 0 SIN(0 325 50)
D1 a b g1 thyristor
D2 b a g2 thyristor
V2 g1 b PULSE(0 5 5m 0 0 3m 20m)
V3 g2 a PULSE(0 5 15m 0 0 3m 20m)
R1 b c 10
L1 c 0 10m
.model thyristor SCR(Vgt=1 Vh=1 Ron=10m)
.tran 0.1m 60m
"""
BY_CURRENT = """gate current through a resistor, a freewheeling diode
V1 a 0 SIN(0 325 50)
D1 a b g thyristor
V2 gg b PULSE(0 10 3m 0 0 1m 20m)
R2 gg g 100
D2 0 b
L1 b c 50m
R1 c 0 10
.model thyristor SCR(Igt=20m Vgt=0.7 Rg=20 Vh=1.1 Ron=5m Vrev=1000)
.tran 0.1m 60m
"""


@pytest.mark.parametrize("deck", [REGULATOR, BY_CURRENT, CHOPPER.replace("uic", "")])
def test_the_core_steps_as_the_oracle_does(deck: str):
    (mna,) = [island.assemble() for island in build(parse_text(deck)).islands]
    found = compare(mna, 5e-5, 400)
    assert found.distance < 1e-12, (found.signal, found.time)


@pytest.mark.parametrize("deck", [REGULATOR, BY_CURRENT, CHOPPER])
def test_both_engines_agree(deck: str):
    circuit = nsspice.read(deck)
    exact, steps = nsspice.tran(circuit), nsspice.tran(circuit, method="sdirk", reltol=1e-8)
    for name in exact.signals:
        size = np.max(np.abs(exact[name]))
        if name.startswith("i(l") or name == "v(x)":
            assert np.max(np.abs(steps[name] - exact[name])) < 3e-8 * size, name


@pytest.mark.parametrize("store", ["R2 b 0 1k", "C2 b 0 1n"])
@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_current_that_rests_at_zero_has_ended(store: str, method: str):
    deck = f"""fired once, then the voltage is taken away and comes back
V1 a 0 PWL(0 100 1m 100 2m 0 3m 0 4m 100)
R1 a b 10
{store}
D1 b 0 g thyristor
V2 g 0 PULSE(0 5 0.5m 0 0 0.1m 1)
.model thyristor SCR(Vgt=1)
.tran 0.1m 5m
"""
    run = nsspice.tran(nsspice.read(deck), method=method)
    t, i = run.time, run["i(d1)"]
    on = (t > 0.501e-3) & (t < 1.999e-3)
    assert i[on] == pytest.approx(np.interp(t[on], [0, 1e-3, 2e-3], [10, 10, 0]), rel=1e-4)
    assert np.all(i[t > 2.2e-3] == 0.0)


def test_a_pulse_shorter_than_the_step_fires():
    deck = """fired across its own source, for less than a step
V1 a 0 SIN(0 10 50)
L1 a 0 2.8m
D1 a 0 g thyristor
V2 g 0 PULSE(0 5 8.1029m 0 0 68u 20m)
.model thyristor SCR(Vgt=1)
.tran 0.2m 20m uic
"""
    for method in ("modewise", "sdirk", "moreau"):
        with pytest.raises(nsspice.NumericalError, match="v1 and d1 contradict each other"):
            nsspice.tran(nsspice.read(deck), method=method)


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_pulse_while_nothing_flows_does_not_fire(method: str):
    run = nsspice.tran(nsspice.read(FIRED_AT_REST), method=method)
    assert np.all(run["i(d0)"] == 0.0)
