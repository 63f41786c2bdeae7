"""What a model card says about the energies of switchings and the way of the heat.

``Eon`` and ``Eoff`` of a switch, ``Err`` of a diode, each ``table(i=... v=... t=... e=...)``; one
of ``Foster`` and ``Cauer``.  They change no waveform: switching stays ideal, and what a data sheet
says about it is looked up at each event.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...netlist.findings import Findings
from ..parameter import Parameter
from .energy_table import EnergyTable, energy_table
from .thermal_network import ThermalNetwork, thermal_network

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model, Param


def _energies(param: Param, owner: str, findings: Findings) -> None:
    energy_table(param, owner, findings)


def _network(param: Param, owner: str, findings: Findings) -> None:
    thermal_network(param, owner, findings)


_THERMAL = (
    Parameter("foster", "thermal network: r [K/W] and tau [s]", status="table", check=_network),
    Parameter("cauer", "thermal network: r [K/W] and c [J/K]", status="table", check=_network),
)
#: of a switch
SWITCH_LOSSES = (
    Parameter("eon", "energies of turning on, by i, v, t", "J", status="table", check=_energies),
    Parameter("eoff", "energies of turning off, by i, v, t", "J", status="table", check=_energies),
    *_THERMAL,
)
#: of a diode
DIODE_LOSSES = (
    Parameter("err", "energies of its recovery, by i, v, t", "J", status="table", check=_energies),
    *_THERMAL,
)


@dataclass(frozen=True, slots=True)
class SwitchingLoss:
    """What the model cards of an element say.

    Parameters
    ----------
    on, off, recovery : EnergyTable or None
    network : ThermalNetwork or None
    """

    on: EnergyTable | None
    off: EnergyTable | None
    recovery: EnergyTable | None
    network: ThermalNetwork | None

    @property
    def temperatures(self) -> list[float]:
        """Of the grid points of all tables [C]."""
        known = (self.on, self.off, self.recovery)
        points = {t for table in known if table is not None for t in table.axes[2] if t == t}
        return sorted(points)


def switching_loss(element: Element) -> SwitchingLoss | None:
    """Return what the model cards of an element say, None if they say nothing."""
    model = element.model
    if model is None:
        return None
    body = element.models.get("body") or model.models.get("body")
    table = {key: _table(model, key) for key in ("eon", "eoff", "err")}
    if body is not None:
        table["err"] = _table(body, "err")
    network = None
    for key in ("foster", "cauer"):
        if key in model.params:
            network = thermal_network(model.params[key], model.name)
    found = SwitchingLoss(table["eon"], table["eoff"], table["err"], network)
    return None if found == SwitchingLoss(None, None, None, None) else found


def _table(model: Model, key: str) -> EnergyTable | None:
    param = model.params.get(key)
    return None if param is None else energy_table(param, model.name)
