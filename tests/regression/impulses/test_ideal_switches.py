"""Ideal switches in every position, exactly: closed forms, or a refusal that names them."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.errors import NsspiceError

MODEL = ".model SW SW(VT=0.5)\n"
#: closes at 1 ms, exactly where the source steps; opens at 2 ms
GATE = "Vg g 0 PWL(0 0 1m 0 1m 1 2m 1 2m 0)\n"


def run(text: str, stop: float = 3e-3, rows: int = 300):
    sol = nsspice.tran(
        nsspice.read("switch\n" + text + MODEL),
        stop=stop,
        row_step=stop / rows,
        uic=True,
        method="modewise",
    )
    assert sol.certificate.passed
    assert sol.stats.get("fixed_steps", 0) == 0
    return sol


def impulses(sol, time: float) -> dict[str, float]:
    """Return the impulses by element; all of them at one instant."""
    assert [i.time for i in sol.impulses] == pytest.approx([time] * len(sol.impulses), rel=1e-14)
    return {i.element: i.value for i in sol.impulses}


def inside(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which rows stand before, while and after the switch conducts, instants left out."""
    edge = 1e-9
    return t < 1e-3 - edge, (t > 1e-3 + edge) & (t < 2e-3 - edge), t > 2e-3 + edge


def test_in_series_with_an_inductor_that_has_another_way():
    """10 V on 10 mH through the switch: 1 A/ms; a diode carries it on over 5 Ohm."""
    sol = run(GATE + "V1 a 0 10\nS1 a b g 0 SW\nL1 b c 10m IC=0\nVs c 0 0\nR1 0 d 5\nD1 d b DI\n"
              ".model DI D(ideal)\n")  # fmt: skip
    t, i = sol.time, sol["i(l1)"]
    before, closed, after = inside(t)
    assert np.abs(i[before]).max() == 0.0
    assert np.abs(i[closed] - 1e3 * (t[closed] - 1e-3)).max() < 1e-14
    assert np.abs(i[after] - np.exp(-(t[after] - 2e-3) * 5.0 / 10e-3)).max() < 1e-13


def test_in_series_with_an_inductor_that_has_none():
    """Opening takes the current away at once, with the impulse that the flux needs."""
    sol = run(GATE + "V1 a 0 10\nS1 a b g 0 SW\nL1 b 0 10m IC=0\n")
    t, i = sol.time, sol["i(l1)"]
    before, closed, after = inside(t)
    assert np.abs(i[closed] - 1e3 * (t[closed] - 1e-3)).max() < 1e-14
    assert np.abs(i[before]).max() == np.abs(i[after]).max() == 0.0
    # the flux of 1 A in 10 mH, given up by the coil and held off by the switch
    assert impulses(sol, 2e-3) == pytest.approx({"l1": -10e-3, "s1": 10e-3}, rel=1e-12)


def test_across_a_capacitor():
    """Closing empties it at once; R charges it again from 2 ms on, as from 0."""
    sol = run(GATE + "V1 a 0 10\nR1 a b 1k\nC1 b 0 1u IC=0\nS1 b 0 g 0 SW\n")
    t, v = sol.time, sol["v(b)"]
    before, closed, after = inside(t)
    assert np.abs(v[before] + 10.0 * np.expm1(-t[before] / 1e-3)).max() < 1e-13
    assert np.abs(v[closed]).max() < 1e-15
    assert np.abs(v[after] + 10.0 * np.expm1(-(t[after] - 2e-3) / 1e-3)).max() < 1e-13
    charge = -1e-5 * np.expm1(-1.0)
    assert impulses(sol, 1e-3) == pytest.approx({"s1": charge}, rel=1e-12)


def test_across_a_source_is_refused_when_it_closes():
    """Nothing limits the current: no solution from 1 ms on, and the elements are named."""
    with pytest.raises(NsspiceError) as caught:
        run(GATE + "V1 a 0 10\nR1 a 0 1k\nC1 a 0 1u IC=10\nS1 a 0 g 0 SW\n")
    text = str(caught.value).lower()
    assert "s1" in text
    assert "v1" in text


def test_two_in_parallel_share_what_neither_determines():
    """Both carry half of 10 mA while both are closed; each all of it alone."""
    text = GATE + (
        "Vh h 0 PWL(0 0 1.5m 0 1.5m 1 2.5m 1 2.5m 0)\nV1 a 0 10\n"
        "S1 a b g 0 SW\nS2 a b h 0 SW\nR1 b 0 1k\nC1 b 0 1n IC=0\n"
    )
    sol = run(text)
    t = sol.time
    s1, s2 = sol["i(s1)"], sol["i(s2)"]
    one, both, other = [(t > a + 1e-9) & (t < a + 0.5e-3 - 1e-9) for a in (1e-3, 1.5e-3, 2e-3)]
    assert np.abs(s1[one] - 1e-2).max() < 1e-16
    assert np.abs(s2[one]).max() == 0.0
    assert np.abs(s1[both] - 5e-3).max() < 1e-16
    assert np.abs(s2[both] - 5e-3).max() < 1e-16
    assert np.abs(s1[other]).max() == 0.0
    assert np.abs(s2[other] - 1e-2).max() < 1e-16


