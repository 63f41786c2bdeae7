"""Junctions without capacitance tear off currents of windings: voltages that nothing bounds."""

from __future__ import annotations

import re

import pytest
from decks.index_three import INDEX_THREE
from decks.output_points import told

import nsspice
from nsspice.analyses.certificate.failure import unbounded

#: the reset winding of a forward converter lets go
FORWARD = """forward converter with a reset winding, diodes with a transit time alone
Vin a 0 5
Vg g 0 PULSE(0 1 0 0.1289u 0.1289u 3.39103u 12.8883u)
L1 a m 251u
L2 s 0 4.747m
L3 a q 251u
K1 L1 L2 0.99
K2 L1 L3 0.99
K3 L2 L3 0.99
S1 m 0 g 0 sw
D3 0 q ds
D1 s f ds
D2 0 f ds
RSm0 m sm0 3.79
CSm0 sm0 0 108n
Lo f o 50.2u
C1 o 0 221.3u
R1 o 0 2.935
.model ds D(IS=4.51e-14 TT=5.77n{more})
.model sw SW(VT=0.5 VH=0.1)
.tran 0.6444u 64.442u uic
"""


def test_a_voltage_without_bound_is_named() -> None:
    circuit = nsspice.read(FORWARD.format(more=""))
    run = nsspice.tran(circuit, reltol=1e-4)

    # a voltage without bound depends on the steps, as the first warning says
    def fine() -> nsspice.Solution:
        return nsspice.tran(circuit, reltol=1e-4, all_points=True)

    assert told(run, fine, near=0.2, kinds="i") == ["NS3053"]
    assert re.search(r"the voltage at node \w+ \(d\d.*\) has no bound", run.warnings[0].message)
    circuit = nsspice.read(FORWARD.format(more=" CJO=100p"))
    held = nsspice.tran(circuit, reltol=1e-4)
    assert held.certificate.passed
    assert not told(held, lambda: nsspice.tran(circuit, reltol=1e-4, all_points=True))


@pytest.mark.parametrize(
    ("text", "said", "advised"),
    [
        (INDEX_THREE, "could follow l1 at", "another method"),
        (
            INDEX_THREE.replace("R1 c 0 1", "R1 c 0 V={i+i^3}"),
            "could follow l1 at",
            "capacit",
        ),
        (FORWARD.format(more=""), "junctions", "CJO"),
    ],
)
def test_junctions_are_blamed_where_there_are_any(text: str, said: str, advised: str) -> None:
    """A circuit of ideal diodes was told to give them a CJO, by ``sdirk``."""
    circuit = nsspice.read(text)
    mna = circuit.islands[0].assemble()
    warning = unbounded(circuit, mna, mna.layout.branches["l1"], 0.25)
    assert warning.code == "NS3053"
    assert said in warning.message
    assert advised in warning.hint
    assert ("CJO" in warning.hint) == ("junctions" in warning.message)


@pytest.mark.parametrize(
    ("stop", "reltol"), [("46.6u", 1e-4), ("47.7u", 1e-4), ("53.2u", 1e-3), ("60.9u", 1e-4)]
)
def test_rounding_of_fluxes_does_not_keep_steps_short(stop: str, reltol: float) -> None:
    """Behind a tear steps of 1e-16 s showed rounding of currents as volts, and stayed so short.

    What moves by less than Newton's method leaves open is no error.  The length of the run decides
    on that of the steps: at these, 150,000 of them came to a nanosecond.
    """
    deck = FORWARD.format(more="").replace("64.442u", stop)
    run = nsspice.tran(nsspice.read(deck), reltol=reltol)
    assert run.certificate.passed
    assert run.stats["steps"] < 20_000
