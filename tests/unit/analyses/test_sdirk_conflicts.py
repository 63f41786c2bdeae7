"""Conflicts on the way of controlled steps: refused by name where they begin, not stepped into."""

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
