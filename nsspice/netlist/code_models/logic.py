"""Logic as sums that are compared: values of 0 and 1, memories, delays.

A value is an expression that is 0 or 1.  Of n values all are 1 where their sum is above n - 1/2:
one comparison for a gate of any width; each comparison is an event, and costs.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..elements.template import Port
from .block import Block


def no(value: str) -> str:
    """Return the inverse of a value."""
    return {"0": "1", "1": "0"}.get(value, f"(1 - {value})")


def all_of(*values: str) -> str:
    """Return 1 where all of some values are 1."""
    if "0" in values:
        return "0"
    left = [value for value in values if value != "1"]
    if len(left) < 2:
        return left[0] if left else "1"
    return f"if({' + '.join(left)} > {len(left) - 0.5}, 1, 0)"


def any_of(*values: str) -> str:
    """Return 1 where one of some values is 1."""
    if "1" in values:
        return "1"
    left = [value for value in values if value != "0"]
    if len(left) < 2:
        return left[0] if left else "0"
    return f"if({' + '.join(left)} > 0.5, 1, 0)"


def one_of(values: Sequence[str]) -> str:
    """Return the sum of values of which no two are 1."""
    left = [value for value in values if value != "0"]
    return f"({' + '.join(left)})" if left else "0"


def parity(values: Sequence[str]) -> str:
    """Return 1 where an odd number of values is 1."""
    total = values[0]
    for other in values[1:]:
        total = f"({total} + {other} - 2*{all_of(total, other)})"
    return total


def gate_value(kind: str, values: Sequence[str]) -> str:
    """Return what a gate computes."""
    plain = {"nand": "and", "nor": "or", "xnor": "xor"}.get(kind, kind)
    if plain == "xor":
        value = parity(values)
    else:
        value = all_of(*values) if plain == "and" else any_of(*values)
    return value if plain == kind else no(value)


def set_and_reset(enabled: str, value: str, setting: str, resetting: str) -> str:
    """Return the control of a memory that takes a value, unless it is set or reset."""
    up = all_of(any_of(setting, all_of(enabled, value)), no(resetting))
    down = any_of(resetting, all_of(enabled, no(value), no(setting)))
    return f"{up} - {down}"


def memory(control: str, node: str, half: float = 0.5, on: bool = False) -> list[str]:
    """Return a node that becomes 1 above ``half`` of a control, 0 below minus ``half``."""
    return [
        f"B{node} {node}c 0 V={{{control}}}",
        f"V{node} {node}1 0 1",
        f"S{node} {node}1 {node} {node}c 0 {node}m" + " on" * on,
        f"R{node} {node} 0 1",
        f".model {node}m SW(VT=0 VH={half})",
    ]


def flip_flop(
    wanted: str, clock: str, setting: str, resetting: str, label: str = "", on: bool = False
) -> list[str]:
    """Return a flip-flop, node ``slave``: a master follows before the edge, the slave after it."""
    before = set_and_reset(no(clock), wanted, setting, resetting)
    after = set_and_reset(clock, f"v(master{label})", setting, resetting)
    return [*memory(before, f"master{label}", on=on), *memory(after, f"slave{label}", on=on)]


def held(source: str, node: str, tracks: str) -> list[str]:
    """Return a node that follows another one while a value is 1, and then keeps its voltage.

    The resistor gives the kept voltage a value at an operating point; its time constant is beyond
    rounding.
    """
    return [
        f"B{node}c {node}c 0 V={{{tracks}}}",
        f"S{node} {source} {node} {node}c 0 {node}m",
        f"C{node} {node} 0 1",
        f"R{node} {node} 0 1e17",
        f".model {node}m SW(VT=0.5)",
    ]


def delayed(
    block: Block, value: str, index: int, delay: tuple[float, float], label: str = ""
) -> list[str]:
    """Return a digital output that follows a value after a time."""
    port = block.ports[index][0] if index < len(block.ports) else Port("null", "0", "d")
    if port.plus == "null":
        return []
    if port.inverted:
        value = no(value)
    rise, fall = delay
    k = label or str(index)
    if rise <= 0.0 and fall <= 0.0:
        return [f"Bout{k} {port.plus} 0 V={{{value}}}"]
    # a ramp between two clamps, whose currents show when it has arrived: a gate that drives itself
    # starts its way back from there
    unit = max(rise, fall)
    up, down = unit / max(rise, 1e-3 * unit), unit / max(fall, 1e-3 * unit)
    return [
        f"C{k} x{k} 0 {unit} ic=0",
        f"Bramp{k} 0 x{k} I={{{up + down}*{value} - {down}}}",
        f"Dtop{k} x{k} top{k}",
        f"Vtop{k} top{k} 0 1",
        f"Dlow{k} low{k} x{k}",
        f"Vlow{k} low{k} 0 0",
        f"Vone{k} one{k} 0 1",
        f"Bend{k} end{k} 0 V={{i(Vtop{k}) + i(Vlow{k})}}",
        f"S{k} one{k} {port.plus} end{k} 0 m{k}",
        f"R{k} {port.plus} 0 1",
        f".model m{k} SW(VT=0 VH=0.5)",
    ]
