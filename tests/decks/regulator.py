"""A regulator of 18 transistors, for tests of its operating points."""

from __future__ import annotations

#: LM7805 without load: its reference starts between 4 V and 5 V
REGULATOR = """a regulator starts
QT6 23 10 0 qn 0.1
QT7 5 4 10 qn 0.1
QT5 7 6 5 qn 0.1
QT1 in 9 8 qn 0.1
QT3 11 8 7 qn 0.1
QT2 11 13 12 qn 0.1
QT17 in 15 14 qn 10
R16 12 5 500
R12 16 0 12.1K
QT18 17 23 16 qn 0.1
D1 18 19 dd
R11 20 21 850
R5 22 out 100
QT14 24 18 0 qn 0.1
R21 6 0 2.67K
R20 out 6 640
DZ2 25 26 z1
R19 in 26 16K
R18 14 out 250M
R17 25 14 380
R15 25 15 1.62K
QT16 in 20 15 qn 1
QT15 0 24 21 qp 0.1
R14 21 24 4K
R13 19 0 4K
QT13 24 27 18 qn 0.1
QT12 20 25 22 qn 1
QT11 20 28 0 qn 0.1
QT10 20 11 in qp 0.1
R10 17 27 16.5K
R9 5 4 1.9K
R8 4 23 26
R7 10 0 1.2K
R6 29 0 1K
QT9 11 11 in qp 0.1
QT8 27 16 29 qn 0.1
QT4 15 6 17 qn 0.1
DZ1 0 9 z6
R4 in 9 80K
R3 28 0 830
R2 13 28 4.97K
R1 8 13 7K
.model z1 D(IS=10f N=1.16 BV=5.1 IBV=0.5m)
.model z6 D(IS=10f N=1.16 BV=5.6 IBV=5u)
.model qn NPN(IS=10f NF=1.16 NR=1.16 BF=80)
.model qp PNP(IS=10f NF=1.16 NR=1.16 BF=80)
.model dd D(IS=1f N=1.16)
VIN in 0 12
"""
