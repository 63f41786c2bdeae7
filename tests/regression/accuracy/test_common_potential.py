"""Steps with error control: large capacitors hang at a small one; a transient is cut short.

The error of a node was that of its charge, as a voltage of all capacitors there: a small capacitor
to ground, which alone holds the potential of large ones behind kilohms, was given 500 times its
tolerance.  Inside steps the continuous solution was looked at in the first step of a mode alone;
where an edge ended after a thousandth of the time constant, the whole decay fell into the next one.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

HANGING = """large capacitors behind kilohms at a small one to ground
V1 n0 0 PULSE(0 1 0 0.4u 0.4u 1.5m 3.8m)
Rs n0 n1 22
C1 n1 0 0.436u
C2 n1 n2 21.6u
R2 n2 0 2.3k
C3 n1 n4 222u
R4 n4 0 9.69k
Vg g 0 PULSE(0 5 0.477m 0.4u 0.4u 1.7m 3.8m)
S1 n4 n3 g 0 SW
R3 n3 0 22
.model SW SW(VT=2.5)
.tran 19u 11.4m
"""
DECAY = """the current of an inductor decays after an edge
V1 n0 0 PWL(0 0 3.5607u 5 7.1214u 5 10.682u -5 14.243u 0)
Rs n0 n1 2
L1 n1 n4 66.7u
R1 n4 0 18.5
D1 0 n4 DI
C1 n4 n3 14.2n
R2 n4 n3 1.63k
L2 n3 n2 205u
R3 n2 0 9.55k
R4 n3 0 736
.model DI D(ideal)
.tran 35.607n 21.364u uic
"""


@pytest.mark.parametrize("deck", [HANGING, DECAY], ids=["hanging", "decay"])
@pytest.mark.parametrize("reltol", [1e-3, 1e-4, 1e-5, 1e-6])
def test_errors_fall_with_the_tolerance(deck: str, reltol: float) -> None:
    """At all rows but those at edges within ten times the tolerance of the exact engine."""
    exact = nsspice.tran(nsspice.read(deck), method="modewise")
    run = nsspice.tran(nsspice.read(deck), method="sdirk", reltol=reltol)
    assert run.certificate.passed
    for name in (n for n in run.columns if n.startswith("v(n")):
        error = np.abs(run[name] - exact[name])
        # rows at an edge of the source lie on one side of it or on the other
        assert np.sort(error)[-3] < 10.0 * reltol * np.ptp(exact[name]), name
