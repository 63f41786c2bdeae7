"""What all code models have in common: ports and parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..deck import Grid, Model
from ..elements.template import CodeTemplate, Port
from ..findings import Unreadable

#: XSPICE's delay of digital models that do not give one [s]
DELAY = 1e-9


class Block(NamedTuple):
    """An A line with its values: ports by position, and the parameters of its model.

    ``clean`` are nodes that have 0 V or 1 V, nothing between.
    """

    name: str
    ports: Sequence[Sequence[Port]]
    model: Model | None
    given: Mapping[str, float]
    clean: frozenset[str] = frozenset()

    def number(self, key: str, default: float) -> float:
        """Return a parameter of the model or of the line."""
        if key in self.given:
            return self.given[key]
        param = self.model.params.get(key) if self.model else None
        if param is None:
            return default
        if isinstance(param.value, Grid):
            return next(iter(param.value.lists.values()))[0]
        if isinstance(param.value, str):
            return 1.0 if param.value in ("true", "t", "yes") else 0.0
        return float(param.value) if isinstance(param.value, int | float) else default

    def numbers(self, key: str) -> list[float]:
        """Return a vector of the model, a number as a vector of one."""
        param = self.model.params.get(key) if self.model else None
        if param is None:
            return []
        if isinstance(param.value, Grid):
            return list(next(iter(param.value.lists.values())))
        return [self.number(key, 0.0)]

    def text(self, key: str) -> str:
        """Return a word of the model."""
        param = self.model.params.get(key) if self.model else None
        return param.value if param is not None and isinstance(param.value, str) else ""

    def input(self, index: int, member: int = 0) -> str:
        """Return an input as an expression; an inverted digital one is 1 less it."""
        port = self.ports[index][member]
        if port.kind.startswith("i"):
            return f"i(Vin{index}x{member})"
        name = f"v({port.plus},{port.minus})" if port.minus != "0" else f"v({port.plus})"
        return f"(1-{name})" if port.inverted else name

    def inputs(self, index: int) -> list[str]:
        """Return all members of a vector of inputs."""
        return [self.input(index, k) for k in range(len(self.ports[index]))]

    def bit(self, index: int, member: int = 0) -> str:
        """Return a digital input as a value of 0 or 1; one left open is 0."""
        if index >= len(self.ports):
            return "0"
        port = self.ports[index][member]
        if port.plus == "null":
            return "0"
        value = f"v({port.plus})" if port.plus in self.clean else f"v(in{index}x{member})"
        return f"(1 - {value})" if port.inverted else value

    def compared(self, index: int) -> list[str]:
        """Return the sources that make 0 V or 1 V of digital inputs that have other voltages."""
        return [
            f"Bin{index}x{k} in{index}x{k} 0 V={{if(v({port.plus}) > 0.5, 1, 0)}}"
            for k, port in enumerate(self.ports[index])
            if port.plus not in self.clean and port.plus != "null"
        ]

    def bits(self, index: int) -> list[str]:
        """Return all members of a vector of digital inputs."""
        return [self.bit(index, k) for k in range(len(self.ports[index]))]

    def output(self, index: int, value: str) -> list[str]:
        """Return the source that drives an analogue output."""
        port = self.ports[index][0]
        if port.plus == "null":
            return []
        quantity = "I" if port.kind.startswith("i") else "V"
        return [f"Bout{index} {port.plus} {port.minus} {quantity}={{{value}}}"]


def delays(block: Block, default: float = DELAY) -> tuple[float, float]:
    """Return the times of a rise and of a fall [s]."""
    return block.number("rise_delay", default), block.number("fall_delay", default)


def beyond_table(x: str, xs: Sequence[float], ys: Sequence[float]) -> str:
    """Return a table that goes on beyond its ends in straight lines."""
    points = ", ".join(f"{a}, {b}" for a, b in zip(xs, ys, strict=True))
    before, after = (ys[1] - ys[0]) / (xs[1] - xs[0]), (ys[-1] - ys[-2]) / (xs[-1] - xs[-2])
    beyond = f"{before}*min({x} - {xs[0]}, 0) + {after}*max({x} - {xs[-1]}, 0)"
    return f"pwl({x}, {points}) + {beyond}"


def pairs(block: Block, xs: str, ys: str) -> tuple[list[float], list[float]]:
    """Return two vectors of the model that belong together."""
    found = block.numbers(xs), block.numbers(ys)
    if len(found[0]) != len(found[1]) or len(found[0]) < 2:
        raise wrong(block, f"{xs} and {ys} must have the same number of values, 2 at least")
    return found


def wrong(block: Block, what: str, item: CodeTemplate | None = None) -> Unreadable:
    """Return what is said of a line or of its model."""
    place = item.span if item is not None else (block.model.span if block.model else None)
    return Unreadable("NS1008", f"{block.name}: {what}", place)
