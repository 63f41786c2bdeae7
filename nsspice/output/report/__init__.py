"""The report: one self-contained page of a run, to be opened offline, sent or archived.

Read ``page`` (the document), ``content`` (tables and sentences), ``waveforms`` (the data and the
script that draws it).  Imports the files next to this folder, and ``analyses``.
"""

from __future__ import annotations

from .page import page_of, write_report

__all__ = ["page_of", "write_report"]
