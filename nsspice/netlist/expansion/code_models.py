"""XSPICE's code models, written out as sources, switches and storage.

An A line becomes an instance of a subcircuit that is written here.  Digital nodes are voltages of
0 and 1; a gate with delays is a ramp between them that a switch with hysteresis watches, so that
its events are those of any other switch.  Pulses shorter than a delay are swallowed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from ..deck import Grid, Model
from ..elements.template import CodeTemplate, Port
from ..findings import Unreadable
from .file_sources import analogue_source, digital_source

_GATES = ("and", "nand", "or", "nor", "xor", "xnor")
#: XSPICE's delay of digital models that do not give one [s]
_DELAY = 1e-9


class Block(NamedTuple):
    """An A line with its values: ports by position, and the parameters of its model."""

    name: str
    ports: Sequence[Sequence[Port]]
    model: Model | None
    given: Mapping[str, float]

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

    def high(self, index: int, member: int = 0) -> str:
        """Return whether a digital input is 1; one left open never is."""
        if index >= len(self.ports) or self.ports[index][member].plus == "null":
            return "0"
        return f"{self.input(index, member)} > 0.5"

    def output(self, index: int, value: str) -> list[str]:
        """Return the source that drives an analogue output."""
        port = self.ports[index][0]
        if port.plus == "null":
            return []
        quantity = "I" if port.kind.startswith("i") else "V"
        return [f"Bout{index} {port.plus} {port.minus} {quantity}={{{value}}}"]


def _linear(block: Block) -> list[str]:
    gain, before, after = (
        block.number(k, d) for k, d in (("gain", 1.0), ("in_offset", 0.0), ("out_offset", 0.0))
    )
    return block.output(1, f"{gain}*({block.input(0)} + {before}) + {after}")


def _limited(block: Block) -> list[str]:
    gain, before = block.number("gain", 1.0), block.number("in_offset", 0.0)
    low, high = block.number("out_lower_limit", -1.0), block.number("out_upper_limit", 1.0)
    return block.output(1, f"limit({gain}*({block.input(0)} + {before}), {low}, {high})")


def _controlled_limit(block: Block) -> list[str]:
    gain, before = block.number("gain", 1.0), block.number("in_offset", 0.0)
    high = f"{block.input(1)} - {block.number('upper_delta', 0.0)}"
    low = f"{block.input(2)} + {block.number('lower_delta', 0.0)}"
    value = f"min(max({gain}*({block.input(0)} + {before}), {low}), {high})"
    return block.output(3, value)


def _combined(block: Block, sign: str) -> list[str]:
    """Return the summer and the multiplier."""
    inputs = block.inputs(0)
    gains = block.numbers("in_gain") or [1.0] * len(inputs)
    offsets = block.numbers("in_offset") or [0.0] * len(inputs)
    terms = [f"{g}*({x} + {o})" for x, g, o in zip(inputs, gains, offsets, strict=False)]
    gain, after = block.number("out_gain", 1.0), block.number("out_offset", 0.0)
    return block.output(1, f"{gain}*({sign.join(terms)}) + {after}")


def _divided(block: Block) -> list[str]:
    top = f"{block.number('num_gain', 1.0)}*({block.input(0)} + {block.number('num_offset', 0.0)})"
    bottom = (
        f"{block.number('den_gain', 1.0)}*({block.input(1)} + {block.number('den_offset', 0.0)})"
    )
    least = block.number("den_lower_limit", 1e-10)
    bottom = f"if(abs({bottom}) > {least}, {bottom}, {least})"
    return block.output(
        2, f"{block.number('out_gain', 1.0)}*({top})/({bottom}) + {block.number('out_offset', 0.0)}"
    )


def _integrated(block: Block) -> list[str]:
    """Return the integrator, which stops at its limits."""
    gain, before = block.number("gain", 1.0), block.number("in_offset", 0.0)
    start = block.number("out_ic", 0.0)
    lines = [f"C1 x 0 1 ic={start}", f".ic v(x)={start}"]
    lines.append(f"B1 0 x I={{{gain}*({block.input(0)} + {before})}}")
    if block.model and "out_upper_limit" in block.model.params:
        lines += ["D1 x top", f"V1 top 0 {block.number('out_upper_limit', 0.0)}"]
    if block.model and "out_lower_limit" in block.model.params:
        lines += ["D2 bottom x", f"V2 bottom 0 {block.number('out_lower_limit', 0.0)}"]
    return [*lines, *block.output(1, "v(x)")]


def _differentiated(block: Block) -> list[str]:
    """Return the differentiator: the current of a capacitor across its input."""
    gain = block.number("gain", 1.0)
    lines = [f"B1 x 0 V={{{block.input(0)}}}", "V1 x y 0", "C1 y 0 1"]
    value = f"{gain}*i(v1) + {block.number('out_offset', 0.0)}"
    if block.model and "out_upper_limit" in block.model.params:
        low, high = block.number("out_lower_limit", -1e30), block.number("out_upper_limit", 1e30)
        value = f"limit({value}, {low}, {high})"
    return [*lines, *block.output(1, value)]


def _ends(block: Block, pairs: int = 1, which: int = 0) -> tuple[str, str]:
    """Return the nodes of a port that is differential: written as a pair, or as two nodes."""
    if len(block.ports) <= pairs:
        port = block.ports[which][0]
        return port.plus, port.minus
    first, second = block.ports[2 * which][0], block.ports[2 * which + 1][0]
    return first.plus, second.plus


def _capacitor(block: Block) -> list[str]:
    """Return the capacitor; its initial voltage is that of the operating point, too."""
    a, b = _ends(block)
    start = block.number("ic", 0.0)
    held = [f".ic v({a})={start}"] if b == "0" else []
    return [f"C1 {a} {b} {block.number('c', 0.0)} ic={start}", *held]


def _magnetic_core(block: Block) -> list[str]:
    """Return the core without hysteresis: the flux, a current, is a table of the field."""
    if block.number("mode", 1.0) != 1.0:
        raise _wrong(block, "a core with mode=2 is not simulated; write L ... Hc= Br= Bs=")
    fields, densities = block.numbers("h_array"), block.numbers("b_array")
    if len(fields) != len(densities) or len(fields) < 2:
        raise _wrong(block, "H_array and B_array must have the same number of values, 2 at least")
    length, area = block.number("length", 1.0), block.number("area", 1.0)
    a, b = _ends(block)
    xs, ys = [h * length for h in fields], [d * area for d in densities]
    return [f"B1 {a} {b} I={{{_beyond_table(f'v({a},{b})', xs, ys)}}}"]


def _winding(block: Block) -> list[str]:
    """Return a winding: in its magnetic circuit flux is a current, ampere-turns are a voltage."""
    if len(block.ports) not in (2, 4):
        raise _wrong(block, "lcouple needs two ports of two nodes each")
    (a, b), (c, d) = _ends(block, 2), _ends(block, 2, 1)
    turns = block.number("num_turns", 1.0)
    return [
        f"V1 {a} x 0",
        f"H1 {c} {d} V1 {turns}",
        f"F1 w 0 H1 {turns}",
        "L1 w 0 1",
        f"E1 x {b} w 0 1",
    ]


def _transfer(block: Block) -> list[str]:
    """Return the transfer function of s; coefficients begin with the highest power."""
    rate = block.number("denormalized_freq", 1.0)

    def polynomial(key: str) -> str:
        found = block.numbers(key)
        return (
            " + ".join(f"{c}*(s/{rate})^{len(found) - 1 - k}" for k, c in enumerate(found)) or "1"
        )

    gain, before = block.number("gain", 1.0), block.number("in_offset", 0.0)
    function = f"{gain}*({polynomial('num_coeff')})/({polynomial('den_coeff')})"
    return [
        f"E1 x 0 LAPLACE {{{block.input(0)} + {before}}} = {{{function}}}",
        *block.output(1, "v(x)"),
    ]


def _hysteresis(block: Block) -> list[str]:
    """Return the comparator with hysteresis; its corners are sharp."""
    low, high, width = (
        block.number(k, d) for k, d in (("in_low", 0.0), ("in_high", 1.0), ("hyst", 0.1))
    )
    bottom, top = block.number("out_lower_limit", 0.0), block.number("out_upper_limit", 1.0)
    middle, half = 0.5 * (low + high), max(0.5 * (high - low) + width, 0.0)
    lines = memory(f"{block.input(0)} - {middle}", "x", half)
    return [*lines, *block.output(1, f"{bottom} + {top - bottom}*v(x)")]


def _table(block: Block) -> list[str]:
    """Return the piecewise linear function, extended beyond its ends by straight lines."""
    xs, ys = block.numbers("x_array"), block.numbers("y_array")
    if len(xs) != len(ys) or len(xs) < 2:
        raise _wrong(block, "x_array and y_array must have the same number of values, 2 at least")
    return block.output(1, _beyond_table(block.input(0), xs, ys))


def _beyond_table(x: str, xs: Sequence[float], ys: Sequence[float]) -> str:
    """Return a table that goes on beyond its ends in straight lines."""
    points = ", ".join(f"{a}, {b}" for a, b in zip(xs, ys, strict=True))
    before, after = (ys[1] - ys[0]) / (xs[1] - xs[0]), (ys[-1] - ys[-2]) / (xs[-1] - xs[-2])
    beyond = f"{before}*min({x} - {xs[0]}, 0) + {after}*max({x} - {xs[-1]}, 0)"
    return f"pwl({x}, {points}) + {beyond}"


def _slew(block: Block) -> list[str]:
    """Return the slew rate limiter: a follower whose rate is limited."""
    rise, fall = block.number("rise_slope", 1e9), block.number("fall_slope", 1e9)
    fast = 1e3 * max(rise, fall)
    return [
        "C1 x 0 1",
        f"B1 0 x I={{limit({fast}*({block.input(0)} - v(x)), {-fall}, {rise})}}",
        *block.output(1, "v(x)"),
    ]


def _analogue_switch(block: Block) -> list[str]:
    port = block.ports[1][0]
    off, on = block.number("cntl_off", 0.0), block.number("cntl_on", 1.0)
    return [
        f"Bctl c 0 V={{{block.input(0)}}}",
        f"S1 {port.plus} {port.minus} c 0 sw",
        f".model sw SW(VT={0.5 * (on + off)} RON={block.number('r_on', 1.0)} "
        f"ROFF={block.number('r_off', 1e12)})",
    ]


def _sine(block: Block) -> list[str]:
    """Return the controlled oscillator."""
    xs, ys = block.numbers("cntl_array"), block.numbers("freq_array")
    points = ", ".join(f"{a}, {b}" for a, b in zip(xs, ys, strict=False))
    low, high = block.number("out_low", -1.0), block.number("out_high", 1.0)
    value = f"{0.5 * (low + high)} + {0.5 * (high - low)}*sin(v(x))"
    rate = f"2*pi*max(pwl({block.input(0)}, {points}), 0)"
    return ["C1 x 0 1 ic=0", ".ic v(x)=0", f"B1 0 x I={{{rate}}}", *block.output(1, value)]


def _oscillation(block: Block, rises_first: bool = False) -> list[str]:
    """Return a ramp, node x, from 0 to 1 and back, and node ``up`` that is 1 while it rises.

    The duty cycle is the part of the period in which it rises: the first one, or the last one.
    """
    xs, ys = block.numbers("cntl_array"), block.numbers("freq_array")
    if len(xs) != len(ys) or len(xs) < 2:
        raise _wrong(block, "cntl_array and freq_array must have the same number of values")
    points = ", ".join(f"{a}, {b}" for a, b in zip(xs, ys, strict=True))
    duty = min(max(block.number("duty_cycle", 0.5), 1e-6), 1.0 - 1e-6)
    phase = (block.number("init_phase", 0.0) / 360.0 + (0.0 if rises_first else duty)) % 1.0
    rises = phase < duty
    start = phase / duty if rises else (1.0 - phase) / (1.0 - duty)
    lines = memory("0.5 - v(x)", "up")
    lines[2] += " on" * rises
    slope = f"if(v(up) > 0.5, {1.0 / duty}, {-1.0 / (1.0 - duty)})"
    rate = f"max(pwl({block.input(0)}, {points}), 0)*{slope}"
    # at an operating point it is where its phase says
    return [*lines, f"Cx x 0 1 ic={start}", f".ic v(x)={start}", f"Bx 0 x I={{{rate}}}"]


def _square(block: Block) -> list[str]:
    """Return the controlled square wave; its edges are sharp."""
    low, high = block.number("out_low", -1.0), block.number("out_high", 1.0)
    return [*_oscillation(block), *block.output(1, f"{low} + {high - low}*v(up)")]


def _triangle(block: Block) -> list[str]:
    """Return the controlled triangle wave."""
    low, high = block.number("out_low", -1.0), block.number("out_high", 1.0)
    return [*_oscillation(block, True), *block.output(1, f"{low} + {high - low}*v(x)")]


# -- digital -----------------------------------------------------------------------------------


def memory(control: str, node: str, half: float = 0.5) -> list[str]:
    """Return a node that becomes 1 above ``half`` of a control, 0 below minus ``half``."""
    return [
        f"B{node} {node}c 0 V={{{control}}}",
        f"V{node} {node}1 0 1",
        f"S{node} {node}1 {node} {node}c 0 {node}m",
        f"R{node} {node} 0 1",
        f".model {node}m SW(VT=0 VH={half})",
    ]


def delayed(
    block: Block, state: str, index: int, delay: tuple[float, float], label: str = ""
) -> list[str]:
    """Return a digital output that follows a condition after a time."""
    port = block.ports[index][0] if index < len(block.ports) else Port("null", "0", "d")
    if port.plus == "null":
        return []
    if port.inverted:
        state = f"!({state})"
    rise, fall = delay
    k = label or str(index)
    if rise <= 0.0 and fall <= 0.0:
        return [f"Bout{k} {port.plus} 0 V={{if({state}, 1, 0)}}"]
    # a ramp between two clamps, whose currents show when it has arrived: a gate that drives itself
    # starts its way back from there
    unit = max(rise, fall)
    up, down = unit / max(rise, 1e-3 * unit), unit / max(fall, 1e-3 * unit)
    return [
        f"C{k} x{k} 0 {unit} ic=0",
        f"Bramp{k} 0 x{k} I={{if({state}, {up}, {-down})}}",
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


def _clock(block: Block) -> list[str]:
    """Return the digital controlled oscillator."""
    return [*_oscillation(block), *delayed(block, "v(up) > 0.5", 1, _both(block))]


def _both(block: Block, default: float = _DELAY) -> tuple[float, float]:
    return block.number("rise_delay", default), block.number("fall_delay", default)


def _parity(conditions: Sequence[str]) -> str:
    """Return whether an odd number of conditions holds."""
    total = conditions[0]
    for other in conditions[1:]:
        total = f"(({total}) && !({other})) || (!({total}) && ({other}))"
    return total


def condition(kind: str, conditions: Sequence[str]) -> str:
    """Return the condition that a gate computes."""
    plain = {"nand": "and", "nor": "or", "xnor": "xor"}.get(kind, kind)
    joined = {"and": " && ", "or": " || "}.get(plain)
    value = _parity(conditions) if joined is None else joined.join(conditions)
    return value if plain == kind else f"!({value})"


def _gate(kind: str) -> Callable[[Block], list[str]]:
    def lines(block: Block) -> list[str]:
        conditions = [block.high(0, k) for k in range(len(block.ports[0]))]
        return delayed(block, condition(kind, conditions), 1, _both(block))

    return lines


def turn(up: str, down: str) -> str:
    """Return the control of a memory: 1 to set it, -1 to reset it.

    Both conditions are flat: no comparison is inside of a choice that another one makes.
    """
    return f"if({up}, 1, 0) - if({down}, 1, 0)"


def _set_and_reset(enabled: str, value: str, setting: str, resetting: str) -> str:
    """Return the control of a memory that takes a value, unless it is set or reset."""
    up = f"(({setting}) || (({enabled}) && ({value}))) && !({resetting})"
    down = f"({resetting}) || (({enabled}) && !({value}) && !({setting}))"
    return turn(up, down)


def flip_flop(wanted: str, clock: str, setting: str, resetting: str) -> list[str]:
    """Return a flip-flop, node ``slave``: a master follows before the edge, the slave after it."""
    before = _set_and_reset(f"!({clock})", wanted, setting, resetting)
    after = _set_and_reset(clock, "v(master) > 0.5", setting, resetting)
    return [*memory(before, "master"), *memory(after, "slave")]


def _flip_flop(kind: str) -> Callable[[Block], list[str]]:
    """Return an edge-triggered flip-flop with its outputs."""

    def lines(block: Block) -> list[str]:
        first = 1 if kind in ("d", "t") else 2
        clock, setting, resetting = (block.high(first + k) for k in range(3))
        q = "v(slave) > 0.5"
        wanted = {
            "d": block.high(0),
            "t": _parity([block.high(0), q]),
            "jk": f"(({q}) && !({block.high(1)})) || (!({q}) && ({block.high(0)}))",
            "sr": f"({block.high(0)}) || (({q}) && !({block.high(1)}))",
        }[kind]
        delay = (block.number("clk_delay", _DELAY),) * 2
        return [
            *flip_flop(wanted, clock, setting, resetting),
            *delayed(block, q, first + 3, delay),
            *delayed(block, "v(slave) < 0.5", first + 4, delay),
        ]

    return lines


def _d_latch(block: Block) -> list[str]:
    control = _set_and_reset(block.high(1), block.high(0), block.high(2), block.high(3))
    delay = (block.number("data_delay", _DELAY),) * 2
    return [
        *memory(control, "q"),
        *delayed(block, "v(q) > 0.5", 4, delay),
        *delayed(block, "v(q) < 0.5", 5, delay),
    ]


def _sr_latch(block: Block) -> list[str]:
    enabled, one, zero = (block.high(k) for k in (2, 0, 1))
    up = f"({block.high(3)}) || (({enabled}) && ({one}) && !({zero}))"
    down = f"({block.high(4)}) || (({enabled}) && ({zero}))"
    delay = (block.number("sr_delay", _DELAY),) * 2
    return [
        *memory(turn(f"({up}) && !({down})", down), "q"),
        *delayed(block, "v(q) > 0.5", 5, delay),
        *delayed(block, "v(q) < 0.5", 6, delay),
    ]


def _to_digital(block: Block) -> list[str]:
    """Return the bridges to digital nodes: between in_low and in_high the state is kept."""
    low, high = block.number("in_low", 0.1), block.number("in_high", 0.9)
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 0.0)
    lines: list[str] = []
    for k, port in enumerate(block.ports[1]):
        lines += memory(f"{block.input(0, k)} - {middle}", f"q{k}", half)
        one = block._replace(ports=[block.ports[0], [port]])
        lines += delayed(one, f"v(q{k}) > 0.5", 1, _both(block), f"1y{k}")
    return lines


def _to_analogue(block: Block) -> list[str]:
    """Return the bridges from digital nodes; edges are sharp."""
    low, high = block.number("out_low", 0.0), block.number("out_high", 1.0)
    lines = []
    for k, port in enumerate(block.ports[1]):
        value = f"{low} + {high - low}*{block.input(0, k)}"
        lines.append(f"B{k} {port.plus} {port.minus} V={{{value}}}")
    return lines


def _constant(value: int) -> Callable[[Block], list[str]]:
    return lambda block: [f"V{k} {port.plus} 0 {value}" for k, port in enumerate(block.ports[0])]


#: by type of the model: number of ports, and what writes it
MODELS: dict[str, tuple[int, Callable[[Block], list[str]]]] = {
    "gain": (2, _linear),
    "summer": (2, lambda block: _combined(block, " + ")),
    "mult": (2, lambda block: _combined(block, "*")),
    "divide": (3, _divided),
    "limit": (2, _limited),
    "climit": (4, _controlled_limit),
    "int": (2, _integrated),
    "d_dt": (2, _differentiated),
    "s_xfer": (2, _transfer),
    "hyst": (2, _hysteresis),
    "pwl": (2, _table),
    "slew": (2, _slew),
    "capacitor": (1, _capacitor),
    "capacitoric": (1, _capacitor),
    "core": (1, _magnetic_core),
    "lcouple": (2, _winding),
    "aswitch": (2, _analogue_switch),
    "pswitch": (2, _analogue_switch),
    "sine": (2, _sine),
    "square": (2, _square),
    "triangle": (2, _triangle),
    "adc_bridge": (2, _to_digital),
    "dac_bridge": (2, _to_analogue),
    "d_inverter": (2, lambda b: delayed(b, f"!({b.high(0)})", 1, _both(b))),
    "d_buffer": (2, lambda b: delayed(b, b.high(0), 1, _both(b))),
    **{f"d_{kind}": (2, _gate(kind)) for kind in _GATES},
    "d_dff": (5, _flip_flop("d")),
    "d_tff": (5, _flip_flop("t")),
    "d_jkff": (6, _flip_flop("jk")),
    "d_srff": (6, _flip_flop("sr")),
    "d_dlatch": (5, _d_latch),
    "d_srlatch": (6, _sr_latch),
    "d_osc": (2, _clock),
    "d_pullup": (1, _constant(1)),
    "d_pulldown": (1, _constant(0)),
    "d_source": (1, digital_source),
    "filesource": (1, analogue_source),
}


def digital_ports(item: CodeTemplate, model: Model) -> set[str]:
    """Return the nodes of an A line that have states instead of voltages."""
    ports = item.ports
    if model.type in ("adc_bridge", "dac_bridge"):
        ports = ports[1:2] if model.type == "adc_bridge" else ports[:1]
    elif model.type == "d_osc":
        ports = ports[1:2]
    elif not model.type.startswith("d_") or model.type == "d_dt":
        return set()
    return {port.plus for vector in ports for port in vector}


def written(item: CodeTemplate, model: Model) -> list[str]:
    """Return the lines of the subcircuit that stands for an A line.

    Parameters
    ----------
    item : CodeTemplate
        Its nodes are those of the subcircuit, by their names on the line.
    model : Model

    Raises
    ------
    Unreadable
        If there is no such code model, or it has other ports.
    """
    found = MODELS.get(model.type)
    if found is None:
        message = f"{item.name}: the code model {model.type} is not simulated"
        hint = "known: " + ", ".join(MODELS)
        raise Unreadable("NS1005", message, item.model_span, hint)
    count, writer = found
    block = Block(item.name, item.ports, model, {})
    if len(item.ports) < count:
        raise _wrong(block, f"{model.type} needs {count} ports, {len(item.ports)} given", item)
    for port in (port for vector in item.ports for port in vector):
        if port.kind not in ("", "v", "vd", "i", "id", "d", "g", "gd", "h", "hd"):
            raise _wrong(block, f"ports of type %{port.kind} are not simulated here", item)
    sensed = [
        f"Vin0x{k} {port.plus} {port.minus} 0"
        for k, port in enumerate(item.ports[0])
        if port.kind in ("i", "id")
    ]
    return [*sensed, *writer(block)]


def _wrong(block: Block, what: str, item: CodeTemplate | None = None) -> Unreadable:
    place = item.span if item is not None else (block.model.span if block.model else None)
    return Unreadable("NS1008", f"{block.name}: {what}", place)
