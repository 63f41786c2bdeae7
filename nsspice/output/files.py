"""Errors of files turned into sentences, and checks before a long run begins."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from ..errors import Diagnostic, OutputError, UsageError

_HINTS = {
    errno.ENOSPC: "free some space or write elsewhere with -o FILE",
    errno.EACCES: "write elsewhere with -o FILE",
    errno.EROFS: "write elsewhere with -o FILE",
    errno.EISDIR: "give a file name: -o FOLDER/NAME.csv",
    errno.ENOENT: "create the folder first, or write elsewhere with -o FILE",
    errno.EPIPE: "the reading program ended before the last row",
}


def output_error(error: OSError, name: str, where: str = "") -> OutputError:
    """Return the error for a file that could not be written.

    Examples
    --------
    >>> print(output_error(OSError(errno.ENOSPC, "No space left on device"), "a.csv"))
    error NS4001: cannot write a.csv: No space left on device
      hint: free some space or write elsewhere with -o FILE
    """
    reason = error.strerror or str(error) or type(error).__name__
    message = f"cannot write {name}: {reason}" + (f" ({where})" if where else "")
    return OutputError(Diagnostic("NS4001", message, hint=_HINTS.get(error.errno or 0, "")))


#: endings that promise another format than text with commas, which any other ending gets
_OTHER_FORMATS = frozenset([
    ".arrow", ".feather", ".json", ".mat", ".npy", ".ods", ".pickle", ".pkl", ".vcd", ".xls",
    ".xlsx",
])  # fmt: skip
_PICTURES = frozenset([".png", ".svg", ".pdf", ".jpg", ".jpeg", ".gif", ".eps", ".ps"])


def check_table_format(path: Path) -> None:
    """Refuse a name whose ending promises a format that is not written.

    Raises
    ------
    UsageError
        NS4008

    Examples
    --------
    >>> check_table_format(Path("a.txt"))
    >>> check_table_format(Path("a.xlsx"))
    Traceback (most recent call last):
    ...
    nsspice.errors.UsageError: error NS4008: a.xlsx: tables cannot be written as .xlsx
      hint: use the extension .csv, .raw, .npz, .parquet or .h5; spreadsheets read .csv
    """
    suffix = path.suffix.lower()
    if suffix not in _OTHER_FORMATS | _PICTURES:
        return
    hint = "use the extension .csv, .raw, .npz, .parquet or .h5; spreadsheets read .csv"
    if suffix in _PICTURES:
        hint = f"draw a picture with --plot {path}"
    message = f"{path}: tables cannot be written as {suffix}"
    raise UsageError(Diagnostic("NS4008", message, hint=hint))


def check_target(path: Path, inputs: Iterable[Path] = (), force: bool = False) -> None:
    """Make sure, before anything is computed, that a file can be written and is not an input.

    Parameters
    ----------
    path : Path
    inputs : iterable of Path
    force : bool
        Whether a file that something else has written may be replaced.

    Raises
    ------
    OutputError
        NS4001 if the folder is missing or closed, NS4002 if the file is one of the inputs, NS4018
        if it was written by something else.
    """
    for source in inputs:
        if path.exists() and source.exists() and path.samefile(source):
            raise OutputError(
                Diagnostic(
                    "NS4002",
                    f"writing {path} would overwrite the netlist itself",
                    hint="choose another name with -o FILE",
                )
            )
    folder = path.parent
    if path.is_dir():
        raise output_error(OSError(errno.EISDIR, "it is a folder"), str(path))
    if not folder.is_dir():
        raise output_error(OSError(errno.ENOENT, f"there is no folder {folder}"), str(path))
    if path.is_file() and not force:
        from .ownership import written_by_nsspice

        try:
            own = written_by_nsspice(path)
        except OSError as error:
            raise output_error(error, str(path)) from error
        if not own:
            raise OutputError(
                Diagnostic(
                    "NS4018",
                    f"{path} exists and was not written by nsspice",
                    hint="choose another name with -o FILE, or replace it with --force",
                )
            )
    place = path if path.exists() else folder
    if not os.access(place, os.W_OK):
        raise output_error(OSError(errno.EACCES, "permission denied"), str(path))


def check_room(path: Path, rows: int) -> None:
    """Make sure, before anything is computed, that a table of so many rows can be written.

    A row takes four bytes at least: an instant, a comma, a value and the end of the line.

    Raises
    ------
    OutputError
        NS4001 if the disk has less room than that.
    """
    free = shutil.disk_usage(path.parent).free
    if 4 * rows > free:
        message = f"cannot write {path}: {rows:.3g} rows need more than the {free:.3g} bytes free"
        hint = "write fewer rows: the first number of .tran is their distance"
        raise OutputError(Diagnostic("NS4001", message, hint=hint))
