"""Secondaries of ideal transformers whose capacitors hang on a large resistance.

In a step of a picosecond 100 uF is E/h = 1e8 S, the tie of 1 GOhm 1 nS: one rounding of the former
is more than all of the latter, so that the potential of the secondary was rounding, and grew by a
factor in every step.  In the sum of the laws of the secondary nothing is stored.
"""

from __future__ import annotations

import numpy as np
import pytest
from ideal_transformer import IDEAL_TRANSFORMER

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
    # 100 S beside 1 / tie: what the sum of the laws has lost to rounding, in each of some steps
    assert potential <= 100.0 * RELTOL + 100.0 * EPS * 100.0 * tie


@pytest.mark.parametrize("tie", [300e6, 5e9, 1e12])
def test_fixed_steps_of_a_smooth_circuit(tie: float) -> None:
    """The steps err alike, whatever the tie."""
    ends = []
    for value in (1e6, tie):
        text = SECONDARY.format(tie=value, c2="1p", tran="0.1n 50n").replace(".tran", SMOOTH)
        run = nsspice.tran(nsspice.read(text), method="moreau")
        assert run.certificate.passed
        ends.append(run)
    capacitor, potential = errors(ends[1], ends[0])
    assert capacitor <= RELTOL
    # the tie itself moves the potential by its part of the load of 10 Ohm
    assert potential <= 1e-5 + 100.0 * EPS * 100.0 * tie
