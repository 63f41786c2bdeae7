"""Parts of converters, and one converter, of which several tests make their decks."""

from __future__ import annotations

#: between ``a`` and ground, gates ``g`` and ``h``; its output lies between ``p`` and ``q``
BRIDGE = """S1 a p g 0 sw
S2 p 0 h 0 sw
D1 0 p ds
D2 p a ds
S3 a q h 0 sw
S4 q 0 g 0 sw
D3 0 q ds
D4 q a ds
"""

#: windings ``L1`` to ``L3`` without leakage, two of which a rectifier joins to ``f``
SECONDARY = """K1 L1 L2 1
K2 L1 L3 1
K3 L2 L3 1
D5 s f ds
D6 t f ds
"""

#: a coil, a capacitor and a winding in series, on a bridge without capacitance
RESONANT = (
    """LLC converter, junctions with a transit time
Vin a 0 48
Vg g 0 PULSE(0 1 0 2.9u 2.9u 66.3u 287u)
Vh h 0 PULSE(0 1 143.5u 2.9u 2.9u 66.3u 287u)
"""
    + BRIDGE
    + """Lr p p2 5.5m
Cr p2 p3 374n
L1 p3 q 275m
L2 s 0 50.9m
L3 0 t 50.9m
"""
    + SECONDARY
    + """Rf f o 31m
C1 o 0 1.36m
R1 o 0 10.5
.model ds D(IS=6.88e-11 RS=26.1m TT=2.53n)
.model sw SW(VT=0.5)
.tran 14.34u 300u
"""
)

#: four windings with a switch and a diode at each primary, rectified to ``f``; the deck has
#: parameters ``primary`` and ``secondary`` [H] and ``k``
PUSH_PULL = """L1 a m1 {primary}
L2 m2 a {primary}
L3 s 0 {secondary}
L4 0 t {secondary}
K1 L1 L2 {k}
K2 L1 L3 {k}
K3 L1 L4 {k}
K4 L2 L3 {k}
K5 L2 L4 {k}
K6 L3 L4 {k}
S1 m1 0 g 0 sw
S2 m2 0 h 0 sw
D3 0 m1 ds
D4 0 m2 ds
D1 s f ds
D2 t f ds
"""


def half_bridge(k: int, on: float, off: float, pulse: str) -> str:
    """Two switches with a diode beside each, from ``a`` and ground to ``p{k}``, and their gates.

    These have one pulse (its edges, width and period) from ``on`` and from ``off`` on [us].
    """
    return f"""Vg{k} g{k} 0 PULSE(0 1 {on}u {pulse})
Vh{k} h{k} 0 PULSE(0 1 {off}u {pulse})
Sh{k} a p{k} g{k} 0 sw
Sl{k} p{k} 0 h{k} 0 sw
Dh{k} p{k} a ds
Dl{k} 0 p{k} ds
"""
