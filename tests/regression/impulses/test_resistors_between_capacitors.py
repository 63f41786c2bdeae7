"""Nodes that a resistor ties together, in the sum of whose laws little but capacitors is left.

What is left of the conductances in such a sum is leakage; the charges beside it are no less large
than those in the single laws, and count there.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

PUMP = """Charge pump with a snubber at its switches
V1 in 0 48
L1 in a 13.29n
C1 a 0 7.745u
VG g 0 PULSE(0 5 0 0 0 6.00662u 12.5138u)
VH h 0 PULSE(0 5 6.2569u 0 0 6.00662u 12.5138u)
D1 a b d
S1 x 0 g 0 sw
S2 a x h 0 sw
C2 a x 173.1p
C3 b x 3.973u
R1 x y 1.04
{end}
.model d D(Ron=10m Roff=1meg)
.model sw SW(VT=2.5 VH=0.5 Ron=20m Roff=10meg)
.tran 0.62569u 37.541u
"""


@pytest.mark.parametrize("end", ["C4 y 0 1.067n", "* nothing"])
@pytest.mark.parametrize("reltol", [1e-4, 1e-6])
def test_laws_hold_with_a_capacitor_behind_a_resistor_and_with_nothing(end, reltol):
    circuit = nsspice.read(PUMP.format(end=end))
    run = nsspice.tran(circuit, method="sdirk", reltol=reltol)
    assert run.certificate.passed
    assert run.certificate.laws < 1e-9
    exact = nsspice.tran(circuit, method="modewise")
    for name in ("v(a)", "v(b)", "i(l1)"):
        # steps pass over the 4 ps in which the first edge of a gate acts: the first row
        largest = np.abs(exact[name]).max()
        distance = np.abs(run[name] - exact[name])[1:].max()
        # 30 events, between which next to nothing is lost, add up: each errs by a few tolerances
        assert distance <= 100 * reltol * largest, name
