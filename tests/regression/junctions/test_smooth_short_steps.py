"""Short steps of circuits with smooth laws: what Newton's method accepts, and what a switch sees.

In a step of length h a capacitor is C/h and an inductor L/h.  Their terms are no currents and
voltages of the network: laws elsewhere must hold to the network's own, in the shortest step too.
"""

import numpy as np
import pytest

import nsspice

#: accepted by Newton's method, relative
ACCEPTED = 1e-10

BRIDGE = """Rectifier bridge whose junctions store charge, with a floating electrolytic
V1 s 0 SIN(0 24 50)
RS s a 0.2
D1 a p dr
D2 0 p dr
D3 n a dr
D4 n 0 dr
C1 p x 2200u
RX x n 0.05
RL p n 50
.model dr D(IS=7.03n RS=0.034 N=1.8 CJO=18.8p VJ=.7 M=.33 TT=4.3u BV=400 IBV=5u)
.tran 0.1m 8m
"""


def test_charges_of_junctions_at_a_floating_capacitor() -> None:
    """2.2 mF at 24 V hold 50 mC: rounding of it is what a junction of 20 pF holds at 0.3 uV."""
    run = nsspice.tran(nsspice.read(BRIDGE), method="sdirk", reltol=1e-7)
    coarse = nsspice.tran(nsspice.read(BRIDGE), method="sdirk", reltol=1e-5)
    assert run.certificate.passed
    stats = run.islands[0].stats
    assert stats["forced"] == 0
    # where rounding is chased several steps are rejected for each that is taken
    assert stats["rejected"] < stats["steps"]
    across = [r["v(p)"] - r["v(x)"] for r in (run, coarse)]
    # three times the tolerance, as everywhere
    assert np.abs(across[0] - across[1]).max() < 3e-5 * np.abs(across[0]).max()


EDGES = """A switch, a junction with charge and a coil
VIN in 0 24
VG g 0 PULSE(0 1 0 20n 20n 4u 10u)
S1 in sw g 0 sm
D1 0 sw ds
L1 sw out 47u IC=2
R1 out 0 3
.model sm SW(VT=0.5 RON=20m ROFF=10meg)
.model ds D(IS=2u RS=15m CJO=300p)
.tran 1u 20u uic
"""


@pytest.mark.parametrize("reltol", [1e-4, 1e-5, 1e-6])
def test_sources_hold_beside_the_voltage_of_a_coil_in_a_short_step(reltol: float) -> None:
    """20 mOhm and 300 pF are 6 ps: steps of 0.1 fs, in which 2 A in 47 uH bear 1e12 V."""
    circuit = nsspice.read(EDGES)
    run = nsspice.tran(circuit, method="sdirk", reltol=reltol, all_points=True)
    assert np.abs(run["v(in)"] - 24.0).max() <= ACCEPTED * 24.0
    assert run.certificate.passed


RECOVERY = """Diffusion charge alone recovers in no time, beside a large capacitor
VIN in 0 100
VG g 0 PULSE(0 1 0 2.127e-08 2.127e-08 9.771e-06 1.81e-05)
S1 in sw g 0 sm
L1 sw la 0.002895
RL1 la 0 0.3832
D1 out sw dm
RS1 sw s1 32.9682
CS1 s1 0 4.351e-09
RO out 0 109.9
CO out 0 3.215e-06
.model sm SW(VT=0.5 VH=0.1 RON=0.4717 ROFF=9.954e+07)
.model dm D(IS=1.67e-10 N=1.765 RS=5.979 TT=2.257e-09)
.tran 9.052e-07 0.0003621 uic
"""


def test_currents_hold_beside_what_a_capacitor_stores() -> None:
    """In a single step of 2 ps 3 uF at 100 V are 2e8 A: 1e-16 of it is 20 nA in a diode's law."""
    run = nsspice.tran(nsspice.read(RECOVERY))
    assert run.certificate.passed
    assert run.certificate.laws < 1e-9  # a tenth of what is allowed


BLOCKING = """Diffusion charge that blocks while a switch closes
VIN in 0 24
VG g 0 PULSE(0 1 1u 50n 50n 1u 4u)
L1 in sw 200u
S1 sw 0 g 0 sm
DC sw k dn
CK in k 40n
RK in k 1k
RSN sw s1 40
CSN s1 0 0.7n
.model sm SW(VT=0.5 RON=0.15 ROFF=15meg)
.model dn D(IS=1n N=1.7 RS=1.5 TT=1.4u)
.tran 0.2u 10u uic
"""


