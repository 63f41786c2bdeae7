"""Waveforms as files and pictures, results as text and JSON.

Read ``csv`` and ``files`` (how files are written), ``plot`` (pictures), ``summary`` (what a run
prints), ``report`` (the HTML page).  Imports ``analyses`` and everything below it.
"""

from __future__ import annotations

from .csv import CsvSink, write_csv
from .raw import write_raw
from .summary import describe, to_dict

__all__ = [
    "CsvSink",
    "describe",
    "to_dict",
    "write_csv",
    "write_raw",
]
