"""Other simulators on the decks of the work-precision page, each in a Python of its own."""

from __future__ import annotations

from .ladder import measure

__all__ = ["measure"]
