"""LTspice's A devices with eight terminals: gates, Schmitt triggers, flip-flops.

Terminals 1 to 5 are inputs, 6 is the inverted output, 7 the output, 8 the common; one that is
connected to the common is not used.  Edges are sharp: ``Trise``, ``Tau`` and ``Rout`` are not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..elements.template import CodeTemplate, Port
from ..findings import Unreadable
from .block import Block
from .logic import all_of, delayed, flip_flop, gate_value, memory, no


class _Device:
    """One line: its terminals and levels."""

    def __init__(self, item: CodeTemplate, given: Mapping[str, float]) -> None:
        self.item, self.given = item, given
        self.nodes = [vector[0].plus for vector in item.ports]
        self.common = self.nodes[7]
        self.high, self.low = given.get("vhigh", 1.0), given.get("vlow", 0.0)
        self.threshold = given.get("ref", 0.5 * (self.high + self.low))

    def volts(self, node: str) -> str:
        """Return the voltage of a terminal against the common."""
        return f"v({node})" if self.common == "0" else f"v({node},{self.common})"

    def used(self, terminal: int) -> bool:
        """Return whether a terminal, counted from 1, is connected."""
        return self.nodes[terminal - 1] != self.common

    def is_high(self, terminal: int) -> str:
        """Return 1 where an input is high."""
        if not self.used(terminal):
            return "0"
        return f"if({self.volts(self.nodes[terminal - 1])} > {self.threshold}, 1, 0)"

    def outputs(self, state: str) -> list[str]:
        """Return what drives both outputs by a value."""
        delay = (self.given.get("td", 0.0),) * 2
        swing = self.high - self.low
        lines: list[str] = []
        for terminal, inner, what in ((7, "y", state), (6, "ny", no(state))):
            if not self.used(terminal):
                continue
            block = Block(self.item.name, [(Port(inner, "0"),)] * 10, None, self.given)
            lines += delayed(block, what, terminal, delay)
            node = self.nodes[terminal - 1]
            lines.append(
                f"Bdrive{terminal} {node} {self.common} V={{{self.low} + {swing}*v({inner})}}"
            )
        return lines


def _gate(kind: str) -> Callable[[_Device], list[str]]:
    def lines(device: _Device) -> list[str]:
        values = [device.is_high(k) for k in range(1, 6) if device.used(k)]
        if not values:
            raise _wrong(device, "no input is connected")
        return device.outputs(gate_value(kind, values))

    return lines


def _schmitt(inverted: bool) -> Callable[[_Device], list[str]]:
    def lines(device: _Device) -> list[str]:
        middle, half = device.given.get("vt", device.threshold), device.given.get("vh", 0.0)
        control = f"{device.volts(device.nodes[0])} - {middle}"
        state = no("v(q)") if inverted else "v(q)"
        return [*memory(control, "q", half), *device.outputs(state)]

    return lines


def _d_flop(device: _Device) -> list[str]:
    if device.used(4) or device.used(5):
        raise _wrong(device, "preset and clear of a DFLOP are not simulated")
    q = flip_flop(device.is_high(1), device.is_high(3), "0", "0")
    return [*q, *device.outputs("v(slave)")]


def _sr_flop(device: _Device) -> list[str]:
    one, zero = device.is_high(1), device.is_high(2)
    control = f"{all_of(one, no(zero))} - {zero}"
    return [*memory(control, "q"), *device.outputs("v(q)")]


_WRITERS: dict[str, Callable[[_Device], list[str]]] = {
    "and": _gate("and"),
    "or": _gate("or"),
    "xor": _gate("xor"),
    "buf": _gate("or"),
    "inv": _gate("nor"),
    "schmitt": _schmitt(False),
    "schmtbuf": _schmitt(False),
    "schmtinv": _schmitt(True),
    "dflop": _d_flop,
    "srflop": _sr_flop,
}


def written(item: CodeTemplate, given: Mapping[str, float]) -> list[str]:
    """Return the lines of the subcircuit that stands for an A device.

    Raises
    ------
    Unreadable
        If it has no input, or inputs that are not simulated.
    """
    return _WRITERS[item.model](_Device(item, given))


def _wrong(device: _Device, what: str) -> Unreadable:
    return Unreadable("NS1002", f"{device.item.name}: {what}", device.item.span)
