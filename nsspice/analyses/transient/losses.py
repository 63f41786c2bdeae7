"""Where the power goes: averages of all elements, exact along closed forms, and the efficiency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...circuit import Circuit
from ...devices import CurrentSource, VoltageSource
from ...errors import Diagnostic, UsageError
from .heat import heating
from .integrals import Integrals


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
        What the tables of its model card say about its switchings, on average [W]: beside the power
        above, and beside the circuit's balance.
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
        """What sources that are no loads deliver in all, jumps included [W]."""
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


def without_powers(circuit: Circuit, integrals: Integrals) -> list[str]:
    """Return the elements of blocks that others drive, whose powers have no closed forms."""
    homes = integrals.circuit.element_island
    return [d.name for d in circuit.devices if homes.get(d.name) in integrals.driven]


def losses(
    circuit: Circuit,
    integrals: Integrals,
    loads: Sequence[str] = (),
    lost_in_jumps: float = 0.0,
    delivered_in_jumps: float = 0.0,
) -> LossTable:
    """Return the average powers of all elements.

    Parameters
    ----------
    circuit : Circuit
    integrals : Integrals
        Over a period, or another window.
    loads : sequence of str
        Elements whose power is useful.
    lost_in_jumps : float
        Energy that jumps of charges and fluxes took within the window [J].
    delivered_in_jumps : float
        Energy that sources delivered in them [J].

    Raises
    ------
    UsageError
        NS4005 for a load that does not exist.
    """
    known = [d for d in circuit.devices if d.letter != "k" and d.name in circuit.element_island]
    left_out = without_powers(circuit, integrals)
    for load in loads:
        if load in left_out:
            raise ValueError(f"{load} belongs to a block that another one drives, by steps")
    known = [d for d in known if d.name not in left_out]
    names = [d.name for d in known]
    for load in loads:
        if load not in names:
            raise UsageError(
                Diagnostic("NS4005", f"there is no element {load} to be the load", hint="--load R1")
            )
    powers = integrals.powers(names)
    heat = heating(circuit, integrals)
    rows = []
    for device, power in zip(known, powers, strict=True):
        source = isinstance(device, VoltageSource | CurrentSource)
        kind = "source" if source else "store" if device.stores_energy else "loss"
        current = math.nan if device.stores_energy and device.letter == "c" else 0.0
        if math.isfinite(current):
            current = integrals.rms(f"i({device.name})")
        hot = heat.get(device.name)
        more = () if hot is None else (hot.switching, hot.temperature)
        rows.append(ElementPower(device.name, power, current, kind, *more))
    rows.sort(key=lambda row: -abs(row.power))
    length = integrals.window[1] - integrals.window[0]
    return LossTable(tuple(rows), tuple(loads), lost_in_jumps / length, delivered_in_jumps / length)