def test_a_vanishing_charge_makes_no_time_constant() -> None:
    """TT IS exp(-30 V / nVt) / nVt is 1e-300 F: impulsive steps short beside that moved 1e225 A."""
    run = nsspice.tran(nsspice.read(BLOCKING))
    assert run.certificate.passed
    # 24 V across 200 uH drive 0.13 A in each of the two pulses of 1.05 us, from rest
    assert np.abs(run["i(vin)"]).max() < 1.0


COMPARISON = """Pulse width by a comparison with a saw-tooth, a junction beside the coil
VIN in 0 24
VSAW saw 0 PULSE(0 1 0 9.8u 0.1u 0.1u 10u)
VREF ref 0 0.4
RREF ref er 1k
CREF er 0 1n IC=0.4
BG g 0 V={if(v(er)>v(saw),1,0)}
S1 in sw g 0 sm
D1 0 sw ds
L1 sw out 47u
C1 out 0 100u
RO out 0 2
.model sm SW(VT=0.5 RON=20m ROFF=10meg)
.model ds D(IS=2u RS=15m N=1.05)
.tran 1u 200u uic
"""


def test_a_comparison_turns_once_at_each_crossing() -> None:
    """Behind its event the difference is what Newton's method leaves of zero, on either side."""
    run = nsspice.tran(nsspice.read(COMPARISON), method="sdirk")
    stats = run.islands[0].stats
    # twenty periods, two crossings in each, in each the comparison and the switch; and the start
    crossings = [event for event in run.events if event.element == "bg#1"]
    assert len(crossings) == 40
    assert stats["switchings"] <= 2 * len(crossings) + 2
    assert stats["located"] == len(crossings)


CHAIN = """Four RTL inverters with charges, small resistances in emitter and collector
VCC vcc 0 12
VIN n0 0 PULSE(0 12 0 3.159u 3.159u 80.95u 185.8u)
.subckt stage vcc in out
RB in b 15.57k
RC vcc out 3893
Q1 out b 0 qn
.ends
X1 vcc n0 n1 stage
X2 vcc n1 n2 stage
X3 vcc n2 n3 stage
X4 vcc n3 n4 stage
.model qn NPN(IS=3.394e-16 BF=292.5 VAF=38.85 BR=5.5 RC=0.3687 RE=0.1058 ISE=7.841e-16 NE=1.555
+ CJC=3.243p TF=395.4p)
.tran 9.292u 200u
"""


@pytest.mark.parametrize("reltol", [1e-5, 1e-6, 1e-7])
def test_what_junctions_store_is_not_put_back_after_a_corner(reltol: float) -> None:
    """3 pF hold a voltage, no potential: put back at a collector, they drove 8 uA."""
    run = nsspice.tran(nsspice.read(CHAIN), method="sdirk", reltol=reltol)
    assert run.certificate.passed


LOOSE = """Class B stage at rest: nothing but leakage decides on the output
VCC vcc 0 15
VEE vee 0 -15
R1 vcc b1 20k
R2 b2 vee 10k
R3 b1 b2 100
Q1 vcc b1 e qn
Q2 vee b2 e qp
RE1 e m 0.47
RE2 m out 0.47
C1 out load 470u
RL load 0 8
.model qn NPN(IS=1e-14 BF=200 VAF=100 ISE=1e-13 NE=1.5 RB=100 RE=0.5 RC=10 CJE=25p CJC=10p TF=500p)
.model qp PNP(IS=1e-14 BF=200 VAF=100 ISE=1e-13 NE=1.5 RB=100 RE=0.5 RC=10 CJE=25p CJC=10p TF=500p)
.op
.tran 10u 100u
"""


def test_a_run_starts_from_its_dc_point_whatever_the_tolerance() -> None:
    """Within what steps are solved to, laws at the output left 0.2 V open there."""
    circuit = nsspice.read(LOOSE)
    rest = nsspice.op(circuit)["v(out)"][0]
    # rounding of 10 V across 0.47 Ohm, beside leakage of a picoampere per thermal voltage
    known = 20 * np.finfo(float).eps * 10 / 0.47 / (1e-12 / 0.026)
    for reltol in (1e-3, 1e-5, 1e-7):
        run = nsspice.tran(circuit, method="sdirk", reltol=reltol)
        assert abs(run["v(out)"][0] - rest) < known
