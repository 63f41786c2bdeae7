"""Islands: independent parts of a circuit, solved each in its own class.

Two elements belong together if they share a node other than ground, or if one senses or is coupled
to the other.  Ground joins nothing: its potential is known.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..devices.device import Device
from .union_find import UnionFind


def split(devices: Sequence[Device]) -> list[list[Device]]:
    """Return the devices of each island, both in deck order.

    Elements that touch ground only have no unknown voltage; they join the first island.

    Parameters
    ----------
    devices : sequence of Device
    """
    number = {device.name: k for k, device in enumerate(devices)}
    node_item: dict[str, int] = {}
    links: list[tuple[int, int]] = []
    grounded: list[int] = []
    total = len(devices)
    for k, device in enumerate(devices):
        alone = True
        for node in (*device.nodes, *device.control_nodes):
            if node != "0":
                item = node_item.get(node)
                if item is None:
                    item = node_item[node] = total + len(node_item)
                links.append((k, item))
                alone = False
        for other in device.control_elements:
            # the base of q1 is q1.b
            links.append((k, number[other if other in number else other.rpartition(".")[0]]))
            alone = False
        if alone:
            grounded.append(k)
    sets = UnionFind(total + len(node_item))
    for one, two in links:
        sets.union(one, two)
    for k in grounded[1:] if len(grounded) == total else grounded:
        if sets.find(k) == k:
            first = next((j for j in range(total) if j not in grounded), grounded[0])
            sets.union(k, first)
    groups: dict[int, list[Device]] = {}
    for k, device in enumerate(devices):
        groups.setdefault(sets.find(k), []).append(device)
    return list(groups.values())
