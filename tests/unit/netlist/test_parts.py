"""Standard parts by name, against typical values of data sheets."""

from __future__ import annotations

import pytest

from nsspice import read
from nsspice.netlist import parse_text
from nsspice.netlist.expansion.parts import LIBRARY


def at(lines: str) -> dict[str, float]:
    """The operating point at 25 degrees."""
    run = read(f"part\n{lines}\n.op\n.temp 25\n").run()[0]
    return {name: float(run[name][0]) for name in run.columns}


@pytest.mark.parametrize(
    ("part", "current", "voltage"),
    [
        ("1N4148", 1e-3, 0.60), ("1N4148", 1e-2, 0.71), ("1N4148", 0.1, 0.87),
        ("1N4007", 1e-3, 0.60), ("1N4007", 1.0, 0.93),
        ("1N5819", 0.1, 0.35), ("1N5819", 1.0, 0.45),
    ],
)  # fmt: skip
def test_forward_voltages(part: str, current: float, voltage: float) -> None:
    # the values of the data sheets are read off logarithmic figures, to 10 mV at best
    assert at(f"I1 0 a {current}\nD1 a 0 {part}")["v(a)"] == pytest.approx(voltage, abs=0.01)


@pytest.mark.parametrize(
    ("part", "current", "voltage", "resistance"),
    [("1N750", 20e-3, 4.7, 19.0), ("1N4733A", 49e-3, 5.1, 7.0), ("1N4742A", 21e-3, 12.0, 9.0)],
)
def test_zener_diodes(part: str, current: float, voltage: float, resistance: float) -> None:
    below, above = (at(f"I1 0 a {i}\nD1 0 a {part}")["v(a)"] for i in (current, 1.01 * current))
    assert below == pytest.approx(voltage, rel=0.01)  # of the 5 % that the part itself has
    assert (above - below) / (0.01 * current) == pytest.approx(resistance, rel=0.05)


@pytest.mark.parametrize(
    ("part", "collector", "gain", "base"),
    [
        ("2N2222", 10e-3, 180, 0.68), ("2N2222A", 150e-3, 130, None),
        ("2N2907", 10e-3, 180, 0.68), ("2N3904", 10e-3, 180, 0.70), ("2N3904", 100e-3, 80, None),
        ("2N3906", 10e-3, 180, 0.70), ("BC547", 2e-3, 280, 0.66), ("BC557", 2e-3, 280, 0.66),
    ],
)  # fmt: skip
def test_gains(part: str, collector: float, gain: float, base: float | None) -> None:
    sign = -1 if part in ("2N2907", "2N3906", "BC557") else 1
    lines = f"Vc c 0 {5 * sign}\nI1 0 b {sign * collector / gain}\nQ1 c b 0 {part}"
    found = at(lines)
    # gains of a type spread by a factor of three: 15 % is within what one sheet says of typical
    assert abs(found["i(vc)"]) == pytest.approx(collector, rel=0.15)
    if base is not None:
        assert sign * found["v(b)"] == pytest.approx(base, abs=0.01)


@pytest.mark.parametrize(
    ("part", "current", "resistance"), [("2N7000", 0.5, 1.8), ("IRF540", 17.0, 0.040)]
)
def test_on_resistances(part: str, current: float, resistance: float) -> None:
    found = at(f"I1 0 d {current}\nVg g 0 10\nM1 d g 0 {part}")
    assert found["v(d)"] / current == pytest.approx(resistance, rel=0.05)


def test_cards_of_the_deck_go_first_and_the_library_is_told() -> None:
    own = parse_text("t\nD1 a 0 1N4148\n.model 1N4148 D(is=1f)\nR1 a 0 1").elements[0].model
    assert own is not None
    assert own.params["is"].value == 1e-15
    (warning,) = parse_text("t\nX1 a s\n.subckt s p\nD1 p 0 1n4148\n.ends").warnings
    assert warning.code == "NS1098"


def test_every_part_can_be_used() -> None:
    for line in LIBRARY.read_text().splitlines():
        if not line.startswith(".model"):
            continue
        _, name, kind = line.split()[:3]
        nodes = {"D": "D1 a 0", "N": "Q1 a b 0", "P": "Q1 a b 0", "V": "M1 a b 0"}[kind[0]]
        read(f"t\nV1 a 0 1\nV2 b 0 1\n{nodes} {name}\n.op\n")
