"""SPICE raw files: the binary format that waveform viewers read, and ngspice writes.

The layout is that of Berkeley SPICE and ngspice: a text header, then one double per variable, point
after point.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..analyses.signals.signal_names import unit
from .atomic_write import whole
from .files import output_error

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution

_PLOTS = {
    "tran": "Transient Analysis",
    "dc": "DC transfer characteristic",
    "op": "Operating Point",
    "pss": "Transient Analysis",
    "ac": "AC Analysis",
    "loop": "AC Analysis",
    "noise": "Noise Spectral Density Curves",
    "tf": "Transfer Function",
    "pz": "Pole-Zero Analysis",
    "sp": "SP Analysis",
    "sens": "Sensitivity Analysis",
}
_HEAD = 1 << 20  # bytes of a header: thousands of variables
_TYPES = {"V": "voltage", "A": "current", "s": "time", "Hz": "frequency"}


def write_raw(
    solution: Solution,
    path: str | Path,
    columns: Sequence[str] | None = None,
    *,
    append: bool = False,
) -> None:
    """Write a solution as a binary raw file, readable with ngspice, LTspice viewers or spicelib.

    Parameters
    ----------
    solution : Solution
    path : str or Path
    columns : sequence of str, optional
        Signals to write; all ``columns`` of the solution if left out.
    append : bool
        Whether it becomes one more plot of a file that is there: the runs of ``.step`` cards.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    names, table = solution.table(columns)
    complex_ = any(name.startswith("re(") for name in names)
    if complex_:
        # real and imaginary part are one variable; the axis has an imaginary part of zero
        axes = 1 if solution.axis_name else 0
        names = [*names[:axes], *(name[3:-1] for name in names[axes::2])]
        zeros = np.zeros((len(table), axes))
        table = np.column_stack([table[:, :axes], zeros, table[:, axes:]])
    types = [_TYPES.get(unit(name), "notype") for name in names]
    if solution.axis_name and types[0] == "notype":
        types[0] = "voltage" if solution.axis_name.startswith("v") else "notype"
    lines = [
        # a title must stay on its line
        f"Title: {_title(solution)}",
        "Date: -",  # no clock: two runs of a deck give identical bytes
        f"Plotname: {_PLOTS[solution.analysis]}",
        "Command: nsspice, in the layout of ngspice",  # by which readers recognise the dialect
        f"Flags: {'complex' if complex_ else 'real'}",
        f"No. Variables: {len(names)}",
        f"No. Points: {table.shape[0]}",
        "Variables:",
        *(
            f"\t{k}\t{name}\t{kind}"
            for k, (name, kind) in enumerate(zip(names, types, strict=True))
        ),
        "Binary:\n",
    ]
    content = "\n".join(lines).encode() + np.ascontiguousarray(table, dtype="<f8").tobytes()
    try:
        if append:
            with Path(path).open("ab") as file:
                file.write(content)
            return
        with whole(path) as part:
            part.write_bytes(content)
    except OSError as error:
        raise output_error(error, str(path)) from error


def _title(solution: Solution) -> str:
    """Return the title with the values of the ``.step`` cards, which distinguish plots."""
    values = [f"{name} = {value:.9g}" for name, value in solution.parameters.items()]
    return ", ".join([" ".join(solution.title.split()) or "nsspice", *values])


def read_raw(path: str | Path, imaginary: bool = False) -> tuple[list[str], npt.NDArray[Any]]:
    """Read the first plot of a raw file of ngspice or nsspice: binary or text, real or complex.

    Parameters
    ----------
    path : str or Path
    imaginary : bool
        Keep the imaginary parts of a complex file.

    Returns
    -------
    names : list of str
    data : ndarray, shape (len(names), points)
        Real parts, or complex numbers; a file that ends early has as many points as are complete.

    Raises
    ------
    ValueError
        If it is not a raw file.
    OSError
        If it cannot be read.

    Examples
    --------
    >>> import tempfile, nsspice
    >>> solution = nsspice.op(nsspice.read("divider\\nV1 a 0 3\\nR1 a 0 1k\\n"))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_raw(solution, f"{folder}/a.raw")
    ...     names, data = read_raw(f"{folder}/a.raw")
    >>> names, data[:, 0].tolist()
    (['v(a)', 'i(v1)'], [3.0, -0.003])
    """
    content = Path(path).read_bytes()
    found = re.search(rb"^(Binary|Values):[ \t]*\r?\n", content[:_HEAD], re.MULTILINE)
    if found is None:
        raise ValueError(f"{path} is not a raw file: it has no line Binary: or Values:")
    lines = content[: found.start()].decode("utf-8", "replace").splitlines()
    fields = {}
    for line in lines:
        key, colon, value = line.partition(":")
        if colon and not line[:1].isspace():
            fields[key.strip().lower()] = value.strip()
    try:
        count, points = int(fields["no. variables"]), int(fields["no. points"])
    except (KeyError, ValueError):
        raise ValueError(f"{path} is not a raw file: its numbers are missing") from None
    first = 1 + next(k for k, line in enumerate(lines) if line.lower().startswith("variables:"))
    names = [line.split()[1] for line in lines[first : first + count]]
    if len(names) < count:
        raise ValueError(f"{path} is not a raw file: it names {len(names)} of {count} variables")
    width = 2 if "complex" in fields.get("flags", "") else 1
    body = content[found.end() :]
    if found.group(1) == b"Values":
        numbers = _text_values(body, count, width)
    else:
        size = len(body) // (8 * count * width) * count * width
        numbers = np.frombuffer(body, "<f8", min(size, points * count * width))
    parts = numbers.reshape(-1, count, width)[:points]
    table = parts[:, :, 0] + 1j * parts[:, :, 1] if imaginary and width == 2 else parts[:, :, 0]
    return names, np.ascontiguousarray(table.T)


def _text_values(body: bytes, count: int, width: int) -> npt.NDArray[np.float64]:
    """Return the numbers of a text body: the point's number, then one value a line."""
    words = body.replace(b",", b" ").split()
    whole = len(words) // (1 + count * width)
    table = np.array(words[: whole * (1 + count * width)], dtype=np.float64)
    return table.reshape(whole, -1)[:, 1:].ravel()
