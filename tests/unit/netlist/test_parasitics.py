"""Rser, Lser, Rlshunt, Rpar and Cpar on element lines: the elements that they mean."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.errors import NetlistError

#: both decks are the same equations, solved exactly but for rounding in another order
ROUNDING = 1e-10


def both(short: str, drawn: str, signals: list[str], cards: str) -> None:
    """Check that a deck with parasitics has the waveforms of one in which they are drawn."""
    one, two = (
        nsspice.read(f"t\n{text}\n{cards}\n").run(signals=signals)[0] for text in (short, drawn)
    )
    for name in signals:
        scale = np.abs(two[name]).max()
        assert scale > 0.0
        assert one[name] == pytest.approx(two[name], rel=0.0, abs=ROUNDING * scale)


def test_a_coil_with_all_of_them():
    both(
        "V1 a 0 PULSE(0 5 0 1u 1u 30u 60u)\nL1 a b 1m Rser=2 Rpar=10k Cpar=3n\nR1 b 0 50",
        "V1 a 0 PULSE(0 5 0 1u 1u 30u 60u)\nRs a x 2\nL1 x b 1m\nRp a b 10k\nCp a b 3n\nR1 b 0 50",
        ["v(b)", "i(l1)"],
        ".tran 1u 100u",
    )


def test_a_capacitor_with_all_of_them():
    both(
        "V1 a 0 PULSE(0 5 0 1u 1u 30u 60u)\nR1 a b 5\n"
        "C1 b 0 1u m=2 Rser=1 Lser=1u Rlshunt=7 Rpar=90 Cpar=20n",
        "V1 a 0 PULSE(0 5 0 1u 1u 30u 60u)\nR1 a b 5\nRs b x .5\nLs x y .5u\nRl x y 3.5\n"
        "C1 y 0 2u\nRp b 0 45\nCp b 0 40n",
        ["v(b)", "i(c1)"],
        ".tran 1u 100u",
    )


def test_sources_have_an_inner_resistance():
    both(
        "V1 a 0 PULSE(0 5 0 1u 1u 30u 60u) Rser=3 Cpar=1u\nI1 0 b 1 Rpar=5\nR1 a b 10",
        "V1 x 0 PULSE(0 5 0 1u 1u 30u 60u)\nRs x a 3\nCp a 0 1u\nI1 0 b 1\nRp b 0 5\nR1 a b 10",
        ["v(a)", "v(b)", "i(v1)"],
        ".tran 1u 100u",
    )


def test_coupled_coils_keep_their_coupling():
    lines = "V1 a 0 SIN(0 1 10k)\n{}\n{}\nK1 L1 L2 0.9\nR1 b 0 20"
    both(
        lines.format("L1 a 0 1m Rser=5", "L2 b 0 2m Rser=3"),
        lines.format("R5 a x 5\nL1 x 0 1m", "R3 b y 3\nL2 y 0 2m"),
        ["v(b)", "i(l1)", "i(l2)"],
        ".tran 10u 1m",
    )


def test_initial_conditions_are_those_of_the_element_itself():
    text = "L1 a 0 1m ic=2 Rser=4\nR1 a 0 6\nC1 b 0 1u ic=3 Rser=10\nR2 b 0 20\n.tran 10u 200u uic"
    solution = nsspice.read(f"t\n{text}\n").run(signals=["i(l1)", "v(b)"])[0]
    time = solution.axis
    assert solution["i(l1)"] == pytest.approx(2 * np.exp(-time * 10 / 1e-3), rel=1e-9)
    assert solution["v(b)"] == pytest.approx(2 * np.exp(-time / 30e-6), rel=1e-9)


def test_at_dc_a_coil_is_its_resistance():
    solution = nsspice.read("t\nV1 a 0 6\nL1 a 0 1m Rser=2\n.op\n").run()[0]
    assert float(solution["i(l1)"][0]) == pytest.approx(3.0, rel=1e-14)


def test_values_may_be_parameters_and_zero_means_none():
    circuit = nsspice.read(
        "t\n.param r=2\nL1 a 0 1m Rser={r/2} Rpar=0 Cpar=0\n"
        "C1 a 0 1u Rser=r Rlshunt=3\nR1 a 0 1\n.op\n"
    )
    assert "connected across lser" in circuit.warnings[0].message
    names = ["l1", "l1.rser", "c1", "c1.rser", "r1"]
    assert [d.name for d in circuit.devices] == names
    assert circuit.device("l1.rser").at(circuit.islands[0].defaults) == 1.0
    assert circuit.default_signals() == ["v(a)", "i(l1)"]


def test_lines_of_a_catalogue_are_read():
    circuit = nsspice.read(
        't\nL1 a b 10u Ipk=3 Rser=0.05 Rpar=5k Cpar=2p mfg="Coilcraft" pn="DO3316P-103"\n'
        'C1 b 0 220u V=16 Irms=2 Rser=0.035 Lser=0 mfg="Nichicon" type="Al electrolytic" ppPkg=1\n'
        "V1 a 0 1\nR1 b 0 1 tol=1 pwr=0.1\n.op\n"
    )
    assert not circuit.warnings
    found = [d.name for d in circuit.devices]
    assert found == ["l1", "l1.rser", "l1.rpar", "l1.cpar", "c1", "c1.rser", "v1", "r1"]


def test_parts_may_be_named():
    text = "X1 a s\n.subckt s p\nL1 p 0 1m Rser=1 Rpar=8\n.ends\nV1 a 0 4\n.op"
    card = ".save i(x1.l1.rser) i(x1.l1.rpar) v(x1.l1#rser)"
    solution = nsspice.read(f"t\n{text}\n{card}\n").run()[0]
    found = [float(solution[name][0]) for name in solution.columns]
    assert found == pytest.approx([4.0, 0.5, 0.0], abs=1e-14)


@pytest.mark.parametrize(
    ("line", "code", "word"),
    [
        ("L1 a 0 1m Rser=foo", "NS1010", "l1: rser=foo is not a number"),
        ("L1 a 0 1m Rsr=1", "NS1014", "did you mean rser?"),
        ("C1 a 0 1u Cpar=-1p", "NS2005", "c1.cpar has the capacitance -1e-12 F"),
    ],
)
def test_wrong_ones(line: str, code: str, word: str):
    with pytest.raises(NetlistError) as caught:
        nsspice.read(f"t\n{line}\nR1 a 0 1\n.op\n")
    assert caught.value.code == code
    assert word in str(caught.value)
    assert caught.value.diagnostics[0].span.line == 2
