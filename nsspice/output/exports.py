"""Waveforms for other programs: NPZ, Parquet, HDF5 and xarray, by the libraries that keep them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analyses.signals.signal_names import unit
from ..errors import Diagnostic, UsageError
from ..lazy import need_library
from .atomic_write import whole
from .csv import write_csv
from .files import output_error

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution

_need = partial(need_library, instead="write .csv or .npz")
_Writer = Callable[["Solution", Path, "Sequence[str] | None"], None]

#: by which a later run knows that it may replace the file
_MARK = "nsspice"


def _npz(solution: Solution, path: Path, columns: Sequence[str] | None) -> None:
    """Write a numpy archive: an array for each column under its name, axis first."""
    names, rows = solution.table(columns)
    with path.open("wb") as file:
        np.savez_compressed(file, **dict(zip(names, rows.T, strict=True)))
    import zipfile

    with zipfile.ZipFile(path, "a") as archive:
        archive.comment = _MARK.encode()


def _parquet(solution: Solution, path: Path, columns: Sequence[str] | None) -> None:
    """Write a Parquet file (pyarrow): a column each, its unit in the metadata of the field."""
    arrow, parquet = _need("pyarrow"), _need("pyarrow.parquet")
    names, rows = solution.table(columns)
    fields = [arrow.field(n, arrow.float64(), metadata={"unit": unit(n)}) for n in names]
    about = {"title": solution.title, "generator": _MARK}
    arrays = [arrow.array(np.ascontiguousarray(column)) for column in rows.T]
    table = arrow.Table.from_arrays(arrays, schema=arrow.schema(fields, metadata=about))
    parquet.write_table(table, path)


def _hdf5(solution: Solution, path: Path, columns: Sequence[str] | None) -> None:
    """Write an HDF5 file (h5py): a data set for each column, its unit as an attribute."""
    h5py = _need("h5py")
    names, rows = solution.table(columns)
    with h5py.File(path, "w") as file:
        file.attrs.update(generator=_MARK, title=solution.title, **solution.parameters)
        for name, column in zip(names, rows.T, strict=True):
            data = file.create_dataset(name, data=column, compression="gzip")
            data.attrs["unit"] = unit(name)


#: endings of names, how such a file is written, and the package that it needs
_FORMATS: dict[str, tuple[_Writer, str]] = {
    ".npz": (_npz, "numpy"),
    ".parquet": (_parquet, "pyarrow"),
    ".h5": (_hdf5, "h5py"),
    ".hdf5": (_hdf5, "h5py"),
}


def is_whole(suffix: str) -> bool:
    """Return whether a table is written when it is complete; CSV is while it is computed."""
    return suffix == ".raw" or suffix in _FORMATS or _is_touchstone(suffix)


def _is_touchstone(suffix: str) -> bool:
    return re.fullmatch(r"\.s\d+p", suffix) is not None


def check_export(path: Path) -> None:
    """Make sure, before anything is computed, that the package of a format is installed.

    Raises
    ------
    UsageError
        NS4010
    """
    found = _FORMATS.get(path.suffix.lower())
    if found is not None:
        _need(found[1])


def save(solution: Solution, path: str | Path, columns: Sequence[str] | None = None) -> None:
    """Write a solution in the format that the extension of a name stands for.

    Parameters
    ----------
    solution : Solution
    path : str or Path
        ``.csv``, ``.raw``, ``.npz``, ``.parquet``, ``.h5``, ``.hdf5``, or ``.s2p`` for two ports.
    columns : sequence of str, optional
        Signals to write; all ``columns`` of the solution if left out.

    Raises
    ------
    UsageError
        NS4008 for another ending, NS4010 for a package that is not installed.
    OutputError
        NS4001 if the file cannot be written.

    Examples
    --------
    >>> import tempfile, nsspice
    >>> solution = nsspice.op(nsspice.read("divider\\nV1 a 0 3\\nR1 a 0 1k\\n"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(solution, f"{folder}/a.npz")
    ...     with np.load(f"{folder}/a.npz") as archive:
    ...         print(archive["v(a)"])
    [3.]
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix == ".csv":
        write_csv(solution, path, columns)
    elif suffix == ".raw":
        from .raw import write_raw

        write_raw(solution, path, columns)
    elif _is_touchstone(suffix):
        from .touchstone import write_touchstone

        _export(write_touchstone, solution, path, columns)
    elif suffix in _FORMATS:
        _export(_FORMATS[suffix][0], solution, path, columns)
    else:
        raise UsageError(
            Diagnostic(
                "NS4008",
                f"{path}: tables cannot be written as {suffix or 'a file without an extension'}",
                hint=f"use the extension .csv, .raw, {', '.join(_FORMATS)}",
            )
        )


def _export(writer: _Writer, solution: Solution, path: Path, columns: Sequence[str] | None) -> None:
    try:
        with whole(path) as part:
            writer(solution, part, columns)
    except OSError as error:
        raise output_error(error, str(path)) from error


def to_xarray(solution: Solution, columns: Sequence[str] | None = None) -> Any:
    """Return an ``xarray.Dataset``, as :meth:`Solution.to_xarray` does."""
    xarray = _need("xarray")
    axis = solution.axis_name or "point"
    names = list(solution.columns if columns is None else columns)
    data = {n: (axis, np.asarray(solution[n]), {"units": unit(n)}) for n in names}
    coordinates = {axis: (axis, solution.axis, {"units": unit(axis)})}
    attributes = {"title": solution.title, "analysis": solution.analysis, **solution.parameters}
    return xarray.Dataset(data, coordinates, attributes)
