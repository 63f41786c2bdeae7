"""A thyristor whose gate is pulsed while nothing flows."""

FIRED_AT_REST = """fired at rest: the current that would hold it is rounding
V1 a 0 SIN(0 10 50)
R0 0 d 6.889
L0 d 0 58.6m
R1 0 c 27.19
R2 b 0 48.55k
C0 c x0 27.3u
R3 x0 b 4.038
D0 c d g thyristor
R4 g d 1k
V2 g d PULSE(0 5 5.15621m 0 0 0.513969m 20m)
D1 b a
D3 d b
.model thyristor SCR(Vgt=2 Vbo=30 Vrev=150 Rrev=1)
.tran 0.2m 20m
"""