def test_two_in_series_conduct_only_together():
    """The node between them follows neither side while both are open: it is shared."""
    text = GATE + (
        "Vh h 0 PWL(0 0 1.5m 0 1.5m 1)\nV1 a 0 10\nS1 a m g 0 SW\nS2 m b h 0 SW\nR1 b 0 1k\n"
        "C1 b 0 1u IC=0\n"
    )
    sol = run(text)
    t, v = sol.time, sol["v(b)"]
    together = (t > 1.5e-3 + 1e-9) & (t < 2e-3 - 1e-9)
    after = t > 2e-3 + 1e-9
    assert np.abs(v[t < 1.5e-3 - 1e-9]).max() == 0.0
    assert np.abs(v[together] - 10.0).max() < 1e-13  # an ideal way charges it at once
    assert np.abs(v[after] - 10.0 * np.exp(-(t[after] - 2e-3) / 1e-3)).max() < 1e-13
    assert np.abs(sol["v(m)"][(t > 1e-3 + 1e-9) & (t < 1.5e-3 - 1e-9)] - 10.0).max() < 1e-13


def test_between_two_floating_parts():
    """Two charged capacitors on floating islands, each with its resistor; one wire joins them."""
    text = GATE + (
        "C1 p q 1u IC=8\nR1 p q 1k\nC2 r s 1u IC=-3\nR2 r s 2k\nS1 p r g 0 SW\nRg q 0 1meg\n"
    )
    sol = run(text)
    t = sol.time
    # a single wire closes no loop: nothing changes hands
    assert np.abs(sol["v(p)"] - sol["v(q)"] - 8.0 * np.exp(-t / 1e-3)).max() < 1e-13
    assert np.abs(sol["v(r)"] - sol["v(s)"] + 3.0 * np.exp(-t / 2e-3)).max() < 1e-13
    _, closed, _ = inside(t)
    assert np.abs(sol["v(p)"] - sol["v(r)"])[closed].max() < 1e-13
    assert np.abs(sol["i(s1)"]).max() < 1e-16


def test_two_wires_between_floating_parts_share_the_charge():
    """Two switches make a loop of two capacitors: 1 uF at 8 V and 3 uF at -4 V meet at -1 V."""
    text = GATE + "C1 p q 1u IC=8\nC2 r s 3u IC=-4\nS1 p r g 0 SW\nS2 q s g 0 SW\nRg q 0 1meg\n"
    sol = run(text)
    before, closed, after = inside(sol.time)
    v1, v2 = sol["v(p)"] - sol["v(q)"], sol["v(r)"] - sol["v(s)"]
    assert np.abs(v1[before] - 8.0).max() < 1e-13
    assert np.abs(v2[before] + 4.0).max() < 1e-13
    for part in (closed, after):
        assert np.abs(v1[part] + 1.0).max() < 1e-13
        assert np.abs(v2[part] + 1.0).max() < 1e-13
    assert impulses(sol, 1e-3) == pytest.approx({"s1": 9e-6, "s2": -9e-6}, rel=1e-12)


@pytest.mark.parametrize("at", ["0", "1m"])
def test_closing_with_the_step_of_a_source(at):
    """The source steps at the instant at which the switch closes: one corner, one transient."""
    gate = "Vg g 0 PWL(0 0 0 1)\n" if at == "0" else GATE
    source = "V1 a 0 PWL(0 -5 0 10)\n" if at == "0" else "V1 a 0 PWL(0 -5 1m -5 1m 10)\n"
    sol = run(gate + source + "S1 a b g 0 SW\nR1 b c 1k\nC1 c 0 1u IC=0\n")
    begin = 0.0 if at == "0" else 1e-3
    t = sol.time
    on = (t > begin + 1e-9) & (t < begin + 1e-3 - 1e-9)
    assert np.abs(sol["v(c)"][on] + 10.0 * np.expm1(-(t[on] - begin) / 1e-3)).max() < 1e-13
    assert np.abs(sol["v(c)"][t < begin + 1e-9]).max() < 1e-15


