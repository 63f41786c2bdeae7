"""Random converters of junctions with TT and no capacitance: where their energy went, to 1e-6.

In steps of 1e-19 s the charge of such a junction over the length of the step is 1e11 A, and its
rounding amperes.  What that, potentials of teravolts, or the limit of short steps made of a state
was certified once, since the allowance for rounding grew with the largest voltage of the run.
"""

from __future__ import annotations

import pytest
from switched_bridge import BRIDGE

import nsspice

LEG = """Vg{k} g{k} 0 PULSE(0 1 {on}u 0 0 19.67u 43.72u)
Vh{k} h{k} 0 PULSE(0 1 {off}u 0 0 19.67u 43.72u)
Sh{k} a p{k} g{k} 0 sw
Sl{k} p{k} 0 h{k} 0 sw
Dh{k} p{k} a ds
Dl{k} 0 p{k} ds
Ll{k} p{k} x{k} 12.65m IC={start}
Rl{k} x{k} star 27.4
"""
#: reverse recovery begins in a step of 6e-20 s, in which rounding fed 70 uC into a junction
INVERTER = "\n".join(
    [
        "inverter with a star, from currents that do not sum to zero\nVin a 0 24",
        LEG.format(k=0, on=0, off=21.86, start=-0.5),
        LEG.format(k=1, on=14.57, off=36.43, start=0),
        LEG.format(k=2, on=29.15, off=7.286, start=1),
        ".model ds D(IS=2.04e-12 RS=0.17 TT=71.8n)\n.model sw SW(VT=0.5)",
        ".tran 2.186u 437u uic",
    ]
)
#: the limit of three steps behind an edge put 8e9 C into a junction
PUSH_PULL = """push-pull converter with leakage
Vin vi 0 5
Rin vi a 10.3m
Vg g 0 PULSE(0 1 0 7.859n 7.859n 3.53656u 7.85902u)
Vh h 0 PULSE(0 1 3.92951u 7.859n 7.859n 3.53656u 7.85902u)
L1 a m1 50.58u
L2 m2 a 50.58u
L3 s 0 27.34u
L4 0 t 27.34u
K1 L1 L2 L3 L4 0.95
S1 m1 0 g 0 sw
S2 m2 0 h 0 sw
D3 0 m1 ds
D4 0 m2 ds
D1 s f ds
D2 t f ds
Lo f o 10.12u
C1 o 0 1.1m
R1 o 0 1.075
.model ds D(IS=1.77n N=1.66 RS=0.402 TT=52.3n)
.model sw SW(VT=0.5)
.tran 0.393u 39.295u uic
"""
#: all that holds the potential of the DC side is 1 MOhm
RECTIFIER = """three-phase rectifier behind coils
V0 w0 0 SIN(0 325 140.56k)
L0 w0 p0 5.849u
Dh0 p0 o ds
Dl0 n p0 ds
V1 w1 0 SIN(0 325 140.56k 0 0 -120)
L1 w1 p1 5.849u
Dh1 p1 o ds
Dl1 n p1 ds
V2 w2 0 SIN(0 325 140.56k 0 0 -240)
L2 w2 p2 5.849u
Dh2 p2 o ds
Dl2 n p2 ds
C1 o y 164.7u
RC1 y n 6.32m
R1 o n 1.874
Rg n 0 1meg
.model ds D(IS=1.5e-11 N=1.57 RS=6.79m TT=2.17n)
.tran 0.3557u 3.557u
"""
#: windings without leakage, whose rates are beyond all that they store
DOUBLE = (
    """full bridge, LLC tank, K=1
Vin a 0 48
Vg g 0 PULSE(0 1 0 2.9u 2.9u 66.3u 287u)
Vh h 0 PULSE(0 1 143.5u 2.9u 2.9u 66.3u 287u)
"""
    + BRIDGE
    + """Lr p p2 5.5m
Cr p2 p3 374n
L1 p3 q 275m
L2 s 0 50.9m
L3 0 t 50.9m
K1 L1 L2 L3 1
D5 s f ds
D6 t f ds
Rf f o 31m
C1 o 0 1.36m
R1 o 0 10.5
.model ds D(IS=6.88e-11 RS=26.1m TT=2.53n)
.model sw SW(VT=0.5)
.tran 14.34u 300u
"""
)
DECKS = {"inverter": INVERTER, "push-pull": PUSH_PULL, "rectifier": RECTIFIER, "bridge": DOUBLE}


@pytest.mark.parametrize("name", DECKS)
def test_no_energy_comes_from_nowhere(name: str) -> None:
    """Sources, stores, heat, jumps and the scheme: their sum vanishes to a millionth of the parts.

    Steps are accepted with residuals of 1e-10; charges of junctions count as heat.  What the sums
    are judged against is little more than these parts.
    """
    run = nsspice.tran(nsspice.read(DECKS[name]))
    assert run.certificate.passed
    energy = run.certificate.energy
    parts = [-energy.delivered, energy.stored, energy.dissipated, energy.lost, energy.scheme]
    size = sum(abs(part) for part in parts)
    assert abs(sum(parts)) < 1e-6 * size
    assert energy.turned < 100.0 * size
