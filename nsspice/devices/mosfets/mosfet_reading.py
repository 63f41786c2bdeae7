"""Reading the card of a smooth MOSFET as that of a switch: ``.options mosfet=switch``.

    Vto: the threshold     Ron: Rd + Rs + v_ds/i at the gate's drive level, for small v_ds
    body diode: Vfwd = N kT/q ln(1 + I/IS), Ron = Rb, Vrev = BV

The drop of the diode is that at the current I which drops 0.1 V over the channel: a transistor
that is used as a switch carries currents of this order, and ten times more is 60 mV.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from ..device import Context
from ..diodes.diode import DiodeLaw, curve_body
from ..diodes.diode_branch import Leg
from ..diodes.number_tape import NumberTape
from ..stamper import Conditions
from ..switches.switch import SwitchLaw
from ..temperature import CELSIUS, thermal_voltage
from .level1 import Level1
from .level3 import Level3
from .mosfet import VDMOS_TYPES
from .mosfet_switch import MosfetSwitch
from .vdmos import Vdmos
from .vdmos_law import VdmosLaw

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model

#: drop of the channel at which the drop of the body diode is taken [V]
_DROP = 0.1
#: v_ds far in the triode region [V]: v_ds/i errs by this over the overdrive
_SMALL = 1e-6
#: drive level of a gate whose source is not found [V]: of power transistors, of others
_DRIVES = 10.0, 5.0
#: effects that the switch has
_KEPT = frozenset(
    {"vto", "kp", "mtriode", "theta", "rd", "rs", "rsh", "is", "js", "n", "rb", "bv", "tnom"}
    | {"gamma", "t_abs"}
)
#: parameters of the gate's charge, on which the instants of switching depend
_GATE_CHARGE = frozenset({"cgs", "cgdmin", "cgdmax", "cgso", "cgdo", "cgbo", "tox"})
#: what is said where they are left out
_AT_ONCE = (
    "; without gate charge it switches as soon as its gate passes the threshold: delays, dead "
    "times and everything that depends on them are not those of the model"
)
#: levels whose cards say threshold and transconductance as LEVEL=1 does
LEVELS = (1.0, 2.0, 3.0)


def as_switch(element: Element, model: Model, context: Context) -> MosfetSwitch | None:
    """Return the switch for a smooth MOSFET, or None after reporting what is wrong."""
    power = model.type in VDMOS_TYPES
    given = model.params.get("level")
    if not power and given is not None and given.value not in LEVELS:
        context.findings.error(
            "NS2008",
            f"model {model.name} ({model.type}, level {given.value}) cannot be read as a switch: "
            f"VTO and KP are missing",
            model.span,
            f"write .model {model.name} {model.type}(ideal Vto= Ron= body=)",
        )
        return None
    square = Level1 if given is None or given.value != 3.0 else Level3
    smooth = (Vdmos if power else square).of(element, model, context)
    if smooth is None:
        return None
    drive = context.drives.get(element.name)
    level = _DRIVES[0 if power else 1] if drive is None else drive
    law, diode = _laws(smooth, level)
    if law is None:
        context.findings.error(
            "NS2005",
            f"{element.name} cannot be read as a switch: {level:g} V at its gate does not open "
            f"its channel",
            element.span,
            "write .options mosfet=switch vgson=10 if the gate is driven by 10 V",
        )
        return None
    legs: dict[str, Leg] = {}
    if diode is not None:
        leg = Leg(curve_body(diode, smooth.parallel, context), None, smooth.parallel)
        legs = {"d": leg} if smooth.body == smooth.corners[2] else {"d": leg, "s": leg}
    left = tuple(e.parameter for e in smooth.effects if e.parameter and e.parameter not in _KEPT)
    text = (
        f"model {model.name}: vto={dict(law.given)['vto']:.4g} V, ron={law.ron:.4g} Ohm at "
        f"{level:g} V of the gate{'' if drive is not None else ' (its source was not found)'}"
    )
    if diode is not None:
        text += f", body diode of {diode.vfwd:.3g} V"
    text += f"; omitted: {', '.join(left)}" if left else ""
    text += _AT_ONCE if _GATE_CHARGE & set(left) else ""
    context.switched.setdefault(text, []).append(element)
    plain = replace(element, nodes=element.nodes[:3]) if power else element
    return MosfetSwitch(plain, smooth.n, law, legs, smooth.parallel)


def _laws(smooth: Vdmos | Level1, level: float) -> tuple[SwitchLaw | None, DiodeLaw | None]:
    """Return channel and body diode for a drive level [V]; no channel if that does not open it."""
    card = smooth.card
    conditions = Conditions(temperature=card.get("tnom", 27.0), nominal=card.get("tnom", 27.0))
    p = smooth.parameters(conditions)
    v = {"gs": level, "gd": level - _SMALL, "ds": _SMALL, "bs": 0.0, "bd": -_SMALL, "gb": level}
    if isinstance(smooth, Vdmos):
        current, threshold = VdmosLaw(NumberTape(), p, v).channel(), p["vto"]
        emission, saturation = p["n"], p["is"]
    else:
        current = smooth.law(NumberTape(), p, v).channel()
        threshold = p["vbi"] + p["gamma"] * math.sqrt(p["phi"])
        emission, saturation = p["n"], p["isd"]
    if not level > threshold:
        return None, None
    ron = p["rd"] + p["rs"] + _SMALL / current
    shown = (("vto", threshold if smooth.n else -threshold), ("ron", ron))
    law = SwitchLaw(ron, math.inf, threshold, threshold, False, shown)
    if saturation <= 0.0:
        return law, None
    kt = thermal_voltage(conditions.temperature + CELSIUS)
    drop = emission * kt * math.log1p(_DROP / ron / saturation)
    return law, DiodeLaw(vfwd=drop, ron=card.get("rb"), vrev=card.get("bv"))
