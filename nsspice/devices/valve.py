"""A part of an element that conducts as a switch or a diode, and whose switchings cost energy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple


class Valve(NamedTuple):
    """A part of an element that turns on and off.

    Parameters
    ----------
    kind : str
        ``switch`` or ``diode``.
    pair : int
        Its complementarity pair.
    parallel : float
        How many equal ones it stands for.
    inverted : bool
        The pair conducts while the part is off (``RON`` above ``ROFF``).
    """

    kind: Literal["switch", "diode"]
    pair: int
    parallel: float = 1.0
    inverted: bool = False

    def conducts(self, active: Sequence[int]) -> bool:
        """Return whether the part is on, with these pairs conducting."""
        return (self.pair in active) != self.inverted
