"""What PSpice's model cards say of the temperature: ``TCE`` of resistors, ``T_ABS``."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.compare import ngspice


def value(lines: str, signal: str) -> float:
    solution = nsspice.read(f"title\nV1 a 0 1\n{lines}\n.op\n.save all alli\n").run()[0]
    return float(solution[signal][0])


@pytest.mark.parametrize(
    ("lines", "ohms"),
    [
        ("R1 a 0 rm 1k\n.model rm res(tce=2)\n.temp 37", 1e3 * 1.01**20),
        ("R1 a 0 1k tce=2\n.temp 37", 1e3 * 1.01**20),
        ("R1 a 0 rm 1k tce=1\n.model rm res(tce=2)\n.temp 37", 1e3 * 1.01**10),
        ("R1 a 0 rm 1k\n.model rm res(tce=2 tc1=1)\n.temp 37", 1e3 * 1.01**20),  # as in ngspice
        ("R1 a 0 rm 1k\n.model rm res(tce=0 tc1=0.01)\n.temp 37", 1.1e3),
        ("R1 a 0 rm 1k\n.model rm res(tce=2 tnom=17)", 1e3 * 1.01**20),
        ("R1 a 0 rm 1k\n.model rm res(tc1=0.01 t_abs=37)\n.temp 100", 1.1e3),
        ("R1 a 0 rm 1k temp=47\n.model rm res(tc1=0.01 t_abs=37)", 1.2e3),
        ("R1 a 0 rm 1k\n.model rm RES (TCE=0 T_ABS=-273.15)\n.temp 100", 1e3),
        ("R1 a 0 R={1k+0*v(a)} tce=2\n.temp 37", 1e3 * 1.01**20),
    ],
)
def test_resistors(lines: str, ohms: float) -> None:
    assert value(lines, "i(r1)") == pytest.approx(1.0 / ohms, rel=1e-9)


@pytest.mark.parametrize("card", ["d(is=1e-14 rs=1 cjo=1p", "npn(is=1e-14 bf=50"])
@pytest.mark.parametrize("own", ["", "temp=90"])
def test_junctions(card: str, own: str) -> None:
    element = "D1 a 0 mm" if card[0] == "d" else "Q1 a a 0 mm"
    there = f"R9 a 0 1\n{element} {own}\n.model mm {card} t_abs=60)\n.temp 30"
    same = f"R9 a 0 1\n{element} {own}\n.model mm {card})\n.temp {90 if own else 60}"
    signal = "i(d1)" if card[0] == "d" else "i(q1)"
    assert value(there, signal) == pytest.approx(value(same, signal), rel=1e-9)


@pytest.mark.parametrize(
    ("line", "kind"),
    [
        ("R1 a b mm 1", "res("),
        ("C1 a b mm 1", "cap("),
        ("L1 a b mm 1", "ind("),
        ("D1 a b mm", "d(is=1f "),
        ("Q1 a b 0 mm", "npn(is=1f "),
    ],
)
def test_colder_than_absolute_zero(line: str, kind: str) -> None:
    with pytest.raises(nsspice.NsspiceError) as caught:
        value(f"{line}\nR9 b 0 1\n.model mm {kind}t_abs=-300)", "v(b)")
    assert [d.code for d in caught.value.diagnostics] == ["NS2005"]


def test_set_valued_diodes_have_no_temperature() -> None:
    assert value("D1 a b mm\nR9 b 0 1\n.model mm d(ideal t_abs=60)", "v(b)") == pytest.approx(1.0)


def test_the_comparison_has_these_temperatures() -> None:
    text = """both
V1 a 0 0.65
R1 a 0 rm 1k
R2 a 0 1k tce=1
D1 a 0 dm
Q1 a a 0 qm
.model rm res(tce=2 t_abs=60)
.model dm d(is=1e-14 t_abs=60)
.model qm npn(is=1e-14 t_abs=60)
.temp 40
.op
.save all alli
"""
    check = ngspice.cross_check(nsspice.read(text), tolerance=1e-4)
    assert check.passed


def test_a_sweep_of_the_temperature_in_the_comparison() -> None:
    circuit = nsspice.read("s\nV1 a 0 1\nR1 a 0 1k tce=1\n.dc temp -40 120 20\n")
    exact = circuit.run()[0]["i(v1)"]
    assert ngspice.run(circuit)["i(v1)"] == pytest.approx(exact, rel=1e-9)
