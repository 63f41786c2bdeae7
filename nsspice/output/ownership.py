"""Which files nsspice has written: those it may replace without being asked.

Nothing is kept next to a file.  Raw files, pictures and pages name their program; a table is known
by its form: a header of signals, and numbers that are each the shortest text of their double.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np

from .._core import format_rows

_HEAD = 1 << 16  # bytes looked at, from both ends
_ROWS = 100
#: ``v(a)``, ``i(r1)``, without the blanks and capitals of other programs
_SIGNAL = re.compile(r"[a-z]\w*\([^()\s]*\)")
_PLAIN = re.compile(r"[^A-Z\s]+")


def written_by_nsspice(path: Path) -> bool:
    """Return whether a file is one of nsspice's own, or empty.

    Parameters
    ----------
    path : Path
        An ordinary file.

    Raises
    ------
    OSError

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     own, lab = Path(folder, "a.csv"), Path(folder, "b.csv")
    ...     _ = own.write_text("time,v(a)\\n0,1\\n1e-6,0.5\\n")
    ...     _ = lab.write_text("time,v(a)\\n0.000,1.000\\n0.000001,0.500\\n")
    ...     written_by_nsspice(own), written_by_nsspice(lab)
    (True, False)
    """
    with path.open("rb") as file:
        head = file.read(_HEAD)
        size = file.seek(0, 2)
        file.seek(max(size - _HEAD, 0))
        tail = file.read(_HEAD)
    if not head:
        return True
    # pictures and archives name their program
    if head.startswith((b"\x89PNG", b"%PDF", b"<?xml", b"PK\x03\x04", b"PAR1", b"\x89HDF")):
        return b"nsspice" in head or b"nsspice" in tail
    if head.lstrip()[:15].lower() == b"<!doctype html>":
        return b'name="generator" content="nsspice' in head
    if head.startswith(b"<svg") and b"<desc>drawn by nsspice</desc>" in head:
        return True
    if b"\n* recommended by nsspice effects" in head:
        return True
    if head.startswith(b"cross-check of nsspice\n"):  # a deck for ngspice
        return True
    if head.startswith(b'{\n "name": '):  # an operating point of windings
        return head.split(b"\n")[1].endswith(b'(by nsspice)",')
    if head.startswith(b"! "):  # scattering parameters
        return head.split(b"\n")[0].endswith(b"(by nsspice)")
    if head.startswith(b"Title:"):
        return b"\nCommand: nsspice" in head
    return _is_table(head, len(head) == size)


def _is_table(head: bytes, complete: bool) -> bool:
    """Return whether the beginning of a file is that of a table, whole lines only."""
    lines = head.split(b"\n")
    if not complete or lines[-1] == b"":
        lines = lines[:-1]
    try:
        names = _names(lines[0].decode("utf-8"))
    except (UnicodeDecodeError, IndexError, StopIteration, csv.Error):
        return False
    if not all(map(_PLAIN.fullmatch, names)) or not any(map(_SIGNAL.fullmatch, names)):
        return False
    for line in lines[1 : 1 + _ROWS]:
        try:
            row = np.array([float(cell) for cell in line.split(b",")])
        except ValueError:
            return False
        if row.size != len(names) or format_rows(row[None]) != line + b"\n":
            return False
    return True


def _names(header: str) -> list[str]:
    """Return the cells of a header line; names with commas are in quotes."""
    return next(csv.reader([header]))
