"""XSPICE's code models with states, and those of devices: closed forms and ngspice 39."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.analyses.solution.solution import Solution
from nsspice.errors import NetlistError


def run(lines: str) -> Solution:
    return nsspice.read(f"models\n{lines}\n").run()[0]


def test_zener_diodes() -> None:
    """Voltages across diodes of 9 V and of 0.3 V behind 100 Ohm, by ngspice 39."""
    card = (
        ".model {} zener(v_breakdown={} i_breakdown=2e-2 r_breakdown={} i_rev=1e-6 i_sat=1e-12)\n"
    )
    found = nsspice.dc(
        nsspice.read(
            "z\nV1 a 0 0\nR1 a b 100\nA1 (b 0) one\nR2 a c 100\nA2 (c 0) two\n"
            + card.format("one", 9, 1)
            + card.format("two", 0.3, 10)
        ),
        "v1",
        np.arange(-12.0, 3.0),
    )
    nine = [-9.00805, -9.00000, -8.98641, -8.93226, -7.99991, -6.99992, -5.99993, -4.99994,
            -3.99996, -2.99997, -1.99998, -0.999989, 0.0, 0.5763422, 0.6072846]  # fmt: skip
    low = [-0.607303, -0.590163, -0.571447, -0.550839, -0.527918, -0.502107, -0.472587, -0.438135,
           -0.396816, -0.345309, -0.277207, -0.177694, 0.0, 0.2582304, 0.5084326]  # fmt: skip
    # ngspice, at reltol=1e-9, prints six digits
    assert found["v(b)"] == pytest.approx(nine, rel=2e-6, abs=1e-9)
    assert found["v(c)"] == pytest.approx(low, rel=2e-6, abs=1e-9)


def test_an_output_stage_with_limits() -> None:
    """Behind 2 Ohm, at most 1 A out and 0.5 A in, between 3 V and -10 V."""
    found = nsspice.dc(
        nsspice.read(
            "i\nV1 a 0 0\nV2 p 0 3\nV3 n 0 -10\nA1 a p n o stage\nR1 o 0 1\n.model stage ilimit("
            "r_out_source=2 r_out_sink=2 i_limit_source=0.9 i_limit_sink=0.5)"
        ),
        "v1",
        np.arange(-3.0, 4.5, 0.5),
    )
    a = found.axis
    current = np.clip(np.clip(a, -10, 3) / 3.0, -0.5, 0.9)
    assert found["v(o)"] == pytest.approx(current, abs=1e-13)
    assert found["i(v2)"] == pytest.approx(-np.maximum(current, 0.0), abs=1e-13)
    assert found["i(v3)"] == pytest.approx(-np.minimum(current, 0.0), abs=1e-13)


def test_meters_see_through_sources_of_zero_volts() -> None:
    """ngspice 39 says 0.6521739 uH (three in parallel) and 7 uF."""
    found = nsspice.op(
        nsspice.read(
            "m\nL6 61 0 1u\nL7 61 0 3u\nL8 61 62 5u\nV8 62 0 0\nA6 61 60 lm\n.model lm lmeter\n"
            "C1 51 0 1u\nC2 51 52 2u\nV5 51 53 0\nC4 53 0 4u\nR5 52 0 1k\nV9 51 0 1\n"
            "A5 51 50 cm\n.model cm cmeter(gain=1e6)\nR6 60 0 1\nR7 50 0 1"
        )
    )
    assert found["v(60)"][0] == pytest.approx(1e-6 / (1 + 1 / 3 + 1 / 5), rel=1e-14)
    assert found["v(50)"][0] == pytest.approx(7.0, rel=1e-14)


def test_initial_currents_and_a_memristor() -> None:
    """Both decay from the operating point on; a memristor integrates its voltage."""
    found = run(
        "A1 1 0 cap\n.model cap capacitor(c=1m ic=1)\nR1 1 0 1k\nA2 2 0 ind\n"
        ".model ind inductor(l=2 ic=3)\nR2 2 0 4\nV1 m 0 SIN(0 1 1)\n"
        "A3 m 0 mem\n.model mem memristor(rmin=1k rmax=10k rinit=2k beta=30k alpha=0 vt=0.5)\n"
        ".tran 0.05 1"
    )
    t = found.axis
    # the certificate judges charges to 1e-9 of the largest: steps follow the exponentials
    assert found["v(1)"] == pytest.approx(np.exp(-t), rel=1e-9)
    assert found["v(2)"] == pytest.approx(-12.0 * np.exp(-2.0 * t), rel=1e-9)
    fine = np.linspace(0.0, 1.0, 200_001)
    v = np.sin(2.0 * np.pi * fine)
    rate = 30e3 * v - 15e3 * (abs(v + 0.5) - abs(v - 0.5))
    r = np.empty_like(fine)  # the trapezoidal rule, and the clamps after each step
    r[0] = 2e3
    for k in range(fine.size - 1):
        r[k + 1] = min(max(r[k] + 0.5 * (rate[k] + rate[k + 1]) * 5e-6, 1e3), 10e3)
    expected = np.interp(t, fine, v / r)
    assert -found["i(v1)"] == pytest.approx(expected, abs=2e-3 * expected.max())  # reltol


def test_one_shot() -> None:
    """Delays and edges are those of the model; a second edge within the pulse is ignored."""
    found = run(
        "V1 c 0 PULSE(0 1 1u 0 0 1u 3u)\nV2 w 0 PWL(0 1 1.5u 1 1.6u 3)\nA1 c w 0 o shot\n"
        ".model shot oneshot(cntl_array=[0 2] pw_array=[1u 5u] clk_trig=0.5 out_low=-1 out_high=4 "
        "rise_time=0.2u fall_time=0.4u rise_delay=0.3u fall_delay=0.1u)\n.tran 0.1u 9.9u\n"
        ".meas tran up when v(o)=1.5 rise=1\n.meas tran down when v(o)=1.5 fall=1\n"
        ".meas tran again when v(o)=1.5 rise=2\n.meas tran high max v(o)"
    )
    # 3 us wide: 1 + 0.3 + 0.1 up; 1 + 0.3 + 0.2 + 3 + 0.1 + 0.2 down; over at 5, then the edge at 7
    expected = {"up": 1.4e-6, "down": 4.8e-6, "again": 7.4e-6, "high": 4.0}
    assert found.measures == pytest.approx(expected, rel=1e-9)


def test_functions_of_time_and_delays() -> None:
    """Corners are parabolas: at 0.1 s the value is a quarter of the width times the slope."""
    found = run(
        "A1 a lim\nA2 b free\n.model lim pwlts(x_array=[0 0.1 0.2 0.5] y_array=[0 0 1 1] "
        "input_domain=0.2 fraction=true limit=true)\n"
        ".model free pwlts(x_array=[0 0.1 0.2 0.5] y_array=[0 0 1 2.5] input_domain=0)\n"
        "V1 s 0 PWL(0 0 1 1)\nA3 s d late\n.model late delay(delay=0.25)\nRa a 0 1\nRb b 0 1\n"
        ".tran 0.1 1"
    )
    t = found.axis
    assert found["v(a)"][1:3] == pytest.approx([0.25 * 0.02 * 10, 1 - 0.25 * 0.02 * 10], abs=1e-12)
    # rows between two steps are interpolated
    assert found["v(a)"][4:] == pytest.approx(np.ones(7), abs=1e-10)
    assert found["v(b)"] == pytest.approx(np.interp(t, [0, 0.1, 0.2, 1], [0, 0, 1, 5]), abs=1e-12)
    assert found["v(d)"] == pytest.approx(np.maximum(t - 0.25, 0.0), abs=1e-12)


SOURCES = "V{0} {1} 0 PULSE(0 1 {2}u 0 0 {2}u {3}u)\n"


def test_tables_of_ones_and_zeros() -> None:
    """A full adder: the sum of three bits, of which the first counts least in the table."""
    found = run(
        "".join(SOURCES.format(k, f"n{k}", 2**k, 2 ** (k + 1)) for k in range(3))
        + "A1 [n0 n1 n2] [s c] adder\n.model adder d_genlut(rise_delay=[0 0] fall_delay=[0 0] "
        'table_values "0110100100010111")\nA2 [n0 n1] y first\n'
        '.model first d_lut(rise_delay=0 fall_delay=0 table_values="0100")\n.tran 0.5u 7.75u uic'
    )
    t = found.axis * 1e6
    inside = np.abs(t % 1.0 - 0.5) < 0.1
    bits = np.array([(t[inside] // 2**k) % 2 for k in range(3)])
    total = bits.sum(axis=0)
    assert np.array_equal(found["v(s)"][inside], total % 2)
    assert np.array_equal(found["v(c)"][inside], total // 2)
    assert np.array_equal(found["v(y)"][inside], (bits[0] == 1) & (bits[1] == 0))


def test_divider_and_modulator() -> None:
    """High in 2 of 3 cycles; high in the last 30 % of each period, a quarter of it gone."""
    found = run(
        "V1 c 0 PULSE(0 1 1u 0 0 1u 2u)\nA1 c q third\n.model third d_fdiv(div_factor=3 "
        "high_cycles=2 rise_delay=0 fall_delay=0)\nV2 d 0 0.3\nA2 d p pwm\n"
        ".model pwm d_pwm(cntl_array=[0 1] dc_array=[0 1] frequency=250k init_phase=90 "
        "rise_delay=0 fall_delay=0)\n.tran 0.17u 20u uic"
    )
    t = found.axis[1:] * 1e6
    edges = np.floor((t + 1.0) / 2.0)  # so many rising edges so far
    assert np.array_equal(found["v(q)"][1:] > 0.5, (edges > 0) & ((edges - 1) % 3 < 2))
    assert np.array_equal(found["v(p)"][1:] > 0.5, (t / 4.0 + 0.25) % 1.0 > 0.7)


def test_a_state_machine(tmp_path: Path) -> None:
    """ngspice's own test ``d_state``: it counts up three times and wraps, then down."""
    (tmp_path / "updn.txt").write_text(
        "* up and down\n0  0s 0s  0 -> 3\n          1 -> 1\n1  0s 1z  0 -> 0\n          1 -> 2\n"
        "2  1z 0s  0 -> 1\n          1 -> 3\n3  1z 1z  0 -> 2\n3  1z 1z  1 -> 0\n"
    )
    deck = tmp_path / "machine.cir"
    deck.write_text(
        "t\nV1 up 0 PWL(0 1 9n 1 9n 0)\nV2 c 0 PULSE(0 1 2n 0 0 1n 2n)\n"
        "V3 r 0 PWL(0 1 1n 1 1n 0)\n"
        'A1 [up] c r [o1 o2] m\n.model m d_state(clk_delay=0.1n state_file="updn.txt" '
        "reset_state=0)\n.tran 0.5n 19.75n\n"
    )
    found = nsspice.tran(nsspice.read(deck))
    values = np.round(2 * found["v(o1)"] + found["v(o2)"]).astype(int)
    # after the edges at 2, 4, 6, 8 and then 10, 12, ... 18 ns; the listing of ngspice
    listing = [0, 1, 2, 3, 0, 3, 2, 1, 0, 3]
    rows = [int(np.argmin(np.abs(found.time - (2e-9 * k + 1.5e-9)))) for k in range(10)]
    assert list(values[rows]) == listing


