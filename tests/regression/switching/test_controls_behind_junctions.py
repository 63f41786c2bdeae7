"""A switch whose control a junction clamps: the source behind the resistor does not decide."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

DECK = """A clamped input of a switch
V1 in 0 PULSE(0 10 1m {edge} {edge} 2m 6m)
R1 in a 1k
D1 a 0 junction
V2 supply 0 5
R2 supply out 1k
S1 out 0 a 0 {model}
C1 out 0 1u
.model junction D(IS=1e-14)
.model far SW(VT=3 VH=2.6 RON=1)
.model near SW(VT=5 RON=1)
.tran 50u 6m
"""


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
@pytest.mark.parametrize("model", ["far", "near"])
@pytest.mark.parametrize("edge", ["0", "1u"])
def test_the_switch_sees_the_junction(edge: str, model: str, method: str) -> None:
    circuit = nsspice.read(DECK.format(edge=edge, model=model))
    found = nsspice.tran(circuit, method=method)
    # 10 V over 1 kOhm are 10 mA at most: N Vt ln(1e12) = 0.714 V at 27 degrees
    assert found["v(a)"].max() < 0.72
    assert np.allclose(found["v(out)"], 5.0, rtol=0, atol=1e-6)
    assert found.stats["switchings"] == 0
    assert found.certificate.passed, found.certificate
