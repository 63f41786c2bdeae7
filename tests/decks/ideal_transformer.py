"""A transformer made of controlled sources: no current leaves its secondary."""

from __future__ import annotations

#: cards: primary at `a` behind 10 mOhm, secondary from `n` to `s`, and on to `u` by 10 mOhm
IDEAL_TRANSFORMER = """V1 p 0 SIN(0 1 10k)
R1 p a 0.01
F1 a 0 Vs -10
E1 s x a 0 10
Vs x n 0
R2 s u 0.01
"""
