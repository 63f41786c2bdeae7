import math

import pytest

from nsspice.circuit import build
from nsspice.devices.sources.waveform import check_source, initial_value
from nsspice.errors import NetlistError, Span
from nsspice.netlist import parse_text
from nsspice.netlist.deck import Source
from nsspice.netlist.findings import Findings
from nsspice.problems.descriptor import Waveform

INF = math.inf


def waveform(text: str, card: str = ".tran 1m 50m", analysis: str = "tran") -> Waveform:
    circuit = build(parse_text(f"title\nV1 a 0 {text}\nR1 a 0 1\n{card}\n"))
    waves = circuit.islands[0].assemble(analysis=analysis).system.waveforms
    return waves[0] if waves else Waveform("dc", (0.0,))


def test_left_out_edges_are_tstep_and_written_zeros_are_ideal():
    assert waveform("PULSE(0 5)").values[:5] == (0.0, 5.0, 0.0, 1e-3, 1e-3)
    assert waveform("PULSE(0 5 0 0 0 1m 2m)").values == (0.0, 5.0, 0.0, 0.0, 0.0, 1e-3, 2e-3, INF)


def test_a_pulse_without_period_happens_once_and_lasts_to_the_end():
    values = waveform("PULSE(0 5 1m 0 0)").values
    assert values[6] == INF
    assert values[2] + values[5] > 50e-3


def test_pulse_count():
    assert waveform("PULSE(0 5 0 0 0 1m 2m 3)").values[7] == 3.0


def test_defaults_of_sin_exp_sffm_am():
    assert waveform("SIN(1 2)").values == (1.0, 2.0, 20.0, 0.0, 0.0, 0.0)
    assert waveform("EXP(1 2)").values == (1.0, 2.0, 0.0, 1e-3, 1e-3, 1e-3)
    assert waveform("SFFM(1 2 1k 5 10)").values == (1.0, 2.0, 1e3, 5.0, 10.0)
    assert waveform("AM(1 2 10 1k)").values == (1.0, 2.0, 10.0, 1e3, 0.0)


def test_pwl_delay_and_repetition():
    wave = waveform("PWL(0 0 1m 5 2m 0) td=1m r=0")
    assert wave.values == (1e-3, 0.0, 2e-3, 5.0, 3e-3, 0.0)
    assert wave.repeat == 1e-3
    assert math.isnan(waveform("PWL(0 0 1m 5)").repeat)


def test_dc_analysis_takes_the_dc_value_else_the_value_at_zero():
    assert waveform("DC 3 SIN(1 2 50)", analysis="dc") == Waveform("dc", (3.0,))
    assert waveform("SIN(1 2 50)", analysis="dc").values == (1.0,)
    assert waveform("DC 3 SIN(1 2 50)").kind == "sin"


