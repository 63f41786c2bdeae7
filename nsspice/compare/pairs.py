"""Which column of a reference belongs to which signal, and how far they lie apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analyses.request.recorder import select
from ..analyses.signals.curve import Curve
from ..analyses.signals.signal_names import canonical
from ..analyses.solution.solution import Solution
from ..circuit import Circuit
from ..errors import Diagnostic, NetlistError, UsageError
from .norms import Distance, distance
from .reference import Table


@dataclass(slots=True)
class Row:
    """The distance of one signal from its column.

    Parameters
    ----------
    signal, column : str
    distance : Distance
    passed : bool
    """

    signal: str
    column: str
    distance: Distance
    passed: bool = True

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        d = self.distance
        return {
            "signal": self.signal,
            "column": self.column,
            "max": _finite(d.maximum),
            "l1": _finite(d.l1),
            "rms": _finite(d.rms),
            "range": _finite(d.span),
            "passed": self.passed,
        }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def pairs_of(
    circuit: Circuit,
    table: Table,
    maps: Mapping[str, str],
    wanted: Sequence[str] | None = None,
) -> list[tuple[str, str]]:
    """Return (column, signal) for all columns that are signals of the circuit.

    Parameters
    ----------
    circuit : Circuit
    table : Table
    maps : mapping of str to str
        Signal by column, for columns of another name.
    wanted : sequence of str, optional
        Compare only these signals.

    Raises
    ------
    UsageError
        NS4011 if no column fits, or a mapped column or a wanted signal is missing.
    NetlistError
        NS2012 if a mapped signal does not exist.
    """
    pairs = []
    for column, name in maps.items():
        table.column(column)
        pairs.append((column, select(circuit, [name])[0]))
    for column in table.names[1:] if not maps else table.names:
        if column not in maps:
            try:
                pairs.append((column, select(circuit, [canonical(column)])[0]))
            except NetlistError:
                continue
    if wanted is not None:
        names = [canonical(name) for name in wanted]
        missing = [n for n in names if n not in {signal for _, signal in pairs}]
        if missing:
            raise _nothing(table, f"{table.path} has no column for {', '.join(missing)}")
        pairs = [pair for pair in pairs if pair[1] in names]
    if not pairs:
        raise _nothing(table, f"no column of {table.path} is a signal of the circuit")
    return pairs


def _nothing(table: Table, message: str) -> UsageError:
    columns = ", ".join(table.names[:8])
    return UsageError(
        Diagnostic(
            "NS4011",
            message,
            hint=f'name the pairs with --map "COLUMN=v(out)"; the columns are {columns}',
        )
    )


def compare_table(
    solution: Solution,
    table: Table,
    pairs: Sequence[tuple[str, str]],
    time: str | None = None,
    window: tuple[float | None, float | None] = (None, None),
) -> list[Row]:
    """Return the distances of all pairs.

    Parameters
    ----------
    solution : Solution
    table : Table
    pairs : sequence of (str, str)
        Column and signal.
    time : str, optional
        Column of the axis; the first one if left out.
    window : (float or None, float or None)
    """
    rows = []
    for column, signal in pairs:
        reference = table.curve(time or table.names[0], column)
        curve = Curve.of(solution.axis, solution[signal])
        rows.append(Row(signal, column, distance(curve, reference, *window)))
    if any(row.distance.length == 0.0 and not np.isfinite(row.distance.maximum) for row in rows):
        raise UsageError(
            Diagnostic(
                "NS4011",
                f"{table.path} and the simulation have no {solution.axis_name} in common",
                hint="check --time, --from and --to",
            )
        )
    return rows
