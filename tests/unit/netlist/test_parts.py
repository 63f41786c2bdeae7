"""Standard parts by name, against the limits of data sheets."""

from __future__ import annotations

import pytest

from nsspice import read
from nsspice.netlist import parse_text
from nsspice.netlist.expansion.parts import LIBRARY


def at(lines: str) -> dict[str, float]:
    """The operating point at 25 degrees."""
    run = read(f"part\n{lines}\n.op\n.temp 25\n").run()[0]
    return {name: float(run[name][0]) for name in run.columns}


#: part, current [A], least and largest forward voltage [V] at 25 degrees
FORWARD = [
    # Diotec, 1N4148 / 1N4448 (dtsheet.com/doc/562899); the 1N914 is the same diode
    ("1N4148", 10e-3, 0.0, 1.0),
    ("1N914", 10e-3, 0.0, 1.0),
    ("1N4448", 5e-3, 0.62, 0.72),
    ("1N4448", 0.1, 0.0, 1.0),
    # Wing Shing, 1N4001 - 1N4007 (dtsheet.com/doc/1346528)
    ("1N4001", 1.0, 0.0, 1.0),
    ("1N4007", 1.0, 0.0, 1.0),
    # RFE International, 1N5817 - 1N5819 (dtsheet.com/doc/1313526)
    ("1N5817", 1.0, 0.0, 0.45),
    ("1N5818", 1.0, 0.0, 0.55),
    ("1N5819", 1.0, 0.0, 0.60),
    ("1N5817", 3.0, 0.0, 0.75),
    ("1N5819", 3.0, 0.0, 0.90),
]


@pytest.mark.parametrize(("part", "current", "least", "most"), FORWARD)
def test_forward_voltages(part: str, current: float, least: float, most: float) -> None:
    assert least <= at(f"I1 0 a {current}\nD1 a 0 {part}")["v(a)"] <= most


@pytest.mark.parametrize(
    ("part", "voltage", "current"),
    [
        ("1N4148", 20.0, 25e-9), ("1N4148", 75.0, 5e-6), ("1N4007", 1000.0, 5e-6),
        ("1N5817", 20.0, 1e-3), ("1N5819", 40.0, 1e-3),
    ],
)  # fmt: skip
def test_reverse_currents(part: str, voltage: float, current: float) -> None:
    # largest values of the same sheets; the card of a part in breakdown has just that current
    assert -at(f"V1 a 0 {voltage}\nD1 0 a {part}")["i(v1)"] <= 1.01 * current


@pytest.mark.parametrize(
    ("part", "current", "voltage", "resistance"),
    # Crea-Tek, 1N4728A - 1N4764A; Digitron, 1N4728 - 1N4764: nominal values, largest impedances
    [("1N4733A", 49e-3, 5.1, 7.0), ("1N4733", 49e-3, 5.1, 7.0), ("1N4742A", 21e-3, 12.0, 9.0)],
)
def test_zener_diodes(part: str, current: float, voltage: float, resistance: float) -> None:
    below, above = (at(f"I1 0 a {i}\nD1 0 a {part}")["v(a)"] for i in (current, 1.01 * current))
    assert below == pytest.approx(voltage, rel=0.002)  # of the 5 % that the part itself has
    assert 0.5 * resistance <= (above - below) / (0.01 * current) <= resistance


def test_a_zener_diode_has_the_voltage_of_its_card() -> None:
    card = parse_text("t\nD1 a 0 1N750\nR1 a 0 1").elements[0].model
    assert card is not None
    bv, ibv, rs = (float(card.params[key].value) for key in ("bv", "ibv", "rs"))
    assert at(f"I1 0 a {ibv}\nD1 0 a 1N750")["v(a)"] == pytest.approx(bv + rs * ibv, abs=1e-3)


