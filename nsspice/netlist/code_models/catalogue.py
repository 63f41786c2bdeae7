"""XSPICE's code models, written out as sources, switches and storage.

An A line becomes an instance of a subcircuit that is written here.  Digital nodes are voltages of
0 and 1; a gate with delays is a ramp between them that a switch with hysteresis watches, so that
its events are those of any other switch.  Pulses shorter than a delay are swallowed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from ..deck import Model
from ..elements.template import CodeTemplate
from ..findings import Unreadable
from . import analogue, coupled_lines, digital, lossy_lines, machines, reals
from .block import Block, delays, wrong
from .file_sources import analogue_source, digital_source
from .logic import delayed, no

_GATES = ("and", "nand", "or", "nor", "xor", "xnor")

#: by type of the model: number of ports, and what writes it
MODELS: dict[str, tuple[int, Callable[[Block], list[str]]]] = {
    "gain": (2, analogue.linear),
    "summer": (2, lambda block: analogue.combined(block, " + ")),
    "mult": (2, lambda block: analogue.combined(block, "*")),
    "divide": (3, analogue.divided),
    "limit": (2, analogue.limited),
    "climit": (4, analogue.controlled_limit),
    "ilimit": (4, analogue.current_limit),
    "int": (2, analogue.integrated),
    "d_dt": (2, analogue.differentiated),
    "s_xfer": (2, analogue.transfer),
    "hyst": (2, analogue.hysteresis),
    "pwl": (2, analogue.table),
    "pwlts": (1, analogue.timed_table),
    "delay": (2, analogue.late),
    "slew": (2, analogue.slew),
    "capacitor": (1, analogue.capacitor),
    "capacitoric": (1, analogue.capacitor),
    "inductor": (1, analogue.inductor),
    "inductoric": (1, analogue.inductor),
    "memristor": (1, analogue.memristor),
    "zener": (1, analogue.zener),
    "core": (1, analogue.magnetic_core),
    "lcouple": (2, analogue.winding),
    "cmeter": (2, analogue.meter("c")),
    "lmeter": (2, analogue.meter("l")),
    "aswitch": (2, analogue.analogue_switch),
    "pswitch": (2, analogue.power_switch),
    "sine": (2, analogue.sine),
    "square": (2, analogue.square),
    "triangle": (2, analogue.triangle),
    "oneshot": (4, analogue.one_shot),
    "adc_bridge": (2, digital.to_digital),
    "dac_bridge": (2, digital.to_analogue),
    "d_inverter": (2, lambda b: delayed(b, no(b.bit(0)), 1, delays(b))),
    "d_buffer": (2, lambda b: delayed(b, b.bit(0), 1, delays(b))),
    **{f"d_{kind}": (2, digital.gate(kind)) for kind in _GATES},
    "d_lut": (2, digital.look_up),
    "d_genlut": (2, digital.look_up),
    "d_dff": (5, digital.flip_flop("d")),
    "d_tff": (5, digital.flip_flop("t")),
    "d_jkff": (6, digital.flip_flop("jk")),
    "d_srff": (6, digital.flip_flop("sr")),
    "d_dlatch": (5, digital.d_latch),
    "d_srlatch": (6, digital.sr_latch),
    "d_fdiv": (2, machines.divider),
    "d_state": (4, machines.state_machine),
    "d_ram": (5, machines.random_access),
    "d_osc": (2, digital.clock),
    "d_pwm": (2, digital.modulator),
    "d_pullup": (1, digital.constant(1)),
    "d_pulldown": (1, digital.constant(0)),
    "d_source": (1, digital_source),
    "filesource": (1, analogue_source),
    "ltra": (2, lossy_lines.line),
    "txl": (2, lossy_lines.line),
    "urc": (3, lossy_lines.uniform),
    "cpl": (2, coupled_lines.lines),
    "d_to_real": (3, reals.from_digital),
    "real_gain": (2, reals.gain),
    "real_delay": (3, reals.clocked),
    "real_to_v": (2, reals.to_analogue),
}
#: by letter: the type of the model of a transmission line
_LINES = {"o": "ltra", "y": "txl", "u": "urc", "p": "cpl"}
#: by type of the model: the ports that are digital, and those of type real, if not all or none
_DIGITAL = {
    "adc_bridge": (1,), "dac_bridge": (0,), "d_osc": (1,), "d_pwm": (1,), "d_to_real": (0, 1),
    "real_delay": (1,), "d_dt": (),
}  # fmt: skip
_DRIVEN = {
    **dict.fromkeys(("d_dff", "d_tff", "d_dlatch"), (4, 5)),
    **dict.fromkeys(("d_jkff", "d_srff", "d_srlatch"), (5, 6)),
    **dict.fromkeys(("d_pullup", "d_pulldown", "d_source"), (0,)),
    **dict.fromkeys(("adc_bridge", "d_osc", "d_pwm"), (1,)),
    "d_state": (3,),
}
_REAL = {"d_to_real": (2,), "real_gain": (0, 1), "real_delay": (0, 2), "real_to_v": (0,)}


def digital_ports(item: CodeTemplate, model: Model) -> set[str]:
    """Return the nodes of an A line that have states instead of voltages."""
    return _nodes(item, _digital(item, model.type))


def driven_ports(item: CodeTemplate, model: Model) -> set[str]:
    """Return the nodes that an A line drives with 0 V or 1 V, nothing between."""
    return _nodes(item, _driven(model.type))


def _digital(item: CodeTemplate, kind: str) -> set[int]:
    every = range(len(item.ports)) if kind.startswith("d_") else ()
    return {k for k in _DIGITAL.get(kind, tuple(every)) if k < len(item.ports)}


def _driven(kind: str) -> tuple[int, ...]:
    gate = kind.startswith("d_") and kind in MODELS and kind not in _DIGITAL
    return _DRIVEN.get(kind, (1,) if gate else ())


def real_ports(item: CodeTemplate, model: Model) -> set[str]:
    """Return the nodes of an A line whose values are added."""
    return _nodes(item, _REAL.get(model.type, ()))


def _nodes(item: CodeTemplate, which: Iterable[int]) -> set[str]:
    return {port.plus for k in which if k < len(item.ports) for port in item.ports[k]}


def written(
    item: CodeTemplate, model: Model, clean: frozenset[str], given: Mapping[str, float]
) -> list[str]:
    """Return the lines of the subcircuit that stands for an A line.

    Parameters
    ----------
    item : CodeTemplate
        Its nodes are those of the subcircuit, by their names on the line.
    model : Model
    clean : frozenset of str
        Nodes that have 0 V or 1 V, nothing between.
    given : dict of str to float
        Parameters of the line.

    Raises
    ------
    Unreadable
        If there is no such code model, or it has other ports.
    """
    own = _LINES.get(item.name[0])
    if (own or model.type) != model.type or (own is None and model.type in _LINES.values()):
        message = f"{item.name}: the model {item.model} is of type {model.type}"
        raise Unreadable("NS2001", message, item.model_span, f"its type must be {own or 'another'}")
    found = MODELS.get(model.type)
    if found is None:
        message = f"{item.name}: the code model {model.type} is not simulated"
        hint = "known: " + ", ".join(MODELS)
        raise Unreadable("NS1005", message, item.model_span, hint)
    count, writer = found
    block = Block(item.name, item.ports, model, given, clean)
    if len(item.ports) < count:
        raise wrong(block, f"{model.type} needs {count} ports, {len(item.ports)} given", item)
    for port in (port for vector in item.ports for port in vector):
        if port.kind not in ("", "v", "vd", "i", "id", "d", "g", "gd", "h", "hd"):
            raise wrong(block, f"ports of type %{port.kind} are not simulated here", item)
    sensed = [
        f"Vin0x{k} {port.plus} {port.minus} 0"
        for k, port in enumerate(item.ports[0])
        if port.kind in ("i", "id")
    ]
    inputs = _digital(item, model.type) - set(_driven(model.type))
    if model.type == "dac_bridge":
        inputs = set()  # a straight line of what its inputs have
    made = [line for index in sorted(inputs) for line in block.compared(index)]
    return [*sensed, *made, *writer(block)]
