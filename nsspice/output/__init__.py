"""Waveforms as files and pictures, results as text and JSON."""

from __future__ import annotations

from ..analyses.events import Event
from ..analyses.solution import Impulse, IslandRun, Solution
from .csv import CsvSink, write_csv
from .raw import write_raw
from .summary import describe, to_dict

__all__ = [
    "CsvSink",
    "Event",
    "Impulse",
    "IslandRun",
    "Solution",
    "describe",
    "to_dict",
    "write_csv",
    "write_raw",
]
