"""The control library against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.analyses.solution.solution import Solution
from nsspice.netlist import parse_text


def run(lines: str) -> Solution:
    return nsspice.read(f"block\n.lib control\n{lines}\n").run()[0]


def test_pi_controller_stops_at_its_limit_and_leaves_it_at_once() -> None:
    """e = 1 for 10 ms, then -1: without windup the output leaves its limit with the error."""
    found = run(
        "V1 ref 0 PULSE(1 -1 10m 0 0 1 2)\nX1 ref 0 out pi_controller kp=0.1 ki=100 max=0.6\n"
        ".tran 0.1m 12m uic"
    )
    t = found.axis
    # before: min(kp + ki t, max).  The state is led to max - kp e + ki e/kaw = 0.6, and after the
    # turn of the error falls at once by kp and with ki
    state = 0.6 - (0.6 - 0.5) * np.exp(-(t - 5e-3) * 1000) * (t > 5e-3)
    assert found["v(out)"][t < 9.95e-3] == pytest.approx(
        np.minimum(0.1 + 100 * t, 0.6)[t < 9.95e-3]
    )
    last = found["v(out)"][-1]
    turned = state[t >= 9.95e-3][0]
    assert last == pytest.approx(turned - 0.1 - 100 * 2e-3, abs=1e-3)


@pytest.mark.parametrize(
    ("kind", "rise", "fall"),
    [("trailing", 0.0, 0.3), ("leading", 0.7, 1.0), ("centre", 0.35, 0.65)],
)
def test_pulse_width_modulators(kind: str, rise: float, fall: float) -> None:
    found = run(
        f"V1 d 0 0.3\nX1 d g pwm_{kind} f=10k\n.tran 1u 1m\n.meas tran mean avg v(g)\n"
        ".meas tran on when v(g)=0.5 rise=5 td=0.05m\n.meas tran off when v(g)=0.5 fall=5 td=0.05m"
    )
    period = 1e-4
    assert found.measures["mean"] == pytest.approx(0.3, rel=1e-12)
    assert (found.measures["on"] / period) % 1.0 == pytest.approx(rise % 1.0, abs=1e-9)
    assert (found.measures["off"] / period) % 1.0 == pytest.approx(fall % 1.0, abs=1e-9)


@pytest.mark.parametrize("slope", [0.0, 0.3, 0.5])
def test_peak_current_mode(slope: float) -> None:
    """The map of one period: without compensation a disturbance grows by 7/3 each period."""
    found = run(
        "Vin in 0 10\nS1 in sw gate 0 ideal\nD1 0 sw\nL1 sw out 10u ic=3.7\nVout out 0 7\n"
        "B1 sense 0 V=i(L1)\nVref ref 0 10\n.model ideal SW(VT=0.5)\n.tran 10u 120u uic\n"
        f"X1 sense ref gate peak_current_mode f=100k slope={slope * 1e6} dmax=1.1"
    )
    rising, falling, period = 0.3, 0.7, 10.0  # A/us, us
    exact = [3.7]
    for _ in range(12):
        on = min((10.0 - exact[-1]) / (rising + slope), period)
        exact.append(exact[-1] + rising * on - falling * (period - on))
    # disturbances grow by (0.7 - slope)/(0.3 + slope) a period: 2.4e4 for none, times rounding
    assert found["i(l1)"] == pytest.approx(exact, abs=1e-9)
    spread = np.ptp(found["i(l1)"][-4:])
    assert spread > 1.0 if slope == 0.0 else spread < 0.2


def test_latch_dead_time_and_hysteresis() -> None:
    found = run(
        "V1 g 0 PULSE(0 1 10u 0 0 20u 50u)\nX1 g h l dead_time td=2u\n.tran 1u 50u\n"
        ".meas tran on when v(h)=0.5 rise=1\n.meas tran off when v(h)=0.5 fall=1\n"
        ".meas tran low_off when v(l)=0.5 fall=1\n.meas tran low_on when v(l)=0.5 rise=1"
    )
    expected = {"on": 12e-6, "off": 30e-6, "low_off": 10e-6, "low_on": 32e-6}
    assert found.measures == pytest.approx(expected, rel=1e-12)
    found = run(
        "V1 s 0 PWL(0 0 1 0 1 1 2 1 2 0)\nV2 r 0 PWL(0 0 4 0 4 1 5 1 5 0)\nX1 s r q sr_latch\n"
        "V3 x 0 PWL(0 0 3 3 6 0)\nX2 x y hysteretic low=1 high=2\n.tran 0.5 6"
    )
    t = found.axis
    assert found["v(q)"][t % 1 > 0] == pytest.approx(((t > 1) & (t < 4))[t % 1 > 0].astype(float))
    assert found["v(y)"][t % 1 > 0] == pytest.approx(((t < 2) | (t > 5))[t % 1 > 0].astype(float))


def test_phase_shift_and_sample() -> None:
    found = run(
        "V1 p 0 0.25\nX1 p a b phase_shift f=10k\n.tran 1u 400u\n"
        ".meas tran a when v(a)=0.5 rise=2\n"
        ".meas tran b when v(b)=0.5 rise=2\nV2 i 0 PWL(0 0 1 1)\n"
        "V3 c 0 PULSE(0 1 50u 0 0 1u 100u)\n"
        "X2 i c o sample_hold"
    )
    assert found.measures["b"] - found.measures["a"] == pytest.approx(
        0.25 * 50e-6 - 100e-6, rel=1e-9
    )
    # the end of the sampling pulse, less the time constant of 1 Ohm and 1 nF
    assert found["v(o)"][found.axis == 3e-4] == pytest.approx([251e-6 - 1e-9], rel=1e-9)


def test_three_phases() -> None:
    found = run(
        "V1 a 0 SIN(0 0.5 50 0 0 90)\nV2 b 0 SIN(0 0.5 50 0 0 -30)\nV3 c 0 SIN(0 0.5 50 0 0 210)\n"
        "V4 th 0 PWL(0 0 1 {2*pi*50})\nX1 a b c da db dc space_vector\nX2 a b c th d q abc_to_dq\n"
        "X3 d q th a2 b2 c2 dq_to_abc\nX4 a b c angle w pll w0=300\n.tran 1m 300m uic"
    )
    assert found["v(d)"] == pytest.approx(0.5, abs=1e-12)
    assert found["v(q)"] == pytest.approx(0.0, abs=1e-12)
    for phase in "abc":
        assert found[f"v({phase}2)"] == pytest.approx(found[f"v({phase})"], abs=1e-12)
    lines = found["v(da)"] - found["v(db)"]
    assert lines == pytest.approx(found["v(a)"] - found["v(b)"], abs=1e-12)
    assert max(found["v(da)"]) <= 0.5 + 0.5 * math.sqrt(3) / 2 + 1e-12
    assert found["v(w)"][-1] == pytest.approx(2 * math.pi * 50, rel=1e-4)  # locked, reltol 1e-3


def test_op_amp() -> None:
    found = run(
        "V1 i 0 PULSE(0 1 0 0 0 1 2)\nX1 i o o op_amp gain=1e5 gbw=1meg\n"
        "X2 i 0 rail op_amp high=5\n.tran 0.1u 2u uic"
    )
    closed, rate = 1e5 / (1 + 1e5), 2 * math.pi * 1e6 * (1 + 1e-5)
    assert found["v(o)"] == pytest.approx(-closed * np.expm1(-rate * found.axis), abs=1e-12)
    assert found["v(rail)"][-1] == pytest.approx(5.0, rel=1e-12)


def test_compensators() -> None:
    found = nsspice.read(
        "t\n.lib control\nV1 e 0 AC 1\nX1 e 0 o2 type2_compensator k=10\n"
        "X2 e 0 o3 type3_compensator k=10 wz2=2k wp2=2meg\n.ac dec 2 10 1meg\n"
    ).run()[0]
    s = 2j * np.pi * found.axis
    second = 10 * (1 + s / 1e3) / (s * (1 + s / 1e5))
    assert np.abs(found["v(o2)"] / second - 1).max() < 1e-12
    third = second * (1 + s / 2e3) / (1 + s / 2e6)
    assert np.abs(found["v(o3)"] / third - 1).max() < 1e-10  # rates from 0 to 2e6 in one polynomial


def test_a_file_of_the_folder_goes_first(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "control").write_text(".subckt hysteretic a b\nR1 a b 7\n.ends\n")
    found = parse_text("t\n.lib control\nV1 a 0 1\nX1 a 0 hysteretic", directory=tmp_path)
    assert found.elements[-1].value == 7.0
    confined = parse_text("t\n.lib control\nV1 a 0 1\nX1 a b hysteretic", confined=True)
    assert len(confined.elements) > 3


@pytest.mark.parametrize(("start", "step"), [(0.57, 0.1), (2.77, 0.12)])
def test_maximum_power_point(start: float, step: float) -> None:
    """Perturb and observe on p = v (3 - v): up the hill, then three levels about 1.5 V."""
    found = run(
        f"X1 p x ref mppt f=1k step={step} start={start} min=0 max=4\n"
        "B1 p 0 V={v(ref)*(3-v(ref))}\nE1 x 0 ref 0 1\nR1 ref 0 1\n.tran 0.5m 40.6m uic"
    )
    reference, before, moved, wanted = start, 0.0, 0.0, [start]
    for _ in range(40):
        power = reference * (3.0 - reference)
        together = (power > before) == (reference > moved)
        before, moved = power, reference
        reference += step if together else -step
        wanted.append(reference)
    assert found["v(ref)"][1::2] == pytest.approx(wanted, abs=1e-12)
    assert abs(np.array(wanted[-12:]) - 1.5).max() <= 1.5 * step + 1e-12
