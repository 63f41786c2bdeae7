"""CSV files (RFC 4180): one header line, doubles in the shortest text that reads back the same."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
import numpy.typing as npt

from .._core import format_rows
from ..errors import OutputError
from .atomic_write import aside, publish
from .files import output_error
from .safe_text import visible

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution

Floats = npt.NDArray[np.float64]
_BLOCK = 1 << 16  # numbers formatted at once: some MB of text


def header(names: Sequence[str]) -> bytes:
    r"""Return the header line; names with commas or quotes are quoted.

    Examples
    --------
    >>> header(["time", "v(a,b)"])
    b'time,"v(a,b)"\n'
    """
    cells = ['"' + n.replace('"', '""') + '"' if set(n) & set(',"\r\n') else n for n in names]
    return (",".join(cells) + "\n").encode()


class CsvSink:
    """Writes rows to a CSV file while they are computed, in bounded memory.

    Rows go to ``NAME.part`` next to the file, which gets its name when it is closed: an older file
    is left alone until then.  After each block the part holds complete lines only.

    Parameters
    ----------
    target : str, Path or binary stream
        A stream (standard output) is flushed, not closed.
    """

    def __init__(self, target: str | Path | BinaryIO) -> None:
        self.path = Path(target) if isinstance(target, (str, Path)) else None
        self.rows = 0
        self._file: BinaryIO | None = None if isinstance(target, (str, Path)) else target
        self._names: list[str] = []
        self._started = False
        self._part: Path | None = None
        self._good = 0  # size of the file up to its last complete row

    @property
    def name(self) -> str:
        """The target as the user knows it."""
        return str(self.path) if self.path else "standard output"

    def open(self, names: Sequence[str]) -> None:
        """Take the column names."""
        self._names = list(names)

    def write(self, block: Floats) -> None:
        """Write rows; columns beyond the names are left out."""
        width = len(self._names)
        size = max(1, _BLOCK // max(width, 1))
        try:
            file = self._start()
            for k in range(0, block.shape[0], size):
                part = np.ascontiguousarray(block[k : k + size, :width])
                file.write(format_rows(part))
                file.flush()
                self.rows += part.shape[0]
                if self.path is not None:
                    self._good = file.tell()
        except BrokenPipeError:
            raise  # the reading program has what it wanted
        except OSError as error:
            self._abandon()
            raise self._error(error) from error

    def _error(self, error: OSError) -> OutputError:
        kept = f"; they are kept in {self._part}" if self._part not in (None, self.path) else ""
        return output_error(error, self.name, f"after {self.rows} rows{kept if self.rows else ''}")

    def _start(self) -> BinaryIO:
        if self._file is None:
            assert self.path is not None
            self._part = aside(self.path)
            self._file = self._part.open("wb")
        if not self._started:
            self._started = True
            names = self._names
            if self.path is None and self._file.isatty():
                names = [visible(name) for name in names]
            self._file.write(header(names))
        return self._file

    def _abandon(self) -> None:
        """Close a file that takes no more, cut back to complete rows."""
        if self.path is None or self._file is None:
            return
        with contextlib.suppress(OSError):  # closing flushes once more, and may fail once more
            self._file.close()
        with contextlib.suppress(OSError):
            os.truncate(self._part or self.path, self._good)

    def close(self) -> None:
        """Write the header if no row came, and close the file."""
        try:
            file = self._start()
            file.flush()
            if self.path is not None:
                file.close()
                publish(self._part or self.path, self.path)
        except BrokenPipeError:
            raise
        except OSError as error:
            self._abandon()
            raise self._error(error) from error


def write_csv(solution: Solution, path: str | Path, columns: Sequence[str] | None = None) -> None:
    """Write a solution's columns to a file.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    names, table = solution.table(columns)
    sink = CsvSink(path)
    sink.open(names)
    sink.write(table)
    sink.close()
