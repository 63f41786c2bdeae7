"""Where the last mode shorts a source behind a switch that has just closed.

A switch of a leg closes while the diode across the other one still conducts: until the diode has
opened, both short the source of the leg.  No current solves the laws of that mode, and Newton's
method has to leave it by the sign of the current that the source would drive.  It stayed there and
came to the solution by detours of some hundred linearisations, or not at all.
"""

import numpy as np
import pytest

import nsspice

# Two strings of LEDs with unequal voltages behind a buck; an ideal diode freewheels
LEDS = """LED strings
Vin in 0 48
S1 in sw g 0 SWI
D1 0 sw
L1 sw o 100u
Co o 0 10u
D11 o 1 LED
D12 1 2 LED
D13 2 3 LED
R1 3 k 1
D21 o 4 LED
D22 4 5 LED
D23 5 6 LED
R2 6 k 2
Rs k 0 0.1
.model LED D(IS=1e-20 N=2.6 RS=0.5)
Vg g 0 PULSE(0 1 0 0 0 1.9u 5u)
.model SWI SW(VT=0.5)
.tran 1u {stop}
"""

# Three legs that follow modulators with products in them, a floating star as their load
DRIVE = """drive of a machine
.param w={2*pi*100}
Vdc p n 300
Vn n 0 -150
.subckt LEG p n a r c
B1 g 0 V=if(v(r)>v(c),1,0)
S1 p a g 0 SA
S2 a n 0 g SB
D1 a p
D2 n a
.model SA SW(VT=0.5)
.model SB SW(VT=-0.5)
.ends
Vc c 0 PULSE(-1 1 0 50u 50u 0 100u)
La a a1 2m Rser=0.2
Lb b b1 2m Rser=0.2
Lc cc c1 2m Rser=0.2
Ba a1 st V=80*sin(w*time)
Bb b1 st V=80*sin(w*time-2*pi/3)
Bc c1 st V=80*sin(w*time+2*pi/3)
Vd ud 0 PWL(0 0.3 4m 0.5)
Bra ra 0 V=v(ud)*cos(w*time)
Brb rb 0 V=v(ud)*cos(w*time-2*pi/3)
Brc rc 0 V=v(ud)*cos(w*time+2*pi/3)
Bp pw 0 V=v(a,st)*i(La)+v(b,st)*i(Lb)+v(cc,st)*i(Lc)
Rp pw 0 1k
Xa p n a ra c LEG
Xb p n b rb c LEG
Xc p n cc rc c LEG
.tran 50u 2m uic
"""


@pytest.mark.parametrize("stop", ["20u", "25u", "100u"])
def test_strings_of_leds_behind_a_buck(stop: str) -> None:
    runs = [nsspice.tran(nsspice.read(LEDS.format(stop=stop)), reltol=r) for r in (1e-5, 1e-7)]
    for run in runs:
        assert run.certificate.passed
    stats = runs[0].islands[0].stats
    # two switchings a period: beside their steps some twenty linearisations each
    assert stats["linearised"] < 40 * stats["steps"]
    for name in ("v(o)", "i(l1)"):
        fine = runs[1][name]
        assert np.abs(runs[0][name] - fine).max() <= 1e-4 * np.ptp(fine)


def test_drive_with_three_legs() -> None:
    runs = [nsspice.tran(nsspice.read(DRIVE), reltol=r) for r in (1e-5, 1e-7)]
    for run in runs:
        assert run.certificate.passed
        assert run.islands[0].stats["worst_stage"] < 3  # no homotopy is asked for
    for name in ("i(la)", "i(lb)", "i(lc)"):
        fine = runs[1][name]
        assert np.abs(runs[0][name] - fine).max() <= 1e-4 * np.ptp(fine)


#: a rectifier of ideal diodes; a block senses it and does not act on it
COMMUTATION = """half-wave rectifier with a freewheeling diode
V1 in 0 SIN(2 10 1k 0.1m)
D1 in b
D2 0 b
L1 b out 1m
C1 out 0 20u
R1 out 0 10
{sensor}
.tran 10u 3m uic
"""
SENSORS = (
    "B1 0 f1 I={tanh(v(b,out)/5)*1m}\nRf f1 0 1k\nCf f1 0 10n",
    "B1 0 f1 I={tanh(v(in)/5)*1m}\nRf f1 0 1k\nCf f1 0 10n\nB0 m0 0 V={v(in)*v(in)/50}",
)


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("reltol", [1e-5, 1e-7])
def test_a_current_commutates_beside_a_smooth_block(sensor: str, reltol: float) -> None:
    """Just behind the zero of the source both diodes conducted, with a microvolt round their loop.

    Newton's method moved their currents by milliamperes in each step and gave up (NS3004); a
    circuit like it went on with a wrong current, by 1 V of the output.
    """
    exact = nsspice.tran(nsspice.read(COMMUTATION.format(sensor="")), method="modewise")
    deck = COMMUTATION.format(sensor=sensor)
    run = nsspice.tran(nsspice.read(deck), method="sdirk", reltol=reltol)
    assert run.certificate.passed
    # the sum of the errors of some hundred steps
    assert np.abs(run["v(out)"] - exact["v(out)"]).max() < 100 * reltol * exact["v(out)"].max()
