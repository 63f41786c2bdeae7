"""Digital code models, and the bridges to them."""

from __future__ import annotations

from collections.abc import Callable

from .analogue import oscillation
from .block import DELAY, Block, beyond_table, delays, pairs, wrong
from .logic import all_of, any_of, delayed, gate_value, memory, no, one_of, parity, set_and_reset
from .logic import flip_flop as master_and_slave


def clock(block: Block) -> list[str]:
    """Return the digital controlled oscillator."""
    return [*oscillation(block), *delayed(block, "v(up)", 1, delays(block))]


def gate(kind: str) -> Callable[[Block], list[str]]:
    """Return the writer of a gate."""
    return lambda block: delayed(block, gate_value(kind, block.bits(0)), 1, delays(block))


def flip_flop(kind: str) -> Callable[[Block], list[str]]:
    """Return an edge-triggered flip-flop with its outputs."""

    def lines(block: Block) -> list[str]:
        first = 1 if kind in ("d", "t") else 2
        clock, setting, resetting = (block.bit(first + k) for k in range(3))
        q, one, zero = "v(slave)", block.bit(0), no(block.bit(1))
        wanted = {
            "d": lambda: one,
            "t": lambda: parity([one, q]),
            "jk": lambda: one_of([all_of(q, zero), all_of(no(q), one)]),
            "sr": lambda: any_of(one, all_of(q, zero)),
        }[kind]()
        delay = (block.number("clk_delay", DELAY),) * 2
        return [
            *master_and_slave(wanted, clock, setting, resetting),
            *delayed(block, q, first + 3, delay),
            *delayed(block, no(q), first + 4, delay),
        ]

    return lines


def d_latch(block: Block) -> list[str]:
    """Return the latch that follows its input while it is enabled."""
    control = set_and_reset(*(block.bit(k) for k in (1, 0, 2, 3)))
    delay = (block.number("data_delay", DELAY),) * 2
    return [
        *memory(control, "q"),
        *delayed(block, "v(q)", 4, delay),
        *delayed(block, no("v(q)"), 5, delay),
    ]


def sr_latch(block: Block) -> list[str]:
    """Return the latch that is set and reset while it is enabled."""
    enabled, one, zero = (block.bit(k) for k in (2, 0, 1))
    up = any_of(block.bit(3), all_of(enabled, one, no(zero)))
    down = any_of(block.bit(4), all_of(enabled, zero))
    delay = (block.number("sr_delay", DELAY),) * 2
    return [
        *memory(f"{all_of(up, no(down))} - {down}", "q"),
        *delayed(block, "v(q)", 5, delay),
        *delayed(block, no("v(q)"), 6, delay),
    ]


def to_digital(block: Block) -> list[str]:
    """Return the bridges to digital nodes: between in_low and in_high the state is kept."""
    low, high = block.number("in_low", 0.1), block.number("in_high", 0.9)
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 0.0)
    lines: list[str] = []
    for k, port in enumerate(block.ports[1]):
        lines += memory(f"{block.input(0, k)} - {middle}", f"q{k}", half)
        one = block._replace(ports=[block.ports[0], [port]])
        lines += delayed(one, f"v(q{k})", 1, delays(block), f"1y{k}")
    return lines


def to_analogue(block: Block) -> list[str]:
    """Return the bridges from digital nodes; edges are sharp."""
    low, high = block.number("out_low", 0.0), block.number("out_high", 1.0)
    lines = []
    for k, port in enumerate(block.ports[1]):
        value = f"{low} + {high - low}*{block.input(0, k)}"
        lines.append(f"B{k} {port.plus} {port.minus} V={{{value}}}")
    return lines


def constant(value: int) -> Callable[[Block], list[str]]:
    """Return the writer of nodes that are always 0, or 1."""
    return lambda block: [f"V{k} {port.plus} 0 {value}" for k, port in enumerate(block.ports[0])]


def modulator(block: Block) -> list[str]:
    """Return the modulator of pulse widths: high in the last part of each period."""
    xs, ys = pairs(block, "cntl_array", "dc_array")
    period = 1.0 / block.number("frequency", 1e6)
    phase = (block.number("init_phase", 0.0) / 360.0) % 1.0
    duty = f"limit({beyond_table(block.input(0), xs, ys)}, 0, 1)"
    return [
        f"Vx x 0 PWL 0 {phase} {(1.0 - phase) * period} 1 REPEAT FOREVER (+0 0 +{period} 1) "
        "ENDREPEAT",
        *delayed(block, f"if(v(x) > 1 - {duty}, 1, 0)", 1, delays(block)),
    ]


def look_up(block: Block) -> list[str]:
    """Return what a table of ones and zeros says of the inputs, the first one counting least.

    With several outputs their tables follow each other.
    """
    inputs, outputs = block.bits(0), block.ports[1]
    size = 1 << len(inputs)
    table = block.text("table_values")
    if len(table) != size * len(outputs) or set(table) - {"0", "1"}:
        raise wrong(block, f"table_values must be {size * len(outputs)} characters 0 or 1")
    lines: list[str] = []
    for k, port in enumerate(outputs):
        part = table[k * size : (k + 1) * size]
        terms = [number_is(row, inputs) for row in range(size) if part[row] == "1"]
        times = [block.numbers(name) or [DELAY] for name in ("rise_delay", "fall_delay")]
        rise, fall = (given[min(k, len(given) - 1)] for given in times)
        one = block._replace(ports=[block.ports[0], [port]])
        lines += delayed(one, one_of(terms), 1, (rise, fall), f"1y{k}")
    return lines


def number_is(number: int, bits: list[str]) -> str:
    """Return whether some bits, the first one counting least, are those of a number."""
    return all_of(*(bit if number >> k & 1 else no(bit) for k, bit in enumerate(bits)))
