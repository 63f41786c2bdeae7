"""Forms that other programs read: what each of them comes to here."""

from __future__ import annotations

import math
import statistics
from pathlib import Path

import pytest

from nsspice import read
from nsspice.errors import NetlistError
from nsspice.netlist import Deck, parse_file, parse_text
from nsspice.netlist.deck import TranCard

RC = "title\nV1 in 0 5\nR1 in out 1k\nC1 out 0 1u\n"


def deck(*lines: str) -> Deck:
    return parse_text(RC + "\n".join(lines))


def codes(found: Deck) -> list[str]:
    return [warning.code for warning in found.warnings]


def test_constant_sources_rise_at_the_start() -> None:
    """RC on a ramp of r = 5 V / 20 us: v = r (t - tau (1 - exp(-t / tau)))."""
    (run,) = read(RC + ".tran 10u 20u startup\n").run()
    tau, rise = 1e-3, 20e-6
    end = 5.0 / rise * (rise - tau * -math.expm1(-rise / tau))
    assert run["v(out)"][[0, -1]] == pytest.approx([0.0, end], rel=1e-10, abs=1e-15)
    assert run["v(in)"] == pytest.approx([0.0, 2.5, 5.0], rel=1e-14)
    waving = parse_text("t\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1m startup")
    assert "v1" in waving.warnings[0].message


def test_a_run_to_the_steady_state_goes_on() -> None:
    found = deck(".tran 0 10m 0 steady")
    assert codes(found) == ["NS1003"]
    assert isinstance(found.analyses[0], TranCard)


def test_a_sine_of_negative_frequency() -> None:
    text = "t\nV1 a 0 SIN(1 2 -50 5m 3 30)\nR1 a 0 1\n.tran 1m 40m\n"
    (run,) = read(text).run()
    s = [max(t - 5e-3, 0.0) for t in run.axis]
    exact = [1 + 2 * math.exp(-3 * x) * math.sin(-2 * math.pi * 50 * x + math.pi / 6) for x in s]
    assert run["v(a)"] == pytest.approx(exact, abs=1e-13)


def test_points_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "wave.txt").write_text("0 0\n1m, 2\n3m\t-1\n")
    path = tmp_path / "a.cir"
    for form in ("PWL file=wave.txt", 'pwl(file="wave.txt")', "PWL FILE = wave.txt"):
        path.write_text(f"t\nV1 a 0 {form}\nR1 a 0 1\n.tran 1m 3m\n")
        source = parse_file(path).elements[0].source
        assert source is not None
        assert source.values == (0.0, 0.0, 1e-3, 2.0, 3e-3, -1.0)
    path.write_text("t\nV1 a 0 PWL file=../wave.txt\nR1 a 0 1\n")
    with pytest.raises(NetlistError) as caught:
        parse_file(path, confined=True)
    assert caught.value.code == "NS1054"


def test_white_noise_in_time() -> None:
    """Samples of the given deviation and interval, straight lines between them."""
    text = "t\nV1 a 0 3 TRNOISE(0.1 1u 0 0)\nR1 a 0 1\n.tran 1u 4m\n"
    source = parse_text(text).elements[0].source
    assert source is not None
    times, values = source.values[2::2], source.values[3::2]
    assert len(values) == 4000
    assert times[:3] == pytest.approx((1e-6, 2e-6, 3e-6))
    # five deviations of the estimates of 4000 samples
    assert statistics.fmean(values) == pytest.approx(3.0, abs=5 * 0.1 / math.sqrt(4000))  # type: ignore[type-var]
    assert statistics.stdev(values) == pytest.approx(0.1, abs=5 * 0.1 / math.sqrt(8000))  # type: ignore[type-var]
    assert parse_text(text).elements[0].source == source
    assert parse_text(text, seed=1).elements[0].source != source


@pytest.mark.parametrize(
    ("law", "mean", "deviation"),
    [
        ("1 1u 0 2 1", 1.0, 2 / math.sqrt(3)),
        ("2 1u 0 2 1", 1.0, 2.0),
        ("3 1u 0 2 1", 3.0, 2.0),
        ("4 1u 0 9 1", 10.0, 3.0),
    ],
)
def test_random_steps(law: str, mean: float, deviation: float) -> None:
    source = parse_text(f"t\nV1 a 0 TRRANDOM({law})\nR1 a 0 1\n.tran 1u 4m\n").elements[0].source
    assert source is not None
    values = [v for v in source.values[5::4] if v is not None]
    # five deviations of the estimates; that of an exponential law's deviation is twice as large
    assert statistics.fmean(values) == pytest.approx(mean, abs=5 * deviation / math.sqrt(4000))
    assert statistics.stdev(values) == pytest.approx(
        deviation, abs=10 * deviation / math.sqrt(8000)
    )


@pytest.mark.parametrize(
    "wave", ["trnoise(1 0)", "trnoise(1 1n)", "trrandom(5 1u)", "trnoise(1 1u 1 1)"]
)
def test_random_waveforms_that_are_refused(wave: str) -> None:
    with pytest.raises(NetlistError):
        parse_text(f"t\nV1 a 0 {wave}\nR1 a 0 1\n.tran 1u 4\n")


def test_a_parameter_of_a_model_is_stepped() -> None:
    """Shockley's law at 1 mA: v = n k T / q ln(i / is + 1)."""
    text = "t\nI1 0 a 1m\nD1 a 0 dm\n.model dm D(is=1e-14)\n.op\n.step D dm(is) list 1e-14 1e-12\n"
    for run in read(text).run():
        saturation = run.parameters["@dm[is]"]
        thermal = 1.380649e-23 * 300.15 / 1.602176634e-19
        assert run["v(a)"][0] == pytest.approx(thermal * math.log1p(1e-3 / saturation), rel=1e-9)