@pytest.mark.parametrize(
    ("wave", "value"),
    [
        (Waveform("pulse", (1.0, 5.0, 0.0, 0.0, 0.0, 1.0, INF, INF)), 1.0),
        (Waveform("pulse", (1.0, 5.0, 0.0, 1.0, 0.0, 1.0, INF, INF)), 1.0),
        (Waveform("pulse", (1.0, 5.0, 0.1, 0.0, 0.0, 1.0, INF, INF)), 1.0),
        (Waveform("pulse", (1.0, 5.0, -0.5, 1.0, 1.0, 1.0, INF, INF)), 3.0),
        (Waveform("pulse", (1.0, 5.0, -2.5, 1.0, 1.0, 1.0, INF, INF)), 3.0),
        (Waveform("pulse", (1.0, 5.0, -10.0, 0.0, 0.0, 1.0, 3.0, 2.0)), 1.0),
        (Waveform("pulse", (1.0, 5.0, -6.5, 0.0, 0.0, 1.0, 3.0, INF)), 5.0),
        (Waveform("pulse", (1.0, 5.0, -6.0, 0.0, 0.0, 1.0, 3.0, INF)), 1.0),
        (Waveform("pulse", (1.0, 5.0, -7.0, 0.0, 0.0, 1.0, 3.0, INF)), 5.0),
        (Waveform("pwl", (0.0, 1.0, 0.0, 4.0, 1.0, 5.0)), 1.0),
        (Waveform("pwl", (-1.0, 0.0, 1.0, 4.0)), 2.0),
        (Waveform("pwl", (1.0, 7.0, 2.0, 4.0)), 7.0),
        (Waveform("pwl", (-3.0, 0.0, -1.0, 4.0), -3.0), 2.0),
        (Waveform("pwl", (-4.0, 0.0, -2.0, 4.0), -4.0), 4.0),
        (Waveform("exp", (1.0, 2.0, 0.0, 1.0, 1.0, 1.0)), 1.0),
        (Waveform("exp", (0.0, 1.0, -1.0, 1.0, 5.0, 1.0)), 1 - math.exp(-1)),
        (Waveform("sin", (1.0, 2.0, 50.0, 0.0, 0.0, 90.0)), 3.0),
        (Waveform("sffm", (1.0, 2.0, 50.0, 1.0, 5.0)), 1.0),
        (Waveform("am", (1.0, 2.0, 50.0, 100.0, 0.0)), 0.0),
        (Waveform("dc", (2.0,), scale=-3.0), -6.0),
    ],
)
def test_value_at_zero(wave, value):
    assert initial_value(wave) == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "code", "word"),
    [
        ("PULSE(0 5 0 -1m)", "NS2011", "tr"),
        ("PWL(0 0 2m 1 1m 0)", "NS2011", "decrease"),
        ("PWL(0 0 1m 1) r=5m", "NS2011", "r="),
    ],
)
def test_wrong_sources_are_named(text, code, word):
    with pytest.raises(NetlistError) as caught:
        waveform(text)
    assert caught.value.code == code
    assert "v1" in str(caught.value)
    assert word in str(caught.value)
    assert caught.value.line == 2


@pytest.mark.parametrize(
    ("kind", "values", "code", "word"),
    [
        ("sin", (0.0,), "NS2004", "amplitude"),
        ("pwl", (0.0, 0.0, 1.0), "NS2011", "pairs"),
        ("pwl", (0.0, None), "NS2011", "empty"),
        ("sin", (0.0,) * 9, "NS2011", "at most"),
        ("sin", (0.0, INF), "NS2005", "finite"),
        ("am", (1.0, 2.0, 100.0, 2e4, 0.0, 0.0, 90.0), "NS2008", "phase"),
        ("sffm", (1.0, 2.0, 100.0, 2.0, 2e4, 90.0), "NS2008", "phase"),
    ],
)
def test_incomplete_sources_made_by_hand(kind, values, code, word):
    findings = Findings()
    span = Span("a.net", 2, 1)
    assert not check_source(Source(None, None, kind, values, {}, span), "v1", findings)
    assert findings.errors[0].code == code
    assert word in findings.errors[0].message


@pytest.mark.parametrize("kind", ["am", "sffm"])
def test_phases_of_zero_are_none(kind):
    """ngspice takes two phases more than SPICE3."""
    given = (1.0, 2.0, 100.0, 2e4, 0.0)
    with_phases = waveform(f"{kind}(1 2 100 20k 0 0 0)")
    assert with_phases == waveform(f"{kind}(1 2 100 20k 0)") == Waveform(kind, given)


def test_a_pulse_longer_than_its_period_is_warned_about():
    circuit = build(parse_text("t\nV1 a 0 PULSE(0 1 0 1u 1u 9u 10u)\nR1 a 0 1\n.tran 1u 1m\n"))
    assert [w.code for w in circuit.warnings] == ["NS2056"]


def test_swept_value_goes_first():
    circuit = build(parse_text("t\nV1 a 0 SIN(0 1 50)\nR1 a 0 1\n.dc V1 0 1 0.5\n"))
    waves = circuit.islands[0].assemble(values={"v1": 0.25}, analysis="dc").system.waveforms
    assert waves == (Waveform("dc", (0.25,)),)
