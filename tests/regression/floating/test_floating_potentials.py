"""Parts that float, and chains of capacitors with a sensor inside: potentials that are right.

What is left of the laws of a part that floats is the rounding of all that was summed before; taken
for a conductance it led to potentials of 1e17 to 1e29 V, beside which no current counted.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

ISOLATED = """isolated bridge rectifier with a choke, driven by a full bridge
V1 in 0 PWL(0 0 10n 200 4.98u 200 5u -200 9.98u -200 10u 200 14.98u 200 15u -200 20u -200)
L1 in p 5u
L2 p 0 1m
L3 s t 10u
K1 L2 L3 0.9999
D1 s a DM
D2 t a DM
D3 b s DM
D4 b t DM
L4 a o 10u
C1 o b 100u
R1 o b 0.6
{tie}
.model DM D(IS=1e-14)
.tran 20n 20u
.end
"""


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
def test_an_isolated_rectifier_carries_what_a_grounded_one_does(method: str) -> None:
    floating, grounded = (
        nsspice.tran(nsspice.read(ISOLATED.format(tie=tie)), method=method)
        for tie in ("", "Rg b 0 1")
    )
    for run in (floating, grounded):
        assert run.certificate.passed
        # 33.27 A at the end of the grounded deck by ngspice
        assert run["i(l4)"][-1] == pytest.approx(33.27, abs=0.1)
    # the same method twice: its errors differ by those of the steps alone
    tolerance = {"sdirk": 1e-4, "moreau": 1e-9}[method]
    assert np.abs(floating["i(l4)"] - grounded["i(l4)"]).max() <= tolerance * 33.3
    # the least norm of potentials lies within the voltages of the secondary
    assert np.abs(floating["v(s)"]).max() < 200.0


SENSED = """series RC with a sensor, whose current a source mirrors into the supply
{mirror}
V2 in 0 PULSE(0 5 0 1n 1n 2m 5m)
C2 a8 n1 10n
R4 n1 in 100k
Cc a14 a15 1.667n
VF a20 a8 0
R5 a14 a20 13
G2 a14 a16 a8 a14 5.6234n
L1 a14 a16 1.59
Rp a14 a16 1meg
D1 a15 0 DM
.model DM D(IS=6E-16 RS=1m BV=100E6)
.tran 20u 8m
.end
"""


@pytest.mark.parametrize("mirror", ["V1 vp 0 10V\nF1 vp 0 VF 1", "V1 vp 0 10V\nF1 0 vp VF 1"])
def test_a_mirrored_current_does_not_act_back(mirror: str) -> None:
    """An ideal source takes what `F` gives: the rest of the circuit is the same without both."""
    run = nsspice.tran(nsspice.read(SENSED.format(mirror=mirror)))
    plain = nsspice.tran(nsspice.read(SENSED.format(mirror="")))
    assert run.certificate.passed
    assert plain.certificate.passed
    # by ngspice -0.652 to 4.349 V
    assert plain["v(a14)"].min() == pytest.approx(-0.652, abs=2e-3)
    assert plain["v(a14)"].max() == pytest.approx(4.349, abs=2e-3)
    for name in ("v(a8)", "v(a14)", "v(a15)"):
        assert np.abs(run[name] - plain[name]).max() <= 1e-4 * 5.0


CLAMP = """series RC into a diode clamp, its current mirrored into the supply
V1 vp 0 10
V2 in 0 PULSE(0 5 0 1n 1n 2m 5m)
R4 in n1 100k
C2 n1 a 10n
VF a b 0
F1 0 vp VF {gain}
R6 b 0 1meg
C3 b c 1.667n
D1 c 0 DM
D2 0 c DM
.model DM D(IS=6E-16 RS=1)
.tran 20u 8m
.end
"""


@pytest.mark.parametrize("gain", ["1", "-1", "0.5"])
def test_the_potential_behind_an_edge_is_that_of_the_chain(gain: str) -> None:
    """It was 0.5 V off where the mirrored current is as large as that of the sensor."""
    run = nsspice.tran(nsspice.read(CLAMP.format(gain=gain)))
    current = (run["v(in)"] - run["v(n1)"]) / 100e3
    assert np.abs(current).max() < 60e-6
    # V2, R4, C2 and VF are in series; right behind an edge a capacitor's current is known to the
    # rounding of its charge over the shortest step
    assert np.abs(run["i(v2)"] + current).max() <= 1e-12
    assert np.median(np.abs(run["i(vf)"] - current)) <= 1e-12
    assert np.abs(run["i(vf)"] - current).max() <= 1e-8


CUK = """Cuk converter at rest: winding, resistance, capacitor, junction
V1 a 0 5
L1 a x 2.119
RL1 x m 1.57m
C1 m n 23.14u
D1 n 0 DM
L2 n o 2.119
C2 o 0 23.14u
R2 o 0 540.7
Vg g 0 PULSE(0 1 0 0.271u 0.271u 70u 271u)
S1 m 0 g 0 SM
.model DM D(IS=5.87e-13 N=1.62)
.model SM SW(VT=0.5 VH=0.1)
.tran 13.55u 1.3548m uic
"""


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def test_a_resistor_in_a_floating_part_hides_no_current(tolerance: float) -> None:
    """At first 1e-11 A flow beside 1e7 A of rounding of the capacitor, 1e-6 A of the resistor.

    Potentials of 1e283 V followed, NS3004, or a run without a certificate.
    """
    run = nsspice.tran(nsspice.read(CUK), reltol=tolerance)
    assert run.certificate.passed
    assert run.stats["steps"] < 3000
    for name, most in (("v(n)", 10.0), ("v(x)", 10.0), ("v(o)", 1.0)):
        assert np.abs(run[name]).max() < most
    # the switch connects both windings to the supply for 70 us: 5 V / 2.119 H
    on = run.time <= 70e-6
    assert np.abs(run["i(l1)"] - 5.0 / 2.119 * run.time)[on].max() < 1e-4 * run["i(l1)"].max()


LAMP = """temperature of a filament as a charge, beside an RC of a picosecond
V1 a 0 PULSE(0 12 1m 1u 1u 1 2)
R1 a c 1
C1 c 0 1p
B2 t0 tamb V=V(c)*(1-(V(t)/2750)**4)
RT t0 t 368
CT t tamb 136u
VT tamb 0 298
.tran 0.1m 20m
.end
"""


def test_rounding_of_a_large_charge_is_no_missing_current() -> None:
    """Nothing leaves the loop of B2, RT and CT: VT carries the rounding of its 40 mC alone.

    Right behind the edge, where nothing flows yet, that failed the certificate.
    """
    run = nsspice.tran(nsspice.read(LAMP))
    assert run.certificate.passed
    assert np.abs(run["i(vt)"]).max() <= 1e-7 * np.abs(run["i(b2)"]).max()
