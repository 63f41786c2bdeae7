"""Converters with a periodic steady state, as texts; others stand in netlists/steady."""

SWITCH = ".model SH SW(VT=0)\n"

LLC = (
    """LLC resonant converter: half bridge, ideal transformer, diode bridge
.param f=90k t={1/f}
Vin in 0 200
S1 in sw g 0 SH
S2 sw 0 0 g SH
Vg g 0 PULSE(-1 1 0 0 0 {t/2} {t})
Cr sw a 47n
Lr a b 60u
Lm b 0 240u
Ls c d 240u
K1 Lm Ls 1
D1 c o
D2 d o
D3 0 c
D4 0 d
Co o 0 10u
Ro o 0 25
"""
    + SWITCH
)

SERIES_RESONANT = (
    """Series resonant converter above resonance
.param t=10u
V1 in 0 100
S1 in a g 0 SH
S2 a 0 0 g SH
Vg g 0 PULSE(-1 1 0 0 0 {t/2} {t})
C1 a b 100n
L1 b c 40u
D1 c p
D2 0 p
D3 m c
D4 m 0
Co p m 10u
Ro p m 10
"""
    + SWITCH
)

PHASE_SHIFTED = (
    """Phase-shifted full bridge; a little resistance holds the mean flux of the transformer
.param t=10u ph=3u
Vin in 0 300
SA in a ga 0 SH
SB a 0 0 ga SH
SC in b gb 0 SH
SD b 0 0 gb SH
Vga ga 0 PULSE(-1 1 0 0 0 {t/2} {t})
Vgb gb 0 PULSE(-1 1 {ph} 0 0 {t/2} {t})
Lk a q 5u
Rk q p 1
L1 p b 20u
L2 s1 s2 5u
K1 L1 L2 0.999
D1 s1 x
D2 s2 x
D3 0 s1
D4 0 s2
Lo x o 20u
Rl p b 10k
Co o 0 1u
Ro o 0 4
"""
    + SWITCH
)

THREE_PHASE = """Three-phase rectifier with line inductors
Va a n SIN(0 325 50 0 0 0)
Vb b n SIN(0 325 50 0 0 -120)
Vc c n SIN(0 325 50 0 0 120)
Rn n 0 1k
La a u 2m
Lb b v 2m
Lc c w 2m
D1 u p
D2 v p
D3 w p
D4 m u
D5 m v
D6 m w
Co p m 100u
Ro p m 50
"""

DISCONTINUOUS = (
    """Buck converter in discontinuous conduction
.param t=10u
Vin in 0 24
S1 in sw g 0 SH
D1 0 sw
L1 sw out 10u
C1 out 0 2u
R1 out 0 50
Vg g 0 PULSE(-1 1 0 0 0 {0.3*t} {t})
"""
    + SWITCH
)
