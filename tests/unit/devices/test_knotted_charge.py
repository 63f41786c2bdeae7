"""A charge as a table beside a current as a table: one capacitor with a pair for each knot."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.devices.expressions.knotted_charge import KnottedCharge

#: V and nC; the current begins outside of what is reached
PLACES, CHARGES = [-9.0, -3.0, -1.0, 0.5, 2.0, 8.0], [-16.0, -7.0, -5.0, 1.0, 2.5, 20.5]
TABLE = ", ".join(f"{v},{q}n" for v, q in zip(PLACES, CHARGES, strict=True))
CURRENT = "I={max(v(a)-50, 0)}"


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("count", [1.0, 2.0])
def test_the_charge_is_that_of_the_table(way: float, count: float) -> None:
    """A constant current fills it: the voltage is the inverse of the table at ``I t``."""
    deck = f"""t
I1 0 a {way * 1e-3 * count}
C1 a 0 Q={{table(x, {TABLE})}} m={count} IC=0.5
B1 a 0 {CURRENT}
.tran 0.2u 12u uic
"""
    circuit = nsspice.read(deck)
    assert isinstance(circuit.device("c1"), KnottedCharge)
    run = nsspice.tran(circuit, signals=("v(a)", "i(c1)"))
    expected = np.interp(1e-9 + way * 1e-3 * run.time, np.array(CHARGES) * 1e-9, PLACES)
    assert run["v(a)"] == pytest.approx(expected, abs=1e-11)  # rounding of sums of charges
    assert run["i(c1)"][1:] == pytest.approx(way * 1e-3 * count, rel=1e-11)


def test_other_charges_are_layers() -> None:
    """Their energy is that of the table."""
    circuit = nsspice.read(f"t\nI1 0 a 1m\nC1 a 0 Q={{table(x, {TABLE})}}\n.tran 0.1u 1u uic\n")
    assert not isinstance(circuit.device("c1"), KnottedCharge)