def test_a_memory() -> None:
    """Two words of two bits: written while it is enabled, read a nanosecond later."""
    pulse = "V{} {} 0 PULSE(0 1 {}n 0 0 {}n 1)\n".format
    found = run(
        pulse(1, "d0", 10, 10)
        + pulse(2, "d1", 0, 15)
        + pulse(3, "a", 8, 12)
        + pulse(4, "we", 2, 4)
        + pulse(5, "x", 11, 3)
        + "A3 [we x] w any\n.model any d_or(rise_delay=0 fall_delay=0)\n"
        "V6 cs 0 PULSE(0 1 0 0 0 28n 1)\nA1 [d0 d1] [q0 q1] [a] w [cs] m\n"
        ".model m d_ram(read_delay=1n)\n.tran 0.5n 32n\n"
    )
    # at 2 ns word 0 becomes 01 (d1), at 11 ns word 1 becomes 11; read 0 from 20 ns on, off at 28 ns
    for node, high in (("q0", [(12, 21)]), ("q1", [(3, 9), (12, 29)])):
        t = found.time * 1e9
        inside = np.abs(t % 1.0 - 0.5) < 0.2
        expected = np.any([(t > a) & (t < b) for a, b in high], axis=0)
        assert np.array_equal(found[f"v({node})"][inside] > 0.5, expected[inside]), node


