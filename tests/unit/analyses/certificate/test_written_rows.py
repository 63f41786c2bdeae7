"""Rows that are not those of the deck, and rows that are not those that were computed."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate.copied_rows import CopiedRows
from nsspice.analyses.certificate.node_reach import NodeReach
from nsspice.analyses.certificate.written_rows import WrittenRows, conditions_of
from nsspice.analyses.request.cards import Tran
from nsspice.devices.stamper import Conditions

#: a rectifier and a buck converter: sources, KCL, a diode with resistance, an ideal one, a switch
RECTIFIER = """rectifier
V1 in 0 SIN(0 10 50)
D1 in out d
C1 out 0 100u
R1 out a 50
R2 a 0 50
E1 e 0 a 0 2
R3 e 0 1k
.model d D(Vfwd=0.7 Ron=10m)
.tran 0.2m 40m
"""
BUCK = """buck
V1 in 0 24
V2 g 0 PULSE(0 5 0 1n 1n 4u 10u)
S1 in x g 0 sw
D1 0 x d
L1 x out 10u
C1 out 0 10u
R1 out 0 2
.model sw SW(VT=2.5 VH=0.5 Ron=10m)
.model d D(ideal)
.tran 0.1u 100u uic
"""
#: junctions as broken lines: with resistance, three in parallel without one, one that breaks down
LINES = """rectifier and limiter
V1 in 0 SIN(0 20 50)
D1 in a d
R1 a 0 100
D2 0 b d0 3
R2 b in 20
D3 0 c z dtemp=30
R3 c in 50
.model d D(IS=1n RS=0.1)
.model d0 D(IS=10f)
.model z D(IS=1n RS=1 BV=6 IBV=1m)
.options junctions=lines:0.02
.tran 0.2m 40m
"""
TOLERANCE = 1e-8


def worst(text: str, damage: object = None, method: str = "modewise") -> float:
    """Return the worst error of the rows of a run after some damage."""
    circuit = nsspice.read(text)
    solution = nsspice.tran(circuit, method=method)
    table = np.column_stack([solution.time, *(solution[name] for name in solution.columns)])
    names = ["time", *solution.columns]
    if callable(damage):
        damage(table, names)
    card = Tran.from_card(circuit.deck.analyses[0])
    judge = WrittenRows(circuit, solution.columns, conditions_of(circuit, card, None, None))
    judge.take(table[:50])
    judge.take(table[50:])
    return max(found.error for found in judge.worst())


@pytest.mark.parametrize("text", [RECTIFIER, BUCK, LINES], ids=["rectifier", "buck", "lines"])
@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_rows_of_sound_runs_obey_all_laws(text: str, method: str) -> None:
    assert worst(text, method=method) < TOLERANCE


def scale(name: str, factor: float) -> object:
    """Return a damage: one column times a factor."""

    def damage(table: np.ndarray, names: list[str]) -> None:
        table[:, names.index(name)] *= factor

    return damage


@pytest.mark.parametrize("name", ["v(in)", "v(out)", "v(a)", "v(e)", "i(v1)", "i(d1)"])
def test_a_column_of_the_rectifier_that_is_a_millionth_off(name: str) -> None:
    assert worst(RECTIFIER, scale(name, 1.0 + 1e-6)) > TOLERANCE


@pytest.mark.parametrize("name", ["v(in)", "v(g)", "i(v1)", "i(s1)", "i(d1)", "i(l1)"])
def test_a_column_of_the_buck_that_is_a_millionth_off(name: str) -> None:
    assert worst(BUCK, scale(name, 1.0 + 1e-6)) > TOLERANCE


@pytest.mark.parametrize(("node", "ohms"), [("a", -100.0), ("b", 20.0), ("c", 50.0)])
def test_a_current_that_obeys_kirchhoff_but_not_the_broken_line(node: str, ohms: float) -> None:
    diode = f"i(d{1 + 'abc'.index(node)})"

    def damage(table: np.ndarray, names: list[str]) -> None:
        # v(node) is off by what its resistor has from the current of the diode
        change = 1e-6 * table[:, names.index(diode)]
        table[:, names.index(diode)] += change
        table[:, names.index(f"v({node})")] -= ohms * change
        table[:, names.index("i(v1)")] += change * (1.0 if ohms > 0.0 else -1.0)

    assert worst(LINES, damage) > TOLERANCE


def test_one_value_of_one_row() -> None:
    def damage(table: np.ndarray, names: list[str]) -> None:
        table[77, names.index("i(d1)")] -= 1e-5

    assert worst(BUCK, damage) > TOLERANCE


def test_times_that_are_late() -> None:
    def damage(table: np.ndarray, names: list[str]) -> None:
        table[1:-1, 0] += 1e-6

    assert worst(RECTIFIER, damage) > TOLERANCE


def test_a_switch_that_is_late_by_a_row() -> None:
    def damage(table: np.ndarray, names: list[str]) -> None:
        column = names.index("v(g)")
        table[1:, column] = table[:-1, column].copy()

    assert worst(BUCK, damage) > TOLERANCE


class Told:
    """A stepper that tells of some rows."""

    def __init__(self, rows: np.ndarray, references: np.ndarray, made_of: np.ndarray) -> None:
        weights = 1.0 + np.arange(rows.shape[0]) % 8 / 8
        expected = weights @ made_of[:, 1:]
        self.written = rows.shape[0], weights @ rows, weights @ np.abs(rows), expected
        self._references = references

    def take_references(self) -> np.ndarray:
        """Return them once."""
        found, self._references = self._references, self._references[:0]
        return found


def copied(rows: np.ndarray, table: np.ndarray, made_of: np.ndarray | None = None) -> float:
    """Return the error of a table beside rows of a current and a voltage that were computed."""
    stepper = Told(rows, rows[::4].copy(), rows if made_of is None else made_of)
    reach = NodeReach([], Conditions())
    copies = CopiedRows(stepper, 1, ["i(d)", "v(n)"], reach)  # type: ignore[arg-type]
    for block in np.array_split(table, 3):
        copies.take(block)
    return copies.worst().error


def test_what_is_written_is_what_was_computed() -> None:
    time = np.linspace(0.0, 1.0, 40)
    rows = np.column_stack([time, np.sin(time), 1e3 * np.cos(time)])
    assert copied(rows, rows) < 1e-14
    late, swapped, stale, alone = (rows.copy() for _ in range(4))
    late[1:, 1:] = rows[:-1, 1:]
    swapped[:, 1:] = rows[:, :0:-1]
    stale[37, 1:] = rows[36, 1:]
    alone[5, 2] *= 1.0 + 1e-5
    for table in (late, swapped, stale, alone, rows[:-1]):
        assert copied(rows, table) > TOLERANCE
    # rows that are written as they were computed, but not from the unknowns of the engine
    wrong = rows.copy()
    wrong[6, 1] *= 1.0 + 1e-5
    assert copied(rows, rows, made_of=wrong) > TOLERANCE
    zero = rows.copy()
    zero[:, 1] = 0.0
    assert copied(zero, zero, made_of=rows) > TOLERANCE
    # rows in another order have the same values, but not the same weights
    assert copied(rows, rows[::-1]) > TOLERANCE


def test_rounding_at_a_node_reaches_as_far_as_its_resistances() -> None:
    circuit = nsspice.read(RECTIFIER)
    reach = NodeReach(circuit.devices, Conditions())
    # 50 Ohm and 10 mOhm meet at `out`, 50 and 50 Ohm at `a`, 10 mOhm at `in`
    assert reach.at(["out"]) == pytest.approx((50.0, 100.0 + 1.0 / 50.0))
    text = RECTIFIER.replace("R1 out a", "C2 out x 1u\nR1 x a")
    joined = NodeReach(nsspice.read(text).devices, Conditions())
    assert joined.at(["x"]) == pytest.approx((50.0, 100.0))
    assert reach.at(["a", "0"]) == pytest.approx((50.0, 2.0 / 50.0))
    ohms, siemens = reach.of_columns(["v(a)", "i(d1)", "i(e1)"])
    assert ohms == pytest.approx([50.0, 50.0, 1000.0])
    assert siemens == pytest.approx([0.04, 100.02, 1e-3])
    assert reach.conductance == pytest.approx(1.0 / 50.0)


#: rows at the zeros of the only source: what is left is rounding of an amplitude that no row shows
AT_ZEROS = """static rectifier
V1 a 0 SIN(0 1 100k)
D1 a b
R1 b 0 1
.tran 10u 1m
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_rows_at_zeros_are_measured_by_the_amplitude(method: str) -> None:
    assert nsspice.tran(nsspice.read(AT_ZEROS), method=method).certificate.passed

    def damage(table: np.ndarray, names: list[str]) -> None:
        table[7, names.index("i(d1)")] = -1e-7

    assert worst(AT_ZEROS, damage) > TOLERANCE
