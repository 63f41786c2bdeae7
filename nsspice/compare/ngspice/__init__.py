"""Cross-checks with ngspice, another simulator, on the same circuit.

ngspice supports only smooth laws: an ideal diode or switch is replaced by a sharp smooth one, and
every replacement is listed.  ngspice is optional; it runs in a separate process.
"""

from __future__ import annotations

from .cross_check import CrossCheck, cross_check
from .deck_writer import Substitute
from .options import Options
from .result import NgspiceError, NgspiceRun
from .runs import run
from .translate import Translation, translate

__all__ = [
    "CrossCheck",
    "NgspiceError",
    "NgspiceRun",
    "Options",
    "Substitute",
    "Translation",
    "cross_check",
    "run",
    "translate",
]
