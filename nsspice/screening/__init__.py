"""Which effects matter, and what they cost: a deck is run without each of its effects.

Read ``search`` first (which decks are tried), then ``candidates`` (what may be left out), ``edits``
(how a deck is written without it), ``trial`` (one run) and ``result`` (the table).  ``line_fit``
replaces junctions by lines, ``comparison_basis`` chooses the measures.  Imports ``output``,
``analyses`` and everything below them.
"""

from __future__ import annotations

from .edits import Edit
from .result import EffectRow, EffectsReport
from .search import effects

__all__ = ["Edit", "EffectRow", "EffectsReport", "effects"]
