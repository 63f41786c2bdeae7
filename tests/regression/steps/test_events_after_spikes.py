"""A spike is no measure of the currents after it.

A resonant converter whose capacitors of 1.2 nF are shorted by its switches: a row of 7e10 A right
after an instant became the scale of all guards, and 0.69 A flowed backward through ideal diodes
until the next edge of a gate; the certificate had recorded other steps.
"""

from __future__ import annotations

import numpy as np

import nsspice

DECK = """converter: resonant
V1 in 0 48
L3 in n2 2.307e-08
R4 in n2 637.1
C5 n2 0 2.606e-05 IC=0
V9 n8 0 PULSE(0 5 0 0 0 5.99726e-06 1.24943e-05)
V11 n10 0 PULSE(0 5 6.24714e-06 0 0 5.99726e-06 1.24943e-05)
V13 n12 0 PULSE(0 5 0 0 0 5.99726e-06 1.24943e-05)
V15 n14 0 PULSE(0 5 6.24714e-06 0 0 5.99726e-06 1.24943e-05)
S16 n2 n6 n8 0 sw
D17 n6 n2 d
C18 n2 n6 1.243e-09
S19 n6 0 n10 0 sw
D20 0 n6 d
S21 n7 0 n12 0 sw
D22 0 n7 d
S23 n2 n7 n14 0 sw
D24 n7 n2 d
C25 n2 n7 6.12e-11
L31 n6 n26 2.485e-05
C32 n26 n27 2.058e-07
L33 n27 n7 0.0001291
L34 n28 n29 0.0001291
K35 L33 L34 1
D36 n28 n30 d
D37 0 n28 d
D38 n29 n30 d
D39 0 n29 d
C40 n30 0 8.369e-06 IC=0
R41 n30 0 6.244
.model d D(Vfwd=0.7)
.model sw SW(VT=2.5 VH=1)
.tran 6.2471e-07 0.00012494 uic
.end
"""
DIODES = ("d17", "d20", "d22", "d24", "d36", "d37", "d38", "d39")


def test_no_diode_conducts_backward():
    names = [f"i({name})" for name in DIODES]
    solution = nsspice.tran(
        nsspice.read(DECK), method="sdirk", reltol=1e-7, signals=names, all_points=True
    )
    assert solution.certificate.passed
    for name in names:
        # by the characteristic of an ideal diode; of the instant of an event rounding is left
        assert solution[name].min() >= -1e-8 * np.abs(solution[name]).max(), name
