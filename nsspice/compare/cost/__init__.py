"""What accuracy costs: a deck with every method over a series of steps or tolerances."""

from __future__ import annotations

from .measure import cost
from .reference import Reference, make_reference
from .report import Advice, CostReport, Measurement

__all__ = ["Advice", "CostReport", "Measurement", "Reference", "cost", "make_reference"]
