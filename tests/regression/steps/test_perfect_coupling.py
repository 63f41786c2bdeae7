"""Perfectly coupled inductors (k = 1) with ideal rectifiers: error control ends, and is right.

In a short step `L/h` of a part without a path to ground, whose modes leave its potential open,
hides the ratio of the voltages: the nearest point to a solution let one rectifier carry all of the
current of two until the charges contradicted each other, and steps of femtoseconds followed.  A
longer step tells.
"""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from decks.random_events import perfect_transformer

import nsspice

#: part of the largest voltage: a step errs by 1e-5 of it, and a hundred steps of one sign by this
ERROR = 1e-3

TWO_RECTIFIERS = """\
two secondaries, one of them without a path to ground
V1 p 0 SIN(0 10 719424.4604316547)
R1 p p1 0.283
L0 p1 0 4.86e-06
L1 s1a 0 1.215e-06
K01 L0 L1 1.0
D1 s1a o1 DI
C1 o1 0 2.1e-06 IC=0
RL1 o1 0 1.59
L2 s2a s2b 4.86e-06
K02 L0 L2 1.0
K12 L1 L2 1.0
D2 s2a o2 DV
C2 o2 s2b 5.76e-07 IC=0
RL2 o2 s2b 6.31
.model DI D(ideal)
.model DV D(Vfwd=0.7)
.tran 0.1069u 4.17u uic
.end
"""


def _check(deck: str) -> None:
    circuit = nsspice.read(deck)
    stop = circuit.deck.analyses[0].tstop
    exact, found = (
        nsspice.tran(circuit, stop=stop, step=stop / 200, method=method)
        for method in ("modewise", "sdirk")
    )
    # a run that crawls takes a hundred thousand steps
    assert found.stats["steps"] < 20_000

    def voltage(solution: nsspice.Solution, ends: list[str]) -> np.ndarray:
        levels = [0.0 if node == "0" else solution[f"v({node})"] for node in ends]
        return np.asarray(levels[0] - levels[1])

    loads = [line.split()[1:3] for line in deck.splitlines()[1:] if line[0] in "CR"]
    for ends in loads:
        wanted, got = voltage(exact, ends), voltage(found, ends)
        # up to three output points may lie beside a jump
        worst = np.sort(np.abs(wanted - got))[-4]
        assert worst <= ERROR * max(np.abs(wanted).max(), 1e-9), ends


def test_two_rectifiers() -> None:
    _check(TWO_RECTIFIERS)


@pytest.mark.parametrize("seed", range(24))
def test_random_transformers(seed: int) -> None:
    _check(perfect_transformer(Random(seed)))


@pytest.mark.soak
def test_many_transformers() -> None:
    for seed in range(1000, 2000):
        _check(perfect_transformer(Random(seed)))
