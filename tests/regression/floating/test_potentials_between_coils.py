"""Rows at corners of sources: potentials that only the rates of currents determine.

Between two coils in series, with a resistor or a capacitor between them, Kirchhoff's law ties the
currents, and the potentials are what makes their rates equal.  Steps that are short beside the
fastest time constant (5 mOhm and 10 pF here) leave nothing of them but the rounding of fluxes:
57 uH and 5 A are known to 3e-20 V s, which over 5e-20 s is half a volt.  The references are those
of the exact engine, with an ideal diode that blocks all the time.
"""

import numpy as np
import pytest
from decks import random_converters

import nsspice

DECK = """{title}
V1 a 0 PULSE(0 10 1u 10n 10n 5u 20u)
L1 a b 27u
{network}
R9 a y 5m
C9 y 0 10p
.model d D({model})
.tran 10n 9u
"""

NETWORKS = {
    "resistor": "R1 b c 10m\nL2 c d 165u\nR2 d 0 20\nD1 0 d d",
    "capacitor": "C1 b c 0.9u\nL2 c d 165u\nR2 d 0 20\nD1 0 d d",
    "transformer": "C1 b c 0.9u\nL2 c 0 165u\nL3 e 0 165u\nK1 L2 L3 0.98\nR2 e 0 20\nD1 0 a d",
}

RELTOL = 1e-7
#: of 10 V: the errors of two hundred steps
TOLERANCE = 200.0 * RELTOL


def run(network: str, model: str, **settings: object) -> nsspice.Solution:
    deck = DECK.format(title=network, network=NETWORKS[network], model=model)
    return nsspice.tran(nsspice.read(deck), **settings)


@pytest.mark.parametrize("model", ["ideal", "IS=1e-14", "IS=1e-12 RS=10m"])
@pytest.mark.parametrize("network", NETWORKS)
def test_potentials_at_corners_are_those_of_the_laws(network: str, model: str) -> None:
    exact = run(network, "ideal", method="modewise")
    solution = run(network, model, method="sdirk", reltol=RELTOL)
    assert solution.certificate is not None
    assert solution.certificate.passed
    for node in ("v(b)", "v(c)"):
        assert np.abs(solution[node] - exact[node]).max() <= TOLERANCE * 10.0


def test_one_instant_does_not_blind_the_guards() -> None:
    """A potential of 6e11 V at a corner, and switches opened late: at the ends of their edges.

    Currents of the converter were wrong by 40 % at every tolerance, and certified.
    """
    deck = random_converters.converter(3, True).replace(" 2.9918e-05", " 9.75e-06")
    solution = nsspice.tran(nsspice.read(deck), reltol=1e-5)
    assert solution.certificate is not None
    assert solution.certificate.passed
    assert max(np.abs(solution[name]).max() for name in solution.signals if name[0] == "v") < 1e3
    delay, period, edge, width = 2.49523e-6, 2.99178e-6, 2.99178e-8, 1.16679e-6
    opened = [e.time for e in solution.events if (e.element, e.change) == ("s65", "off")]
    # from 5 V down to 2 V in three fifths of the edge
    expected = delay + edge + width + 0.6 * edge + period * np.arange(3)
    assert np.abs(np.array(opened) - expected).max() <= 1e-9 * period


@pytest.mark.parametrize("seed", [10_127, 10_161, 10_213])
def test_the_first_row_has_them_where_no_current_flows_yet(seed: int) -> None:
    """Currents of kiloamperes in closed switches have rounding enough for volts (8 % of 18 V)."""
    circuit = nsspice.read(random_converters.converter(seed, smooth=False))
    exact = nsspice.tran(circuit, method="modewise")
    stepped = nsspice.tran(circuit, method="sdirk", reltol=1e-6)
    assert stepped.certificate is not None
    assert stepped.certificate.passed, stepped.certificate
    volts = [name for name in exact.signals if name.startswith("v(")]
    size = max(abs(exact[name][0]) for name in volts)
    for name in volts:
        # the mean of two short steps at the first instant, and their curvature
        assert abs(stepped[name][0] - exact[name][0]) < 1e-6 * size, name
