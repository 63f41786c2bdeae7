"""A full bridge of switches with a diode beside each, for decks that several tests share."""

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
