"""The spanning tree of the heaviest branches: its voltages are the unknowns of a network.

Node voltages are sums of them.  In these coordinates the equations stay well conditioned for any
values: every branch outside the tree closes a loop through branches of at least its own
weight, and what little current or voltage it has is not the difference of large numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from ..devices.device import Device
from ..devices.stamper import Conditions
from .union_find import UnionFind

#: among branches of one kind the heavier: large capacitances and conductances, small inductances
_KINDS = {"V": 0, "E": 1, "C": 2, "R": 3, "P": 4, "L": 6, "J": 5, "G": 8, "I": 9}
#: at DC, where inductors are short and capacitors open: a capacitor in the tree would make the
#: voltage at a small conductance the difference of two, and put the current of a large one into
#: its equation
_KINDS_AT_DC = {**_KINDS, "L": 2, "C": 10}
#: pairs with smooth laws: junctions (J) that block leave each cut-set its leakage alone
_LIGHT_PAIR = 7
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
    """Return for each node the one before it on the way to ground.

    Voltage sources go before capacitors, these before resistors, pairs, inductors and sources of
    currents (a normal tree), at DC inductors in place of capacitors; among equal kinds the heavier
    branch.  Where the loops of such a tree
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
    >>> spanning_tree(island.devices, Conditions())
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
    kinds = dict(_KINDS_AT_DC if conditions.analysis == "dc" else _KINDS)
    smooth = any(device.smooth for device in devices)
    if smooth:
        kinds["P"] = _LIGHT_PAIR
    for device in devices:
        value = conditions.values.get(device.name, getattr(device, "value", 0.0))
        size = abs(value) if isinstance(value, int | float) else 0.0
        for edge in device.branches(conditions.values):
            lightness = -size if edge.kind == "C" else size if edge.kind in "RL" else 0.0
            # what conducts now and then, as junctions do and switches with resistances
            changes = edge.kind == "R" and (device.smooth or (smooth and not size))
            kind = "J" if changes else edge.kind
            yield _Weighted(kinds[kind], lightness, number, edge.a, edge.b)
            number += 1


def _forest(branches: Sequence[_Weighted]) -> dict[str, list[str]]:
    """Return the neighbours of each node in the forest of the first branches (Kruskal).

    Of junctions, whose conductances differ by powers of ten from one moment to the next, those come
    first that lead to ground on the shortest way: their cut-sets are small.
    """
    number: dict[str, int] = {"0": 0}
    for branch in branches:
        number.setdefault(branch.a, len(number))
        number.setdefault(branch.b, len(number))
    sets = UnionFind(len(number))
    near: dict[str, list[str]] = {name: [] for name in number}

    def join(some: Iterable[_Weighted]) -> None:
        for branch in some:
            if sets.union(number[branch.a], number[branch.b]):
                near[branch.a].append(branch.b)
                near[branch.b].append(branch.a)

    light = _KINDS["J"]
    junctions = [branch for branch in branches if branch.kind == light]
    join(branch for branch in branches if branch.kind < light)
    join(
        _from_ground(
            junctions, [(sets.find(number[j.a]), sets.find(number[j.b])) for j in junctions]
        )
    )
    join(branch for branch in branches if branch.kind > light)
    return near


def _from_ground(
    junctions: Sequence[_Weighted], ends: Sequence[tuple[int, int]]
) -> Iterator[_Weighted]:
    """Yield branches between parts in the order of a breadth-first search from ground, part 0."""
    beside: dict[int, list[tuple[int, _Weighted]]] = {}
    for branch, (a, b) in zip(junctions, ends, strict=True):
        beside.setdefault(a, []).append((b, branch))
        beside.setdefault(b, []).append((a, branch))
    found: set[int] = set()
    for start in (0, *beside):
        queue = [] if start in found else [start]
        found.add(start)
        for part in queue:
            for other, branch in beside.get(part, ()):
                if other not in found:
                    found.add(other)
                    queue.append(other)
                    yield branch


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