def test_several_temperatures_are_steps() -> None:
    text = "t\nI1 0 a 1\nR1 a 0 1 tc1=0.01\n.op\n.temp 27 127\n"
    assert [run["v(a)"][0] for run in read(text).run()] == pytest.approx([1.0, 2.0], rel=1e-14)


def test_thermal_voltage() -> None:
    text = "t\nB1 a 0 V=vt\nR1 a 0 1\n.op\n.temp 100\n"
    expected = 1.380649e-23 * 373.15 / 1.602176634e-19
    assert read(text).run()[0]["v(a)"][0] == pytest.approx(expected, rel=1e-12)


def test_equal_instances_share_a_current() -> None:
    text = "t\nI1 0 a 6\nX1 a s m=3\n.subckt s p\nR1 p q 1\nR2 q 0 1\n.ends\n.op\n"
    assert read(text).run()[0]["v(a)"][0] == pytest.approx(4.0, rel=1e-14)


@pytest.mark.parametrize(
    ("lines", "warned"),
    [
        ([".op", ".end", "\x1a"], []),
        ([".op\n\x1a"], []),
        (["V2 b 0 PULSE(0 5 0 1n 1n 1u 2u", "R2 b 0 1"], ["NS1003"]),
        (["R2 out 0 1k flavour=3"], ["NS1014"]),
        ([".tran 1u 1m", ".four 1k i(r1) p(r1)"], ["NS1003"]),
        ([".op", ".sens v(out) ac dec 10 1 1k"], ["NS1003"]),
        ([".ic out=1"], []),
        (["D1 out 0 dm", ".model dm d(is=1f jsw=1n cjsw=1p)"], ["NS2052"]),
    ],
)
def test_what_is_read_over(lines: list[str], warned: list[str]) -> None:
    assert [w.code for w in read(RC + "\n".join(lines)).warnings] == warned


def test_a_sidewall_with_a_length_is_refused() -> None:
    with pytest.raises(NetlistError):
        read(RC + "D1 out 0 dm pj=1\n.model dm d(is=1f cjsw=1p)\n")


@pytest.mark.parametrize(
    ("written", "plain"), [("mag(v(out))", "vm(out)"), ("db(V(out))", "vdb(out)")]
)
def test_parts_of_complex_signals(written: str, plain: str) -> None:
    found = deck(".ac dec 1 1 10", f".meas ac a max {written}")
    assert found.measures[0].expression is not None
    assert found.measures[0].expression.variables() == {plain}


def test_measures_of_earlier_measures() -> None:
    """Charging of RC to 0.9 and 0.1 of its end, and what is measured from there on."""
    (run,) = read(
        RC + ".tran 10u 5m uic\n.meas tran vm max v(out)\n"
        ".meas tran t1 when v(out)=0.9*vm rise=1\n"
        ".meas tran rise trig v(out) val='0.1*vm' rise=1 targ v(out) val={0.9*vm} rise=1\n"
        ".meas tran mean avg v(out) from=t1 to=4m\n.meas tran there find v(out) at=t1\n"
        ".meas tran from_there trig at=t1 targ at='2*t1'\n"
        ".meas tran gone when v(out)=nothing*2\n.param nothing=1\n"
    ).run()
    tau, end = 1e-3, 5.0 * -math.expm1(-5.0)
    at = lambda v: -tau * math.log1p(-v / 5.0)  # noqa: E731
    t1 = at(0.9 * end)
    mean = 5.0 * (1 - tau * (math.exp(-t1 / tau) - math.exp(-4.0)) / (4e-3 - t1))
    expected = {
        "vm": end, "t1": t1, "rise": t1 - at(0.1 * end), "mean": mean, "there": 0.9 * end,
        "from_there": t1, "gone": at(2.0),
    }  # fmt: skip
    assert run.measures == pytest.approx(expected, rel=1e-11)


def test_a_measure_of_a_measure_that_failed_is_told() -> None:
    (run,) = read(
        RC + ".tran 10u 1m uic\n.meas tran t1 when v(out)=9\n.meas tran v find v(out) at=t1\n"
    ).run()
    assert math.isnan(run.measures["v"])
    assert len([w for w in run.warnings if w.code == "NS5001"]) == 2
    with pytest.raises(NetlistError):
        read(RC + ".tran 10u 1m\n.meas tran v find v(out) at=t1\n")
    with pytest.raises(NetlistError):  # a window has to be a number
        read(RC + ".tran 10u 1m\n.meas tran a max v(out)\n.meas tran v max v(in) to=a*v(out)\n")


def test_the_half_power_frequency_of_ltspice() -> None:
    (run,) = read(
        "t\nV1 in 0 AC 1\nR1 in out 1k\nC1 out 0 1u\n.ac dec 1000 1 10k\n"
        ".MEAS AC VUmax max mag(V(out))\n.MEAS AC f3 when mag(V(out))=(VUmax/sqrt(2))\n"
    ).run()
    corner = 1e3 / (2 * math.pi)
    top = 1 / math.hypot(1, 1 / corner)
    # linear between points 0.23 % apart: the square of that over 8
    assert run.measures["f3"] == pytest.approx(corner * math.sqrt(2 / top**2 - 1), rel=1e-6)
