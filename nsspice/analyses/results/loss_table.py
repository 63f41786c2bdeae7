"""Average powers of elements, and what follows from them: losses and efficiency."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ElementPower:
    """The average power of an element.

    Parameters
    ----------
    element : str
    power : float
        Taken on average [W]; negative if it delivers.
    current : float
        Root of the mean square of its current [A].
    kind : str
        ``source``, ``store`` or ``loss``.
    switching : float
        What the tables of its model card say about its switchings, on average [W]: in addition to
        the power above, and to the circuit's balance.
    junction : float
        Average temperature of its junction [C]; nan without a thermal network.
    """

    element: str
    power: float
    current: float
    kind: str
    switching: float = 0.0
    junction: float = math.nan


@dataclass(frozen=True, slots=True)
class LossTable:
    """Average powers of all elements over a period, or over a transient.

    Parameters
    ----------
    rows : tuple of ElementPower
        The largest first.
    loads : tuple of str
        Elements whose power is what the circuit is for.
    jumps : float
        Energy lost in jumps of charges and fluxes, on average [W].
    delivered_in_jumps : float
        Energy that sources deliver in jumps, on average [W].
    """

    rows: tuple[ElementPower, ...]
    loads: tuple[str, ...]
    jumps: float
    delivered_in_jumps: float

    @property
    def useful(self) -> float:
        """What the loads take [W]."""
        return math.fsum(row.power for row in self.rows if row.element in self.loads)

    @property
    def delivered(self) -> float:
        """What sources that are not loads deliver in all, jumps included [W]."""
        sources = (r for r in self.rows if r.kind == "source" and r.element not in self.loads)
        return self.delivered_in_jumps - math.fsum(row.power for row in sources)

    @property
    def lost(self) -> float:
        """What all other elements dissipate, jumps aside [W]."""
        others = (r for r in self.rows if r.kind == "loss" and r.element not in self.loads)
        return math.fsum(row.power for row in others)

    @property
    def switching(self) -> float:
        """What the tables of model cards say about all switchings [W]."""
        return math.fsum(row.switching for row in self.rows)

    @property
    def efficiency(self) -> float | None:
        """Useful power by that delivered and lost in switchings, None without a load."""
        spent = self.delivered + self.switching
        return self.useful / spent if self.loads and self.delivered > 0.0 else None

    @property
    def imbalance(self) -> float:
        """Sum of all powers, which Tellegen's theorem says is zero, by the sum of their sizes."""
        size = math.fsum(abs(row.power) for row in self.rows)
        return abs(math.fsum(row.power for row in self.rows)) / size if size else 0.0

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        return {
            "elements": {row.element: row.power for row in self.rows},
            "switching": {r.element: r.switching for r in self.rows if r.switching},
            "junctions": {r.element: r.junction for r in self.rows if not math.isnan(r.junction)},
            "rms_currents": {row.element: row.current for row in self.rows},
            "loads": list(self.loads),
            "delivered": self.delivered,
            "useful": self.useful,
            "lost": self.lost,
            "lost_in_switchings": self.switching,
            "jumps": self.jumps,
            "efficiency": self.efficiency,
            "imbalance": self.imbalance,
        }
