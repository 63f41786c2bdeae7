"""Short ways to run a deck on the compiled core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import nsspice

from .closed_forms import Floats


@dataclass(frozen=True)
class Run:
    """Times and signals of one transient, row by row at every step."""

    t: Floats
    signals: dict[str, Floats]
    solution: Any

    def __getitem__(self, name: str) -> Floats:
        return self.signals[name]


def transient(text: str, h: float, count: int, signals: Sequence[str], theta: float = 1.0) -> Run:
    """Take ``count`` steps of length h [s] from the deck's initial values."""
    circuit = nsspice.read(text)
    solution = nsspice.tran(
        circuit, stop=count * h, row_step=h, step=h, uic=True, theta=theta, signals=list(signals)
    )
    return Run(solution.time, {name: solution[name] for name in signals}, solution)
