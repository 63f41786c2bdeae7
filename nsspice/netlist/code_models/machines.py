"""Code models with states: dividers of a frequency, state machines, memories.

The number of a state is kept in flip-flops, a bit each.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .block import DELAY, Block, delays, wrong
from .digital import number_is
from .logic import all_of, delayed, flip_flop, memory, no, one_of

#: bits of a memory that are written out
_MOST = 1024


class _Step(NamedTuple):
    """One transition: from a state, where a value is 1, to another state."""

    state: int
    condition: str
    following: int


def _machine(
    steps: Sequence[_Step], start: int, clock: str, reset: str
) -> tuple[list[str], list[str]]:
    """Return the flip-flops of a machine, and the values that they have."""
    highest = max(max(step.state, step.following) for step in steps)
    count = max(highest, start, 1).bit_length()
    bits = [f"v(slave{k})" for k in range(count)]
    lines: list[str] = []
    for k in range(count):
        terms = [
            all_of(*_literals(step.state, bits), step.condition)
            for step in steps
            if step.following >> k & 1
        ]
        on = bool(start >> k & 1)
        both = (reset, "0") if on else ("0", reset)
        lines += flip_flop(one_of(terms), clock, *both, f"{k}", on)
    return lines, bits


def _literals(number: int, bits: Sequence[str]) -> list[str]:
    return [bit if number >> k & 1 else no(bit) for k, bit in enumerate(bits)]


def divider(block: Block) -> list[str]:
    """Return the divider of a frequency: it is high in the first of so many cycles."""
    factor, high = int(block.number("div_factor", 2.0)), int(block.number("high_cycles", 1.0))
    start = int(block.number("i_count", 0.0))
    if not 1 <= factor <= 4096:
        raise wrong(block, f"div_factor must be 1 to 4096, not {factor}")
    if not 0 <= start < factor:
        start = 0
    steps = [_Step(k, "1", k % factor + 1) for k in range(factor + 1)]
    lines, bits = _machine(steps, start, block.bit(0), "0")
    up = one_of([number_is(k, bits) for k in range(1, min(high, factor) + 1)])
    return [*lines, *delayed(block, up, 1, delays(block))]


def state_machine(block: Block) -> list[str]:
    """Return the state machine of a file: rows of a state, its outputs, inputs, the next state."""
    inputs, outputs = len(block.ports[0]), len(block.ports[3])
    numbers, width = block.numbers("rows"), 2 + inputs + outputs
    if not numbers or len(numbers) % width:
        place = "its file has no rows of a state, outputs, inputs and the next state"
        raise wrong(block, place)
    rows = [[int(n) for n in numbers[k : k + width]] for k in range(0, len(numbers), width)]
    shown = {row[0]: row[1 : 1 + outputs] for row in rows}
    steps = []
    for row in rows:
        terms = [
            block.bit(0, k) if bit else no(block.bit(0, k))
            for k, bit in enumerate(row[1 + outputs : -1])
            if bit in (0, 1)
        ]
        steps.append(_Step(row[0], all_of(*terms), row[-1]))
    start = int(block.number("reset_state", 0.0))
    lines, bits = _machine(steps, start, block.bit(1), block.bit(2))
    delay = (block.number("clk_delay", DELAY),) * 2
    for k, port in enumerate(block.ports[3]):
        up = one_of([number_is(state, bits) for state, values in shown.items() if values[k]])
        one = block._replace(ports=[[port]])
        lines += delayed(one, up, 0, delay, f"3y{k}")
    return lines


def random_access(block: Block) -> list[str]:
    """Return the memory: what is written at an address, if it is selected; unknown bits are 0."""
    width, lines_of_address = len(block.ports[0]), len(block.ports[2])
    words = 1 << lines_of_address
    if width != len(block.ports[1]) or width * words > _MOST:
        message = f"a memory needs as many outputs as inputs, and has at most {_MOST} bits"
        raise wrong(block, message)
    selected = number_is(int(block.number("select_value", 1.0)), block.bits(4))
    on = block.number("ic", 2.0) == 1.0
    lines = [f"Bwe we 0 V={{{all_of(block.bit(3), selected)}}}"]
    for k in range(width):
        lines.append(f"Bd{k} d{k} 0 V={{{block.bit(0, k)}}}")
    for word in range(words):
        lines.append(f"Ba{word} a{word} 0 V={{{number_is(word, block.bits(2))}}}")
        here = ("v(we)", f"v(a{word})")
        for k in range(width):
            control = f"{all_of(*here, f'v(d{k})')} - {all_of(*here, f'(1 - v(d{k}))')}"
            lines += memory(control, f"m{word}x{k}", on=on)
    delay = (block.number("read_delay", 1e-7),) * 2
    for k, port in enumerate(block.ports[1]):
        read = one_of([all_of(f"v(a{word})", f"v(m{word}x{k})") for word in range(words)])
        one = block._replace(ports=[[port]])
        lines += delayed(one, all_of(selected, read), 0, delay, f"1y{k}")
    return lines