def test_impulses_on_both_sides_of_the_complementarity():
    """An impulse of current through a diode, and one of voltage across it, both positive."""
    diode = ".model DI D(ideal)\n"
    text = "C1 a 0 1u IC=8\nS1 a b g 0 SW\nD1 b c DI\nC2 c 0 3u IC=0\n"
    sol = run(GATE + text + diode)
    _, closed, after = inside(sol.time)
    # closing: 8 uC over 4 uF at once, through the diode
    assert np.abs(sol["v(c)"][closed | after] - 2.0).max() < 1e-14
    assert impulses(sol, 1e-3) == pytest.approx({"s1": 6e-6, "d1": 6e-6}, rel=1e-12)
    # turned over, the diode lets nothing pass: it holds off what would flow
    sol = run(GATE + text.replace("D1 b c", "D1 c b") + diode)
    assert not sol.impulses
    assert np.abs(sol["v(c)"]).max() == 0.0
    # opening: 1 A in 10 mH cannot go on, the diode being turned the wrong way
    text = "V1 a 0 10\nS1 a b g 0 SW\nL1 b 0 10m IC=0\nD1 b k DI\nVk k 0 15\n"
    sol = run(GATE + text + diode)
    i = sol["i(l1)"]
    _, closed, after = inside(sol.time)
    assert np.abs(i[closed] - 1e3 * (sol.time[closed] - 1e-3)).max() < 1e-13
    assert np.abs(i[after]).max() < 1e-15
    found = impulses(sol, 2e-3)
    assert found["s1"] == pytest.approx(10e-3, rel=1e-12)
    assert found["d1"] == pytest.approx(-10e-3, rel=1e-12)  # from anode to cathode


def test_a_diode_that_takes_the_current_over_needs_no_impulse():
    """The same coil with a diode the right way round, 5 V against it: 2 ms down to 0."""
    text = "V1 a 0 10\nS1 a b g 0 SW\nL1 b 0 10m IC=0\nD1 k b DI\nVk k 0 -5\n"
    sol = run(GATE + text + ".model DI D(ideal)\n", stop=5e-3, rows=500)
    t, i = sol.time, sol["i(l1)"]
    assert not sol.impulses
    falling = np.maximum(0.0, 1.0 - 500.0 * (t - 2e-3))
    assert np.abs(i - falling)[t > 2e-3 + 1e-9].max() < 1e-13


SINE_TRIANGLE = """Inverter leg, sine-triangle modulation, no hysteresis
Vp p 0 300
Vn n 0 -300
Vcar car 0 PULSE(-1 1 0 50u 50u 0 100u)
Vref ref 0 SIN(0 0.9 50 0 0 {phase})
S1 p a ref car sw
S2 a n car ref sw
D1 a p
D2 n a
R1 a b 5
L1 b 0 10m
.model sw SW(VT=0)
.tran 100u 40m
"""


@pytest.mark.parametrize("phase", [0, 120])
def test_a_threshold_that_is_met_turns_a_switch_once(phase: int) -> None:
    # where reference and carrier are both small, rounding of their difference had the sign of a
    # second crossing, back and forth for ever
    run = nsspice.tran(nsspice.read(SINE_TRIANGLE.format(phase=phase)), all_points=True)
    stats = run.islands[0].stats
    assert stats["fixed_steps"] == 0
    # both edges of 400 carrier periods, two switches each
    assert stats["switchings"] == 2 * 2 * 400
    # after the start, the mean of each carrier period follows the reference: its sampling errs by
    # the change of the reference within a period, 2 pi 50 Hz 100 us of its height
    a, t = run["v(a)"], run.time
    for k in range(0, 400, 7):
        inside = (t >= k * 1e-4) & (t <= (k + 1) * 1e-4)
        mean = np.trapezoid(a[inside], t[inside]) / 1e-4
        reference = 0.9 * np.sin(2 * np.pi * 50 * (k + 0.5) * 1e-4 + np.radians(phase))
        assert abs(mean / 300 - reference) < 0.9 * 2 * np.pi * 50 * 1e-4


def test_a_steep_edge_late_in_a_run_turns_a_switch_once() -> None:
    # half a volt per picosecond: the rounding of the instant alone is 1e-7 V at 1 ms
    text = """Boost converter, gate edges of 10 ps
    V1 in 0 12
    L1 in a 100u
    S1 a 0 g 0 SW
    D1 a out
    C1 out 0 100u IC=24
    R1 out 0 20
    Vg g 0 PULSE(0 5 0 10p 10p 5u 10u)
    .model SW SW(VT=2.5 VH=0)
    .tran 10u 10m uic
    """
    run = nsspice.tran(nsspice.read(text))
    stats = run.islands[0].stats
    assert stats["fixed_steps"] == 0
    assert stats["switchings"] == 2 * 1000
    # up to six corners and crossings of the gate in each period, and the diode's own
    assert stats["segments"] <= 8 * 1000
