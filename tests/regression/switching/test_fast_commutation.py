"""Currents that a small inductance hands over in nanoseconds: fast motion, which is no jump.

In a passive network the current of a leakage inductance jumps nowhere.  How long it takes from one
diode to the next (current times inductance by voltage) is no time constant, so that impulsive steps
may well be longer.
"""

import numpy as np
import pytest

import nsspice

HALF_BRIDGE = """Half bridge with leakage inductance, perfectly coupled windings and a centre tap
Vin in 0 300
C1 in m 10u IC=150
C2 m 0 10u IC=150
S1 in sw g1 0 sm
S2 sw 0 g2 0 sm
D3 sw in
D4 0 sw
Llk sw p 1u
Lp p m 1m
Ls1 s1 0 40u
Ls2 0 s2 40u
K1 Lp Ls1 Ls2 1
D1 s1 x {diode}
D2 s2 x {diode}
Lo x out 20u
Co out 0 100u
Ro out 0 2
V1 g1 0 PULSE(0 1 0 0 0 4u 10u)
V2 g2 0 PULSE(0 1 5u 0 0 4u 10u)
.model sm SW(VT=0.5)
.model schottky D(IS=1e-6 N=1.05)
.tran 50n {stop} uic
"""

#: A boost rectifier with a smooth law of its duty; 2 mA vanish against 400 V in 4 ns.
TOTEM_POLE = """Totem-pole rectifier, average current control by expressions
Vac l n SIN(0 325 50 0 0 1)
Lb l sw 1m
S1 bus sw gh 0 sm
S2 sw 0 gl 0 sm
Da n bus
Db 0 n
Dc sw bus
Dd 0 sw
Cb bus 0 470u IC=400
Rb bus 0 150
Berr e 0 V={(v(l,n)/50-I(Lb))*0.02}
Vtri tri 0 PULSE(-1 1 0 10u 10u 0 20u)
Bd dut 0 V={limit(v(l,n)/v(bus) - v(e), -1, 1)}
Bm m 0 V={if(v(l,n)>0, v(dut), 1+v(dut))}
Bgh gh 0 V={if(v(m) > 0.5*(v(tri)+1), 1, 0)}
Bgl gl 0 V={1-v(gh)}
.model sm SW(VT=.5)
.tran 5u 1.6m uic
"""


def lost(solution: nsspice.Solution) -> float:
    energy = solution.certificate.energy
    return abs(energy.lost) / abs(energy.delivered)


def test_leakage_current_does_not_jump():
    circuit = nsspice.read(HALF_BRIDGE.format(diode="", stop="400u"))
    exact, stepped = (circuit.run(method=method)[0] for method in ("modewise", "sdirk"))
    assert lost(exact) == 0.0
    assert lost(stepped) == 0.0
    for name in ("i(llk)", "i(lo)", "v(out)"):
        size = np.max(np.abs(exact[name]))
        assert stepped[name] == pytest.approx(exact[name], abs=1e-3 * size)


def test_nor_with_smooth_diodes_behind_it():
    solution = nsspice.read(HALF_BRIDGE.format(diode="schottky", stop="300u")).run(
        method="sdirk", step=2e-5
    )[0]
    assert solution.certificate.passed
    assert not solution.impulses


def test_small_current_into_a_high_voltage_is_motion():
    solution = nsspice.read(TOTEM_POLE).run(method="sdirk", step=8e-4)[0]
    assert solution.certificate.passed
    assert not solution.impulses


def test_floating_bus_behind_line_inductances():
    """Three inductances meet in a bus without ground: their currents sum to zero in every step.

    Beside the charge of 1 mF that sum is lost in short steps, and its noise shortens them more.
    It has to vanish as well as the certificate asks of each law.
    """
    text = """Three-phase bridge of junction diodes with series resistances
V1 a 0 SIN(0 325 50 0 0 0)
V2 b 0 SIN(0 325 50 0 0 -120)
V3 c 0 SIN(0 325 50 0 0 120)
L1 a a1 1m
L2 b b1 1m
L3 c c1 1m
D1 a1 p DS
D2 b1 p DS
D3 c1 p DS
D4 m a1 DS
D5 m b1 DS
D6 m c1 DS
C1 p m 1m
R1 p m 20
.model DS D(IS=1e-9 N=1.8 RS=5m)
.tran 20u 60m
"""
    solution = nsspice.read(text).run()[0]
    assert solution.certificate.passed
    assert solution.islands[0].stats["steps"] < 3000
    total = solution["i(l1)"] + solution["i(l2)"] + solution["i(l3)"]
    assert np.max(np.abs(total)) < 1e-8 * np.max(np.abs(solution["i(l1)"]))
