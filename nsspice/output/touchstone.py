"""Touchstone files: scattering parameters over the frequency, for programs of radio frequency.

Version 1 where all ports have the same impedance, version 2 otherwise.

References: IBIS Open Forum, "Touchstone File Format Specification", version 2.0, 2009.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import Diagnostic, UsageError
from ..netlist.text.numbers import format_number

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution

#: endings of such files
SUFFIX = re.compile(r"\.s(\d+)p", re.IGNORECASE)
#: pairs of numbers in a line
_PAIRS = 4


def write_touchstone(solution: Solution, path: Path, columns: Sequence[str] | None = None) -> None:
    """Write the scattering parameters of ``.sp``.

    Parameters
    ----------
    solution : Solution
    path : Path
        ``NAME.s2p`` for two ports.
    columns : sequence of str, optional
        Has no effect: the file has all parameters.

    Raises
    ------
    UsageError
        NS4008 for another analysis or another number of ports.
    """
    count = len(solution.ports)
    found = SUFFIX.fullmatch(path.with_suffix(path.suffix.removesuffix(".part")).suffix)
    if not count:
        message = f"{path}: only scattering parameters are written as Touchstone files"
        raise UsageError(Diagnostic("NS4008", message, hint="add a .sp card, or write .csv"))
    if found is not None and int(found[1]) != count:
        message = f"{path}: the circuit has {count} ports"
        raise UsageError(Diagnostic("NS4008", message, hint=f"use the extension .s{count}p"))
    path.write_text("\n".join(_lines(solution, count)) + "\n", "utf-8")


def _lines(solution: Solution, count: int) -> Iterator[str]:
    """Yield the lines of a file."""
    impedances = [format_number(z) for z in solution.ports]
    alike = len(set(impedances)) == 1
    yield f"! {' '.join(solution.title.split())} (by nsspice)"
    if not alike:
        yield "[Version] 2.0"
    yield f"# Hz S RI R {impedances[0]}"
    if not alike:
        yield f"[Number of Ports] {count}"
        if count == 2:
            yield "[Two-Port Data Order] 21_12"
        yield f"[Number of Frequencies] {solution.axis.size}"
        yield f"[Reference] {' '.join(impedances)}"
        yield "[Network Data]"
    indices = [(i, j) for i in range(1, count + 1) for j in range(1, count + 1)]
    rows = [[solution[f"s_{i}_{j}"] for i, j in indices if i == row] for row in range(1, count + 1)]
    if count == 2:  # by columns, by tradition
        rows = [[rows[0][0], rows[1][0], rows[0][1], rows[1][1]]]
    for k, frequency in enumerate(solution.axis):
        head = format_number(float(frequency))
        for row in rows:
            pairs = [f"{format_number(s[k].real)} {format_number(s[k].imag)}" for s in row]
            for at in range(0, len(pairs), _PAIRS):
                yield f"{head} {' '.join(pairs[at : at + _PAIRS])}".strip()
                head = ""
    if not alike:
        yield "[End]"
