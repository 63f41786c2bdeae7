"""Analogue code models; corners are sharp, where XSPICE's are rounded."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

from .block import Block, beyond_table, pairs, wrong
from .logic import all_of, any_of, held, memory, no


def linear(block: Block) -> list[str]:
    """Return the gain with an offset on both sides."""
    gain, before, after = (
        block.number(k, d) for k, d in (("gain", 1.0), ("in_offset", 0.0), ("out_offset", 0.0))
    )
    return block.output(1, f"{gain}*({block.input(0)} + {before}) + {after}")


def limited(block: Block) -> list[str]:
    """Return the limiter."""
    gain, before = block.number("gain", 1.0), block.number("in_offset", 0.0)
    low, high = block.number("out_lower_limit", -1.0), block.number("out_upper_limit", 1.0)
    return block.output(1, f"limit({gain}*({block.input(0)} + {before}), {low}, {high})")


def controlled_limit(block: Block) -> list[str]:
    """Return the limiter whose limits are signals."""
    gain, before = block.number("gain", 1.0), block.number("in_offset", 0.0)
    high = f"{block.input(1)} - {block.number('upper_delta', 0.0)}"
    low = f"{block.input(2)} + {block.number('lower_delta', 0.0)}"
    value = f"min(max({gain}*({block.input(0)} + {before}), {low}), {high})"
    return block.output(3, value)


def combined(block: Block, sign: str) -> list[str]:
    """Return the summer and the multiplier."""
    inputs = block.inputs(0)
    gains = block.numbers("in_gain") or [1.0] * len(inputs)
    offsets = block.numbers("in_offset") or [0.0] * len(inputs)
    terms = [f"{g}*({x} + {o})" for x, g, o in zip(inputs, gains, offsets, strict=False)]
    gain, after = block.number("out_gain", 1.0), block.number("out_offset", 0.0)
    return block.output(1, f"{gain}*({sign.join(terms)}) + {after}")


def divided(block: Block) -> list[str]:
    """Return the divider; the denominator stays away from zero."""
    top = f"{block.number('num_gain', 1.0)}*({block.input(0)} + {block.number('num_offset', 0.0)})"
    bottom = (
        f"{block.number('den_gain', 1.0)}*({block.input(1)} + {block.number('den_offset', 0.0)})"
    )
    least = block.number("den_lower_limit", 1e-10)
    bottom = f"if(abs({bottom}) > {least}, {bottom}, {least})"
    return block.output(
        2, f"{block.number('out_gain', 1.0)}*({top})/({bottom}) + {block.number('out_offset', 0.0)}"
    )


def integrated(block: Block) -> list[str]:
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


def differentiated(block: Block) -> list[str]:
    """Return the differentiator: the current of a capacitor across its input."""
    gain = block.number("gain", 1.0)
    lines = [f"B1 x 0 V={{{block.input(0)}}}", "V1 x y 0", "C1 y 0 1"]
    value = f"{gain}*i(v1) + {block.number('out_offset', 0.0)}"
    if block.model and "out_upper_limit" in block.model.params:
        low, high = block.number("out_lower_limit", -1e30), block.number("out_upper_limit", 1e30)
        value = f"limit({value}, {low}, {high})"
    return [*lines, *block.output(1, value)]


def ends(block: Block, count: int = 1, which: int = 0) -> tuple[str, str]:
    """Return the nodes of a port that is differential: written as a pair, or as two nodes."""
    if len(block.ports) <= count:
        port = block.ports[which][0]
        return port.plus, port.minus
    first, second = block.ports[2 * which][0], block.ports[2 * which + 1][0]
    return first.plus, second.plus


def capacitor(block: Block) -> list[str]:
    """Return the capacitor; its initial voltage is that of the operating point, too."""
    a, b = ends(block)
    start = block.number("ic", 0.0)
    held = [f".ic v({a})={start}"] if b == "0" else []
    return [f"C1 {a} {b} {block.number('c', 0.0)} ic={start}", *held]


def inductor(block: Block) -> list[str]:
    """Return the inductor as a gyrator with a capacitor: its initial current holds at once."""
    a, b = ends(block)
    start = block.number("ic", 0.0)
    return [
        f"C1 x 0 {block.number('l', 0.0)} ic={start}",
        f".ic v(x)={start}",
        f"B1 0 x I={{v({a},{b})}}",
        f"B2 {a} {b} I={{v(x)}}",
    ]


def memristor(block: Block) -> list[str]:
    """Return the memristor with a threshold of Pershin and Di Ventra (arXiv:1204.2600).

    Its resistance, in units of the largest, is the voltage of a capacitor between two clamps.
    """
    a, b = ends(block)
    low, high, start = (
        block.number(k, d) for k, d in (("rmin", 10.0), ("rmax", 10e3), ("rinit", 7e3))
    )
    alpha, beta, threshold = (
        block.number(k, d) for k, d in (("alpha", 0.0), ("beta", 1.0), ("vt", 0.0))
    )
    v = f"v({a},{b})"
    rate = f"{beta}*{v} + {0.5 * (alpha - beta)}*(abs({v} + {threshold}) - abs({v} - {threshold}))"
    return [
        f"C1 x 0 {high} ic={start / high}",
        f".ic v(x)={start / high}",
        f"B1 0 x I={{{rate}}}",
        "D1 x top",
        "V1 top 0 1",
        "D2 bottom x",
        f"V2 bottom 0 {low / high}",
        f"B2 {a} {b} I={{{v}/({high}*v(x))}}",
    ]


def zener(block: Block) -> list[str]:
    """Return the Zener diode: two exponentials, and a straight line between them."""
    a, b = ends(block)
    v = f"v({a},{b})"
    given = (
        ("v_breakdown", 1.0), ("i_breakdown", 2e-2), ("r_breakdown", 1.0), ("i_rev", 1e-6),
        ("i_sat", 1e-12), ("n_forward", 1.0),
    )  # fmt: skip
    breakdown, current, resistance, leakage, saturation, emission = (
        block.number(key, default) for key, default in given
    )
    unit = emission * 0.026
    forward = unit * math.log(unit / 10.0)
    rate = 1.0 / (current * resistance)
    reverse = -breakdown + math.log(10.0 / saturation / resistance) / rate
    if reverse < forward:
        middle = f"{saturation / 10.0}*(limit({v}, {reverse}, {forward}) - {forward})"
        # what flows at the breakdown, with the unit of XSPICE's exponential
        scale = 1e-6 * math.exp(-rate * (reverse + breakdown) + math.log(current / 1e-6))
    else:  # the two exponentials meet at zero; a conductance makes their slopes equal
        forward = reverse = 0.0
        scale = current / math.expm1(rate * breakdown)
        more = scale * rate - saturation / unit
        middle = f"{abs(more)}*{'max' if more > 0.0 else 'min'}({v}, 0)"
    law = (
        f"{saturation}*(exp(max({v}, {forward})/{unit}) - 1) + {middle}"
        f" - {scale}*(exp({-rate}*min({v} - {reverse}, 0)) - 1) + {leakage / breakdown}*{v}"
    )
    return [f"B1 {a} {b} I={{{law}}}"]


def current_limit(block: Block) -> list[str]:
    """Return the output stage with a limited current, which flows from one of its supplies."""
    supplies = [None if p[0].plus == "null" else p[0].plus for p in block.ports[1:3]]
    high, low = (
        f"v({node})" if node else f"{bound}"
        for node, bound in zip(supplies, (1e6, -1e6), strict=True)
    )
    out = block.ports[3][0].plus
    gain, before = block.number("gain", 1.0), block.number("in_offset", 0.0)
    source, sink = block.number("r_out_source", 1.0), block.number("r_out_sink", 1.0)
    drop = f"v(x,{out})"
    flow = f"{drop}/{source}"
    if source != sink:
        flow = f"max({drop}, 0)/{source} + min({drop}, 0)/{sink}"
    least, most = -block.number("i_limit_sink", 1.0), block.number("i_limit_source", 1.0)
    flow = f"limit({flow}, {least}, {most})"
    lines = [
        f"B1 x 0 V={{min(max({gain}*({block.input(0)} + {before}), {low}), {high})}}",
        f"B2 y {out} I={{{flow}}}",
        "V1 y 0 0",
    ]
    if supplies[0]:
        lines.append(f"B3 {supplies[0]} 0 I={{max(-i(V1), 0)}}")
    if supplies[1]:
        lines.append(f"B4 0 {supplies[1]} I={{max(i(V1), 0)}}")
    return lines


def one_shot(block: Block) -> list[str]:
    """Return the one-shot: a ramp begins at an edge of the clock and ends with the pulse.

    The width of the pulse is that of the control at the edge, which a capacitor keeps.
    """
    if block.number("retrig", 0.0):
        raise wrong(block, "a one-shot with retrig=true is not simulated")
    xs, ys = pairs(block, "cntl_array", "pw_array")
    low, high = block.number("out_low", 0.0), block.number("out_high", 1.0)
    rise, fall = (max(block.number(k, 1e-9), 1e-12) for k in ("rise_time", "fall_time"))
    wait, late = block.number("rise_delay", 1e-9), block.number("fall_delay", 1e-9)
    level, up = block.number("clk_trig", 0.5), block.number("pos_edge_trig", 1.0)
    edge, back = (f"if({block.input(0)} {sign} {level}, 1, 0)" for sign in ("><" if up else "<>"))
    control = "0" if block.ports[1][0].plus == "null" else block.input(1)
    clear = "0"
    if block.ports[2][0].plus != "null":
        clear = f"if({block.input(2)} > {level}, 1, 0)"
    before = wait + rise
    ended = f"if(v(x) - v(w) > {before + late + fall}, 1, 0)"
    stop = any_of(clear, ended)
    output = (
        f"limit((v(x) - {wait})/{rise}, 0, 1) - limit((v(x) - v(w) - {before + late})/{fall}, 0, 1)"
    )
    return [
        *memory(f"{all_of(edge, no('v(seen)'), no(stop))} - {stop}", "run"),
        *memory(f"{all_of(edge, 'v(run)')} - {back}", "seen"),
        "C1 x 0 1 ic=0",
        "B1 0 x I={1001*v(run) - 1000}",  # it falls back fast,
        "D1 low x",
        "V1 low 0 0",
        f"B2 w1 0 V={{max({beyond_table(control, xs, ys)}, 0)}}",
        *held("w1", "w", no("v(run)")),
        *block.output(3, f"{low} + {high - low}*if(v(run) > 0.5, {output}, 0)"),
    ]


def magnetic_core(block: Block) -> list[str]:
    """Return the core without hysteresis: the flux, a current, is a table of the field."""
    if block.number("mode", 1.0) != 1.0:
        raise wrong(block, "a core with mode=2 is not simulated; write L ... Hc= Br= Bs=")
    fields, densities = pairs(block, "h_array", "b_array")
    length, area = block.number("length", 1.0), block.number("area", 1.0)
    a, b = ends(block)
    xs, ys = [h * length for h in fields], [d * area for d in densities]
    return [f"B1 {a} {b} I={{{beyond_table(f'v({a},{b})', xs, ys)}}}"]


def winding(block: Block) -> list[str]:
    """Return a winding: in its magnetic circuit flux is a current, ampere-turns are a voltage."""
    if len(block.ports) not in (2, 4):
        raise wrong(block, "lcouple needs two ports of two nodes each")
    (a, b), (c, d) = ends(block, 2), ends(block, 2, 1)
    turns = block.number("num_turns", 1.0)
    return [
        f"V1 {a} x 0",
        f"H1 {c} {d} V1 {turns}",
        f"F1 w 0 H1 {turns}",
        "L1 w 0 1",
        f"E1 x {b} w 0 1",
    ]


def transfer(block: Block) -> list[str]:
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


def hysteresis(block: Block) -> list[str]:
    """Return the limiter with hysteresis: shifted to the right on its way up, to the left down."""
    low, high, width = (
        block.number(k, d) for k, d in (("in_low", 0.0), ("in_high", 1.0), ("hyst", 0.1))
    )
    bottom, top = block.number("out_lower_limit", 0.0), block.number("out_upper_limit", 1.0)
    middle, half = 0.5 * (low + high), max(0.5 * (high - low) + width, 0.0)
    # the way back begins where the way up has ended, and the other way round
    lines = memory(f"{block.input(0)} - {middle}", "x", half)
    if high <= low:
        return [*lines, *block.output(1, f"{bottom} + {top - bottom}*v(x)")]
    slope = (top - bottom) / (high - low)
    line = f"{bottom} + {slope}*({block.input(0)} - {low + width} + {2.0 * width}*v(x))"
    return [*lines, *block.output(1, f"limit({line}, {bottom}, {top})")]


def table(block: Block) -> list[str]:
    """Return the piecewise linear function, extended beyond its ends by straight lines."""
    xs, ys = pairs(block, "x_array", "y_array")
    return block.output(1, beyond_table(block.input(0), xs, ys))


def timed_table(block: Block) -> list[str]:
    """Return the piecewise linear function of time, with parabolas in the place of corners."""
    xs, ys = pairs(block, "x_array", "y_array")
    points = ", ".join(f"{x}, {y}" for x, y in zip(xs, ys, strict=True))
    value = f"pwl(time, {points})"
    if not block.number("limit", 0.0):
        value = beyond_table("time", xs, ys)
        first, last = 1, len(xs) - 1
    else:  # its ends are corners, too
        first, last = 0, len(xs)
    domain = block.number("input_domain", 0.01)
    edges = [math.inf, *(b - a for a, b in pairwise(xs)), math.inf]
    slopes = [0.0, *((d - c) / e for (c, d), e in zip(pairwise(ys), edges[1:], strict=False)), 0.0]
    for k in range(first, last):
        shortest = min(edges[k], edges[k + 1])
        width = domain * shortest if block.number("fraction", 1.0) else domain
        more = slopes[k + 1] - slopes[k]
        if width > 0.0 and more != 0.0:
            value += f" + {more / (4.0 * width)}*max({width} - abs(time - {xs[k]}), 0)^2"
    return block.output(0, value)


def late(block: Block) -> list[str]:
    """Return the delay, which is a constant."""
    if block.number("has_delay_cnt", 0.0):
        raise wrong(block, "a delay that a signal controls is not simulated")
    return block.output(1, f"delay({block.input(0)}, {block.number('delay', 0.0)})")


def meter(letter: str) -> Callable[[Block], list[str]]:
    """Return the meter of what is attached to a node: capacitors, or inductors."""

    def lines(block: Block) -> list[str]:
        out = block.ports[1][0]
        node, gain = block.ports[0][0].plus, block.number("gain", 1.0)
        return [f".attached {letter} {node} {gain} {out.plus} {out.minus}"]

    return lines


def slew(block: Block) -> list[str]:
    """Return the slew rate limiter: a follower whose rate is limited."""
    rise, fall = block.number("rise_slope", 1e9), block.number("fall_slope", 1e9)
    fast = 1e3 * max(rise, fall)
    return [
        "C1 x 0 1",
        f"B1 0 x I={{limit({fast}*({block.input(0)} - v(x)), {-fall}, {rise})}}",
        *block.output(1, "v(x)"),
    ]


def analogue_switch(block: Block) -> list[str]:
    """Return the switch whose resistance follows its control, by powers or in a straight line.

    Like XSPICE's it goes on beyond the values of the control, down to 1 nOhm, unless limited.
    """
    off, on, drop = _switch(block)
    least, most = max(block.number("r_on", 1.0), 1e-3), block.number("r_off", 1e12)
    control = block.input(0)
    if block.number("limit", 0.0):
        control = f"limit({control}, {min(off, on)}, {max(off, on)})"
    if block.number("log", 1.0):
        rate = math.log(most / least) / (on - off)
        conductance = f"min(exp({rate}*({control} - {on}))/{least}, 1e9)"
        return [f"B1 {drop[2:-1].replace(',', ' ')} I={{{drop}*{conductance}}}"]
    slope = (least - most) / (on - off)
    value = f"max({least} + {slope}*({control} - {on}), 1e-9)"
    return [f"B1 {drop[2:-1].replace(',', ' ')} I={{{drop}/{value}}}"]


def power_switch(block: Block) -> list[str]:
    """Return the switch whose resistance is smooth between its values, and stays there beyond."""
    if not block.number("log", 1.0):
        return analogue_switch(block)
    off, on, drop = _switch(block)
    least, most = max(block.number("r_on", 1.0), 1e-3), block.number("r_off", 1e10)
    ratio, middle = math.log(most / least), 0.5 * math.log(most * least)
    part = f"limit(({block.input(0)} - {0.5 * (off + on)})/{on - off}, -0.5, 0.5)"
    power = f"{ratio}*(1.5*{part} - 2*({part})^3) - {middle}"
    return [f"B1 {drop[2:-1].replace(',', ' ')} I={{{drop}*exp({power})}}"]


def _switch(block: Block) -> tuple[float, float, str]:
    """Return the values of the control, and the voltage of the switch."""
    port = block.ports[-1][0]
    off, on = block.number("cntl_off", 0.0), block.number("cntl_on", 1.0)
    if off == on:
        raise wrong(block, "cntl_off and cntl_on must be different")
    return off, on, f"v({port.plus},{port.minus})"


def sine(block: Block) -> list[str]:
    """Return the controlled oscillator."""
    xs, ys = block.numbers("cntl_array"), block.numbers("freq_array")
    points = ", ".join(f"{a}, {b}" for a, b in zip(xs, ys, strict=False))
    low, high = block.number("out_low", -1.0), block.number("out_high", 1.0)
    value = f"{0.5 * (low + high)} + {0.5 * (high - low)}*sin(v(x))"
    rate = f"2*pi*max(pwl({block.input(0)}, {points}), 0)"
    return ["C1 x 0 1 ic=0", ".ic v(x)=0", f"B1 0 x I={{{rate}}}", *block.output(1, value)]


def oscillation(block: Block, rises_first: bool = False) -> list[str]:
    """Return a ramp, node x, from 0 to 1 and back, and node ``up`` that is 1 while it rises.

    The duty cycle is the part of the period in which it rises: the first one, or the last one.
    """
    xs, ys = pairs(block, "cntl_array", "freq_array")
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


def square(block: Block) -> list[str]:
    """Return the controlled square wave; its edges are sharp."""
    low, high = block.number("out_low", -1.0), block.number("out_high", 1.0)
    return [*oscillation(block), *block.output(1, f"{low} + {high - low}*v(up)")]


def triangle(block: Block) -> list[str]:
    """Return the controlled triangle wave."""
    low, high = block.number("out_low", -1.0), block.number("out_high", 1.0)
    return [*oscillation(block, True), *block.output(1, f"{low} + {high - low}*v(x)")]
