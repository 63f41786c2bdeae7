"""Decks that no engine can follow event by event."""

from __future__ import annotations

from dataclasses import replace

from nsspice.analyses.certificate.certificate import Certificate


def late_but_sound(certificate: Certificate | None) -> bool:
    """Return whether all that a certificate blames is that sampled switches react late."""
    assert certificate is not None
    return certificate.late > 1.0 and replace(certificate, late=0.0).passed


#: no state of the switch holds 1 V: it chatters, and is sampled
CHATTER = """chatter
V1 in 0 SIN(10 1 300)
R1 in a 1k
S1 a c ref c COMPARE
C1 c 0 1u IC=0
R2 c 0 1k
Vr ref 0 DC 1
.model COMPARE SW(VT=0 VH=0)
.tran 1u 2m uic
.end
"""

#: a nanosecond of storage delays the comparator: implicit steps pass over its gigahertz
MODULATOR = """sigma-delta modulator whose comparator chatters while the clock is high
V1 in 0 SIN(0 0.5 1k)
R1 in x 10k
R2 q x 10k
E1 int 0 0 x 1e6
C1 x int 1n
B1 cmp 0 V=if(v(int)>0,-1,1)
S1 cmp m clock 0 sample
C2 m 0 10p
E2 q 0 m 0 -1
V2 clock 0 PULSE(0 1 0 1n 1n 100n 1u)
.model sample SW(VT=0.5 RON=100)
.tran 0.5u 1m uic
"""

#: a half-controlled bridge; where all four conduct, nothing tells how they share their currents,
#: and a gate turns back and forth with the rounding of an instant
CONTROLLED = """Bridge of two thyristors and two diodes, gates by expressions, which float
V1 a 0 SIN(0 100 50)
Ls a x 1m
D1 x p g1 thyristor
D2 0 p g2 thyristor
D3 n x diode
D4 n 0 diode
L1 p m 20m
R1 m n 10
B1 g1 p V={v(a)>50 ? 5 : 0}
B2 g2 p V={v(a)<-50 ? 5 : 0}
.model thyristor SCR(Vgt=1)
.model diode D(ideal)
.tran 0.1m 60m
"""
