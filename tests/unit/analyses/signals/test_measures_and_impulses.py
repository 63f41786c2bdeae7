"""Integrals of currents hold no impulses; what they miss is told."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.analyses.transient.measure import evaluate_measures

#: 1 uF is charged to 10 V by an ideal switch, and emptied into 10 Ohm, twice
DECK = """charge in no time
V1 a 0 10
Vp p 0 PULSE(0 1 1m 0 0 1m 3m)
Vq q 0 PULSE(0 1 2m 0 0 1m 3m)
S1 a b p 0 SW
C1 b 0 1u IC=0
S2 b c q 0 SW
R1 c 0 10
.model SW SW(VT=0.5)
.tran 1m 6m uic
.meas tran q integ -i(v1) {window}
.meas tran mean avg v(a)*i(s1) {window}
.meas tran peak max i(s1) {window}
.meas tran out integ i(r1) {window}
"""


def told(window: str, method: str) -> list[str]:
    circuit = nsspice.read(DECK.format(window=window))
    run = nsspice.tran(circuit, method=method)
    evaluate_measures(run, circuit.deck.measures)
    assert run.measures["q"] == pytest.approx(0.0, abs=1e-9)
    return [w.message for w in run.warnings if w.code == "NS5002"]


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_the_charge_that_a_measure_leaves_out(method: str) -> None:
    """Only integrals of what carries impulses, only those in the window."""
    assert told("", method) == [
        '.measure "q" omits impulses: -2e-05 A s of i(v1)',
        '.measure "mean" omits impulses: 2e-05 A s of i(s1)',
    ]
    assert told("from=0.5m to=1.5m", method) == [
        '.measure "q" omits impulses: -1e-05 A s of i(v1)',
        '.measure "mean" omits impulses: 1e-05 A s of i(s1)',
    ]
    assert not told("from=1.5m to=3.5m", method)
