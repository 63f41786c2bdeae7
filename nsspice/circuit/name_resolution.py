"""Resolving the names by which elements refer to each other, and checking couplings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..devices.carrier import Carrier, Terminal
from ..devices.device import Device
from ..devices.passive.coupling import Coupling
from ..devices.passive.inductor import Inductor
from ..devices.sources.controlled import Cccs, CurrentControlled
from ..devices.switches.switch import CurrentSwitch
from ..errors import suggest
from ..netlist.findings import Findings
from .signals import owner
from .union_find import UnionFind


def resolve(devices: Sequence[Device], names: Sequence[str], findings: Findings) -> None:
    """Give each F, H, W and expression the elements it reads and each K its inductors.

    Parameters
    ----------
    devices : sequence of Device
    names : sequence of str
        Names of all element lines, also of those that were refused (no second error for them).
    findings : Findings
    """
    by_name = {device.name: device for device in devices}
    lines = set(names)
    for device in devices:
        if isinstance(device, CurrentControlled | CurrentSwitch):
            device.control = _control(device, device.controls[0], by_name, lines, findings)
        elif device.expressions:
            for name in device.control_elements:
                source = _control(device, name, by_name, lines, findings)
                if source is not None:
                    device.sources[name] = source
        elif isinstance(device, Coupling):
            found = [_inductor(device, name, by_name, lines, findings) for name in device.controls]
            device.inductors = tuple(one for one in found if one is not None)
    _check_couplings([d for d in devices if isinstance(d, Coupling)], findings)


def _control(
    device: Device,
    name: str,
    by_name: Mapping[str, Device],
    lines: set[str],
    findings: Findings,
) -> Carrier | None:
    """Return the element whose current is read, or None after reporting why not."""
    control: Carrier | None = by_name.get(name)
    if control is None and device.expressions:
        found = owner(name, by_name)
        control = None if found is None else Terminal(*found)
    span = device.control_span(name)
    if control is None:
        if name not in lines:
            candidates = [n for n, d in by_name.items() if d.letter == "v"] or list(by_name)
            findings.error(
                "NS2006",
                f"{device.name} is controlled by the current of {name}, which does not exist",
                span,
                suggest(name, candidates) or "name a voltage source (insert one of 0 V if needed)",
            )
        return None
    if isinstance(control, Coupling) or (
        isinstance(control, Cccs) and isinstance(device, CurrentControlled | CurrentSwitch)
    ):
        findings.error(
            "NS2006",
            f"{device.name} cannot be controlled by the {control.KIND} {name}",
            span,
            f"put a 0 V source in series with {name} and name that source",
        )
        return None
    if isinstance(control, Device):
        control.keep_current()
    return control


def _inductor(
    device: Coupling,
    name: str,
    by_name: Mapping[str, Device],
    lines: set[str],
    findings: Findings,
) -> Inductor | None:
    """Return a coupled inductor, or None after reporting why not."""
    found = by_name.get(name)
    span = device.control_span(name)
    if isinstance(found, Inductor):
        if found.value == 0.0:
            findings.error(
                "NS2010",
                f"{device.name} couples {name}, which has no inductance",
                span,
                "give it a positive inductance",
            )
            return None
        return found
    if found is not None or name not in lines:
        known = [n for n, d in by_name.items() if isinstance(d, Inductor)]
        what = f"is a {found.KIND}" if found is not None else "does not exist"
        findings.error(
            "NS2010",
            f"{device.name} couples {name}, which {what}",
            span,
            suggest(name, known) or "a K line names two inductors",
        )
    return None


def _check_couplings(couplings: Sequence[Coupling], findings: Findings) -> None:
    """Report couplings that no windings can have: the coupling matrix must not be indefinite."""
    names: dict[str, int] = {}
    for coupling in couplings:
        for inductor in coupling.inductors:
            names.setdefault(inductor.name, len(names))
    sets = UnionFind(len(names))
    for coupling in couplings:
        for inductor in coupling.inductors[1:]:
            sets.union(names[coupling.inductors[0].name], names[inductor.name])
    groups: dict[int, list[Coupling]] = {}
    for coupling in couplings:
        if coupling.inductors:
            groups.setdefault(sets.find(names[coupling.inductors[0].name]), []).append(coupling)
    for group in groups.values():
        if len(group) == 1 and len(group[0].inductors) == 2:
            continue
        members = {one.name: 0 for coupling in group for one in coupling.inductors}
        index = {name: k for k, name in enumerate(members)}
        matrix = np.eye(len(index))
        for coupling in group:
            for one in coupling.inductors:
                for two in coupling.inductors:
                    if one is not two:
                        matrix[index[one.name], index[two.name]] += coupling.coefficient
        if np.linalg.eigvalsh(matrix)[0] < -1e-9:
            findings.error(
                "NS2010",
                f"the couplings {', '.join(c.name for c in group)} contradict each other: "
                f"inductors {', '.join(index)} would store negative energy",
                group[-1].span,
                "lower the couplings, or couple all windings on one K line",
            )
