"""Operating points that leakage of junctions alone determines, behind resistors of some ohms."""

from __future__ import annotations

import math

import pytest

import nsspice

JUNCTIONS = """Leakage through two junctions, tied by 40 Ohm, beside milliamperes
V1 p 0 5
R1 p 0 1k
D1 p a one
R2 a b 40
D2 0 b two
.model one D(IS=1e-15)
.model two D(IS=2e-16)
.op
"""
INVERTER = """TTL inverter with a low input: nothing but leakage reaches the output
VCC vcc 0 5
VIN in 0 0
R1 vcc b1 4k
Q1 b2 b1 in n1
R2 vcc c2 1.6k
Q2 c2 b2 e2 n1
R3 e2 0 1k
R4 vcc c4 130
Q4 c4 c2 e4 n1
D1 e4 out d1
Q3 out e2 0 n1
CL out 0 15p
.model n1 NPN(IS=1e-16 BF=50 BR=1 {ohmic} CJE=.9p CJC=1.5p TF=.1n TR=10n VAF=50)
.model d1 D(IS=1e-15 {series} CJO=.9p TT=.1n)
.tran 1n 10n
"""
CLAMP = """A node between two blocking junctions, beside 0.1 Ohm at 300 V
V1 in 0 SIN(100 200 10k)
R1 in a 0.1
L1 a 0 1m
D1 in m d
DZ 0 m zener
.model d D(IS=1.2e-10 N=1.72)
.model zener D(IS=1e-12 BV=300 IBV=1m RS=0.5)
.tran 1u 300u uic
"""


def test_resistors_of_ohms_leave_leakage_its_digits():
    """40 Ohm at 5 V stand for 0.125 A, of which a hundredth of the leakage is rounding."""
    point = nsspice.op(nsspice.read(JUNCTIONS))
    # IS1 (exp(v/Vt) - 1) = IS2; laws end at 1e-14 of 1e-6 of 0.125 A: 6e-6 of the leakage
    unit = 1.380649e-23 * 300.15 / 1.602176634e-19
    across = point["v(p)"][0] - point["v(a)"][0]
    assert across == pytest.approx(unit * math.log1p(0.2), rel=6e-6)


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
def test_an_output_on_leakage_does_not_leave_the_supply(method):
    """It stood at 9.99997 V with a supply of 5 V: nobody asked for so small currents.

    Without ohmic resistances, which carry 1e-15 A, no rounding hides them; ngspice has 4.96615 V
    there (with them, and without gmin, 3.99647 V).
    """
    with_them, without = (
        nsspice.read(INVERTER.format(ohmic=ohmic, series=series))
        for ohmic, series in (("RB=70 RC=40", "RS=40"), ("", ""))
    )
    known = nsspice.op(without)["v(out)"][0]
    assert known == pytest.approx(4.96615, abs=2e-5)
    assert nsspice.op(with_them)["v(out)"][0] == pytest.approx(known, abs=1e-9)
    assert nsspice.tran(with_them, method=method)["v(out)"][0] == pytest.approx(known, abs=1e-9)


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
def test_a_node_on_leakage_holds_its_own_law(method):
    """2 pA miss Kirchhoff's law by no more than the certificate allows, whatever flows elsewhere.

    They were judged against a millionth of what 300 V drive through 0.1 Ohm, and missed it by 1e-6.
    """
    certificate = nsspice.tran(nsspice.read(CLAMP), method=method).certificate
    assert certificate.passed
    # the iteration ends at 1e-11 of the law
    assert certificate.laws < 1e-11


BRIDGE = """Full bridge, each ideal switch behind a blocking junction, a winding on 100 MOhm
V1 p 0 10
VT tri 0 PULSE(-1 1 0 50u 50u 0 100u)
BG1 g1 0 V=u(0.4-v(tri))
BG2 g2 0 V=u(v(tri)-0.6)
S1 p n1 g1 0 sw
DB1 n1 a d
DY1 a p d
S2 a n2 g2 0 sw
DB2 n2 0 d
DY2 0 a d
S3 p n3 g2 0 sw
DB3 n3 b d
DY3 b p d
S4 b n4 g1 0 sw
DB4 n4 0 d
DY4 0 b d
L1 a c 100u
L2 x y 400u
K1 L1 L2 0.99
R1 c b 0.1
RX x 0 100meg
D1 x o d
D2 y o d
R2 o y 20
C2 o y 1u
.model sw SW(VT=0.5)
.model d D()
.tran 1u 300u uic
"""


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
def test_nodes_behind_open_switches_stay_in_the_bridge(method):
    """Leakage of 1e-14 A beside 11 A: they stood at up to 4.5e14 V, and the certificate held."""
    run = nsspice.tran(nsspice.read(BRIDGE), method=method)
    assert run.certificate.passed
    assert run.stats["steps"] < 1000
    # between the supplies, a junction beyond them at most
    for node in ("n1", "n2", "n3", "n4", "a", "b"):
        assert abs(run[f"v({node})"] - 5.0).max() < 6.5
