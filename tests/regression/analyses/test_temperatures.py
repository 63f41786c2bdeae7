"""Values that are computed from ``temper`` follow a swept temperature; AC resistances."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.errors import NsspiceError

DECK = """a resistor of 1000 + temper, one of a model, a diode current that doubles every 10 K
V1 a 0 5
R1 a 0 {1000 + temper}
R2 a 0 m
V2 b 0 -1
D1 b 0 d area={2**(temper/10)}
.model m r r={2000 - temper}
.model d d is=1n eg=0 xti=0
"""


def test_a_sweep_of_the_temperature() -> None:
    (solution,) = nsspice.run(nsspice.read(DECK + ".dc temp -20 80 20\n"))
    t = np.arange(-20.0, 81.0, 20.0)
    expected = -5.0 / (1000.0 + t) - 5.0 / (2000.0 - t)
    assert solution["i(v1)"] == pytest.approx(expected, rel=1e-14)
    leak = solution["i(v2)"]
    # exp(-1 V/vt) is 5e-15 at 80 degrees
    assert leak / leak[0] == pytest.approx(2.0 ** ((t + 20.0) / 10.0), rel=1e-13)


def test_steps_of_the_temperature_beside_a_sweep() -> None:
    runs = nsspice.run(nsspice.read(DECK + ".temp 0 50\n.dc V1 1 2 1\n"))
    for run, t in zip(runs, (0.0, 50.0), strict=True):
        conductance = 1.0 / (1000.0 + t) + 1.0 / (2000.0 - t)
        assert run["i(v1)"] == pytest.approx([-conductance, -2.0 * conductance], rel=1e-14)


def test_a_resistance_for_small_signals() -> None:
    """As ngspice's test ``ac-resistance``: 4 kOhm instead of 1 kOhm, beside 4 kOhm and 1 nF."""
    circuit = nsspice.read("""two resistances
V1 a 0 DC 5 AC 3
R1 a b 1k ac=4k
R2 b 0 4k
C1 b 0 1n
.tf v(b) V1
""")
    assert nsspice.op(circuit)["v(b)"][0] == pytest.approx(4.0, rel=1e-15)
    f = np.array([1e3, 1e5])
    found = nsspice.ac(circuit, f)["v(b)"]
    assert found == pytest.approx(1.5 / (1.0 + 2j * np.pi * f * 2e-6), rel=1e-14)
    assert nsspice.run(circuit)[0]["transfer_function"][0] == pytest.approx(0.8, rel=1e-14)


def test_no_resistance_on_one_side() -> None:
    circuit = nsspice.read("short\nV1 a 0 AC 1\nR1 a b 0 ac=1\nR2 b 0 1\n")
    with pytest.raises(NsspiceError) as error:
        nsspice.ac(circuit, [1.0])
    assert error.value.code == "NS4020"
