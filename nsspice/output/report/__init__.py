"""The report: one self-contained page of a run, to be opened offline, sent or archived."""

from __future__ import annotations

from .page import page_of, write_report

__all__ = ["page_of", "write_report"]
