"""What accuracy costs: a deck with every method over a series of steps or tolerances.

Read ``measure`` (the runs of all methods), ``reference`` (what is taken for exact, and how exact it
is), ``report`` (the table); ``ngspice_ladders`` adds ngspice's runs, ``picture`` draws them.
Imports ``ngspice`` and everything that ``compare`` may.
"""

from __future__ import annotations

from .measure import cost
from .reference import Reference, make_reference
from .report import Advice, CostReport, Measurement

__all__ = ["Advice", "CostReport", "Measurement", "Reference", "cost", "make_reference"]
