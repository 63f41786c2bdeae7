"""Current sources that are tables of their own voltage: resistances, exact by pairs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import nsspice
from nsspice.devices.expressions.broken_conductor import BrokenConductor, conduction_of
from nsspice.devices.expressions.broken_line import broken_line
from nsspice.netlist.expressions.expression import Expression

#: a junction as a table: leakage, three pieces of the exponential, and its series resistance
POINTS = [(-900.0, -1e-9), (0.0, 0.0), (0.64, 2e-3), (0.79, 0.063), (0.94, 2.0), (2.0, 30.0)]
VOLTS, AMPERES = (np.array(column) for column in zip(*POINTS, strict=True))
TABLE = "table(v(a,b), " + ", ".join(f"{v:.17g}, {i:.17g}" for v, i in POINTS) + ")"
#: a hundred times what the exact engine leaves of a unit: output, interpolation and reference round
ROUNDING = 1e-11


def line(text: str, own: str = "v(a)"):
    return broken_line(Expression.parse(text).node, {own: 1.0})


def run(text: str, signals: list[str], method: str | None = None) -> nsspice.Solution:
    circuit = nsspice.read(f"t\n{text}\n")
    return nsspice.tran(circuit, signals=signals, method=method)


@pytest.mark.parametrize("low", [-100.0, -0.5, 0.2, 0.7, 1.5])
def test_branches_and_limits_add_up_to_the_table(low: float):
    found = conduction_of(line(TABLE.replace("v(a,b)", "v(a)")))
    assert found is not None
    assert found.limits == ((-900.0, False), (2.0, True))
    total = found.parts.conductance * low
    for pair in found.parts.pairs:
        # the pairs of a table whose slope grows add 1 / R above their offset each
        total += max(low - pair.offset, 0.0) / pair.resistance
    assert total == pytest.approx(float(np.interp(low, VOLTS, AMPERES)), rel=1e-12)


def test_a_flattest_piece_through_the_origin_but_for_rounding():
    """-5e-6 + 80 (5e-6 / 80) is 8e-22, not zero."""
    text = "table(v(a), -80,-5e-06, 0,0, 0.206440146,0.01, 0.300227982,0.316227766, 0.394028549,10)"
    found = conduction_of(line(text))
    assert found is not None
    assert found.parts.conductance == pytest.approx(5e-6 / 80.0, rel=1e-15)
    assert [pair.offset for pair in found.parts.pairs] == [0.0, 0.206440146, 0.300227982]


@pytest.mark.parametrize(
    "text",
    [
        "max(1 - v(a), 0)",  # it falls
        "table(v(a), 0,0, 1,5, 2,6, 3,9)",  # flattest away from the origin
        "max(v(a), 0) + 1",  # a source besides
        "v(a) > 0 ? 1 : 0",  # a jump
        "2*v(a)",  # no kink
    ],
)
def test_other_currents_are_left_to_nodes(text: str):
    assert conduction_of(line(text)) is None


@pytest.mark.parametrize("method", [None, "sdirk", "moreau"])
def test_a_table_behind_a_resistor_is_solved_at_each_instant(method: str | None):
    deck = f"V1 in 0 SIN(0 400 1k)\nR1 in a 20\nB1 a b I={{{TABLE}}}\nV2 b 0 0\n.tran 7u 2m"
    solution = run(deck, ["v(in)", "v(a,b)", "i(b1)"], method)
    for source, v, i in zip(*(solution[n] for n in ("v(in)", "v(a,b)", "i(b1)")), strict=True):
        law = lambda x, source=source: (source - x) / 20.0 - float(np.interp(x, VOLTS, AMPERES))  # noqa: E731
        root = brentq(law, -401.0, 401.0, xtol=1e-14, rtol=9e-16)
        # conducting, the voltage is a difference of terms of 400 V
        assert v == pytest.approx(root, abs=400.0 * ROUNDING)
        assert i == pytest.approx(float(np.interp(root, VOLTS, AMPERES)), abs=20.0 * ROUNDING)


def test_what_blocks_is_known_to_its_own_digits():
    deck = f"V1 a 0 PWL(0 -300 1m -1)\nV2 b 0 0\nB1 a b I={{{TABLE}}}\n.tran 10u 1m"
    solution = run(deck, ["v(a,b)", "i(b1)"])
    leakage = 1e-9 / 900.0 * solution["v(a,b)"]
    # 12 S conduct a volt further on: nodes for each kink would leave picoamperes of rounding
    assert solution["i(b1)"] == pytest.approx(leakage, rel=1e-11)


def test_beyond_the_last_point_the_current_is_constant():
    # 1 uF from 10 V: at 1 A down to 1 V, then exponentially with 1 Ohm
    deck = "C1 a 0 1u IC=10\nB1 a 0 I={table(v(a), -1,-1, 0,0, 1,1)}\n.tran 0.1u 15u uic"
    solution = run(deck, ["v(a)", "i(b1)"])
    time, end = solution.time, 9e-6
    expected = np.where(time < end, 10.0 - 1e6 * time, np.exp(-np.maximum(time - end, 0.0) / 1e-6))
    assert solution["v(a)"] == pytest.approx(expected, abs=10.0 * ROUNDING)
    assert solution["i(b1)"] == pytest.approx(np.minimum(expected, 1.0), abs=10.0 * ROUNDING)
    assert solution.stats["segments"] <= 3


def test_several_in_parallel_and_their_current_as_an_unknown():
    deck = (
        "V1 in 0 SIN(0 3 1k)\nR1 in a 1\nB1 a 0 I={max(v(a)-1, 0)} m=4\n"
        "H1 out 0 b1 2\nR2 out 0 1\n.tran 10u 1m"
    )
    solution = run(deck, ["v(in)", "v(out)"])
    source = solution["v(in)"]
    expected = np.where(source > 1.0, 0.8 * (source - 1.0), 0.0)  # 4 S behind 1 Ohm
    assert solution["v(out)"] == pytest.approx(2.0 * expected, abs=10.0 * ROUNDING)


CHARGE = [(-800.0, -2e-8), (-5.0, -6e-10), (0.0, 0.0), (0.6, 2e-10), (0.9, 4e-9), (2.0, 1e-7)]


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_junction_of_tables_rings_as_its_differential_equation(mirrored: bool):
    """A reverse recovery: current and charge as tables, ringing with an inductance."""
    volts, charges = (np.array(column) for column in zip(*CHARGE, strict=True))
    own, (a, b) = ("v(b,a)", ("b", "a")) if mirrored else ("v(a,b)", ("a", "b"))
    current = TABLE.replace("v(a,b)", own)
    charge = f"table({own}, " + ", ".join(f"{v:.17g}, {q:.17g}" for v, q in CHARGE) + ")"
    deck = (
        f"V1 in 0 PWL(0 20 1u 20 1.1u -20)\nR1 in x 10\nL1 x a 2u\nV2 b 0 0\n"
        f"B1 {a} {b} I={{{current}}}\nC1 {a} {b} Q={{{charge}}}\n.tran 5n 3u"
    )
    if mirrored:
        deck = deck.replace("L1 x a 2u", "L1 x b 2u").replace("V2 b 0 0", "V2 a 0 0")
    solution = run(deck, ["i(l1)", f"v({a},{b})", "i(b1)"])
    assert solution.stats["segments"] > 10  # closed forms between kinks
    assert solution.stats["fixed_steps"] == 0

    def rates(t: float, state: np.ndarray) -> list[float]:
        il, q = state
        v = float(np.interp(q, charges, volts))
        source = float(np.interp(t, [0.0, 1e-6, 1.1e-6], [20.0, 20.0, -20.0]))
        return [(source - 10.0 * il - v) / 2e-6, il - float(np.interp(v, VOLTS, AMPERES))]

    start = [solution["i(l1)"][0], float(np.interp(solution[f"v({a},{b})"][0], volts, charges))]
    exact = solve_ivp(
        rates, (0.0, 3e-6), start, "DOP853", solution.time, rtol=1e-10, atol=1e-18, max_step=1e-9
    )
    v = np.interp(exact.y[1], charges, volts)
    # steps of the reference go across kinks: to a millionth of the range
    assert solution["i(l1)"] == pytest.approx(exact.y[0], abs=1e-6 * np.ptp(exact.y[0]))
    assert solution[f"v({a},{b})"] == pytest.approx(v, abs=1e-6 * np.ptp(v))


def test_it_is_written_as_pairs_only_where_nothing_is_smooth():
    deck = "t\nV1 in 0 SIN(0 3 1k)\nR1 in a 1\nB1 a 0 I={max(v(a)-1, 0)}\n"
    exact = nsspice.read(f"{deck}.tran 1u 1m\n")
    assert isinstance(exact.device("b1"), BrokenConductor)
    smooth = nsspice.read(f"{deck}D1 a 0 DS\n.model DS D(IS=1n)\n.tran 1u 1m\n")
    assert not isinstance(smooth.device("b1"), BrokenConductor)
    low = math.inf
    for circuit in (exact, smooth):
        low = min(low, float(circuit.run(signals=["i(b1)"])[0]["i(b1)"].min()))
    assert low == pytest.approx(0.0, abs=ROUNDING)
