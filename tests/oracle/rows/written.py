"""The written rows: columns of a CSV file by name, and the scales by which errors are measured."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: share of a run's largest voltage or current below which an element's own range is not measured:
#: a millionth of it is 1e-12 of the largest, what rounding leaves of differences of node voltages
FLOOR = 1e-6
#: instants of which events are known to some rounding units of the time
SAME_INSTANT = 1e-12


@dataclass(frozen=True)
class Violation:
    """A law that the rows miss, by which share of the range, where and when [s]."""

    law: str
    element: str
    time: float
    size: float


@dataclass
class Rows:
    """Rows in ascending time.

    Parameters
    ----------
    columns : mapping of str to array
        With ``time`` [s], ``v(node)`` [V] and ``i(element)`` [A].
    """

    columns: Mapping[str, Floats]

    def __post_init__(self) -> None:
        time = self.columns["time"]
        #: instants [s] before which a later one was written
        self.turns_back = [float(t) for t in time[1:][np.diff(time) < 0.0]]
        order = np.argsort(time, kind="stable")
        self.columns = {k: v[order] for k, v in self.columns.items()}

    @property
    def time(self) -> Floats:
        return self.columns["time"]

    def voltage(self, a: str, b: str = "0") -> Floats:
        """Return the voltage from a to b [V]."""
        zero = np.zeros_like(self.time)
        return (zero if a == "0" else self.columns[f"v({a})"]) - (
            zero if b == "0" else self.columns[f"v({b})"]
        )

    def current(self, element: str) -> Floats | None:
        """Return the current into the first terminal [A], None if it was not written."""
        return self.columns.get(f"i({element})")

    @cached_property
    def volts(self) -> float:
        """The largest voltage of the run [V]."""
        return self._largest("v(")

    @cached_property
    def amperes(self) -> float:
        """The largest current of the run [A]."""
        return self._largest("i(")

    def _largest(self, kind: str) -> float:
        tops = [np.abs(v).max() for k, v in self.columns.items() if k.startswith(kind) and v.size]
        return max([float(t) for t in tops if np.isfinite(t)], default=0.0) or 1.0

    def scale_of(self, signal: Floats, kind: str) -> float:
        """Return the range of a voltage or current, not less than the floor."""
        own = float(np.abs(signal).max()) if signal.size else 0.0
        return max(own, FLOOR * (self.volts if kind == "v" else self.amperes))

    @cached_property
    def moves(self) -> Bools:
        """For each interval: whether time passes in it, or it stands for a jump."""
        return np.diff(self.time) > SAME_INSTANT * np.abs(self.time[1:])

    def on_grid(self, distance: float) -> Rows:
        """Return the rows at multiples of a distance [s], at a jump the last of them."""
        share = self.time / distance
        near = np.abs(share - np.round(share)) < 1e-9 * np.maximum(1.0, share)
        keep = near & np.append(self.moves, True)
        return Rows({name: column[keep] for name, column in self.columns.items()})

    def worst(self, law: str, element: str, error: Floats) -> list[Violation]:
        """Return the largest error of one law of one element; values that are not finite are."""
        if not error.size:
            return []
        error = np.where(np.isfinite(error), error, np.inf)
        k = int(np.argmax(error))
        return [Violation(law, element, float(self.time[k]), float(error[k]))]


def read_csv(path: Path) -> Rows:
    """Return the rows of a CSV file with one header line."""
    with path.open() as file:
        names = [n.lower() for n in next(csv.reader(file))]
        values = np.loadtxt(file, delimiter=",", ndmin=2)
    return Rows({name: values[:, k].copy() for k, name in enumerate(names)})
