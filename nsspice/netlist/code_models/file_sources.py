"""XSPICE's sources that read files: digital vectors, and analogue values.

The reader of files has put the rows into the card, as a vector ``rows``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..findings import Unreadable

if TYPE_CHECKING:
    from .block import Block


def _rows(block: Block, width: int) -> list[list[float]]:
    """Return the rows of the file of a source: a time and so many values."""
    numbers = block.numbers("rows")
    if not numbers or len(numbers) % (width + 1):
        place = block.model.span if block.model else None
        message = f"{block.name}: its file has no rows of a time and {width} values"
        raise Unreadable("NS1008", message, place)
    return [numbers[k : k + width + 1] for k in range(0, len(numbers), width + 1)]


def _stairs(rows: Sequence[Sequence[float]], column: int) -> str:
    """Return the points of a PWL that keeps each value to the time of the next one."""
    points = [(rows[0][0], rows[0][column])]
    for row in rows[1:]:
        if row[column] != points[-1][1]:
            points += [(row[0], points[-1][1]), (row[0], row[column])]
    return " ".join(f"{t} {v}" for t, v in points)


def digital_source(block: Block) -> list[str]:
    """Return the digital source of a file; what is unknown is 0."""
    ports = block.ports[0]
    rows = _rows(block, len(ports))
    return [f"V{k} {p.plus} 0 PWL({_stairs(rows, k)})" for k, p in enumerate(ports, start=1)]


def analogue_source(block: Block) -> list[str]:
    """Return the analogue source of a file: straight lines, or steps."""
    ports = block.ports[0]
    rows = _rows(block, len(ports))
    ones, zeros = [1.0] * len(ports), [0.0] * len(ports)
    scales = block.numbers("amplscale") or ones
    offsets = block.numbers("amploffset") or zeros
    made: list[list[float]] = []
    for row in rows:
        at = row[0] * block.number("timescale", 1.0)
        relative = block.number("timerelative", 0.0) and made
        at += made[-1][0] if relative else block.number("timeoffset", 0.0)
        values = [v * s + o for v, s, o in zip(row[1:], scales, offsets, strict=False)]
        made.append([at, *values])
    lines = []
    for k, port in enumerate(ports, start=1):
        points = " ".join(f"{row[0]} {row[k]}" for row in made)
        if block.number("amplstep", 0.0):
            points = _stairs(made, k)
        lines.append(f"V{k} {port.plus} {port.minus} PWL({points})")
    return lines
