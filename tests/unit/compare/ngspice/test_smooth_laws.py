"""Smooth laws mean the same in ngspice: junctions, transistors, thyristors, with their effects."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.analyses.request.request import Request
from nsspice.compare import ngspice
from nsspice.compare.ngspice import Options


def worst(text: str, **request) -> float:
    check = ngspice.cross_check(nsspice.read(text), request=Request(**request))
    assert check.rows
    return check.worst.share("max")


@pytest.mark.parametrize(
    ("card", "tolerance"),
    [
        # the constants of nature differ in the seventh digit, Vt and the exponent with them
        ("IS=1e-12", 3e-6),
        ("IS=1e-12 N=1.7 RS=5", 3e-6),
        ("IS=1e-12 EG=0.69 XTI=2 TNOM=20", 3e-6),
        # ngspice finds the start of the breakdown by an iteration that it ends early
        ("IS=1e-12 BV=4 IBV=1m NBV=1.2", 1e-4),
    ],
)
def test_junctions(card, tolerance):
    text = f"""junction in a sweep, area, temperature
V1 a 0 0
R1 a b 100
D1 b 0 DX 2
D2 b 0 DX temp=80
.model DX D({card})
.temp 50
.dc V1 -6 3 0.05
"""
    assert worst(text) < tolerance


def test_charges_of_a_junction():
    text = """turn-off of a diode with transit time and depletion charge
V1 a 0 PULSE(5 -5 1u 10n 10n 2u 9u)
R1 a b 1k
D1 b 0 DX 2
.model DX D(IS=1e-13 CJO=20p VJ=0.7 M=0.4 FC=0.5 TT=50n RS=2)
.tran 10n 2u
"""
    # theta = 1 with 20 ps on a storage time of 35 ns
    assert worst(text, step=2e-11) < 2e-3


@pytest.mark.parametrize("kind", ["NPN", "PNP"])
def test_transistors(kind):
    sign = 1 if kind == "NPN" else -1
    text = f"""output curves, forward and reverse
VC c 0 0
VB bb 0 {sign * 5}
RB bb b 100k
Q1 c b 0 QX 2
.model QX {kind}(IS=1e-15 BF=120 BR=3 NF=1.1 NR=1.05 VAF=60 VAR=20 RB=50 RC=2 RE=0.5
+ IKF=20m ISE=1e-14 NE=1.8)
.save v(b) i(VC) i(Q1) i(Q1.b) i(Q1.e)
.dc VC {-2 * sign} {5 * sign} {0.1 * sign}
"""
    assert worst(text) < 5e-6


def test_charges_of_a_transistor():
    text = """inverter
Vcc vcc 0 5
Vin in 0 PULSE(0 5 10n 1n 1n 50n 200n)
Rb in b 10k
Rc vcc c 1k
Q1 c b 0 QN
.model QN NPN(IS=1e-15 BF=100 CJE=1p CJC=0.5p TF=0.3n TR=10n VAF=80)
.tran 0.2n 100n
"""
    # theta = 1 with 2 ps on edges of 1 ns
    assert worst(text, step=2e-12) < 5e-3


def test_ebers_moll_transistors_with_diode_laws():
    text = """all three currents of an Ebers-Moll transistor
VC c 0 0
VB bb 0 3
RB bb b 1k
RC c cc 10
Q1 cc b 0 QX
.model QX NPN(alphaN=0.98 alphaI=0.5 DE=one DC=two)
.model one D(Vfwd=0.6 Ron=2 V={0.1*asinh(1000*i)})
.model two D(IS=1e-12 N=1.2)
.save v(b) i(Q1) i(Q1.b) i(Q1.e)
.dc VC -1 5 0.1
"""
    assert worst(text) < 1e-5


def test_thyristors_while_they_hold():
    text = """a triggered thyristor and one that blocks
V1 a 0 0
R1 a b 10
VG g 0 3
RG g gg 100
D1 b 0 gg TH
D2 b 0 OFF
.model TH SCR(VBO=400 VH=1 IH=50m RON=0.05 IGT=20m VGT=0.7 VREV=20 RG=1)
.model OFF SCR(VBO=400 VH=1 IH=50m RON=0.05 VREV=30 RREV=2)
.save v(b) i(D1) i(D2) i(D1.g)
.dc V1 -40 40 0.5
"""
    assert worst(text) < 1e-5


def test_a_series_drop_in_a_diode_with_area():
    text = """drop
V1 a 0 0
R1 a b 1
D1 b 0 DX 3
.model DX D(Vfwd=0.3 Vrev=2 V={0.2*atan(5*i)})
.dc V1 -5 5 0.1
"""
    # 1 uOhm stands for no resistance
    assert worst(text) < 5e-6


def test_smooth_circuits_have_no_slack_and_no_substitutes():
    text = """half wave
V1 a 0 SIN(0 5 50)
D1 a b DX
R1 b 0 1k
.model DX D(IS=1e-14)
.tran 50u 20m
"""
    check = ngspice.cross_check(nsspice.read(text), options=Options(max_step=1e-6), tolerance=1e-4)
    assert check.slack == 0.0
    assert check.run.translation.exact
    assert check.passed
    assert "->" not in check.describe()


def test_a_floating_bridge_is_helped_by_a_shunt():
    text = """bridge on a floating source
V1 a b SIN(0 10 50)
D1 a p DX
D2 b p DX
D3 0 a DX
D4 0 b DX
R1 p 0 1k
C1 p 0 10u
.model DX D(IS=1e-14 RS=0.1)
.save v(p)
.tran 20u 20m
"""
    check = ngspice.cross_check(
        nsspice.read(text), request=Request(step=2e-7), options=Options(timeout=60.0)
    )
    assert [e.reason for e in check.run.attempts] == ["timestep too small"] * 2
    assert check.run.translation.options.rshunt == 1e9
    assert "from every node to ground" in check.describe()
    assert "reltol=0.001: timestep too small" in check.describe()
    assert check.worst.share("max") < 1e-3


def test_an_amplifier_of_high_gain_is_helped_by_spices_own_tolerances():
    """A resistor to ground from every node would load the coupling capacitor of its input."""
    text = """amplifier with a saturating output
VCC p 0 14.4
VIN s 0 SIN(0 50m 1k)
C1 in s 10u
EREF r 0 p 0 0.5
RI in r 1meg
RP fb r 1meg
B1 d 0 V={0.75+12.9*(0.5+0.5*tanh(1e5*v(in,fb)/6.45))}
RO d out 0.2
RF out x 220
RG x 0 2.2
CG fb f2 470u
RX f2 x 39
CL out l 1m
RL l 0 4
CZ l z 100n
RZ z 0 1
CW out w 39n
RW w fb 39
.tran 10u 2m
"""
    check = ngspice.cross_check(nsspice.read(text))
    assert check.run.translation.options.rshunt is None
    assert check.passed, check.describe()


CURVES = """collector curves of a transistor, the first one without base current
Q1 c b 0 QN
V1 vc 0 0
R1 vc c 1k
I1 0 b 0
.model QN NPN(IS=14.34f VAF=74 BF=400 NE=1.307 ISE=14.34f IKF=.2847 BR=6.092 NC=2 RC=1 RB=10)
.dc V1 0 5 0.05 I1 0 5m 1m
"""


def test_gmin_stepping_that_breaks_off_spoils_no_comparison():
    """ngspice would go on with a conductance at each junction, and leave 0.1 mA without a base."""
    check = ngspice.cross_check(nsspice.read(CURVES), options=Options(gmin=1e-18))
    assert check.passed, check.describe()
