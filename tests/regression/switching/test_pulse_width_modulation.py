"""Bridges whose gates are comparisons of a reference with a carrier, as SPICE decks write them."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

NPC = """Leg of three levels, antiparallel and clamping diodes
V1 p m 300
V2 m n 300
Vm m 0 0
S1 p a g1 0 SW
S2 a o g2 0 SW
S3 o b g3 0 SW
S4 b n g4 0 SW
D1 a p
D2 o a
D3 b o
D4 n b
D5 m a
D6 b m
L1 o q 2m
R1 q 0 5
Vr r 0 SIN(0 0.9 50)
Vc1 c1 0 PULSE(0 1 0 0.25m 0.25m 0 0.5m)
B1 g1 0 V=if(v(r)>v(c1),1,0)
B2 g2 0 V=if(v(r)>v(c1)-1,1,0)
B3 g3 0 V=1-v(g1)
B4 g4 0 V=1-v(g2)
.model SW SW(VT=0.5)
.tran 20u 40m
"""
RECTIFIER = """Active rectifier with dead time
V1 a 0 SIN(0 325 50)
L1 a x 3m
R1 x y 0.1
S1 p y g1 0 SW
S2 y n g2 0 SW
S3 p 0 g2 0 SW
S4 0 n g1 0 SW
D1 y p
D2 n y
D3 0 p
D4 n 0
C1 p n 2m IC=400
Ro p n 40
Vr r 0 SIN(0 0.8 50 0 0 -10)
Vc c 0 PULSE(-1 1 0 0.25m 0.25m 0 0.5m)
B1 g1 0 V=if(v(r)-v(c)>0.02,1,0)
B2 g2 0 V=if(v(r)-v(c)<-0.02,1,0)
.model SW SW(VT=0.5)
.tran 20u 20m uic
"""


@pytest.mark.parametrize("text", [NPC, RECTIFIER], ids=["three levels", "rectifier"])
def test_two_engines_agree_and_nothing_jumps(text: str) -> None:
    """A switch that closes beside a conducting diode shares its current; no flux may jump there.

    Each of two hundred events may err by the tolerance; the exact engine needs no implicit step.
    """
    circuit = nsspice.read(text)
    exact = nsspice.tran(circuit)
    assert exact.islands[0].method == "modewise"
    assert exact.stats["fixed_steps"] == 0
    assert exact.certificate.passed
    assert exact.stats["jumps"] == 0
    size = np.abs(exact["i(l1)"]).max()
    for reltol in (1e-6, 1e-8):
        run = nsspice.tran(circuit, method="sdirk", reltol=reltol)
        assert run.certificate.passed
        assert run.stats["jumps"] == 0
        assert np.abs(run["i(l1)"] - exact["i(l1)"]).max() <= 200.0 * reltol * size


def test_a_comparator_switches_where_the_signals_cross() -> None:
    """A sine against a triangle: the instants solve one equation each."""
    run = nsspice.tran(nsspice.read(NPC))
    times = np.array([e.time for e in run.events if e.element == "b1#1"])
    carrier = np.abs((times / 0.25e-3 + 1.0) % 2.0 - 1.0)
    # twice at each lowest point of the carrier between zeros of the reference, where both touch
    assert 76 <= times.size <= 80
    assert np.abs(0.9 * np.sin(100.0 * np.pi * times) - carrier).max() <= 1e-12


def test_the_first_harmonic_is_that_of_the_reference() -> None:
    """Two carriers in phase: the mean over a carrier follows the reference, up to its slope."""
    run = nsspice.tran(nsspice.read(NPC.replace("20u 40m", "1u 40m 20m")))
    t, v = run.time[:-1], run["v(o)"][:-1]
    first = 2.0 * np.mean(v * np.exp(-1j * 100.0 * np.pi * t))
    # natural sampling has no error at the first harmonic; 40 pulses are cut off by rows of 1 us
    assert abs(first - (-1j) * 0.9 * 300.0) <= 80 * 300.0 * 1e-6 / 20e-3


@pytest.mark.parametrize(
    ("carrier", "duty"),
    [
        ("asin(sin(2*pi*10k*time))*2/pi", 0.75),
        ("sin(2*pi*10k*time)**3", 0.5 + np.arcsin(0.5 ** (1 / 3)) / np.pi),
    ],
)
def test_no_pulse_of_a_carrier_of_time_is_missed(carrier: str, duty: float) -> None:
    """A fiftieth of the run is eight periods, and the filter is at rest between pulses."""
    run = nsspice.read(f"""Comparator and a carrier that only an expression knows
Bt t 0 V={carrier}
Bg g 0 V=if(0.5 > v(t), 1, 0)
R1 g o 1k
C1 o 0 1n
.tran 5u 40m
.meas duty AVG v(g)
""").run()[0]
    assert abs(run.measures["duty"] - duty) < 1e-4
    assert len(run.events) == 800
