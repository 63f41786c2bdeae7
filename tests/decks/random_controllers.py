"""Random closed loops with saturating controllers: a plant, filters, expressions with kinks."""

from __future__ import annotations

import numpy as np

#: what a controller may do with its error, an input x and a level a between 0.2 and 2
_LAWS = (
    "limit({x},-{a},{a})",
    "min(max({x},-{a}),{a})",
    "table({x},-{a},-1,0,0,{a},2)",
    "table({x},-{a},-1,-{b},0,{b},0,{a},1.5)",
    "if({x}>{a},{a},if({x}<-{a},-{a},{x}))",
    "abs({x})-abs({x}-{a})",
    "({x}>{a}) ? ({x}-{a}) : (({x}<-{a}) ? ({x}+{a}) : 0)",
    "uramp({x})-uramp(-{x}-{a})",
    "{x}*(v(gate)>0.5)",
    "limit({x},-{a},v(ref)*v(ref)>0.04 ? {a} : {b})",
    "max({x},0)*if(v(saw)>{b},1,0.5)",
    "limit({x}+0.1*abs(v(p1)),min(0,v(ref)),max(0.5,v(p1)))",
)


def controller_deck(seed: int) -> str:
    """Return a deck: integrators and lags in a loop that is closed by one or two random laws."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.5, 2.0), rng.uniform(0.05, 0.4)

    def law(x: str) -> str:
        text = _LAWS[rng.integers(len(_LAWS))].replace("v(ref)*v(ref)>0.04", "v(ref)>0.2")
        return text.format(x=f"({x})", a=f"{a:.3f}", b=f"{b:.3f}")

    gain, damping = rng.uniform(1.0, 8.0), rng.uniform(0.2, 2.0)
    return f"""saturating controller {seed}
Vref ref 0 SIN({rng.uniform(-0.3, 0.3):.3f} {rng.uniform(0.5, 2.0):.3f} {rng.uniform(0.4, 2.0):.3f})
Vsaw saw 0 PULSE(0 1 0 0.09 0.09 0.02 0.2)
Vgate gate 0 PULSE(0 1 {rng.uniform(0, 0.3):.3f} 1m 1m 0.3 {rng.uniform(0.7, 1.1):.3f})
* controller: proportional and integral part
Ex xin 0 VALUE={{{law("v(ref)-v(p1)")}}}
Gi 0 int VALUE={{v(xin)-{damping:.3f}*v(int)}}
Ci int 0 1 IC={rng.uniform(-1, 1):.3f}
Bu u 0 V={{{law(f"{gain:.3f}*v(xin)+v(int)")}}}
* plant of second order
R1 u p0 0.2
C1 p0 0 1 IC=0
R2 p0 p1 0.3
C2 p1 0 0.5 IC=0
R3 p1 0 5
.tran 10m 4 uic
.options reltol=1e-10
"""
