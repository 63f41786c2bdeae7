"""Cross-checks with ngspice, another simulator, on the same circuit.

ngspice supports only smooth laws: an ideal diode or switch is replaced by a sharp smooth one, and
every replacement is listed.  ngspice is optional; it runs in a separate process.  Read
``cross_check`` (both runs and the verdict), ``translate`` (the deck for ngspice, with a function
per letter in ``elements``), ``process`` (the two ways to start it).  Imports what ``compare`` may.
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
