"""SPICE raw files: the binary format that waveform viewers read.

The layout is that of Berkeley SPICE and ngspice: a text header, then one double per variable, point
after point.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analyses.names import unit
from .files import output_error

if TYPE_CHECKING:
    from ..analyses.solution import Solution

_PLOTS = {
    "tran": "Transient Analysis",
    "dc": "DC transfer characteristic",
    "op": "Operating Point",
}
_TYPES = {"V": "voltage", "A": "current", "s": "time"}


def write_raw(solution: Solution, path: str | Path, columns: Sequence[str] | None = None) -> None:
    """Write a solution as a binary raw file, readable with ngspice, LTspice viewers or spicelib.

    Parameters
    ----------
    solution : Solution
    path : str or Path
    columns : sequence of str, optional
        Signals to write; all ``columns`` of the solution if left out.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    names, table = solution.table(columns)
    types = [_TYPES.get(unit(name), "notype") for name in names]
    if solution.axis_name and types[0] == "notype":
        types[0] = "voltage" if solution.axis_name.startswith("v") else "notype"
    lines = [
        # a title must stay on its line, whatever the deck said
        f"Title: {' '.join(solution.title.split()) or 'nsspice'}",
        "Date: -",  # no clock: two runs of a deck give identical bytes
        f"Plotname: {_PLOTS[solution.analysis]}",
        "Command: nsspice, in the layout of ngspice",  # by which readers tell the dialect
        "Flags: real",
        f"No. Variables: {len(names)}",
        f"No. Points: {table.shape[0]}",
        "Variables:",
        *(
            f"\t{k}\t{name}\t{kind}"
            for k, (name, kind) in enumerate(zip(names, types, strict=True))
        ),
        "Binary:\n",
    ]
    try:
        with Path(path).open("wb") as file:
            file.write("\n".join(lines).encode())
            file.write(np.ascontiguousarray(table, dtype="<f8").tobytes())
    except OSError as error:
        raise output_error(error, str(path)) from error
