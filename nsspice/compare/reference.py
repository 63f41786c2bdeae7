"""Reference waveforms from CSV files."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..analyses.signals.curve import Curve, Floats
from ..errors import Diagnostic, OutputError, UsageError, suggest


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of numbers by name.

    Parameters
    ----------
    path : Path
    names : list of str
        As in the header line.
    data : ndarray, shape (rows, columns)
    """

    path: Path
    names: list[str]
    data: Floats

    def column(self, name: str) -> Floats:
        """Return one column, shape (rows,).

        Raises
        ------
        UsageError
            If there is no such column.
        """
        if name not in self.names:
            known = ", ".join(self.names[:12])
            raise UsageError(
                Diagnostic(
                    "NS4011",
                    f"{self.path} has no column {name!r}",
                    hint=suggest(name, self.names) or f"its columns are: {known}",
                )
            )
        return self.data[:, self.names.index(name)]

    def curve(self, time: str, name: str) -> Curve:
        """Return a column over the column ``time``, rows without a number left out."""
        x, y = self.column(time), self.column(name)
        known = np.isfinite(x) & np.isfinite(y)
        return Curve.of(x[known], y[known])


def read_table(path: str | Path) -> Table:
    """Read a CSV file with one header line; lines that begin with ``#`` are comments.

    Raises
    ------
    OutputError
        If the file cannot be read or holds something else than numbers.
    """
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = (line for line in file if line.strip() and not line.startswith("#"))
            reader = csv.reader(lines)
            names = [name.strip() for name in next(reader, [])]
            rows = [[float(cell) if cell.strip() else np.nan for cell in row] for row in reader]
    except OSError as error:
        reason = error.strerror or str(error)
        raise _unreadable(path, reason) from error
    except (ValueError, csv.Error) as error:
        raise _unreadable(path, f"it is not a table of numbers ({error})") from error
    if not names or not rows:
        raise _unreadable(path, "it contains no rows")
    if any(len(row) != len(names) for row in rows):
        raise _unreadable(path, "its rows and its header line differ in length")
    return Table(path, names, np.array(rows))


def _unreadable(path: Path, reason: str) -> OutputError:
    return OutputError(
        Diagnostic(
            "NS4011",
            f"cannot read the reference {path}: {reason}",
            hint="a reference is a CSV file: one header line, then numbers",
        )
    )
