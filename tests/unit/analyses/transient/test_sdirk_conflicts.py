"""Conflicts on the way of controlled steps: refused by name where they begin, not stepped into."""

import math

import pytest

import nsspice

#: the diode breaks down across the source once v(a) < -20 V; a choke carries 10 A meanwhile, whose
#: voltage in a step of picoseconds is 1e8 V: what diodes bear backward is 1e-10 of that
BREAKDOWN = """breakdown across a source, beside a choke
V1 a 0 SIN(0 325 4238.4)
L1 0 e 37.45u
C1 e x 1.047u
R1 x b 0.413
C2 a y 203.5n
R2 y c 0.08166
C3 e c 544n
D1 0 b ideal
D2 d b zener
S1 a d b 0 held
.model held SW(VT=5 VH=8)
.model ideal D(ideal)
.model zener D(ideal Vrev=20 Vfwd=0.5)
.tran 0.59u 177u uic
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_a_conflict_is_not_hidden_by_the_voltage_of_an_inductor(method):
    with pytest.raises(nsspice.InfeasibleError) as caught:
        nsspice.tran(nsspice.read(BREAKDOWN), method=method)
    assert set(caught.value.elements) == {"v1", "d1", "d2", "s1"}
    # -325 sin(w t) = 20 in the second half of the period, 0.5 pi/w later at the latest step
    partial = caught.value.partial
    assert partial is not None
    assert partial["v(a)"][-1] > -20.0
    assert partial.time[-1] > 119e-6


#: two thresholds of 0.5 V across a source that passes 1 V; what is stored elsewhere sets the pace
THRESHOLDS = """two diodes in series across a source
V1 a 0 SIN(0 100 479.365)
L1 a l 41.23m
R1 l b 0.48
R2 f d 22.62
C1 e y 209.3n
R3 y a 39.63
D1 a d twoway
D2 d 0 twoway
S1 c a g 0 fast
V2 g 0 PULSE(0 1 11.419u 0 0 15.034u 71.4486u)
.model twoway D(ideal Vrev=20 Vfwd=0.5)
.model fast SW(VT=0.5)
.tran 5.21523u 1.56457m uic
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_a_conflict_below_the_tolerance_is_not_passed_in_ever_shorter_steps(method):
    """Either diode can be a microvolt off, by turns, for ten thousand steps of femtoseconds."""
    with pytest.raises(nsspice.InfeasibleError) as caught:
        nsspice.tran(nsspice.read(THRESHOLDS), method=method)
    assert set(caught.value.elements) == {"v1", "d1", "d2"}
    # 100 V sin(w t) = 1 V, to the tolerance of the voltage
    instant = math.asin(0.01) / (2 * math.pi * 479.365)
    found = float(str(caught.value.diagnostics[0].message).split("t = ")[1].split(" ")[0])
    assert found == pytest.approx(instant, rel=2e-5)
    assert caught.value.partial.islands[0].stats.get("steps", 0) < 500
