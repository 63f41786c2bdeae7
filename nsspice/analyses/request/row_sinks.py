"""Where rows go while they are computed: into memory, into a file, or both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ...errors import Diagnostic, OutputError

Floats = npt.NDArray[np.float64]

#: Tables above this size [bytes] are kept in an unnamed temporary file instead of memory.
MEMORY_LIMIT = 256 * 2**20


class Sink(Protocol):
    """Takes the rows of one analysis in order."""

    def open(self, names: Sequence[str]) -> None:
        """Begin with the names of the leading columns: the axis, then the signals to show."""

    def write(self, block: Floats) -> None:
        """Take some complete rows, shape (k, at least the number of names); copy what you keep."""

    def close(self) -> None:
        """End; called after the last row, also when a run was stopped early."""


class Table(Protocol):
    """Has all its rows already."""

    def table(self) -> tuple[list[str], Floats]:
        """Return the column names and the rows."""


def hand_over(finished: Table, sink: Sink | None) -> None:
    """Write a table that is complete at once, if there is a sink."""
    if sink is not None:
        names, block = finished.table()
        sink.open(names)
        sink.write(block)
        sink.close()


class Store:
    """A table of known size that is filled block by block.

    Large tables live in a memory-mapped temporary file, so that memory stays bounded; the pages are
    written out by the operating system and vanish with the object.

    Parameters
    ----------
    rows, columns : int
    limit : int
        Size above which a file is used [bytes].

    Raises
    ------
    OutputError
        NS4001 if there is no room for such a table.
    """

    def __init__(self, rows: int, columns: int, limit: int = MEMORY_LIMIT) -> None:
        self.filled = 0
        shape = (rows, columns)
        self._data: Floats
        if rows * columns * 8 > limit:
            import tempfile  # seldom needed, and slow to import

            try:
                with tempfile.TemporaryFile(prefix="nsspice-") as file:
                    self._data = np.memmap(file, dtype=np.float64, mode="w+", shape=shape)
            except (OSError, OverflowError) as error:
                message = f"cannot store {rows} rows of {columns} columns: {error}"
                hint = "save fewer signals, or use a larger output step"
                raise OutputError(Diagnostic("NS4001", message, hint=hint)) from error
        else:
            self._data = np.empty(shape)

    def write(self, block: Floats) -> None:
        """Append complete rows."""
        end = self.filled + block.shape[0]
        self._data[self.filled : end] = block
        self.filled = end

    def room(self, rows: int) -> Floats:
        """Return the place of the next rows, for those who write there and raise ``filled``."""
        return self._data[self.filled : self.filled + rows]

    @property
    def table(self) -> Floats:
        """The rows written so far, shape (filled, columns)."""
        return self._data[: self.filled]


class GrowingStore(Store):
    """A table of unknown size, in memory.

    Examples
    --------
    >>> store = GrowingStore(2)
    >>> for k in range(3):
    ...     store.write(np.full((1, 2), float(k)))
    >>> store.table[:, 0].tolist()
    [0.0, 1.0, 2.0]
    """

    def __init__(self, columns: int) -> None:
        super().__init__(64, columns)

    def write(self, block: Floats) -> None:
        """Append complete rows."""
        end = self.filled + block.shape[0]
        if end > self._data.shape[0]:
            grown = np.empty((max(end, 2 * self._data.shape[0]), self._data.shape[1]))
            grown[: self.filled] = self.table
            self._data = grown
        super().write(block)
