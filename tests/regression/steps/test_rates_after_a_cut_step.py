"""A step that a breakpoint cuts to nearly nothing leaves no rates for the next one.

In this power factor corrector the comparator of the duty cycle is reached 8e-16 s before the end
of an edge of the saw-tooth.  The rates of the step between both were differences of 325 V over
2e-16 s: 280 V/s, or 0.12 A in 440 uF, of rounding.  The step after it began with them.
"""

from __future__ import annotations

import nsspice

PFC = """PFC boost, average current mode
.param fsw=65k Vref=390
Vac l n SIN(0 325 50)
Rn n 0 1meg
D1 l rec DB
D2 n rec DB
D3 0 l DB
D4 0 n DB
.model DB D(Vfwd=0.8 Ron=20m)
Cx rec 0 470n
Lb rec sw 600u Rser=50m
Vsen sw sw2 0
S1 sw2 0 gate 0 SM
Dbst sw2 out DBO
.model SM SW(VT=2.5 VH=0 Ron=80m)
.model DBO D(Vfwd=1.2 Ron=50m)
Co out 0 440u IC=325
Rl out 0 {390*390/500}
Bev ev 0 V=(Vref-v(out))/Vref
Giv 0 vi ev 0 20u
Civ vi 0 1u IC=0.2
Rlk vi 0 100meg
Bvc vc 0 V=limit(v(vi)+2*v(ev), 0, 1)
Bir ir 0 V=v(vc)*10*v(rec)/325
Bei ei 0 V=v(ir)-i(Vsen)
X1 0 mi vcmd opa
Ri1 ei0 mi 10k
Bneg ei0 0 V=-v(ei)
Rf vcmd nf 5k
Cf nf mi 10n IC=0
Vsaw saw 0 PULSE(0 1 0 {0.98/fsw} {0.01/fsw} {0.01/fsw} {1/fsw})
Bg gate 0 V=if(v(vcmd)>v(saw),5,0)
.subckt opa p m o
R1 p m 10meg
G1 0 x p m 1m
Rx x 0 1e8
Cx x 0 16n
E1 o 0 TABLE {v(x)} = (-0.2,-0.2) (0.95,0.95)
.ends
.tran 1u 0.2m uic
.end
"""


def test_a_corrector_is_certified(runs_return) -> None:
    (run,) = nsspice.read(PFC).run()
    # Newton's method leaves 1e-11 of the terms open; it was 2.5e-7
    assert run.certificate.laws < 1e-10
