"""Currents and potentials right behind a switching, beside rounding of what is stored.

They are read off short steps.  Rounding of a charge or flux, divided by the length of a step, is a
current (a voltage) there.
"""

import numpy as np
import pytest

import nsspice

#: leakage of the transformer and choke meet at x, where both diodes may block: i(L2) - i(Lo) = -IS
CLAMP = """active clamp forward converter of junctions without capacitance
Vin in 0 48
Lm in sw 100u
L1 in sw 1m
L2 s 0 62.5u
K1 L1 L2 0.998
S1 sw 0 g 0 m
D1 0 sw body
Cs sw 0 200p
Sc cl sw gc 0 m
Dc sw cl body
Cc cl in 100n ic=48
D2 s x dsch
D3 0 x dsch
Lo x out 10u
Co out 0 100u ic=4
Ro out 0 0.5
Bg g 0 V=if(v(d)>v(saw),1,0)
Bgc gc 0 V=if((v(saw)>v(d)+0.05) & (v(saw)<0.97),1,0)
Vsaw saw 0 PULSE(0 1 0 3.96u 20n 20n 4u)
Ge 0 c VALUE={(5-v(out))*100u}
Rc c cx 5k
Cx cx 0 10n ic=0.3
Rx c 0 10meg
Bd d 0 V=limit(v(c),0.05,0.6)
.model m sw(vt=0.5 ron=20m roff=10meg)
.model body d(is=1e-10 n=0.5 rs=20m tt=20n)
.model dsch d(is=1e-6 n=0.5 rs=5m)
.tran 0.5u 80u uic
"""


def test_a_blocking_junction_between_windings() -> None:
    """Steps of 1e-22 s had it at 4000 V, and diodes and switches turned with that."""
    run = nsspice.tran(nsspice.read(CLAMP))
    assert run.certificate.passed
    assert run.islands[0].stats["located"] < 500
    # 48 V through 4 to 1, and what the clamp adds, which holds 48 V and what one period brings
    assert np.abs(run["v(x)"]).max() < 30.0


#: no current flows in R2: all that leads to the secondary is the transformer
BRIDGE = """isolated active bridge whose secondary one resistor ties
Vp a 0 PULSE(-200 200 0 10n 10n 9.99u 20u)
V2 p n 100
R2 n 0 1meg
Vk k 0 PULSE(0 5 2u 10n 10n 9.99u 20u)
Vl l 0 PULSE(5 0 2u 10n 10n 9.99u 20u)
Ls a a1 20u Rser=20m
L1 a1 0 1m
L2 c d 250u
K1 L1 L2 0.9999
S5 p c k 0 sw
S6 c n l 0 sw
S7 p d l 0 sw
S8 d n k 0 sw
D5 c p body
D6 n c body
D7 d p body
D8 n d body
.model sw SW(VT=2.5 VH=0.2 RON=20m ROFF=1MEG)
.model body D(IS=1e-10 N=1.2 RS=10m CJO=1n VJ=0.7 M=0.4)
.tran 100n 60u uic
"""


def test_a_node_that_a_large_resistor_ties_beside_large_currents() -> None:
    """Rows at the edges of the gates were off by 0.3 V, at each tolerance by another value."""
    run = nsspice.tran(nsspice.read(BRIDGE))
    assert run.certificate.passed
    # 1e-9 of the currents of the bridge in 1 MOhm
    assert np.abs(run["v(n)"]).max() < 1e-9 * np.abs(run["i(ls)"]).max() * 1e6


#: nothing but charges leads through D1 while it blocks: i = C(v) v', a hundred pA beside 10 mA
SMALL = """junction that blocks beside capacitors and a closing switch
V0 n1 0 PULSE(0 -0.4104 0 10u 10u .2m .5m)
R1 n2 n1 2862
R2 n3 n1 15.06
C2 n3 0 132.2n
R3 n5 n1 56.41
C3 n5 0 220.8n
S0 0 n3 g 0 SM
D1 n2 n5 DC
C4 n2 n1 300.2n
R4 n2 n3 6.164
VG g 0 PULSE(0 1 0 1u 1u 70u 150u)
.model DC D(IS=1e-14 CJO=10p TT=5n)
.model SM SW(VT=0.5 VH=0.1 RON=10m ROFF=10meg)
.tran {times}
"""


def test_small_currents_at_the_corners_of_sources() -> None:
    """At 0.6 ms a source has a corner that this branch does not feel: its row showed 1e-8 A."""
    fine = nsspice.tran(nsspice.read(SMALL.format(times="0.1u 600.5u 599.5u")))
    run = nsspice.tran(nsspice.read(SMALL.format(times="5u 0.7m")))
    beside = [fine["i(d1)"][np.argmin(np.abs(fine.time - t))] for t in (599.9e-6, 600.1e-6)]
    at = run["i(d1)"][np.argmin(np.abs(run.time - 600e-6))]
    # over 0.2 us the current bends by next to nothing
    assert at == pytest.approx(sum(beside) / 2.0, rel=2e-3)
    assert at == pytest.approx(1.4e-10, rel=0.01)


#: at turn-on Coss discharges through 0.5 Ohm, so that v(cs) jumps in 30 ps; its comparator has a
#: control with a law of its own
LATCH = """peak current latch behind an output capacitance
Vin in 0 300
Dc d cl ur
Rc cl in 100k
Cc cl in 2.2n
L1 in d 1m
S1 d cs q 0 sw
Coss d cs 60p
Rcs cs 0 1
Vc c 0 0.5
Vck ck 0 PULSE(0 1 0 20n 20n 300n 15u)
Bq qi 0 V={ v(cs)>limit(v(c),0.05,1) ? 0 : (v(ck)>0.5 ? 1 : (v(q)>0.5 ? 1 : 0)) }
Rq qi q 50
Cq q 0 200p
.model sw SW(VT=0.5 VH=0.2 RON=0.5 ROFF=10MEG)
.model ur D(IS=1e-9 N=1.6 RS=50m CJO=50p)
.tran 1u 20u uic
"""


@pytest.mark.parametrize("reltol", [1e-4, 1e-6])
def test_what_is_given_back_to_charges_breaks_no_other_law(reltol: float) -> None:
    """v(cs) was given back 60 uV that the law of the comparator did not hear of: exit code 3."""
    run = nsspice.tran(nsspice.read(LATCH), reltol=reltol)
    assert run.certificate.passed
    assert run.certificate.laws < 1e-8
