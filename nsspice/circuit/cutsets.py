"""Cut-sets of current sources: what flows into a part of the circuit must flow out of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..devices.device import Device
from ..devices.sources.isource import CurrentSource
from ..errors import Diagnostic
from .loops import Graph
from .source_sums import WaveSum
from .union_find import UnionFind

if TYPE_CHECKING:
    from .topology import Mode


def check_cutsets(graph: Graph, mode: Mode) -> Iterator[tuple[Diagnostic, list[str]]]:
    """Yield an error for each part that current sources alone charge.

    Parts that a controlled current source reaches are left to the solver: its current follows.

    Parameters
    ----------
    graph : sequence of (Device, tuple of Edge)
    mode : Mode
        What the sources do; at DC capacitors are open.
    """
    sources = [device for device, _ in graph if isinstance(device, CurrentSource)]
    if not sources:
        return
    number: dict[str, int] = {"0": 0}
    joins: list[tuple[str, str]] = []
    steered: list[str] = []
    blocking: list[Device] = []
    for device, edges in graph:
        for node in device.nodes:
            number.setdefault(node, len(number))
        for edge in edges:
            if edge.kind == "G":
                steered += (edge.a, edge.b)
            elif edge.kind == "C" and mode.dc:
                blocking.append(device)
            elif edge.kind != "I":
                joins.append((edge.a, edge.b))
    sets = UnionFind(len(number))
    for a, b in joins:
        sets.union(number[a], number[b])
    free = {sets.find(number[node]) for node in steered}
    totals: dict[int, WaveSum] = {}
    crossing: dict[int, list[Device]] = {}
    for source in sources:
        start, end = (sets.find(number[node]) for node in source.ends)
        if start == end:
            continue
        for part, sign in ((start, -1.0), (end, 1.0)):
            if part != 0:
                total = totals.setdefault(part, WaveSum())
                for waveform in mode.waveforms[source.name]:
                    total.add(waveform, sign * source.m)
                crossing.setdefault(part, []).append(source)
    for part, total in totals.items():
        if part in free or total.vanishes():
            continue
        inside = [node for node, k in number.items() if sets.find(k) == part]
        yield _conflict(crossing[part], inside, total, blocking, mode)


def _conflict(
    sources: list[Device], nodes: list[str], total: WaveSum, blocking: list[Device], mode: Mode
) -> tuple[Diagnostic, list[str]]:
    """Return the error for a part with a net current."""
    listed = ", ".join(f"{d.name} (line {d.span.line})" for d in sources)
    where = ", ".join(nodes[:6]) + (f" and {len(nodes) - 6} more" if len(nodes) > 6 else "")
    what = f"node{'s' if len(nodes) > 1 else ''} {where}"
    verb = "drives" if len(sources) == 1 else "drive"
    names = [d.name for d in sources]
    inside = set(nodes)
    charged = [d for d in blocking if (d.ends[0] in inside) != (d.ends[1] in inside)]
    if charged:
        caps = ", ".join(f"{d.name} (line {d.span.line})" for d in charged)
        verb_open = "is" if len(charged) == 1 else "are"
        message = (
            f"{mode.what} {caps} {verb_open} open, and {listed} {verb} {total} A into {what}, "
            f"which has no return path"
        )
        hint = "add uic to .tran, or connect a resistor to ground"
        names += [d.name for d in charged]
        return Diagnostic("NS2024", message, sources[0].span, hint), names
    message = f"{listed} {verb} {total} A into {what}, which has no return path"
    hint = "connect a resistor, capacitor or diode that carries the current"
    return Diagnostic("NS2023", message, sources[0].span, hint), names
