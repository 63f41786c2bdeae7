"""Which expressions of an island have their kinks as pairs, and which are left on the tape.

Pairs keep an island in the exact engine.  Where another element is smooth all the same, or where a
step may have several solutions (positive feedback without storage), Newton's method on the tape is
better at finding one, and it finds that of the branch on which the circuit would rest.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..devices import Conditions, Device
from ..problems.csc import weighted_sum
from ..problems.one_solution import may_have_several
from .mna import assemble

#: Unknowns and pairs up to which a step is looked at: larger islands take steps in any case.
_MOST = 300
#: a short step, as a part of the run
_SHORT = 1e-9


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
    pairs = _as(devices, True)
    return pairs if _suits(pairs, nodes, conditions) else _as(devices, False)


def _as(devices: Sequence[Device], pairs: bool) -> list[Device]:
    return [device.written(pairs) for device in devices]


def _suits(devices: Sequence[Device], nodes: Sequence[str], conditions: Conditions) -> bool:
    """Return whether nothing is smooth, and each step is proved to have one solution.

    Where nothing is stored pairs are the better form anyway: an answer is found or disproved.
    """
    if any(device.smooth for device in devices):
        return False
    system = assemble(devices, nodes, conditions).system
    if system.n + system.m > _MOST:
        return False
    if system.static or system.passive:
        return True  # each point is a problem of its own, whose contradictions are proved
    step = _SHORT * (conditions.tstop or 1.0)
    return not may_have_several(system, weighted_sum([(system.G, 1.0), (system.E, 1.0 / step)]))
