"""Decks with smooth laws through all analyses, against closed forms."""

import math

import numpy as np
import pytest

import nsspice

ARGSINH = """argsinh resistor and a practical diode of 1 V
V1 a 0 SIN(0 4 0.15915494309189535)
B1 a b I={sinh(v(a,b))}
D1 b 0 practical
.model practical D(Vfwd=1 Vrev=1)
.tran 0.01 10
.dc V1 -4 4 0.25
"""

JUNCTION = """half-wave rectifier with a smooth junction
V1 a 0 SIN(0 5 1k)
B1 a b I={1e-14*(exp(v(a,b)/0.025852)-1)}
R1 b 0 1k
.tran 10u 2m
"""


def test_argsinh_resistor_behind_a_practical_diode_is_solved_point_by_point():
    tran, dc = nsspice.read(ARGSINH).run()
    for solution, p in ((tran, 4.0 * np.sin(tran.time)), (dc, np.linspace(-4.0, 4.0, 33))):
        exact = np.where(p > 1, np.sinh(p - 1), np.where(p < -1, np.sinh(p + 1), 0.0))
        # residuals up to 1e-14 of 4 V, at the slope cosh(3) = 10 of the law
        assert np.abs(-solution["i(v1)"] - exact).max() < 4e-13
        assert solution.certificate.passed
    assert tran.islands[0].problem_class == "GE"


def test_functions_of_time_stand_still_in_a_sweep():
    """In a .dc sweep the time is 0, not the number of the point."""
    (solution,) = nsspice.read(
        "time\nV1 a 0 1\nB1 b 0 V={v(a) + time}\nR1 b 0 1\n.dc V1 1 5 1\n"
    ).run()
    assert solution["v(b)"].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]


def test_a_junction_holds_its_law_at_every_row():
    (solution,) = nsspice.read(JUNCTION).run()
    v = solution["v(a,b)"]
    law = 1e-14 * np.expm1(np.minimum(v, 1.0) / 0.025852)
    assert np.abs(law - solution["v(b)"] / 1e3).max() < 1e-12
    assert solution["v(b)"].max() == pytest.approx(4.28, abs=0.05)  # one drop below the peak


def test_averaging_is_refused_by_name():
    circuit = nsspice.read(JUNCTION + "C1 b 0 1u\n")
    with pytest.raises(nsspice.NsspiceError) as error:
        nsspice.tran(circuit, theta=0.5)
    assert error.value.code == "NS2063"
    assert "b1" in str(error.value)


@pytest.mark.parametrize(
    ("cards", "node", "expected"),
    [
        ("R1 a 0 1k\nI1 0 a 1m\nB1 b 0 V={1/v(a)}\nR2 b 0 1k\n", "v(b)", 1.0),
        ("V1 a 0 2\nB1 b 0 V={1/v(a)}\nR2 b 0 1k\n", "v(b)", 0.5),
        # (2 - v) / 1k = (v - 1/v) / 1k
        ("V1 i 0 2\nR1 i a 1k\nB1 b 0 V={1/v(a)}\nR2 b a 1k\n", "v(a)", (1 + 3**0.5) / 2),
        # the edge of a domain beside the pole, and a long way up an exponential behind it
        ("V1 a 0 10\nB1 b 0 V={sqrt(v(a)) + 1/v(a)}\n", "v(b)", 10**0.5 + 0.1),
        ("V1 a 0 10\nB1 b 0 V={exp(v(a))}\nB2 c 0 V={1/v(a)}\n", "v(b)", math.exp(10)),
    ],
)
def test_a_pole_where_the_search_begins_is_passed(cards, node, expected):
    solution = nsspice.read(f"pole at zero\n{cards}.op\n").run()[0]
    assert solution[node] == pytest.approx(expected, rel=1e-12)


def test_a_deck_without_a_solution_names_the_law():
    """No real v has v^2 + 1 = 0."""
    circuit = nsspice.read("no root\nB1 a 0 I={v(a)*v(a) + 1}\nR1 a 0 1e12\n.op\n")
    with pytest.raises(nsspice.NsspiceError) as error:
        circuit.run()
    assert error.value.code == "NS3004"
    assert "node a" in str(error.value)
    assert "b1" in str(error.value)


@pytest.mark.parametrize("method", ["moreau", "sdirk"])
def test_a_circuit_at_rest_needs_no_search_for_its_first_state(method):
    """All sources begin at zero: with nothing to compare with, rounding looked like no solution."""
    circuit = nsspice.read(
        "doubler\nV1 in 0 SIN(0 10 1k)\nC1 in a 1u IC=0\nD1 0 a j\nD2 a out j\nC2 out 0 1u IC=0\n"
        "R1 out 0 100k\n.model j D(IS=1e-14)\n.tran 2u 20u 0 2u uic\n"
    )
    solution = nsspice.tran(circuit, method=method)
    assert solution.stats["worst_stage"] <= 1
    assert np.abs(solution["v(out)"][0]) == 0.0