#: part, collector-emitter voltage [V], and collector current [A] with least and largest gain
GAINS = [
    # onsemi P2N2222A (sheetsdata.com/parts/2N2222), Semelab 2N2222A
    ("2N2222", 10.0, [(1e-4, 35, 1e3), (1e-3, 50, 1e3), (1e-2, 75, 1e3), (0.15, 100, 300)]),
    ("2N2222A", 10.0, [(0.15, 100, 300), (0.5, 40, 1e3)]),
    # Micro Commercial Components 2N3904
    ("2N3904", 1.0, [(1e-4, 40, 1e3), (1e-3, 70, 1e3), (1e-2, 100, 300), (0.05, 60, 1e3),
                     (0.1, 30, 1e3)]),
    # Fairchild BC547, rev. B, 1997: all groups, and group B; NXP BC847BV has the same
    ("BC547", 5.0, [(2e-3, 110, 800)]),
    ("BC547B", 5.0, [(2e-3, 200, 450)]),
]  # fmt: skip
#: transistors that are sold as complements of these
COMPLEMENTS = {"2N2907": "2N2222", "2N2907A": "2N2222A", "2N3906": "2N3904", "BC557": "BC547",
               "BC557B": "BC547B"}  # fmt: skip


@pytest.mark.parametrize(("part", "volts", "gains"), GAINS)
def test_gains(part: str, volts: float, gains: list[tuple[float, float, float]]) -> None:
    twins = [part, *(other for other, of in COMPLEMENTS.items() if of == part)]
    for name in twins:
        sign = 1 if name == part else -1
        for collector, least, most in gains:
            # the largest and the smallest gain give a smaller and a larger current
            for gain, below in ((most, True), (least, False)):
                base = sign * collector / gain
                found = at(f"Vc c 0 {sign * volts}\nI1 0 b {base}\nQ1 c b 0 {name}")
                assert (abs(found["i(vc)"]) <= collector) == below, (name, collector)


@pytest.mark.parametrize(
    ("part", "collector", "base", "across", "least", "most"),
    [
        ("2N2222A", 0.15, 15e-3, 0.3, 0.6, 1.2),
        ("2N2222A", 0.5, 50e-3, 1.0, 0.6, 2.0),
        ("2N3904", 10e-3, 1e-3, 0.2, 0.65, 0.85),
        ("2N3904", 50e-3, 5e-3, 0.3, 0.65, 0.95),
    ],
)
def test_saturation(
    part: str, collector: float, base: float, across: float, least: float, most: float
) -> None:
    # the same sheets
    found = at(f"I1 0 c {collector}\nI2 0 b {base}\nQ1 c b 0 {part}")
    assert 0.0 < found["v(c)"] <= across
    assert least <= found["v(b)"] <= most


def test_base_voltage() -> None:
    # NXP BC847BV: 580 to 700 mV at 2 mA; the BC547B is the same transistor in another case
    found = at("Vc c 0 5\nI1 0 b 6.6u\nQ1 c b 0 BC547B")
    assert found["i(vc)"] == pytest.approx(-2e-3, rel=0.02)
    assert 0.58 <= found["v(b)"] <= 0.70


@pytest.mark.parametrize(
    ("part", "current", "typical", "most"),
    # electronics-notes.com, 2N7000: 1.2 Ohm as a rule, 5 Ohm at most; Wikipedia, BS170: 5 Ohm
    [("2N7000", 0.5, 1.2, 5.0), ("BS170", 0.2, 1.2, 5.0)],
)
def test_on_resistances(part: str, current: float, typical: float, most: float) -> None:
    found = at(f"I1 0 d {current}\nVg g 0 10\nM1 d g 0 {part}")
    assert typical <= found["v(d)"] / current <= most


def test_thresholds() -> None:
    # 2N7000: 1 mA flows at 0.8 to 3 V (electronics-notes.com)
    for gate, flows in ((0.8, False), (3.0, True)):
        found = at(f"Vd d 0 {gate}\nM1 d d 0 2N7000")
        assert (-found["i(vd)"] > 1e-3) == flows


def test_a_power_mosfet_conducts_both_ways() -> None:
    # no sheet of an IRF540 is at hand: the on-resistance of its own card, in both directions
    ahead, back = (at(f"I1 0 d {i}\nVg g 0 10\nM1 d g 0 IRF540")["v(d)"] / i for i in (0.1, -0.1))
    assert ahead == pytest.approx(back, rel=2e-3)
    # drain and source in series with 1/(kp (vgs - vto)) of the channel
    assert ahead == pytest.approx(30e-3 + 3e-3 + 1.0 / (25.0 * 6.5), rel=5e-3)


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
