"""Where the power goes: averages of all elements, exact along closed forms, and the efficiency."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...circuit import Circuit
from ...devices.sources.isource import CurrentSource
from ...devices.sources.vsource import VoltageSource
from ...errors import Diagnostic, UsageError
from ..results.loss_table import ElementPower, LossTable
from .heat import heating
from .integrals import Integrals


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
            raise ValueError(f"{load} belongs to a block driven by another one, which takes steps")
    known = [d for d in known if d.name not in left_out]
    names = [d.name for d in known]
    for load in loads:
        if load not in names:
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    f"there is no element {load} to use as the load",
                    hint="write --load R1",
                )
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