def test_sampled_values_are_added() -> None:
    """Two registers with feedback: y[n] = x[n-1] + 0.5 y[n-1]; nodes of type real add."""
    found = run(
        "V1 c 0 PULSE(0 1 1u 0 0 1u 2u)\nV2 e 0 1\nA1 c e x bridge\n"
        ".model bridge d_to_real(zero=2 one=2)\nA2 x s one\n.model one real_gain\n"
        "A3 y s half\n.model half real_gain(gain=0.5)\nA4 s c y reg\n.model reg real_delay\n"
        "A5 y out bridge2\n.model bridge2 real_to_v(gain=3)\nR1 out 0 1k\n.tran 0.5u 9.75u\n"
    )
    t = found.time * 1e6
    inside = np.abs(t % 1.0 - 0.5) < 0.1
    count = np.floor((t[inside] + 1.0) / 2.0)  # rising edges at 1, 3, 5 us
    expected = 3.0 * 4.0 * (1.0 - 0.5**count)
    assert found["v(out)"][inside] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("A1 a b c d m\n.model m oneshot(retrig=true)", "retrig"),
        ("A1 a b m\n.model m delay(has_delay_cnt=true)", "that a signal controls"),
        ('A1 [a b] c m\n.model m d_lut(table_values="01")', "must be 4 characters"),
        ("A1 a b m\n.model m d_fdiv(div_factor=0)", "div_factor"),
        ("A1 [a] b c [d] m\n.model m d_state(rows=[1 2])", "its file has no rows"),
        ("A1 [a] [b c] [d] e [f] m\n.model m d_ram()", "as many outputs"),
        ("A1 a %gd(b 0) m\n.model m aswitch(cntl_off=1 cntl_on=1)", "must be different"),
    ],
)
def test_what_is_refused(line: str, message: str) -> None:
    with pytest.raises(NetlistError, match=message):
        nsspice.read(f"t\nV1 a 0 1\nR1 a b 1\n{line}\n")
