"""XSPICE's code models and LTspice's A devices against closed forms and truth tables."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import nsspice
from nsspice.analyses.solution.solution import Solution
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text


def run(lines: str) -> Solution:
    return nsspice.read(f"models\n{lines}\n").run()[0]


ANALOGUE = "V1 a 0 SIN(0 2 1k)\nV2 b 0 1\nA1 {} out mod\n.model mod {}\n.tran 10u 1m uic"


@pytest.mark.parametrize(
    ("ports", "card", "law"),
    [
        ("a", "gain(gain=3 in_offset=0.1 out_offset=-1)", lambda a, t: 3 * (a + 0.1) - 1),
        ("[a b]", "summer(in_gain=[2 -1] in_offset=[0 1] out_gain=0.5)", lambda a, t: a - 1),
        ("[a b a]", "mult(in_gain = [ 2 3 1 ])", lambda a, t: 6 * a * a),
        ("a b", "divide(den_offset=3 out_gain=2)", lambda a, t: 2 * a / 4),
        ("%vd(a b)", "limit(gain=2 out_lower_limit=-1 out_upper_limit=1.5)",
         lambda a, t: np.clip(2 * (a - 1), -1, 1.5)),
        ("a b 0", "climit(gain=1 lower_delta=-0.5)", lambda a, t: np.clip(a, -0.5, 1)),
        ("a", "pwl(x_array=[-1 0 1] y_array=[0 0 2])", lambda a, t: np.maximum(2 * a, 0)),
        ("b", "s_xfer(num_coeff=[1] den_coeff=[1e-3 1])", lambda a, t: -np.expm1(-t / 1e-3)),
        ("b", "int(gain=100 out_ic=0.5)", lambda a, t: 0.5 + 100 * t),
        ("b", "int(gain=1k out_lower_limit=0 out_upper_limit=0.4)",
         lambda a, t: np.minimum(1e3 * t, 0.4)),
        ("a", "d_dt(gain=1m)", lambda a, t: 4 * np.pi * np.cos(2e3 * np.pi * t)),
    ],
)  # fmt: skip
def test_analogue_models(ports: str, card: str, law) -> None:  # type: ignore[no-untyped-def]
    found = run(ANALOGUE.format(ports, card))
    # closed forms on both sides; sine and product are followed with the tolerance of the steps
    scale = 1e-3 if "mult" in card else 1e-12
    assert found["v(out)"] == pytest.approx(law(found["v(a)"], found.axis), abs=scale)


def test_hysteresis_and_switches() -> None:
    """Laws of the manual of XSPICE; ngspice 39 has 0.799269 at 0.9 V, and 0.997510 in a line."""
    found = run(
        "V1 a 0 PWL(0 0 1 2 2 -2 3 0)\nA1 a h hy\n.model hy hyst(in_low=-0.5 in_high=0.5 hyst=0.5 "
        "out_lower_limit=-3 out_upper_limit=3)\nV2 one 0 1\nR1 one c 1\nR2 one d 1\nR3 one e 1\n"
        "A2 a %gd(c 0) sw\n.model sw aswitch(cntl_off=0.5 cntl_on=1 r_on=1 r_off=1e3)\n"
        "A3 a %gd(d 0) line\n.model line aswitch(cntl_off=0.5 cntl_on=1 r_on=1 r_off=1e3 log=false "
        "limit=true)\nA4 a %gd(e 0) smooth\n.model smooth pswitch(cntl_off=0.5 cntl_on=1 r_on=1 "
        "r_off=1e3)\n.tran 0.15 3 uic"
    )
    t, a = found.axis[1:], found["v(a)"][1:]
    on_the_way_back = (t > 0.5) & (t < 1.75)
    play = 6.0 * (a + np.where(on_the_way_back, 0.5, -0.5))
    assert found["v(h)"][1:] == pytest.approx(np.clip(play, -3.0, 3.0), abs=1e-12)
    powers = np.maximum(1e3 ** ((1.0 - a) / 0.5), 1e-9)
    assert found["v(c)"][1:] == pytest.approx(powers / (1.0 + powers), rel=1e-9)
    straight = np.interp(a, [0.5, 1.0], [1e3, 1.0])
    assert found["v(d)"][1:] == pytest.approx(straight / (1.0 + straight), rel=1e-9)
    part = np.clip((a - 0.75) / 0.5, -0.5, 0.5)
    smooth = 1e3 ** (0.5 - 1.5 * part + 2.0 * part**3)
    assert found["v(e)"][1:] == pytest.approx(smooth / (1.0 + smooth), rel=1e-9)


@pytest.mark.parametrize("kind", ["and", "nand", "or", "nor", "xor", "xnor"])
@pytest.mark.parametrize("inputs", [2, 3])
def test_truth_tables(kind: str, inputs: int) -> None:
    table = {"and": all, "or": any, "xor": lambda bits: sum(bits) % 2 == 1}
    for bits in itertools.product((0, 1), repeat=inputs):
        sources = "\n".join(f"V{k} n{k} 0 {bit}" for k, bit in enumerate(bits))
        names = " ".join(f"n{k}" for k in range(inputs))
        found = run(f"{sources}\nA1 [{names}] y g\n.model g d_{kind}\n.tran 1n 10n uic")
        plain = {"nand": "and", "nor": "or", "xnor": "xor"}.get(kind, kind)
        expected = table[plain](bits) != (plain != kind)  # type: ignore[operator]
        assert found["v(y)"][-1] == float(expected), bits


def test_oscillators() -> None:
    """At 1.5 V they give 2 kHz: a wave is high, or falls, in the last part of a period.

    ngspice 39 shows the same phases (its edges take 1 us).
    """
    arrays = "cntl_array=[0 1 2] freq_array=[500 1k 3k]"
    found = run(
        f"V1 c 0 1.5\nA1 c sq one\nA2 c tr two\nA3 c dg three\nA4 [dg] [an] dac\n"
        f".model one square({arrays} out_low=-0.8 out_high=1.2 duty_cycle=0.3)\n"
        f".model two triangle({arrays} out_low=-1 out_high=1 duty_cycle=0.8)\n"
        f".model three d_osc({arrays} duty_cycle=0.25 init_phase=90 rise_delay=1u fall_delay=1u)\n"
        ".model dac dac_bridge(out_low=0 out_high=1)\n.tran 12u 1.2m uic"
    )
    t = found.axis[1:]
    turns = (t * 2e3) % 1.0
    ramp = np.where(turns < 0.8, turns / 0.8, (1.0 - turns) / 0.2)
    assert found["v(tr)"][1:] == pytest.approx(2.0 * ramp - 1.0, abs=1e-11)
    assert np.array_equal(found["v(sq)"][1:] > 0.0, turns > 0.7)
    late = ((t - 1e-6) * 2e3 + 0.25) % 1.0  # what follows it by a microsecond, from phase 90
    assert np.array_equal(found["v(an)"][1:] > 0.5, late > 0.75)


def test_a_gate_that_drives_itself() -> None:
    """It waits for its whole delay each time; an operating point knows the phase of a clock."""
    found = run(
        "V1 e 0 PULSE(0 1 1.1u 0 0 1 2)\nA1 [e] [en] adc\nA2 [en y] y gate\nA3 [y] [an] dac\n"
        ".model adc adc_bridge(rise_delay=100n)\n.model gate d_nand(rise_delay=2u fall_delay=1u)\n"
        ".model dac dac_bridge(out_low=0 out_high=1)\nV2 c 0 1\nA4 c clk osc\n"
        ".model osc d_osc(cntl_array=[0 2] freq_array=[100k 100k] init_phase=180)\n.tran 0.3u 20u"
    )
    since = found.axis - 1.2e-6  # enabled; it falls 1 us later, and then every 3 us
    rows = found.axis > 0.0
    inside = np.abs((since - 1e-6) % 1e-6 - 0.5e-6) < 0.49e-6
    expected = (since < 1e-6) | ((since - 1e-6) % 3e-6 > 2e-6)
    assert np.array_equal(found["v(an)"][rows & inside] > 0.5, expected[rows & inside])
    # its high half comes first, a nanosecond late
    late = (found.axis - 1e-9)[rows]
    assert np.array_equal(found["v(clk)"][rows] > 0.5, late % 10e-6 < 5e-6)


def test_delays_and_a_divider_by_two() -> None:
    """Ramps of 1 ns between 0 and 5 V cross 4 V after 0.8 ns and 1 V after 0.8 ns."""
    found = run(
        "V1 ai 0 PULSE(0 5 0 1n 1n 50n 100n)\nV2 bi 0 PULSE(0 5 0 1n 1n 100n 200n)\n"
        "A1 [ai bi] [a b] adc\n.model adc adc_bridge(in_low=1 in_high=4 rise_delay=1n "
        "fall_delay=1n)\n"
        "A2 [a b] y nand\n.model nand d_nand(rise_delay=2n fall_delay=3n)\nA4 [y] [yo] dac\n"
        ".model dac dac_bridge(out_low=0 out_high=3.3)\nA6 nq a null null q nq ff\n"
        ".model ff d_dff(clk_delay=1n)\n.tran 1n 400n uic\n"
        ".meas tran up when v(yo)=1 rise=1\n.meas tran down when v(yo)=1 fall=1\n"
        ".meas tran one when v(q)=0.5 rise=1\n.meas tran two when v(q)=0.5 fall=1\n"
        ".meas tran three when v(q)=0.5 rise=2\n.meas tran high max v(yo)"
    )
    # a falls at 51.8 ns + 1 ns, the gate 2 ns later; both are high again at 201.8 ns, then 3 ns.
    # The overlap of 1 ns at 101.8 ns is shorter than the delay, and swallowed
    expected = {
        "up": 54.8e-9,
        "down": 204.8e-9,
        "one": 2.8e-9,
        "two": 102.8e-9,
        "three": 202.8e-9,
        "high": 3.3,
    }
    assert found.measures == pytest.approx(expected, rel=1e-9)


def test_latches_and_flip_flops() -> None:
    pulse = "PULSE(0 1 {} 0 0 1u 1)".format
    common = (
        f"V1 s 0 {pulse('2u')}\nV2 r 0 {pulse('5u')}\nV3 one 0 1\nV4 c 0 PULSE(0 1 1u 0 0 1u 2u)\n"
    )
    found = run(
        common + "A1 s r one null null q nq sl\n.model sl d_srlatch(sr_delay=0)\n"
        "A2 s c null null d dn dl\n.model dl d_dlatch(data_delay=0)\n"
        "A3 one c null r t nt tf\n.model tf d_tff(clk_delay=0)\n"
        "A4 one one c null null j nj jk\n.model jk d_jkff(clk_delay=0)\n.tran 0.5u 9.25u uic"
    )
    t = found.axis * 1e6
    between = np.abs(t - np.round(t)) > 0.1
    inside = lambda *pairs: np.any([(t > a) & (t < b) for a, b in pairs], axis=0)  # noqa: E731
    for node, high in {
        "q": inside((2, 5)),
        "nq": ~inside((2, 5)),
        "d": inside((3, 3)),  # s is high from 2 to 3, while c is low: never stored
        "t": inside((1, 3), (7, 9)),  # reset at 5, which would have been its next rise
        "j": inside((1, 3), (5, 7), (9, 11)),
    }.items():
        assert found[f"v({node})"][between] == pytest.approx(high[between].astype(float)), node


def test_ltspice_devices() -> None:
    found = run(
        "V1 a 0 PULSE(0 5 1u 0 0 1u 2u)\nV2 b 0 5\nA1 a b 0 0 0 n y 0 AND Vhigh=5 Td=100n\n"
        "A2 a 0 0 0 0 0 i 0 INV Vhigh=5\nA3 dn 0 a 0 0 dn q 0 DFLOP Vhigh=5 Td=10n\n"
        "V3 x 0 PWL(0 0 4u 4 8u 0)\nA4 x 0 0 0 0 0 s 0 SCHMITT Vt=2 Vh=1\n"
        "A5 a x 0 0 0 0 f 0 SRFLOP Vhigh=5\n.tran 0.5u 8u uic\n"
        ".meas tran y when v(y)=2.5 rise=1\n.meas tran q1 when v(q)=2.5 rise=1\n"
        ".meas tran q2 when v(q)=2.5 rise=2\n.meas tran on when v(s)=0.5 rise=1\n"
        ".meas tran off when v(s)=0.5 fall=1"
    )
    expected = {"y": 1.1e-6, "q1": 1.01e-6, "q2": 5.01e-6, "on": 3e-6, "off": 7e-6}
    assert found.measures == pytest.approx(expected, rel=1e-9)
    assert found["v(i)"][1] == 5.0
    assert found["v(n)"][3] == 0.0


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("A1 a b nothing", "NS1060"),
        ("A1 a b m\n.model m d_tristate()", "NS1005"),
        ("A1 a m\n.model m gain()", "NS1008"),
        ("A1 [a b m\n.model m summer()", "NS1007"),
        ("A1 a ] b m\n.model m gain()", "NS1007"),
        ("A1 m", "NS1008"),
        ("A1 %vnam v1 b m\n.model m gain()", "NS1008"),
        ("A1 a b m\n.model m pwl(x_array=[0 1] y_array=[1])", "NS1008"),
        ("A1 a 0 b a 0 0 q 0 DFLOP", "NS1002"),
        ("A1 0 0 0 0 0 0 q 0 AND", "NS1002"),
    ],
)
def test_what_is_refused(line: str, code: str) -> None:
    with pytest.raises(NetlistError) as caught:
        parse_text(f"t\nV1 a 0 1\nR1 a b 1\n{line}\n")
    assert [d.code for d in caught.value.diagnostics] == [code]


def test_a_node_that_is_digital_and_analogue_is_told() -> None:
    text = "t\nV1 a 0 1\nA1 a y g\n.model g d_inverter\nR1 {} 0 1\n"
    (warning,) = parse_text(text.format("y")).warnings
    assert (warning.code, warning.message.rsplit(": ")[-1]) == ("NS1097", "a, y")
    bridged = (
        "t\nV1 a 0 1\nA1 [a] [d] adc\n.model adc adc_bridge(in_low=0.4 in_high=0.6)\nA2 d y g\n"
        ".model g d_inverter\nA3 [y] [z] dac\n.model dac dac_bridge(out_high=5)\nR1 z 0 1\n"
    )
    assert not parse_text(bridged).warnings


def test_a_winding_on_a_core_is_a_saturating_inductor() -> None:
    """As ngspice's example: 10 turns, 1 H of a turn, behind 100 Ohm; and an undriven input."""
    found = run(
        "V1 a 0 PULSE(0 4 0 0 0 1 2)\nR1 a b 2\nA1 (b 0) (m 0) coil\nA2 m iron\n"
        ".model coil lcouple(num_turns=10)\n"
        ".model iron core(H_array=[-20 -10 10 20] B_array=[-1.1 -1 1 1.1] area=0.1 length=1)\n"
        "A3 [nowhere] [dig] buffer\nA4 [dig] [an] dac\n"
        ".model dac dac_bridge(out_low=1 out_high=2)\n"
        ".model buffer d_inverter\n.tran 10m 0.9 uic"
    )
    # 1 H up to 1 A, then 0.1 H; 2 Ohm
    time = found.axis[1:]
    corner = 0.5 * np.log(2.0)
    early = 2.0 * (1.0 - np.exp(-2.0 * time))
    late = 2.0 - np.exp(-20.0 * (time - corner))
    current = np.where(time < corner, early, late)
    assert found["v(m)"][1:] == pytest.approx(10.0 * current, rel=1e-12)
    assert found["v(an)"][-1] == 2.0


