"""Which effects matter, and what they cost: a deck is run without each of its effects."""

from __future__ import annotations

from .edits import Edit
from .result import EffectRow, EffectsReport
from .search import effects

__all__ = ["Edit", "EffectRow", "EffectsReport", "effects"]
