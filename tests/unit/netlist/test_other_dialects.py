"""What LTspice and PSpice write and others do not."""

from __future__ import annotations

from pathlib import Path

import pytest

import nsspice
from nsspice import read
from nsspice.netlist import Deck, NetlistError, parse_file, parse_text


def deck(*lines: str) -> Deck:
    return parse_text("title\n.param t0=10u tr=1u\n" + "\n".join(lines))


@pytest.mark.parametrize(
    ("written", "times"),
    [
        ("PWL(0 0 +1m 1 +2m 1 +3m 0)", (0.0, 1e-3, 3e-3, 6e-3)),
        ("PWL(0 0 +1u 1 20u 1 +1u 0)", (0.0, 1e-6, 20e-6, 21e-6)),
        ("PWL 0,0 t0,0 +10n,5 +480n,5", (0.0, 10e-6, 10.01e-6, 10.49e-6)),
        ("PWL(0 0 {t0} 0 +{tr} 5 +{2*tr} 3)", (0.0, 10e-6, 11e-6, 13e-6)),
        ("PWL(0 +1 1u +2\n+2u +1 3u -1)", (0.0, 1e-6, 2e-6, 3e-6)),
    ],
)
def test_relative_times_of_pwl(written: str, times: tuple[float, ...]) -> None:
    (source, _) = deck(f"V1 a 0 {written}", "R1 a 0 1").elements
    assert source.source is not None
    assert source.source.values[::2] == pytest.approx(times, rel=1e-12)


@pytest.mark.parametrize(
    ("written", "current"),
    [
        ("R=1k + 2*V(a)", 4.0 / 1008.0),
        ("R=if(V(a)>3,1k,2k)", 4e-3),
        ("R={1k} tol=5", 4e-3),
        ("R='2*1k' pwr=0.25", 2e-3),
        ("R=2k m=2", 4e-3),
        ("V=i*1k", 4e-3),
    ],
)
def test_resistors_by_expressions_without_braces(written: str, current: float) -> None:
    solution = read(f"title\nV1 a 0 4\nR1 a 0 {written}\n.op\n").run()[0]
    assert -float(solution["i(v1)"][0]) == pytest.approx(current, rel=1e-9)


def test_notes_of_catalogues() -> None:
    line = 'C1 a 0 330u V=4 Irms=2.5 Rser=7m MTBF=2000 Lser=0 mfg="K" pn="A7" ppPkg=1'
    assert [e.name for e in deck("V1 a 0 1", line).elements] == ["v1", "c1", "c1.rser"]


def test_a_transfer_function_needs_an_input() -> None:
    with pytest.raises(NetlistError) as caught:
        deck("V1 a 0 1", "R1 a b 1", "G1 0 b Laplace=1/(1+s)")
    assert [d.code for d in caught.value.diagnostics] == ["NS1008"]


@pytest.mark.parametrize("written", ['"nom.lib"', "nom.lib", '"NOM.LIB"'])
def test_the_catalogue_of_pspice_may_be_missing(written: str) -> None:
    found = deck("V1 a 0 1", "R1 a 0 1", f".LIB {written}")
    assert [w.code for w in found.warnings] == ["NS1053"]


def test_libraries_may_be_missing_if_nothing_of_them_is() -> None:
    found = deck("V1 a 0 1", "R1 a 0 1", ".lib mynom.lib", ".inc opamp.sub")
    assert [w.code for w in found.warnings] == ["NS1053", "NS1053"]
    for line in ("X1 a 0 amp", "D1 a 0 mine", "R2 a 0 {load}", "F1 a 0 vsense 2", ".ic v(b)=1"):
        with pytest.raises(NetlistError) as caught:
            deck("V1 a 0 1", "R1 a 0 1", ".lib mynom.lib", line)
        assert [d.code for d in caught.value.diagnostics] == ["NS1050"], line
    with pytest.raises(NetlistError):
        deck("V1 a 0 1", "R1 a 0 1", ".include settings.inc")


def test_paths_of_windows(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "load.inc").write_text("R1 a 0 1k\n")
    path = tmp_path / "main.cir"
    path.write_text('title\nV1 a 0 1\n.include ".\\parts\\load.inc"\n')
    assert [e.name for e in parse_file(path).elements] == ["v1", "r1"]


def test_one_instance_is_one() -> None:
    lines = ("V1 a 0 1", ".subckt load p\nR1 p 0 1k\n.ends")
    assert len(deck(*lines, "X1 a load m=1").elements) == 2
    twice = deck(*lines, "X1 a load m=2")
    assert [e.name for e in twice.elements] == ["v1", "x1.r1", "x1#2.r1"]
    for m in ("1.5", "0", "101"):
        with pytest.raises(NetlistError):
            deck(*lines, f"X1 a load m={m}")
    own = deck("V1 a 0 1", ".subckt load p m=3\nR1 p 0 {m}\n.ends", "X1 a load m=2")
    assert own.elements[1].value == 2.0


def test_probe64() -> None:
    found = deck("V1 a 0 1", "R1 a 0 1", ".PROBE64 V(a)")
    assert [s.name for s in found.saves] == ["v(a)"]
    assert not found.warnings


@pytest.mark.parametrize("model", ["np", "2n2222"])
def test_the_substrate_in_brackets(model: str) -> None:
    found = deck("V1 3 0 1", "R1 3 4 1k", f"Q1 3 0 4 [4] {model} 2", f".model {model} NPN(CJS=1p)")
    transistor = found.elements[-1]
    assert transistor.nodes == ("3", "0", "4", "4")
    assert transistor.node_spans[3].column == 11
    assert transistor.params["area"].value == 2.0


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ("E1 a 0 VALUE={1+1m*(TEMP-27)}", [1.0]),
        ("E1 a 0 VALUE={1+1m*(TEMP-27)}\n.temp 127", [1.1]),
        ("E1 a 0 VALUE={1+1m*(TEMP-27)}\n.step temp list 27 127", [1.0, 1.1]),
        ("V1 a 0 {v}\n.param v={1+1m*(temp-27)}\n.temp 127", [1.1]),
        ("E1 a 0 VALUE={1+1m*(TEMP-27)}\n.param temp=77\n.temp 127", [1.05]),
        ("E1 a 0 VALUE={V(temp)}\nV1 temp 0 2\n.temp 127", [2.0]),
    ],
)
def test_temp_is_the_temperature(lines: str, expected: list[float]) -> None:
    solutions = read(f"title\n{lines}\nR1 a 0 1k\n.op\n").run()
    found = [float(v) for s in solutions for v in s["v(a)"]]
    assert found == pytest.approx(expected)


def test_parentheses_of_a_table_that_do_not_match() -> None:
    """As in Microchip's macromodels: MCP6041.txt, lines 120 and 121."""
    deck = parse_text(
        "t\nV1 a 0 2\nG1 0 b TABLE {V(a)} ((-1,-1)(0,0)(3,6))(4,7))\nR1 b 0 1\n"
        "G2 0 c TABLE {V(a)} ((-1,-1)((0,0)(4,4))\nR2 c 0 1\n.op\n"
    )
    assert [w.code for w in deck.warnings] == ["NS1003"] * 2
    point = nsspice.op(
        nsspice.read("t\nV1 a 0 2\nG1 0 b TABLE {V(a)} ((0,0)(3,6))(4,7))\nR1 b 0 1\n")
    )
    assert point["v(b)"][0] == pytest.approx(4.0, rel=1e-14)
    with pytest.raises(NetlistError):
        parse_text("t\nV1 a 0 2\nG1 0 b TABLE {V(a)} ((0,0)(3,6))(4))\nR1 b 0 1\n")
