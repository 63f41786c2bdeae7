"""The spanning tree of the heaviest branches: its voltages are the unknowns of a network.

Node voltages are sums of them.  In these coordinates the equations stay well conditioned whatever
the values are: every branch outside the tree closes a loop through branches of at least its own
weight, and what little current or voltage it has is not the difference of large numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from ..devices import Conditions, Device
from .union_find import UnionFind

#: whether engines solve in these coordinates, or in node voltages everywhere
IN_USE = True
#: among branches of one kind the heavier: large capacitances and conductances, small inductances
_KINDS = {"V": 0, "E": 1, "C": 2, "R": 3, "P": 4, "L": 5, "G": 6, "I": 7}
#: a tree may ask for so many more terms than node voltages do, for each node
_FILL = 64
#: below this number of nodes matrices are dense anyway
_SMALL, _DENSE = 100, 4


class _Weighted(NamedTuple):
    """A branch; the least comes first."""

    kind: int
    lightness: float
    number: int
    a: str
    b: str


def spanning_tree(devices: Sequence[Device], conditions: Conditions) -> dict[str, str]:
    """Return the tree in whose voltages an island is solved; empty for node voltages.

    Newton's method beside smooth laws has node voltages.

    Parameters
    ----------
    devices : sequence of Device
        Of one island.
    conditions : Conditions
    """
    if not IN_USE or any(d.smooth for d in devices):
        return {}
    return heaviest_tree(devices, conditions)


def heaviest_tree(devices: Sequence[Device], conditions: Conditions) -> dict[str, str]:
    """Return for each node the one before it on the way to ground.

    Voltage sources go before capacitors, these before resistors, pairs, inductors and sources of
    currents (a normal tree); among equal kinds the heavier branch.  Where the loops of such a tree
    would fill the equations of a large network, nothing: the unknowns are node voltages.

    Parameters
    ----------
    devices : sequence of Device
        Of one island.
    conditions : Conditions

    References
    ----------
    S. A. Vavasis, Stable numerical algorithms for equilibrium systems, SIAM J. Matrix Anal. Appl.
    15 (1994) 1108-1131.

    Examples
    --------
    >>> from nsspice.circuit import build
    >>> from nsspice.netlist import parse_text
    >>> island = build(parse_text("t\\nV1 a 0 1\\nR1 a b 1\\nC1 b c 1u\\nR2 c 0 1\\n")).islands[0]
    >>> heaviest_tree(island.devices, Conditions())
    {'a': '0', 'b': 'a', 'c': 'b'}
    """
    branches = sorted(_branches(devices, conditions))
    near = _forest(branches)
    before: dict[str, str] = {"0": "0"}
    depth = {"0": 0}
    # a part without a branch to ground hangs from ground by its first node
    for root in near:
        before.setdefault(root, "0")
        depth.setdefault(root, 1)
        new = [root]
        while new:
            node = new.pop()
            for other in near[node]:
                if other not in before:
                    before[other], depth[other] = node, depth[node] + 1
                    new.append(other)
    del before["0"]
    return before if _is_sparse(branches, before, depth) else {}


def _branches(devices: Sequence[Device], conditions: Conditions) -> Iterator[_Weighted]:
    """Yield all branches."""
    number = 0
    for device in devices:
        value = conditions.values.get(device.name, getattr(device, "value", 0.0))
        size = abs(value) if isinstance(value, int | float) else 0.0
        for edge in device.branches(conditions.values):
            lightness = -size if edge.kind == "C" else size if edge.kind in "RL" else 0.0
            yield _Weighted(_KINDS[edge.kind], lightness, number, edge.a, edge.b)
            number += 1


def _forest(branches: Sequence[_Weighted]) -> dict[str, list[str]]:
    """Return the neighbours of each node in the forest of the first branches (Kruskal)."""
    number: dict[str, int] = {"0": 0}
    for branch in branches:
        number.setdefault(branch.a, len(number))
        number.setdefault(branch.b, len(number))
    sets = UnionFind(len(number))
    near: dict[str, list[str]] = {name: [] for name in number}
    for branch in branches:
        if sets.union(number[branch.a], number[branch.b]):
            near[branch.a].append(branch.b)
            near[branch.b].append(branch.a)
    return near


def _is_sparse(
    branches: Sequence[_Weighted], before: Mapping[str, str], depth: Mapping[str, int]
) -> bool:
    """Return whether the loops of the tree fill the matrices with a few terms for each node."""
    left = _FILL * len(before) + _DENSE * min(len(before), _SMALL) ** 2
    for branch in branches:
        a, b, length = branch.a, branch.b, 0
        while a != b and length * length <= left:
            if depth[a] >= depth[b]:
                a = before[a]
            else:
                b = before[b]
            length += 1
        left -= length * length
        if left < 0:
            return False
    return True
