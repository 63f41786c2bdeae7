"""Current sources as loads, LTspice's: ``TBL`` and ``load``."""

from __future__ import annotations

import pytest

from nsspice import NsspiceError, read
from nsspice.compare import ngspice
from nsspice.netlist import NetlistError, parse_text


@pytest.mark.parametrize(
    "written",
    [
        "TBL(0 0 2 180u 100V 185u)",
        "TBL(0,0,2,{2*90u},100,185u) AC 1",
        "tbl=(0 0 2 180u 100 185u)",
        "tbl 0 0 2 180u 100 185u m=1",
    ],
)
@pytest.mark.parametrize(
    ("volts", "current"), [(1.0, 90e-6), (51.0, 182.5e-6), (200.0, 185e-6), (-1.0, 0.0)]
)
def test_a_table_of_the_own_voltage(written: str, volts: float, current: float) -> None:
    text = f"t\n.subckt load p n\nI1 p n {written}\n.ends\nV1 a b {volts}\nV2 b 0 3\n"
    solution = read(f"{text}X1 a b load\n.op\n.save all alli\n").run()[0]
    assert float(solution["i(x1.i1)"][0]) == pytest.approx(current, rel=1e-9)
    assert float(solution["i(v1)"][0]) == pytest.approx(-current, rel=1e-9)


def test_a_table_meets_a_resistor() -> None:
    text = "t\nV1 in 0 4\nR1 in a 10k\nI1 a 0 TBL(0 0 2 200u 100 200u)\n.op\n"
    circuit = read(text)
    assert float(circuit.run()[0]["v(a)"][0]) == pytest.approx(2.0, rel=1e-9)
    assert ngspice.cross_check(circuit, tolerance=1e-6).passed


@pytest.mark.parametrize(
    ("written", "code"),
    [
        ("TBL(0 0 2)", "NS1008"),
        ("TBL(2 0 0 1)", "NS1024"),
        ("TBL(0 0 2 1) 5", "NS1008"),
        ("5 TBL(0 0 2 1)", "NS1009"),
        ("SIN(0 1 1) tbl=(0 0 1 1)", "NS1009"),
    ],
)
def test_tables_that_are_none(written: str, code: str) -> None:
    with pytest.raises(NetlistError) as caught:
        parse_text(f"t\nV1 a 0 1\nI1 a 0 {written}\n")
    assert [d.code for d in caught.value.diagnostics] == [code]


def test_a_voltage_source_has_no_such_table() -> None:
    with pytest.raises(NetlistError):
        parse_text("t\nV1 a 0 TBL(0 0 2 1)\nR1 a 0 1\n")


@pytest.mark.parametrize("written", ["100u load", "load 100u"])
def test_a_load_takes_power_only(written: str) -> None:
    """Constant above 0.5 V, proportional to the voltage below, nothing of a reverse voltage."""
    for volts, current in ((5.0, 100e-6), (0.25, 50e-6), (-1.0, 0.0)):
        text = f"t\nV1 a 0 {volts}\nI1 a 0 {written}\n.op\n"
        assert float(read(text).run()[0]["i(v1)"][0]) == pytest.approx(-current, rel=1e-12)
        assert [w.code for w in parse_text(text).warnings] == ["NS1097"]


def test_a_load_with_a_waveform_is_refused() -> None:
    with pytest.raises(NetlistError) as caught:
        parse_text("t\nV1 a 0 1\nI1 a 0 PWL(0 0 1 1) load\n")
    (finding,) = caught.value.diagnostics
    assert finding.code == "NS1002"


@pytest.mark.parametrize("line", ["I1 a 0 TBL(0 0 2 1)", "R1 a 0 R={1k+v(a)}", "C1 a 0 Q={x**3}"])
@pytest.mark.parametrize("card", [".dc {} 1 2 1", ".step {} 1 2 1\n.op"])
def test_a_law_cannot_be_swept(line: str, card: str) -> None:
    with pytest.raises(NsspiceError) as caught:
        read(f"t\nV1 a 0 1\n{line}\n{card.format(line[:2])}\n").run()
    assert caught.value.diagnostics[0].code == "NS4007"
