"""A deck that no engine can follow event by event."""

from __future__ import annotations

#: no state of the switch holds 1 V: it chatters, and no engine can follow one event after the other
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