def test_currents_as_inputs_and_operating_points_of_integrators() -> None:
    deck = (
        "V1 a 0 DC 2 AC 1\nR1 a b 1k\nA1 %i b %v y gain\n.model gain gain(gain=5k)\n"
        "A2 a z int\n.model int int(gain=3 out_ic=0.5 out_lower_limit=-1 out_upper_limit=1)\n"
    )
    point = nsspice.op(nsspice.read("t\n" + deck))
    assert point["v(y)"][0] == pytest.approx(10.0, rel=1e-14)
    assert point["v(z)"][0] == 0.5
    assert point.certificate.passed
    small = nsspice.ac(nsspice.read("t\n" + deck), [1.0])
    assert small["v(z)"][0] == pytest.approx(3.0 / (2j * np.pi), rel=1e-14)


def test_sources_that_read_files(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "states.txt").write_text("* time a b\n0n 0s 1s\n10n 1s Uu\n30n 0s 1r\n")
    (tmp_path / "values.txt").write_text("0 0 1\n1u 0.5 0\n2u 1 1\n")
    deck = tmp_path / "sources.cir"
    deck.write_text(
        't\nA1 [p q] digital\n.model digital d_source(input_file="states.txt")\n'
        "A2 [p q] [x y] dac\n.model dac dac_bridge(out_low=0 out_high=1)\n"
        'A3 %vd([c 0 d e]) lines\n.model lines filesource(file="values.txt"\n'
        "+ amplscale=[2 3] amploffset=[0.5 0] timescale=0.01)\nRe e 0 1\n"
        'A4 %v([f g]) steps\n.model steps filesource(file="values.txt" amplstep=true\n'
        "+ timescale=0.01)\n"
        "Rd d 0 1\n.tran 5n 40n\n"
    )
    found = nsspice.tran(nsspice.read(deck))
    t = found.time
    inside = np.abs(t % 10e-9 - 5e-9) < 1e-9
    assert np.array_equal(found["v(x)"][inside] > 0.5, ((t > 10e-9) & (t < 30e-9))[inside])
    assert np.array_equal(found["v(y)"][inside] > 0.5, ((t < 10e-9) | (t > 30e-9))[inside])
    assert found["v(c)"] == pytest.approx(np.interp(t, [0, 1e-8, 2e-8], [0.5, 1.5, 2.5]), abs=1e-15)
    pair = np.interp(t, [0, 1e-8, 2e-8], [3.0, 0.0, 3.0])
    assert found["v(d)"] - found["v(e)"] == pytest.approx(pair, abs=1e-15)
    steps = np.where(t < 1e-8, 0.0, np.where(t < 2e-8, 0.5, 1.0))
    assert np.array_equal(found["v(f)"][inside], steps[inside])
    (tmp_path / "values.txt").write_text("0 0\n")
    with pytest.raises(NetlistError, match="no rows"):
        nsspice.read(deck)
