"""Waveforms as files and pictures, results as text and JSON."""

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
