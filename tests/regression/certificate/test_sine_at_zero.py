"""The zero of a sine is no measure of a circuit: certificates of runs that end there hold.

Potentials that no source gives were called unknown.  Where all sources are zero but for the
rounding of pi, the thresholds of diodes give potentials of a volt, which were judged by 2.8e-14 V.
"""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from decks.random_events import zener_chain

import nsspice

METHODS = ("modewise", "moreau", "sdirk")

CHAIN = """\
diodes with thresholds at the end of three periods
V1 in 0 SIN(0.0 10.0 26881.720430107525)
R1 in z0 2181.0
D0 z0 z1 DZ
D1 z2 z1 DI
RB1 z2 z1 34400.0
D2 z2 z3 DZ
RB2 z3 z2 19500.0
D3 0 z3 DZ2
.model DI D(ideal)
.model DZ D(Vfwd=0.6 Vrev=4.7)
.model DZ2 D(Vfwd=0.7 Vrev=3.3 Ron=0)
.tran 2.861538461538462e-06 0.0001116 uic
.end
"""


def _at_zero(rng: Random) -> str:
    """Return a chain of diodes behind a sine that ends at zero, most without storage."""
    lines = zener_chain(rng).splitlines()
    amplitude, frequency = lines[1].split()[4:6]
    lines[1] = f"V1 in 0 SIN({rng.choice(['0', '0', '1e-13'])} {amplitude} {frequency})"
    if rng.random() < 0.7:
        lines = [line for line in lines if line[0] != "C"]
    stop = rng.choice([0.5, 1.0, 1.5]) / float(frequency)
    start = rng.choice(["", "uic"])
    lines[-2] = f".tran {stop / rng.choice([8, 10, 13]):.17g} {stop:.17g} {start}"
    return "\n".join(lines) + "\n"


def _run(deck: str, method: str) -> nsspice.Solution:
    circuit = nsspice.read(deck)
    card = circuit.deck.analyses[0]
    return nsspice.tran(circuit, stop=card.tstop, step=card.tstep, method=method)


@pytest.mark.parametrize("method", METHODS)
def test_sine_at_zero(method: str) -> None:
    solution = _run(CHAIN, method)
    assert solution.certificate.passed
    # D0 and D2 block between their thresholds: nothing flows but rounding of 10 V in kiloohms
    assert abs(solution["i(v1)"][-1]) <= 1e-16 * 10.0
    assert np.abs(solution["v(z0)"][-1]) <= 1e-13


@pytest.mark.parametrize("seed", [*range(24), 65, 68, 106, 131])
def test_random_chains_at_zero(seed: int) -> None:
    deck = _at_zero(Random(seed))
    assert [m for m in METHODS if not _run(deck, m).certificate.passed] == []
