"""Where the power goes: averages of all elements, and the efficiency."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...circuit import Circuit
from ...devices.device import Device
from ...devices.sources.isource import CurrentSource
from ...devices.sources.vsource import VoltageSource
from ...errors import Diagnostic, UsageError
from ..results.jumps import JumpReport
from ..results.loss_table import ElementPower, LossTable
from .heat import Heating, heating
from .integrals import Integrals
from .recorded_integrals import RecordedIntegrals
from .window_integrals import NoClosedForm, WindowIntegrals


def losses(
    circuit: Circuit,
    integrals: WindowIntegrals,
    steps: RecordedIntegrals | None = None,
    loads: Sequence[str] = (),
    jumps: Sequence[JumpReport] = (),
) -> LossTable:
    """Return the average powers of all elements.

    Parameters
    ----------
    circuit : Circuit
    integrals : WindowIntegrals
        Over a period, or another window.
    steps : RecordedIntegrals or None
        Over the same window: for blocks that others drive, whose powers have no closed forms.
    loads : sequence of str
        Elements whose power is useful.
    jumps : sequence of JumpReport
        Jumps of charges and fluxes: those within the window count.

    Raises
    ------
    UsageError
        NS4005 for a load that does not exist.
    """
    known = [d for d in circuit.devices if d.letter != "k" and d.name in circuit.element_island]
    names = [d.name for d in known]
    for load in loads:
        if load not in names:
            message = f"there is no element {load} to use as the load"
            raise UsageError(Diagnostic("NS4005", message, hint="write --load R1"))
    powers, currents = _averages(integrals, steps, known)
    heat: dict[str, Heating] = {}
    if isinstance(integrals, Integrals):
        heat = heating(circuit, integrals)
    rows = []
    for device in known:
        source = isinstance(device, VoltageSource | CurrentSource)
        kind = "source" if source else "store" if device.stores_energy else "loss"
        hot = heat.get(device.name)
        more = () if hot is None else (hot.switching, hot.temperature)
        row = ElementPower(device.name, powers[device.name], currents[device.name], kind, *more)
        rows.append(row)
    rows.sort(key=lambda row: -abs(row.power))
    start, stop = integrals.window
    within = [jump for jump in jumps if start <= jump.time <= stop]
    lost = math.fsum(jump.lost for jump in within)
    delivered = math.fsum(jump.delivered for jump in within)
    return LossTable(tuple(rows), tuple(loads), lost / (stop - start), delivered / (stop - start))


def _averages(
    integrals: WindowIntegrals, steps: RecordedIntegrals | None, devices: Sequence[Device]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return average powers and root mean squares of currents by element."""
    taken: set[str] = set()
    if isinstance(integrals, Integrals):
        homes = integrals.circuit.element_island
        taken = {d.name for d in devices if homes.get(d.name) in integrals.driven}
    powers: dict[str, float] = {}
    currents = {d.name: math.nan for d in devices}
    for ways, by_steps in ((integrals, False), (steps, True)):
        mine = [d for d in devices if (d.name in taken) == by_steps]
        if not mine:
            continue
        if ways is None:
            told = ", ".join(d.name for d in mine)
            raise NoClosedForm(f"{told}: blocks driven by another one take steps")
        names = [d.name for d in mine]
        powers |= zip(names, ways.powers(names), strict=True)
        # that of a capacitor may hold impulses
        known = [d.name for d in mine if not (d.stores_energy and d.letter == "c")]
        squares = ways.squares([f"i({name})" for name in known])
        currents |= {n: math.sqrt(max(s, 0.0)) for n, s in zip(known, squares, strict=True)}
    return powers, currents
