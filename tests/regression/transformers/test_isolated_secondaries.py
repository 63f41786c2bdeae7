"""Secondaries of ideal transformers whose capacitors hang on a large resistance.

In a step of a picosecond 100 uF is E/h = 1e8 S, the tie of 1 GOhm 1 nS: one rounding of the former
is more than all of the latter, so that the potential of the secondary was rounding, and grew by a
factor in every step.  In the sum of the laws of the secondary nothing is stored, and nothing that
conducts inside is left: its potential is known whatever the tie.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.ideal_transformer import IDEAL_TRANSFORMER

import nsspice

SECONDARY = (
    "Ideal transformer, two capacitors and a load behind it\n"
    + IDEAL_TRANSFORMER
    + """C1 u w 100u
C2 s w {c2}
R3 w n 10
R4 n 0 {tie}
.tran {tran} uic
"""
)
#: a smooth law in a corner of its own makes the circuit one for Newton's method
SMOOTH = "DX p dd dm\nRX dd 0 1k\n.model dm D(IS=1e-14)\n.tran"
CASES = [
    (tie, c2, tran)
    for tie in (900e6, 5e9, 20e9, 1e12)
    for c2, tran in (
        ("1p", "1u 1m"),
        ("1n", "1u 1m"),
        ("1p", "10n 10u"),
        ("1n", "10n 10u"),
        ("1p", "0.1n 50n"),
    )
]
RELTOL = 1e-5  # the default
EPS = float(np.finfo(float).eps)


def errors(run: nsspice.Solution, exact: nsspice.Solution) -> tuple[float, float]:
    """Of the voltage of C1 and of the potential of the secondary, as parts of the largest."""

    def part(of: str, minus: str | None) -> float:
        a, b = ((r[of] - r[minus]) if minus else r[of] for r in (run, exact))
        return float(np.abs(a - b).max() / np.abs(b).max())

    return part("v(u)", "v(w)"), part("v(s)", None)


@pytest.mark.parametrize("smooth", [False, True], ids=["linear", "smooth"])
@pytest.mark.parametrize(("tie", "c2", "tran"), CASES)
def test_the_secondary_stays_where_it_is(tie: float, c2: str, tran: str, smooth: bool) -> None:
    text = SECONDARY.format(tie=tie, c2=c2, tran=tran)
    exact = nsspice.tran(nsspice.read(text), method="modewise")
    circuit = nsspice.read(text.replace(".tran", SMOOTH) if smooth else text)
    run = nsspice.tran(circuit, method="sdirk")
    assert run.certificate.passed
    capacitor, potential = errors(run, exact)
    assert capacitor <= RELTOL
    assert potential <= RELTOL
    # nothing but the tie leads out of it
    assert np.abs(run["v(n)"]).max() <= np.abs(run["v(s)"]).max() * EPS
    assert np.abs(exact["v(n)"]).max() <= np.abs(exact["v(s)"]).max() * EPS


@pytest.mark.parametrize("smooth", [False, True], ids=["linear", "smooth"])
@pytest.mark.parametrize("tie", [300e6, 5e9, 1e12])
def test_fixed_steps(tie: float, smooth: bool) -> None:
    """The steps err alike, whatever the tie."""
    ends = []
    for value in (1e6, tie):
        text = SECONDARY.format(tie=value, c2="1p", tran="0.1n 50n")
        text = text.replace(".tran", SMOOTH) if smooth else text
        run = nsspice.tran(nsspice.read(text), method="moreau")
        assert run.certificate.passed
        ends.append(run)
    capacitor, potential = errors(ends[1], ends[0])
    assert capacitor <= RELTOL
    # the first tie is 1e-8 of the 100 S beside it, 1e6 times the rounding of these
    assert potential <= 1e-8


@pytest.mark.parametrize("model", ["ideal", "Vfwd=0.5 Ron=0.1", "IS=1e-14"])
@pytest.mark.parametrize("tie", [1e9, 1e12])
def test_operating_points(tie: float, model: str) -> None:
    """A secondary between two equal ties stands in the middle of what they lead to.

    At 100 TOhm it had stood at 88 V, since 100 S inside it drowned the ties.
    """
    text = IDEAL_TRANSFORMER.replace("SIN(0 1 10k)", "10") + "D1 u w d\nR3 w n 10\n"
    ties = f"R4 n 0 {tie}\nR5 n far {tie}\nVF far 0 7\n.model d D({model})\n.op\n"
    point = nsspice.op(nsspice.read("Two ties\n" + text + ties))
    # a tie is known to the rounding of the conductance of R3, from which it is subtracted
    assert point["v(n)"][0] == pytest.approx(3.5, rel=EPS * 0.2 * tie, abs=1e-9)
    assert point["v(w,n)"][0] > 80.0
