"""Ideal switches beside ideal diodes: a loop in which any current may go round moves no charge.

Where comparisons drive the switches, the engine found such loops by numbers, to 1e-10 beside a node
that 1 MOhm ties to ground.  The loop then seemed to move a charge, impulses went round in it
without bound, and a capacitor lost what the rounding of 1e16 A s left: jumps that no law asked for,
and energy from nowhere.
"""

from __future__ import annotations

import numpy as np

import nsspice

#: one leg of a three-level inverter at a capacitor that nothing discharges
LEG = """leg
Rg n 0 1meg
C2 o n 1m IC=300
Vc1 c1 0 PULSE(0 1 0 0.25m 0.25m 0 0.5m)
Vc2 c2 0 PULSE(-1 0 0 0.25m 0.25m 0 0.5m)
D2 yb o
R9 b0 s 1
Vr r 0 SIN(0 0.85 50 0 0 120)
B1 g1 0 V=if(v(r)>v(c1),1,0)
B3 g3 0 V=if(v(r)>v(c1),0,1)
B2 g2 0 V=if(v(r)>v(c2),1,0)
B4 g4 0 V=if(v(r)>v(c2),0,1)
S1 p x g1 0 sw
S2 x c g2 0 sw
S3 c y g3 0 sw
S4 y n g4 0 sw
D1 x p
Dc1 o x
Rc c c0 5
Lc c0 s 15m
.model sw SW(VT=0.5)
.tran 10u 20m uic
"""

#: three legs with all their diodes on two capacitors, a load with a floating star point
INVERTER = """inverter
.subckt npc p o n a g1 g2 g3 g4
S1 p x g1 0 sw
S2 x a g2 0 sw
S3 a y g3 0 sw
S4 y n g4 0 sw
D1 x p d
D2 a x d
D3 y a d
D4 n y d
Dc1 o x d
Dc2 y o d
.ends
.subckt gate r c1 c2 g1 g2 g3 g4
B1 g1 0 V=if(v(r)>v(c1),1,0)
B3 g3 0 V=if(v(r)>v(c1),0,1)
B2 g2 0 V=if(v(r)>v(c2),1,0)
B4 g4 0 V=if(v(r)>v(c2),0,1)
.ends
{models}
Vdc p n 600
Rg n 0 1meg
C1 p o 1m IC=300
C2 o n 1m IC=300
Vc1 c1 0 PULSE(0 1 0 0.25m 0.25m 0 0.5m)
Vc2 c2 0 PULSE(-1 0 0 0.25m 0.25m 0 0.5m)
Va ra 0 SIN(0 0.85 50)
Vb rb 0 SIN(0 0.85 50 0 0 -120)
Vc rc 0 SIN(0 0.85 50 0 0 120)
Xga ra c1 c2 a1 a2 a3 a4 gate
Xgb rb c1 c2 b1 b2 b3 b4 gate
Xgc rc c1 c2 k1 k2 k3 k4 gate
Xa p o n a a1 a2 a3 a4 npc
Xb p o n b b1 b2 b3 b4 npc
Xc p o n c k1 k2 k3 k4 npc
Ra a a0 5
Rb b b0 5
Rc c c0 5
La a0 s 15m
Lb b0 s 15m
Lc c0 s 15m
.tran 10u 4m uic
"""
IDEAL = ".model sw SW(VT=0.5)\n.model d D(ron=0)"
LOSSY = ".model sw SW(VT=0.5 RON={r} ROFF=1e7)\n.model d D(ron={r})"


def test_a_leg_without_a_load_keeps_its_charge() -> None:
    run = nsspice.tran(nsspice.read(LEG))
    assert run.islands[0].method == "modewise"
    assert run.certificate.passed
    assert not run.jumps
    assert np.abs(run["v(o,n)"] - 300.0).max() < 1e-9


def test_an_inverter_of_ideal_switches_is_the_limit_of_small_resistances() -> None:
    run = nsspice.tran(nsspice.read(INVERTER.format(models=IDEAL)))
    assert run.islands[0].method == "modewise"
    assert run.certificate.passed
    assert not run.jumps
    assert run.certificate.energy.lost == 0.0
    waves = [run["v(o,n)"], run["i(la)"]]
    gaps = []
    for resistance in ("10m", "1m"):
        models = LOSSY.replace("{r}", resistance)
        lossy = nsspice.tran(nsspice.read(INVERTER.format(models=models)))
        others = [lossy["v(o,n)"], lossy["i(la)"]]
        gaps.append([np.abs(u - v).max() for u, v in zip(waves, others, strict=True)])
    # of 300 V and 30 A; the error is of first order in the resistance
    assert gaps[1][0] < 0.01
    assert gaps[1][1] < 0.02
    assert gaps[1][0] < 0.2 * gaps[0][0]
    assert gaps[1][1] < 0.2 * gaps[0][1]
