"""A deck whose mode has the index three."""

from __future__ import annotations

#: the second derivative of a sine, behind an ideal diode
INDEX_THREE = """A coil that takes a second derivative, and a diode behind it
V1 a 0 SIN(0 1 1)
C1 a 0 1
F1 0 b V1 -1
L1 b 0 1
D1 b c
R1 c 0 1
.tran 10m 2
"""
