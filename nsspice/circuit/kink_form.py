"""Which expressions of an island have their kinks as pairs, and which are left on the tape.

Pairs keep an island in the exact engine.  Where another element is smooth all the same, Newton's
method on the tape is better at finding a solution.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..devices.device import Device
from ..devices.stamper import Conditions
from .mna import assemble

#: Unknowns and pairs up to which kinks are pairs: larger islands take steps in any case.
_MOST = 300


def written(
    devices: Sequence[Device], nodes: Sequence[str], conditions: Conditions
) -> list[Device]:
    """Return the elements of an island, their expressions as pairs or on the tape.

    Parameters
    ----------
    devices : sequence of Device
    nodes : sequence of str
        All but ground.
    conditions : Conditions
    """
    if not any(device.kinked for device in devices):
        return list(devices)
    from ..devices.expressions.knotted_charge import as_junctions

    pairs = as_junctions(_as(devices, True))
    return pairs if _suits(pairs, nodes, conditions) else _as(devices, False)


def _as(devices: Sequence[Device], pairs: bool) -> list[Device]:
    return [device.written(pairs) for device in devices]


def _suits(devices: Sequence[Device], nodes: Sequence[str], conditions: Conditions) -> bool:
    """Return whether nothing is smooth, and the island is small enough to be solved by modes."""
    if any(device.smooth for device in devices):
        return False
    system = assemble(devices, nodes, conditions).system
    return system.n + system.m <= _MOST
