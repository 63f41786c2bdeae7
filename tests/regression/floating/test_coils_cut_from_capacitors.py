"""A coil in series with a capacitor, cut by an open switch, in the middle of a converter.

Short steps lift the capacitor to gigavolts, beside which its charge rounds away the current of the
coil: 0.118 A flowed on into nothing, and 65 kA 40 us later.  The certificate called it rounding.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

CONVERTER = """two bridges and a rectifier
V2 ac1 0 SIN(0 24 2500 0 0 0)
R5 ac1 n4 0.004477
L6 n4 ac3 3.365e-07 IC=0
D9 ac3 p7 dron
D10 m8 ac3 dron
D11 0 p7 dron
D12 m8 0 dron
C13 p7 m8 1.249e-08 IC=0
R17 p7 n16 0.05294
L18 n16 n14 4.458e-05 IC=0
V20 g19 0 PULSE(0 5 0 0 0 9.1235e-06 2e-05)
S21 n14 m8 g19 0 swron
D22 n14 n15 dron
C23 n15 m8 1.667e-05 IC=24
R24 m8 0 1e+07
V28 g27 0 PULSE(0 5 2e-07 0 0 9.8e-06 2e-05)
V30 g29 0 PULSE(0 5 1.02e-05 0 0 9.7e-06 2e-05)
S31 n15 leg26 g27 0 swron
D32 leg26 n15 dron
S33 leg26 m8 g29 0 swron
D34 m8 leg26 dron
C35 leg26 m8 2.09e-10 IC=0
C37 n15 n36 1.418e-06 IC=16.8
R40 n36 n39 0.006494
L41 n39 n38 1.678e-09 IC=0
C42 n38 m8 1.418e-06 IC=16.8
C44 leg26 n43 1.131e-05 IC=0
L45 n43 n36 0.001154 IC=0
L48 n46 n47 0.0008347 IC=0
K49 L45 L48 0.95
D51 n46 n50 dron
D52 n47 n50 dron
D53 iso25 n46 dron
D54 iso25 n47 dron
R57 n50 n56 0.04363
L58 n56 n55 4.376e-05 IC=0
R60 n55 n59 97.21
C61 n59 iso25 4.254e-09 IC=0
C62 n55 iso25 1.892e-05 IC=0
R64 n55 n63 11.09
D65 iso25 n63 dz12
R66 n63 iso25 100
V69 g68 0 PULSE(0 5 6e-07 0 0 9.4e-06 2e-05)
V71 g70 0 PULSE(0 5 1.06e-05 0 0 9.1e-06 2e-05)
S72 n15 leg67 g68 0 swron
S73 leg67 m8 g70 0 swron
D74 m8 leg67 dron
R78 n15 n77 0.003971
L79 n77 n76 1.502e-09 IC=0
C80 n76 n75 3.569e-05 IC=16.8
R83 n75 n82 0.004662
L84 n82 n81 1.724e-08 IC=0
C85 n81 m8 3.569e-05 IC=16.8
C88 leg67 n86 1.59e-07 IC=0
L89 n86 n87 5.122e-05 IC=0
L90 n87 n75 0.0003015 IC=0
L93 n91 0 2.145e-05 IC=0
L94 0 n92 2.145e-05 IC=0
K95 L90 L93 L94 0.999
D97 n91 n96 dron
D98 n92 n96 dron
R100 n96 n99 26.17
C101 n99 0 2.936e-10 IC=0
R103 n96 n102 0.002434
C104 n102 0 0.0001243 IC=0
I105 n96 0 PULSE(0 2.721 1.047e-05 1e-06 1e-06 4e-05 0.0001)
R106 n96 0 0.8234
I107 n15 m8 PULSE(0 0.9718 3.187e-05 1e-06 1e-06 4e-05 0.0001)
R108 n15 m8 17.29
.model dron D(Ron=10m)
.model dz12 D(Vfwd=0.7 Ron=10m Vrev=12 Rrev=0.1)
.model swron SW(VT=2.5 Ron=5m)
.tran 2e-06 1.1e-5 uic
.end
"""

ALONE = """a leg with nothing but a diode
V1 in 0 24
V2 g 0 PULSE(0 5 0 0 0 1e-05 2e-05)
S1 in leg g 0 swron
D1 0 leg dron
C1 leg a 1.6e-07 IC=0
L1 a b 5e-05 IC=0
L2 b out 3e-4 IC=0
R3 out 0 1
R1 in f 0.005
C2 f 0 2e-10
.model dron D(Ron=10m)
.model swron SW(VT=2.5 Ron=5m)
.tran 1e-6 4e-5 uic
.end
"""

RELTOL = 1e-7


def test_the_current_of_a_coil_that_is_cut_off_ends() -> None:
    circuit = nsspice.read(CONVERTER)
    exact, stepped = (
        nsspice.tran(circuit, method="modewise"),
        nsspice.tran(circuit, method="sdirk", reltol=RELTOL),
    )
    largest = np.abs(exact["i(l89)"]).max()
    cut = int(np.argmin(np.abs(exact.axis - 1e-5)))
    # an impulse may leave rounding of the currents around it
    assert abs(stepped["i(l89)"][cut]) < 1e-9 * largest
    assert np.abs(exact["i(l89)"] - stepped["i(l89)"]).max() < 10 * RELTOL * largest
    assert stepped.certificate.passed


def test_a_capacitor_keeps_its_voltage_while_an_impulse_lifts_it() -> None:
    circuit = nsspice.read(ALONE)
    exact, stepped = (
        nsspice.tran(circuit, method="modewise")["v(leg,a)"],
        nsspice.tran(circuit, method="sdirk", reltol=RELTOL)["v(leg,a)"],
    )
    # rounding at 1e15 V would leave half a millivolt: 2e-5
    assert np.abs(exact - stepped).max() < 10 * RELTOL * np.abs(exact).max()


#: D3 and the coil are all that leads to ground, so that i(L7) = i(D3) >= 0: {i} A fall to nothing
TORN = """a coil whose current a diode blocks, behind a capacitor and a source that floats
I1 n1 n2 1
D3 0 n1
R4 n2 n3 0.3
C6 n3 n1 {c}
L7 n3 0 {l} IC={i}
.tran 1m 20m uic
"""


@pytest.mark.parametrize("method", ["modewise", "moreau", "sdirk"])
@pytest.mark.parametrize(("c", "l", "i"), [(0.03, 0.01, -3.0), (0.0261, 0.0125, -3.42)])
def test_a_current_that_nothing_carries_on_is_gone(
    method: str, c: float, l: float, i: float
) -> None:
    """The charge of 30 mF at 96 MV, over 7 ps, hid it: 1.1 A, or 0.3 A, flowed on, certified.

    Between the nodes 0.3 Ohm conduct far more than that rounding; the coil, 7e-10 S, less.
    """
    run = nsspice.tran(nsspice.read(TORN.format(c=c, l=l, i=i)), method=method)
    assert run.certificate.passed
    # what one step of 1e-12 of the run carries is left, against 3 A
    assert abs(run["i(l7)"][0]) < 1e-9
    (jump,) = run.jumps
    assert jump.lost == pytest.approx(0.5 * l * i * i, rel=1e-9)
    # no other way leads to ground
    assert np.abs(run["i(l7)"] - run["i(d3)"]).max() < 1e-9
