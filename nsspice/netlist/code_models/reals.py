"""Nodes of XSPICE's type ``real``: their value is a voltage, the sum of all that drives them.

An output is a current into the resistor of 1 Ohm that each such node has.
"""

from __future__ import annotations

from ..elements.template import Port
from .block import DELAY, Block
from .logic import all_of, delayed, held, no


def from_digital(block: Block) -> list[str]:
    """Return the bridge from a digital node; disabled, it is 0."""
    zero, one = block.number("zero", 0.0), block.number("one", 1.0)
    enabled = "1" if block.ports[1][0].plus == "null" else block.bit(1)
    high = all_of(enabled, block.bit(0))
    value = f"{zero}*{enabled} + {one - zero}*{high}"
    return _driven(block, 2, value)


def gain(block: Block) -> list[str]:
    """Return the amplifier of a value, without its delay."""
    value = f"{block.number('gain', 1.0)}*({block.input(0)} + {block.number('in_offset', 0.0)})"
    return _driven(block, 1, f"{value} + {block.number('out_offset', 0.0)}")


def clocked(block: Block) -> list[str]:
    """Return the register: after a rising edge it has the value from before."""
    clock = block.bit(1)
    late = block._replace(ports=[[Port("late", "0")]])
    return [
        f"B1 x 0 V={{{block.input(0)}}}",
        *held("x", "m", no(clock)),
        *delayed(late, clock, 0, (block.number("delay", DELAY),) * 2),
        "B2 y 0 V={v(m)}",
        *held("y", "s", all_of(clock, "v(late)")),
        *_driven(block, 2, "v(s)"),
    ]


def to_analogue(block: Block) -> list[str]:
    """Return the bridge to an analogue node; its steps are sharp."""
    return block.output(1, f"{block.number('gain', 1.0)}*{block.input(0)}")


def _driven(block: Block, index: int, value: str) -> list[str]:
    return [f"Bout{index} 0 {block.ports[index][0].plus} I={{{value}}}"]
