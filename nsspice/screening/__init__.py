"""Which effect matters, and what it costs: a deck is run with each of its effects left out."""

from __future__ import annotations

from .edits import Edit
from .result import EffectRow, EffectsReport
from .search import effects

__all__ = ["Edit", "EffectRow", "EffectsReport", "effects"]
